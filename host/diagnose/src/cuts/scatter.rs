//! What the scatter of the tooth forces leaves in the orders and their trend.
//!
//! The force of a tooth differs from passing to passing: F (1 + g) with independent g of the standard deviation σ. Over n
//! revolutions the mean of a tooth is off by σ/√n, in all orders and channels together; so is its trend, times the
//! standard deviation of the time. Tooth j with the amplitudes P_jk in a channel leaves
//!
//! ```text
//! Σ_k = σ²/n Σ_j P_jk P_jkᴴ + …
//! ```
//!
//! in the covariance of an order, which is measured between the lines. What is common to the orders cannot be seen there;
//! but no order can have less noise than this, so that
//!
//! ```text
//! σ² ≤ n / Σ_j P_jkᴴ Σ_k⁻¹ P_jk,
//! ```
//!
//! and the least of these bounds is taken as σ².

use std::f64::consts::TAU;

use nalgebra::{Cholesky, DMatrix, DVector};
use num_complex::Complex64;

use super::machine::Machine;
use crate::orders::reduction::Orders;
use quietcut_model::Cutter;
use quietcut_stability::cut_orbit::ForceOrders;

/// Angles in the engagement of a tooth at which its force is integrated, per period of the highest order.
const ANGLES: f64 = 8.0;
/// Bounds up to this factor above the least are averaged with it: each is estimated from few cells of the spectrum.
const ALIKE: f64 = 2.0;

/// By tooth: one standard deviation of its mean force, in the orders of the channels. For the machine with a rigid tool,
/// whose structure moves as without regeneration.
pub(super) fn directions(machine: &Machine, orders: &Orders) -> Vec<DMatrix<Complex64>> {
    let highest = orders.kernel().aliases();
    let cutter = &machine.model.cutter;
    let patterns: Vec<DMatrix<Complex64>> = (0..cutter.teeth.len())
        .map(|tooth| {
            let forces = of_force(tooth_force(cutter, tooth, highest));
            orders.of_channels(&machine.reading.orders(&forces))
        })
        .collect();
    let deviation = deviation(orders, &patterns);
    patterns
        .into_iter()
        .map(|pattern| pattern * Complex64::from(deviation))
        .collect()
}

/// σ/√n.
fn deviation(orders: &Orders, patterns: &[DMatrix<Complex64>]) -> f64 {
    let of_order = |order: usize| -> Option<f64> {
        let covariance = &orders.covariances[order];
        let factor = Cholesky::new(covariance.matrix.clone())?;
        let channels = orders.channels.len() as f64;
        // The mean of the inverse of an estimated covariance exceeds the inverse of its mean.
        let freedoms = covariance.freedoms;
        let bias = freedoms / (freedoms - channels).max(1.0);
        let sum: f64 = patterns
            .iter()
            .map(|pattern| {
                let of_tooth: DVector<Complex64> = pattern.row(order).transpose();
                of_tooth.dotc(&factor.solve(&of_tooth)).re
            })
            .sum();
        Some(sum / bias)
    };
    let information: Vec<f64> = (1..orders.covariances.len()).filter_map(of_order).collect();
    let most = information.iter().copied().fold(0.0, f64::max);
    let alike: Vec<f64> = information
        .into_iter()
        .filter(|information| *information > most / ALIKE)
        .collect();
    let mean = alike.iter().sum::<f64>() / alike.len() as f64;
    if mean > 0.0 { mean.sqrt().recip() } else { 0.0 }
}

/// Forces of all teeth of a rigid tool.
pub(super) fn rigid_forces(cutter: &Cutter, highest: usize) -> ForceOrders {
    let none = DMatrix::zeros(highest + 1, 3);
    let of_teeth = (0..cutter.teeth.len()).map(|tooth| tooth_force(cutter, tooth, highest));
    of_force(of_teeth.fold(none, |sum, force_n| sum + force_n))
}

/// A cutting force that no restoring force opposes.
fn of_force(force_n: DMatrix<Complex64>) -> ForceOrders {
    ForceOrders {
        structure_n: force_n.clone(),
        cutting_n: force_n,
    }
}

/// Fourier coefficients of the force of one tooth of a rigid tool, orders × 3.
fn tooth_force(cutter: &Cutter, tooth: usize, highest: usize) -> DMatrix<Complex64> {
    let tooth = &cutter.teeth[tooth];
    let range_rad = cutter.exit_rad - cutter.start_rad;
    let count = (ANGLES * highest as f64 * range_rad / TAU).ceil().max(1.0) as usize;
    let step_rad = range_rad / count as f64;
    let mut coefficients = DMatrix::zeros(highest + 1, 3);
    for index in 0..count {
        let phi_rad = cutter.start_rad + (index as f64 + 0.5) * step_rad;
        let at = cutter.immersion(phi_rad);
        let thickness_m = cutter.recession_m(at, tooth.feed_m).max(0.0);
        let force_n = cutter.force.force_n(at, thickness_m, cutter.depth_m);
        let turn = Complex64::cis(tooth.angle_rad - phi_rad);
        let mut wave = Complex64::from(step_rad / TAU);
        for mut row in coefficients.row_iter_mut() {
            for (entry, force_n) in row.iter_mut().zip(force_n) {
                *entry += wave * force_n;
            }
            wave *= turn;
        }
    }
    coefficients
}
