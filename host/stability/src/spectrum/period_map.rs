//! The collocated map over one tooth period, for many Floquet multipliers (characteristic multipliers) at one spindle
//! speed and axial depth.

use nalgebra::linalg::LU;
use nalgebra::{DMatrix, Dyn};
use num_complex::Complex64;

use super::krylov::{self, LinearMap};
use crate::criteria::{GROWN, NORMAL};
use crate::error::Breakdown;
use crate::problem::period::Period;
use quietcut_numerics::eigenvalues;

/// Largest size (number of rows) of a period map for which block Arnoldi is not tried, because it is not faster there.
const WHOLE: usize = 110;

/// Largest size (number of rows) of a period map for which [`largest`] computes all eigenvalues if block Arnoldi does
/// not converge: about one second.
const UNSETTLED_WHOLE_MAX: usize = 400;

/// Matrix of the map (x, p_τ) → (x⁺, p) over one tooth period at an axial depth, m.
///
/// x is the state of the structure at the start of the period, x⁺ that at its end. p are the displacements along the
/// chip normals at the collocation nodes while teeth cut, p_τ those one tooth period earlier. `None` if the collocation
/// equations are singular.
pub(crate) fn monodromy(period: &Period, depth_m: f64) -> Option<DMatrix<f64>> {
    let order = period.order();
    let size = order + period.ports();
    let mut map = DMatrix::zeros(size, size);
    let mut state = DMatrix::zeros(order, size);
    state.view_mut((0, 0), (order, order)).fill_with_identity();
    let mut first = order;
    for element in &period.elements {
        let ports = element.kernel.nrows();
        // Collocation equation of the element, p − w Q p = E x − w Q p_τ, for the displacements p along the chip
        // normals
        let weighted = &element.kernel * depth_m;
        let implicit = DMatrix::identity(ports, ports) - &weighted;
        // Displacements p_τ of later elements do not act on this element.
        let known = first + ports;
        let mut seen = &element.observe * state.columns(0, known);
        let mut past = seen.columns_mut(first, ports);
        past -= &weighted;
        if !implicit.lu().solve_mut(&mut seen) {
            return None;
        }
        map.view_mut((first, 0), (ports, known)).copy_from(&seen);
        for port in 0..ports {
            seen[(port, first + port)] -= 1.0;
        }
        let mut next = &element.flow * state.columns(0, known);
        next.gemm(depth_m, &element.drive, &seen, 1.0);
        state.columns_mut(0, known).copy_from(&next);
        first = known;
    }
    map.rows_mut(0, order).copy_from(&(&period.flight * state));
    Some(map)
}

/// All Floquet multipliers of the collocated map over a tooth period, largest first.
///
/// # Errors
/// The collocation equations are singular, or the eigenvalues cannot be computed.
pub(crate) fn multipliers(period: &Period, depth_m: f64) -> Result<Vec<Complex64>, Breakdown> {
    of_matrix(monodromy(period, depth_m).ok_or(Breakdown::NoSolution)?)
}

/// All eigenvalues of the matrix of a period map, largest first; of a conjugate pair the upper one first.
///
/// # Errors
/// The matrix is not finite, or the iteration does not converge.
pub(crate) fn of_matrix(map: DMatrix<f64>) -> Result<Vec<Complex64>, Breakdown> {
    let mut multipliers = eigenvalues::of_real(map)?;
    multipliers.sort_by(|p, q| q.norm().total_cmp(&p.norm()).then(q.im.total_cmp(&p.im)));
    Ok(multipliers)
}

/// Approximate largest Floquet multipliers of a period map, as starting values of Newton's method.
#[derive(Clone, Debug, Default)]
pub(crate) struct Candidates {
    /// Multipliers, largest first.
    pub(crate) multipliers: Vec<Complex64>,
    /// False if larger multipliers may be missing: block Arnoldi did not converge, or an entry of the map (or of its
    /// projection on a Krylov space) is so large that rounding may move the eigenvalues.
    pub(crate) is_certain: bool,
}

/// Floquet multipliers of the collocated map of at least `share` times the size of the largest, largest first.
///
/// They are eigenvalues of the transition matrix Φ(w) if the largest of these exceeds [`GROWN`] and rounding does not
/// move them. Otherwise block Arnoldi computes those of a large map, at most [`CROWD`](crate::criteria::CROWD).
///
/// # Errors
/// The collocation equations are singular, or the eigenvalues cannot be computed.
pub(crate) fn largest(period: &Period, depth_m: f64, share: f64) -> Result<Candidates, Breakdown> {
    let (order, size) = (period.order(), period.order() + period.ports());
    let of = |mut multipliers: Vec<Complex64>, norm: f64, is_settled: bool| {
        let largest = multipliers.first().map_or(0.0, |multiplier| multiplier.norm());
        multipliers.retain(|multiplier| multiplier.norm() >= share * largest);
        Candidates {
            multipliers,
            is_certain: is_settled && norm <= NORMAL * largest.max(1.0),
        }
    };
    // Multipliers from the transition matrix Φ(w), which is the map without the surface of the preceding tooth (κ = w);
    // `None` unless the largest exceeds `GROWN`, so that this surface hardly acts, and no entry of Φ(w) is so large
    // that rounding may move its eigenvalues.
    let grown = |transition: DMatrix<f64>| {
        let norm = transition.amax();
        let multipliers = of_matrix(transition).ok()?;
        let is_large = multipliers.first().is_some_and(|first| first.norm() > GROWN);
        Some(of(multipliers, norm, is_large)).filter(|found| found.is_certain)
    };
    if size > WHOLE {
        let map = Map::new(period, depth_m).ok_or(Breakdown::NoSolution)?;
        let image = map.apply(&DMatrix::identity(size, order));
        let transition = image.ok_or(Breakdown::NoSolution)?.rows(0, order).into_owned();
        if let Some(found) = grown(transition) {
            return Ok(found);
        }
        let found = krylov::largest(&map, share)?;
        if found.is_settled || size > UNSETTLED_WHOLE_MAX {
            return Ok(of(found.eigenvalues, found.norm, found.is_settled));
        }
    }
    let map = monodromy(period, depth_m).ok_or(Breakdown::NoSolution)?;
    if let Some(found) = grown(map.view((0, 0), (order, order)).into_owned()) {
        return Ok(found);
    }
    let norm = map.amax();
    Ok(of(of_matrix(map)?, norm, true))
}

/// Floquet multipliers of the collocated map larger than `least`, or larger than `share` times the largest if that is
/// less, largest first. If the map is small, or block Arnoldi fails or does not converge, all smaller multipliers
/// follow.
///
/// Large maps are treated by block Arnoldi, accurate enough to start Newton's method.
///
/// # Errors
/// The collocation equations are singular, the eigenvalues cannot be computed, or block Arnoldi fails or does not
/// converge and the map is too large for all eigenvalues.
pub(crate) fn larger_than(
    period: &Period,
    depth_m: f64,
    least: f64,
    share: f64,
) -> Result<Vec<Complex64>, Breakdown> {
    let size = period.order() + period.ports();
    if size > WHOLE {
        let map = Map::new(period, depth_m).ok_or(Breakdown::NoSolution)?;
        if let Some(found) = krylov::larger_than(&map, least, share) {
            return Ok(found);
        }
    }
    if size > krylov::WHOLE_MAX {
        return Err(Breakdown::TooManyMultipliers);
    }
    multipliers(period, depth_m)
}

/// Map (x, p_τ) → (x⁺, p) of state and displacements along the chip normals over a tooth period, applied element by
/// element without forming its matrix.
struct Map<'a> {
    period: &'a Period,
    depth_m: f64,
    /// LU factors of I − w Q, one for each element of the tooth period in its order, with the axial depth w and the
    /// kernel Q, the response of the displacements along the chip normals to the regenerative chips, 1/m.
    implicit: Vec<LU<f64, Dyn, Dyn>>,
}

impl<'a> Map<'a> {
    fn new(period: &'a Period, depth_m: f64) -> Option<Self> {
        let implicit = period.elements.iter().map(|element| {
            let ports = element.kernel.nrows();
            let lu = (DMatrix::identity(ports, ports) - &element.kernel * depth_m).lu();
            lu.is_invertible().then_some(lu)
        });
        Some(Self {
            implicit: implicit.collect::<Option<_>>()?,
            period,
            depth_m,
        })
    }
}

impl LinearMap for Map<'_> {
    fn size(&self) -> usize {
        self.period.order() + self.period.ports()
    }

    fn apply(&self, columns: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let order = self.period.order();
        let mut out = DMatrix::zeros(columns.nrows(), columns.ncols());
        let mut state = columns.rows(0, order).into_owned();
        let mut first = order;
        for (element, implicit) in self.period.elements.iter().zip(&self.implicit) {
            let ports = element.kernel.nrows();
            let past = columns.rows(first, ports);
            let mut seen = &element.observe * &state;
            seen.gemm(-self.depth_m, &element.kernel, &past, 1.0);
            if !implicit.solve_mut(&mut seen) {
                return None;
            }
            out.rows_mut(first, ports).copy_from(&seen);
            seen -= past;
            let mut next = &element.flow * &state;
            next.gemm(self.depth_m, &element.drive, &seen, 1.0);
            state = next;
            first += ports;
        }
        out.rows_mut(0, order).copy_from(&(&self.period.flight * state));
        out.iter().all(|entry| entry.is_finite()).then_some(out)
    }
}
