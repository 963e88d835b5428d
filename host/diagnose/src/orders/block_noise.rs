//! Combinations of the blocks of a record whose noise is independent.
//!
//! The deviation of block b from the record at one order is Σ_t h_b(t) η(t) in white noise η, after the fit of all lines
//! took its part: with the block's weights h_b, the columns e^{ipθ} of E, p the difference of another order or alias from
//! this order, and the weights W of the record,
//!
//! h_b ← h_b − W E (EᴴWE)⁻¹ Eᴴ h_b, R = real part of the products ⟨h_a, h_b⟩, averaged over the orders.
//!
//! Only columns that are slow, at the times of the samples, matter: aliases are at the same distances from all orders, so
//! that what they take is common to all orders. With the
//! eigenvectors v and eigenvalues λ of R, the combinations λ^(−1/2) vᵀ of blocks have independent noise of unit variance.
//! Combinations of which the lines leave little, such as the mean over the record, are left out.

use nalgebra::DMatrix;
use num_complex::Complex64;
use quietcut_numerics::eigenvalues::of_symmetric;
use quietcut_numerics::least_squares::{Idle, NormalEquations};

use crate::orders::channel_reduction::Plan;

/// Number of points over the record at which weights and columns are evaluated: at least sixteen per block.
const POINTS: usize = 512;

/// Number of orders over which R is averaged; it changes little between adjacent orders.
const ORDERS: usize = 12;

/// Largest distance δ, in cells of a block: the transform of Hann's weights is below 1e-2 beyond four.
const BLOCK_CELLS: f64 = 4.0;

/// Least share of the variance of a combination that the lines must leave. Below, a residual of the lines themselves
/// could exceed the noise; the number itself is unfounded.
const LEAST_LEFT: f64 = 0.3;

/// Ridge of EᴴWE, of which two columns may nearly coincide.
const RIDGE: f64 = 1e-9;

/// Combinations (rows) of the blocks (columns) with independent noise of the variance of one block.
pub(crate) fn independent_combinations(plan: &Plan) -> DMatrix<f64> {
    let [orders, aliases] = [plan.kernel.orders(), plan.kernel.aliases()];
    let blocks = plan.blocks;
    let count = blocks.len();
    let mut mean = DMatrix::zeros(count, count);
    let step = orders.div_ceil(ORDERS);
    for order in (1..=orders).step_by(step) {
        if let Some(products) = products(plan, order, aliases) {
            mean += products;
        }
    }
    let size = mean.diagonal().max().max(f64::MIN_POSITIVE);
    let Ok(eigen) = of_symmetric(mean / size) else {
        return DMatrix::zeros(0, count);
    };
    let rows: Vec<_> = eigen
        .eigenvalues
        .iter()
        .enumerate()
        .filter(|(_, value)| **value > LEAST_LEFT)
        .map(|(index, value)| eigen.eigenvectors.column(index).transpose() / value.sqrt())
        .collect();
    if rows.is_empty() {
        return DMatrix::zeros(0, count);
    }
    DMatrix::from_rows(&rows)
}

/// R of one order, one on the diagonal without lines.
fn products(plan: &Plan, order: usize, aliases: usize) -> Option<DMatrix<f64>> {
    let Plan { taper, blocks, .. } = plan;
    // The aliases appear at whole samples.
    let sample = |point: usize| ((2 * point + 1) * taper.count()) / (2 * POINTS);
    let widest = BLOCK_CELLS / blocks.first()?.taper.count() as f64;
    let apart: Vec<f64> = (-(aliases as i64)..=aliases as i64)
        .map(|line| (line - order as i64) as f64)
        .filter(|apart| {
            let distance = apart * plan.per_sample;
            let wander = distance.abs() * plan.speed_wander * std::f64::consts::SQRT_2;
            (distance - distance.round()).abs() < widest + wander
        })
        .collect();
    let columns = DMatrix::from_fn(POINTS, apart.len(), |point, line| {
        let revolutions = plan.revolutions[sample(point)];
        Complex64::from_polar(1.0, std::f64::consts::TAU * (apart[line] * revolutions).fract())
    });
    let weighted = DMatrix::from_fn(POINTS, apart.len(), |point, line| {
        columns[(point, line)] * taper.weight(sample(point))
    });
    let of_blocks = DMatrix::from_fn(POINTS, blocks.len(), |point, block| {
        let at = sample(point).checked_sub(blocks[block].first);
        let within = at.filter(|at| *at < blocks[block].taper.count());
        Complex64::from(within.map_or(0.0, |at| blocks[block].taper.weight(at)))
    });
    let whole = of_blocks.column(0).norm_squared();
    let equations = NormalEquations::new(&columns.ad_mul(&weighted), RIDGE, Idle::Refuse)?;
    let left = &of_blocks - &weighted * equations.solve_columns(&columns.ad_mul(&of_blocks));
    Some(left.ad_mul(&left).map(|product| product.re / whole))
}
