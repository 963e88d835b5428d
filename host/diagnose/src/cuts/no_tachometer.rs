//! Spindle angle of a cut without tachometer: its speed from the orders, and how it wanders, its zero from the orbit of the baseline.

use std::f64::consts::TAU;

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::conditions::Conditions;
use super::machine::Machine;
use super::scatter::rigid_forces;
use crate::baseline::Baseline;
use crate::error::DiagnoseError;
use crate::orders::followed::followed;
use crate::orders::reduction::{Orders, ReductionSettings};
use crate::orders::speed_from_orders::angle_from_orders;
use crate::orders::spindle_angle::SpindleAngle;
use quietcut_recording::Recording;
use quietcut_stability::cut_orbit::CutOrbit;

/// Trial angles for each period of the highest order.
const TRIALS: usize = 8;

/// The spindle angle of a recording with the speed near that of its sidecar, and with the zero at which the amplitudes are most
/// like those of the baseline. With equal teeth and no runout any tooth may be the first.
///
/// # Errors
/// The sidecar states no speed; the channels show no orders near it; or the baseline has an undamped mode at an order.
pub(super) fn spindle_angle(
    baseline: &Baseline<'_>,
    recording: &Recording,
    names: &[&str],
    settings: &ReductionSettings,
) -> Result<SpindleAngle, DiagnoseError> {
    let steady = angle_from_orders(recording, names, settings)?;
    let angle = followed(recording, names, steady, settings)?;
    let orders = Orders::with_angle(recording, names, angle, settings)?;
    let conditions = Conditions::of_record(baseline.case, recording, &orders)?;
    let highest = orders.kernel().aliases();
    let rate_hz = recording.sample_rate_hz;
    let machine = Machine::of_baseline(baseline, &conditions, &orders.channels, highest, rate_hz);
    let mut machine = machine.ok_or_else(|| {
        DiagnoseError::record(
            &recording.path,
            "the case has no orders of this cut: it has an undamped mode at one of them".to_owned(),
        )
    })?;
    let forces = match CutOrbit::along_depth(&mut machine.model) {
        Ok(orbit) => orbit.force_orders(&orbit.order_weights(highest)),
        Err(_) => rigid_forces(&machine.model.cutter, highest),
    };
    let turned = angle_between(&machine.reading.orders(&forces), &orders);
    Ok(orders.angle.turned((1.0 - turned / TAU).fract(), rate_hz))
}

/// Angle φ from 0 to 2π at which Σ_k Re(ā_k·c_k·e^{ikφ}) is largest, over the orders k ≥ 1 of all channels, each over its own size, with
/// the amplitudes a of the record and c of the prediction.
fn angle_between(predicted: &DMatrix<Complex64>, orders: &Orders) -> f64 {
    let measured = &orders.amplitudes;
    let highest = measured.nrows().min(predicted.nrows());
    let mut products = vec![Complex64::ZERO; highest];
    for channel in 0..measured.ncols() {
        let size = |of: &DMatrix<Complex64>| {
            let all = of.column(channel);
            all.rows(1, highest - 1).norm().max(f64::MIN_POSITIVE)
        };
        let scale = 1.0 / (size(measured) * size(predicted));
        for (order, product) in products.iter_mut().enumerate().skip(1) {
            *product += measured[(order, channel)].conj() * predicted[(order, channel)] * scale;
        }
    }
    let likeness = |angle: f64| -> f64 {
        let turn = Complex64::from_polar(1.0, angle);
        // Horner's scheme from the highest order down.
        products
            .iter()
            .rev()
            .fold(Complex64::ZERO, |sum, product| sum * turn + product)
            .re
    };
    let count = TRIALS * highest;
    (0..count)
        .map(|trial| TAU * trial as f64 / count as f64)
        .max_by(|a, b| likeness(*a).total_cmp(&likeness(*b)))
        .unwrap_or(0.0)
}
