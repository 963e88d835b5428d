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

use super::conditions::Conditions;
use super::machine::Machine;
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
    middle: (&Machine, &CutOrbit),
) -> Option<[DMatrix<Complex64>; 2]> {
    let angle = &orders.angle;
    let wander = angle.speed_wander.hypot(HIDDEN * angle.angle_deviation_rad);
    let highest = orders.kernel().aliases();
    let read = |machine: &Machine, orbit: &CutOrbit| {
        let forces = orbit.force_orders(&orbit.order_weights(highest));
        machine.reading.orders(&forces)
    };
    let at = |step: f64| {
        let conditions = Conditions {
            spindle_hz: conditions.spindle_hz * (1.0 + step),
            ..*conditions
        };
        let machine = Machine::of_baseline(baseline, &conditions, &orders.channels, highest, rate_hz)?;
        let orbit = CutOrbit::near(&machine.model, middle.1).ok()?;
        Some(read(&machine, &orbit))
    };
    let [below, above] = [at(-STEP)?, at(STEP)?];
    let middle = read(middle.0, middle.1);
    let error = angle.frequency_deviation_hz / angle.frequency_hz;
    let moved = (&above - &below) * Complex64::from(0.5 * error / STEP);
    let bent =
        (above + below - middle * Complex64::from(2.0)) * Complex64::from(0.5 * (wander / STEP).powi(2));
    Some([moved, bent].map(|direction| orders.of_channels(&direction)))
}
