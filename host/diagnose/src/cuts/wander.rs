//! What errors and wander of the spindle speed leave in the mean orders.
//!
//! If the speed is known with a relative error ε, the orders are those of another orbit, by ε Ω Y'(Ω). A speed that changes slowly against the decay of the machine moves the orders along the orbits of the speeds that it
//! takes, Y(Ω). With the relative variance σ² of the speed, their mean is
//!
//! ```text
//! E[Y] = Y(Ω) + ½ σ² Ω² Y''(Ω),
//! ```
//!
//! and its difference from Y(Ω) is largest where an order is near a natural frequency.

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::conditions::{Conditions, cut_model};
use super::reading::Reading;
use crate::baseline::Baseline;
use crate::orders::reduction::Orders;
use quietcut_stability::cut_orbit::CutOrbit;

/// Relative step of the spindle speed in the second difference: below the bandwidth of a mode with a damping ratio of
/// 1 %.
const STEP: f64 = 2e-3;
/// Wander of the speed, over the error of the spindle angle in radians, that the tachometer does not show: that of a
/// period of ten revolutions.
const HIDDEN: f64 = 0.1;

/// Orders of the channels that one standard deviation of the mean speed, and its wander, add to those of the mean speed;
/// `None` if the baseline has no orbit.
pub(super) fn directions(
    baseline: &Baseline<'_>,
    conditions: &Conditions,
    orders: &Orders,
    rate_hz: f64,
    highest: usize,
) -> Option<[DMatrix<Complex64>; 2]> {
    let angle = &orders.angle;
    let wander = angle.speed_wander.hypot(HIDDEN * angle.angle_deviation_rad);
    let at = |step: f64, near: Option<&CutOrbit>| {
        let conditions = Conditions {
            spindle_hz: conditions.spindle_hz * (1.0 + step),
            ..*conditions
        };
        let model = cut_model(baseline.case, &baseline.effects, &conditions).ok()?;
        let pickups: Option<Vec<_>> = orders.channels.iter().map(|name| baseline.pickup(name)).collect();
        let reading = Reading::new(
            &model.structure,
            pickups?,
            conditions.spindle_hz,
            highest,
            rate_hz,
        )?;
        let orbit = near
            .map_or_else(|| CutOrbit::new(&model), |near| CutOrbit::near(&model, near))
            .ok()?;
        let forces = orbit.force_orders(&orbit.order_weights(highest));
        Some((reading.orders(&forces), orbit))
    };
    let (middle, orbit) = at(0.0, None)?;
    let [(below, _), (above, _)] = [at(-STEP, Some(&orbit))?, at(STEP, Some(&orbit))?];
    let error = angle.frequency_deviation_hz / angle.frequency_hz;
    let moved = (&above - &below) * Complex64::from(0.5 * error / STEP);
    let bent =
        (above + below - middle * Complex64::from(2.0)) * Complex64::from(0.5 * (wander / STEP).powi(2));
    Some([moved, bent].map(|direction| {
        let seen: Vec<_> = direction
            .column_iter()
            .map(|column| nalgebra::DVector::from_vec(orders.seen(column.as_slice())))
            .collect();
        DMatrix::from_columns(&seen)
    }))
}
