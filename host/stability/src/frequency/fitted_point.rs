//! Dominant Floquet multiplier at one speed and depth of a structure that is fitted to a table of receptances, with the
//! error of the fit.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::fitted_cut::FittedCut;
use super::fitted_structure::FittedStructure;
use super::problem::FrequencyProblem;
use crate::criteria::FIT_ROOM;
use crate::error::StabilityError;
use crate::limits::point::{CutStability, point};
use crate::problem::period::{Period, Resolution};
use crate::spectrum::crossing::Crossing;
use crate::spectrum::port_mode::PortMode;

/// Dominant multiplier at a spindle speed (rev/min) and an axial depth (mm) of the structure that is fitted to the table
/// of a problem. The error is that of collocation, plus the largest change of the multiplier, to first order, with
/// the errors of the table by aliasing and with [`FIT_ROOM`] times the deviation of the fit from the table: as it is on the
/// imaginary axis, and as far as it may be one of the poles and residues, which counts off the axis. It is infinite if the
/// multiplier is not single.
///
/// # Errors
/// As [`point`], or the vibration lies outside the measured frequencies.
pub(crate) fn fitted_point(
    problem: &FrequencyProblem,
    fitted: &FittedStructure,
    rpm: f64,
    depth_mm: f64,
) -> Result<CutStability, StabilityError> {
    let cut = FittedCut { problem, fitted };
    let model = cut.model();
    let found = point(&model, rpm, depth_mm)?;
    problem.check_band(found.chatter_hz, rpm, depth_mm)?;
    let depth_m = 1e-3 * depth_mm;
    let shift = || {
        let crossing = Crossing {
            multiplier: found.multiplier,
            depth_m,
        };
        let period = Period::new(&model, rpm, depth_m, Resolution::WORKING);
        let mode = PortMode::new(&model, rpm, &period, crossing)?;
        let shares = cut.shares_of_modes();
        mode.largest_change_of_multiplier(|s, force, adjoint| {
            let deviation = cut.deviation(s).map(Complex64::norm);
            let sizes = deviation * FIT_ROOM + problem.folding_at(s.im / TAU);
            adjoint
                .map(Complex64::norm)
                .dot(&(sizes * force.map(Complex64::norm)))
                + FIT_ROOM * cut.change_by_modes(&shares, s, force, adjoint)
        })
    };
    // Without a cut the multiplier is that of a pole, on which the deviation acts in no port.
    let shift = if depth_mm == 0.0 { Some(0.0) } else { shift() };
    let error = found.error + shift.unwrap_or(f64::INFINITY);
    Ok(CutStability {
        kind: found.kind,
        ..CutStability::new(rpm, depth_mm, found.multiplier, error, found.chatter_hz)
    })
}
