//! Limits at one spindle speed of a structure that is fitted to a table of receptances, with the error of the fit.

use std::f64::consts::TAU;

use super::fitted_cut::FittedCut;
use super::fitted_structure::FittedStructure;
use super::problem::FrequencyProblem;
use crate::criteria::FIT_ROOM;
use crate::error::StabilityError;
use crate::limits::line::line;
use crate::limits::speed_line::{SpeedLine, Switch};
use crate::problem::period::{Period, Resolution};
use crate::spectrum::crossing::Crossing;
use crate::spectrum::port_mode::PortMode;

/// Limits at a spindle speed (rev/min) up to an axial depth (mm) of the structure that is fitted to the table of a
/// problem. Their errors are those of collocation, plus [`FIT_ROOM`] times the change of each limit with the deviation
/// of the fit from the table, plus the largest change with the errors of the table by aliasing, both to first order.
///
/// # Errors
/// As [`line`], or a vibration lies outside the measured frequencies.
pub(crate) fn fitted_line(
    problem: &FrequencyProblem,
    fitted: &FittedStructure,
    rpm: f64,
    depth_mm: f64,
    samples: usize,
) -> Result<SpeedLine, StabilityError> {
    let cut = FittedCut { problem, fitted };
    let model = cut.model();
    let found = line(&model, rpm, depth_mm, samples)?;
    let deepest_mm = found
        .switches
        .iter()
        .map(|switch| switch.depth_mm)
        .fold(0.0, f64::max);
    let period = Period::new(&model, rpm, 2e-3 * deepest_mm, Resolution::WORKING);
    let shift_mm = |switch: &Switch| {
        let crossing = Crossing {
            multiplier: switch.multiplier(model.tooth_period_s(rpm))?,
            depth_m: 1e-3 * switch.depth_mm,
        };
        let mode = PortMode::new(&model, rpm, &period, crossing)?;
        let by_folding_m = mode.largest_shift_by_sizes_m(|s| problem.folding_at(s.im / TAU))?;
        Some(1e3 * (FIT_ROOM * mode.largest_shift_m(|s| cut.deviation(s))? + by_folding_m))
    };
    for switch in &found.switches {
        problem.check_band(switch.chatter_hz, rpm, switch.depth_mm)?;
    }
    Ok(found.with_further_errors(depth_mm, shift_mm))
}
