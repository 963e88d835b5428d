//! Stability along the depth at one spindle speed: every crossing of the unit circle by a Floquet multiplier
//! (characteristic multiplier).

use super::bounds::{check_depth, check_speed};
use super::scan::{DirectedCrossing, Scan};
use super::speed_line::{SpeedLine, Switch};
use crate::criteria::FIRST_MESH_SHARE;
use crate::error::StabilityError;
use crate::problem::linear::Problem;
use crate::problem::period::check_length;
use crate::spectrum::along_depth::Spectrum;
use crate::spectrum::collocated::Collocated;
use crate::spectrum::crossing::Crossing;
use crate::spectrum::stability_loss::StabilityLoss;

/// Largest number of depth intervals at whose ends multipliers are computed first. An interval is halved where its
/// multipliers cannot be followed. A choice: more cost time, fewer are halved at once.
const INTERVALS: usize = 10;

/// Relative error of the depth of a crossing on a given mesh, due to the tolerance of Newton's method.
const ROOT: f64 = 1e-9;

/// All crossings of the unit circle by Floquet multipliers at one spindle speed (rev/min), from axial depth 0 to
/// `depth_mm`; the largest multiplier is stated at `samples` equal steps.
///
/// The larger multipliers are computed at the ends of at most ten depth intervals. Between them each multiplier that
/// may reach the circle is followed as ln μ by the cubic through both ends with their derivatives, which Newton's
/// method half way confirms and corrects. Crossings are computed with the characteristic matrix, to about 1e-9
/// relative; each must lie on the path of its multiplier and have its direction. The crossings in an interval must
/// agree with the numbers of multipliers outside the circle at its ends. If they do not, or if a multiplier cannot be
/// followed or may touch the circle and return, the interval is halved, up to 14 times. After that, one crossing is
/// found by bisection on the number of multipliers outside, or none if the number is the same at both ends.
///
/// # Errors
/// Speed or depth out of range, too many vibrations in a tooth period, or a computation that breaks down, for example
/// because it leaves the range of numbers.
pub fn line(problem: &Problem, rpm: f64, depth_mm: f64, samples: usize) -> Result<SpeedLine, StabilityError> {
    check_length(problem, rpm, depth_mm)?;
    line_of(rpm, depth_mm, samples, |deepest_m| {
        Collocated::new(problem, rpm, deepest_m)
    })
}

/// Implements [`line()`] for a method that gives a [`Spectrum`]. The function `spectrum` gives the multipliers at this
/// spindle speed, valid up to the axial depth (m) that is its argument.
pub(crate) fn line_of<S: Spectrum>(
    rpm: f64,
    depth_mm: f64,
    samples: usize,
    spectrum: impl Fn(f64) -> S,
) -> Result<SpeedLine, StabilityError> {
    check_speed(rpm)?;
    check_depth(depth_mm)?;
    let depth_m = depth_mm * 1e-3;
    let samples = samples.max(1);
    let mut deepest_m = depth_m * FIRST_MESH_SHARE;
    let mut scan = Scan {
        rpm,
        spectrum: spectrum(deepest_m),
        step_m: depth_m / samples as f64,
        crossings: Vec::new(),
        largest: Vec::with_capacity(samples + 1),
    };
    let mut low = scan.sample(0.0)?;
    let start = low.outside();
    let intervals = samples.min(INTERVALS);
    for index in 1..=intervals {
        let share = index as f64 / intervals as f64;
        if share * depth_m > deepest_m {
            // The mesh of the period must be finer for larger depths: small depths use a coarser, cheaper one.
            deepest_m = (2.0 * deepest_m).max(share * depth_m).min(depth_m);
            scan.spectrum = spectrum(deepest_m);
        }
        let high = scan.sample(depth_m * share)?;
        scan.between(&low, &high, 0)?;
        low = high;
    }
    scan.end(&low);
    Ok(scan.finish(start, depth_mm))
}

impl<S: Spectrum> Scan<S> {
    fn finish(mut self, start: i32, depth_mm: f64) -> SpeedLine {
        let crossings = std::mem::take(&mut self.crossings);
        let deepest_m = depth_mm * 1e-3;
        let mut without_error = Vec::new();
        let switches = crossings
            .iter()
            .map(|DirectedCrossing { crossing, outward }| {
                let error_m = self
                    .error_m(crossing, *outward, deepest_m)
                    .unwrap_or_else(|reason| {
                        without_error.push(reason.to_string());
                        deepest_m
                    });
                Switch {
                    depth_mm: crossing.depth_m * 1e3,
                    error_mm: Some(1e3 * error_m),
                    kind: StabilityLoss::of(crossing.multiplier),
                    gain: !outward,
                    chatter_hz: self.spectrum.chatter_hz(crossing),
                }
            })
            .collect();
        SpeedLine {
            without_error,
            largest: self.largest,
            ..SpeedLine::of_switches(self.rpm, depth_mm, start, switches)
        }
    }

    /// Error of the depth of a crossing, m: a distance in depth at which the multiplier that crosses is inside the unit
    /// circle on one side and outside on the other, by at least its own error; a side below depth 0 is not tested.
    ///
    /// The first try is slightly more than the error of the multiplier divided by d|μ|/dw; the distance doubles until
    /// |μ| confirms it. `deepest_m` if no smaller distance does.
    ///
    /// # Errors
    /// The error of the multiplier, or its derivative over the depth, cannot be computed.
    fn error_m(&mut self, crossing: &Crossing, outward: bool, deepest_m: f64) -> Result<f64, StabilityError> {
        let Crossing { multiplier, depth_m } = *crossing;
        let error = self.spectrum.error(crossing)?;
        let slope = self.spectrum.sensitivity(multiplier, depth_m).ok_or_else(|| {
            self.broke_down(depth_m, "the Floquet multiplier has no derivative over the depth")
        })?;
        let mut reach_m = 1.01 * error / (multiplier.conj() * slope).re.abs() + ROOT * depth_m;
        while reach_m < deepest_m {
            let sides = [(-reach_m, outward), (reach_m, !outward)];
            let mut is_beyond = |(shift_m, inside): (f64, bool)| {
                // If the distance reaches below depth 0, no multiplier needs to be computed on the shallow side.
                depth_m + shift_m <= 0.0 || {
                    let guess = multiplier + slope * shift_m;
                    let there = self.spectrum.multiplier_near(guess, depth_m + shift_m, 0.1);
                    there.is_some_and(|there| {
                        if inside {
                            there.norm() <= 1.0 - error
                        } else {
                            there.norm() >= 1.0 + error
                        }
                    })
                }
            };
            if sides.into_iter().all(&mut is_beyond) {
                return Ok(reach_m);
            }
            reach_m *= 2.0;
        }
        Ok(deepest_m)
    }
}
