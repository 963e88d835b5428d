//! Collocation of the one-period map: all multipliers at one speed and depth at once.

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::period::Period;
use crate::eigenvalues::eigenvalues;

/// The matrix of the map (x, p_τ) → (x⁺, p) over one tooth period at a depth, m.
///
/// p are the displacements along the chip normal at the collocation nodes while teeth cut. `None` where a depth is so
/// large that the collocation equations are singular.
pub(crate) fn monodromy(period: &Period, depth_m: f64) -> Option<DMatrix<f64>> {
    let order = period.order();
    let history: usize = period.elements.iter().map(|element| element.kernel.nrows()).sum();
    let size = order + history;
    let mut map = DMatrix::zeros(size, size);
    let mut state = DMatrix::zeros(order, size);
    state.view_mut((0, 0), (order, order)).fill_with_identity();
    let mut first = order;
    for element in &period.elements {
        let ports = element.kernel.nrows();
        // p − w Q p = E x − w Q p_τ
        let weighted = &element.kernel * depth_m;
        let implicit = DMatrix::identity(ports, ports) - &weighted;
        let mut right = &element.observe * &state;
        let mut past = right.columns_mut(first, ports);
        past -= &weighted;
        let seen = implicit.lu().solve(&right)?;
        let mut chip = seen.clone();
        for port in 0..ports {
            chip[(port, first + port)] -= 1.0;
        }
        state = &element.flow * &state + &element.drive * chip * depth_m;
        map.rows_mut(first, ports).copy_from(&seen);
        first += ports;
    }
    map.rows_mut(0, order).copy_from(&(&period.flight * state));
    Some(map)
}

/// All multipliers of the collocated map, largest first; those of the history that have no physical meaning are near
/// zero.
pub(crate) fn multipliers(period: &Period, depth_m: f64) -> Option<Vec<Complex64>> {
    let map = monodromy(period, depth_m)?;
    let mut multipliers = eigenvalues(map)?;
    multipliers.sort_by(|p, q| q.norm().total_cmp(&p.norm()).then(q.im.total_cmp(&p.im)));
    Some(multipliers)
}

/// The largest multiplier; of a pair the one above the real axis.
pub(crate) fn dominant(period: &Period, depth_m: f64) -> Option<Complex64> {
    multipliers(period, depth_m)?.first().copied()
}
