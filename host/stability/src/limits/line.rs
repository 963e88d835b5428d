//! Stability along the depth at one spindle speed: every crossing of the unit circle by a Floquet multiplier
//! (characteristic multiplier).

use num_complex::Complex64;

use super::bounds::{check_depth, check_speed};
use super::speed_line::{SpeedLine, Switch};
use crate::criteria::{
    LINE_FAR, LINE_FOLLOWED, LINE_LEVELS, LINE_POLISHED, REACH_FACTOR, REACH_LEAST, TOUCHING,
};
use crate::error::{NO_SOLUTION, StabilityError};
use crate::problem::linear::Problem;
use crate::problem::period::check_length;
use crate::spectrum::along_depth::Spectrum;
use crate::spectrum::collocated::Collocated;
use crate::spectrum::crossing::Crossing;
use crate::spectrum::root::Root;
use crate::spectrum::stability_loss::StabilityLoss;

/// Share of the largest depth of a line for which the first mesh of the period is built. Each further mesh covers twice
/// the depth of the one before, or more if the next sampled depth lies deeper, but no more than the largest depth.
const FIRST_SHARE: f64 = 0.125;

/// Relative error of the depth of a crossing on a given mesh, due to the tolerance of Newton's method.
const ROOT: f64 = 1e-9;

/// All crossings of the unit circle by Floquet multipliers at one spindle speed (rev/min), from axial depth 0 to
/// `depth_mm`, sampled at `samples` equal steps and finer where needed.
///
/// Crossings are computed with the characteristic matrix, to about 1e-9 relative. Between two sampled depths each
/// multiplier near the unit circle is followed with its derivative. If the cubic interpolant of |μ| − 1 may reach 0 and
/// return, or if a multiplier cannot be followed, the depth interval is halved, up to 12 times. At every sample the
/// number of multipliers outside the circle must agree with the crossings found. If it does not after 12 halvings, or
/// if a multiplier still cannot be followed, one crossing is found by bisection on that number, and none if the number
/// is the same at both ends.
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
    let mut deepest_m = depth_m * FIRST_SHARE;
    let mut scan = Scan {
        rpm,
        spectrum: spectrum(deepest_m),
        crossings: Vec::new(),
    };
    let mut largest = Vec::with_capacity(samples + 1);
    let mut low = scan.sample(0.0)?;
    let start = low.outside();
    largest.push(low.largest);
    for index in 1..=samples {
        let share = index as f64 / samples as f64;
        if share * depth_m > deepest_m {
            // The mesh of the period must be finer for larger depths: small depths use a coarser, cheaper one.
            deepest_m = (2.0 * deepest_m).max(share * depth_m).min(depth_m);
            scan.spectrum = spectrum(deepest_m);
        }
        let high = scan.sample(depth_m * share)?;
        let found = scan.between(&low, &high, 0)?;
        scan.crossings.extend(found);
        largest.push(high.largest);
        low = high;
    }
    Ok(SpeedLine {
        largest,
        ..scan.finish(start, depth_mm)
    })
}

/// True if a multiplier may reach the unit circle within a step in axial depth.
fn is_near(root: &Root, step_m: f64) -> bool {
    root.excess().abs() < (REACH_FACTOR * root.slope.norm() * step_m + REACH_LEAST).min(LINE_FAR)
}

#[derive(Clone, Debug)]
struct Sample {
    depth_m: f64,
    /// Absolute value of the largest multiplier at this depth, to the error of the scan.
    largest: f64,
    roots: Vec<Root>,
}

impl Sample {
    /// Number of multipliers outside the unit circle at this depth.
    fn outside(&self) -> i32 {
        self.roots
            .iter()
            .filter(|root| root.excess() > 0.0)
            .map(|root| StabilityLoss::of(root.multiplier).count())
            .sum()
    }
}

#[derive(Clone, Copy, Debug)]
struct DirectedCrossing {
    crossing: Crossing,
    outward: bool,
}

struct Scan<S> {
    rpm: f64,
    spectrum: S,
    crossings: Vec<DirectedCrossing>,
}

impl<S: Spectrum> Scan<S> {
    fn broke_down(&self, depth_m: f64, what: &'static str) -> StabilityError {
        StabilityError::BrokeDown {
            rpm: self.rpm,
            depth_mm: depth_m * 1e3,
            what,
        }
    }

    fn sample(&mut self, depth_m: f64) -> Result<Sample, StabilityError> {
        let all = self
            .spectrum
            .multipliers(depth_m)
            .map_err(|cause| cause.at(self.rpm, depth_m * 1e3, NO_SOLUTION))?;
        let largest = all.first().map_or(0.0, |multiplier| multiplier.norm());
        let roots = all
            .into_iter()
            .take_while(|multiplier| multiplier.norm() > LINE_FOLLOWED)
            .filter(|multiplier| multiplier.im >= 0.0)
            .map(|multiplier| self.root(multiplier, depth_m))
            .collect();
        Ok(Sample {
            depth_m,
            largest,
            roots,
        })
    }

    /// Floquet multiplier with its derivative dμ/dw over the axial depth, stated as 0 if |μ| is at least [`LINE_FAR`]
    /// from 1 or if there is no derivative. Near the unit circle the multiplier is computed anew, by Newton's method in
    /// collocation, so that it counts on the right side of the circle.
    fn root(&mut self, coarse: Complex64, depth_m: f64) -> Root {
        let spectrum = &mut self.spectrum;
        let multiplier = if (coarse.norm() - 1.0).abs() < LINE_POLISHED {
            spectrum
                .multiplier_near(coarse, depth_m, LINE_POLISHED)
                .unwrap_or(coarse)
        } else {
            coarse
        };
        let slope = if (multiplier.norm() - 1.0).abs() < LINE_FAR {
            spectrum.sensitivity(multiplier, depth_m)
        } else {
            None
        };
        Root {
            multiplier,
            slope: slope.unwrap_or(Complex64::ZERO),
        }
    }

    /// Crossings of the unit circle between two sampled depths, by ascending depth.
    fn between(
        &mut self,
        low: &Sample,
        high: &Sample,
        level: u32,
    ) -> Result<Vec<DirectedCrossing>, StabilityError> {
        if let Some(found) = self.follow(low, high)
            && balance(&found) == high.outside() - low.outside()
        {
            return Ok(found);
        }
        if level == LINE_LEVELS {
            return self.by_halving(low, high);
        }
        let middle = self.sample(0.5 * (low.depth_m + high.depth_m))?;
        let mut found = self.between(low, &middle, level + 1)?;
        found.extend(self.between(&middle, high, level + 1)?);
        Ok(found)
    }

    /// Follows each multiplier near the unit circle between two sampled depths; `None` if one cannot be followed, may
    /// touch the circle in between, or crosses it at a depth that is not found.
    fn follow(&mut self, low: &Sample, high: &Sample) -> Option<Vec<DirectedCrossing>> {
        let step_m = high.depth_m - low.depth_m;
        let mut free: Vec<Root> = high.roots.clone();
        let mut found = Vec::new();
        for from in low.roots.iter().filter(|root| is_near(root, step_m)) {
            let to = from.take_next(&mut free, step_m)?;
            if (from.excess() > 0.0) != (to.excess() > 0.0) {
                found.push(self.cross(low, high, from, &to)?);
            } else if may_touch(from, &to, step_m) {
                return None;
            }
        }
        // A multiplier at the larger depth without a partner at the smaller one must be far from the unit circle.
        if free.iter().any(|root| is_near(root, step_m)) {
            return None;
        }
        found.sort_by(|a, b| a.crossing.depth_m.total_cmp(&b.crossing.depth_m));
        Some(found)
    }

    fn cross(&mut self, low: &Sample, high: &Sample, from: &Root, to: &Root) -> Option<DirectedCrossing> {
        let share = from.excess() / (from.excess() - to.excess());
        let guess = Crossing {
            depth_m: low.depth_m + share * (high.depth_m - low.depth_m),
            multiplier: from.multiplier + (to.multiplier - from.multiplier) * share,
        };
        let crossing = self.spectrum.crossing_near(guess, low.depth_m, high.depth_m)?;
        // The crossing of the unit circle must lie on the branch of this multiplier, not on that of another which
        // crosses at a nearby depth.
        let distance = (crossing.multiplier - guess.multiplier).norm();
        (distance < 0.5 * (to.multiplier - from.multiplier).norm() + 1e-6).then_some(DirectedCrossing {
            crossing,
            outward: to.excess() > 0.0,
        })
    }

    /// Bisects a depth interval on the number of multipliers outside the unit circle, where multipliers cannot be
    /// followed even over this short interval. Finds one crossing, or none if the number is the same at both ends.
    fn by_halving(&mut self, low: &Sample, high: &Sample) -> Result<Vec<DirectedCrossing>, StabilityError> {
        let (mut low, mut high) = (low.clone(), high.clone());
        if low.outside() == high.outside() {
            return Ok(Vec::new());
        }
        while high.depth_m - low.depth_m > 1e-10 * high.depth_m {
            let middle = self.sample(0.5 * (low.depth_m + high.depth_m))?;
            if middle.outside() == low.outside() {
                low = middle;
            } else {
                high = middle;
            }
        }
        let outward = high.outside() > low.outside();
        let outer = if outward { &high } else { &low };
        let crossed = outer
            .roots
            .iter()
            .filter(|root| root.excess() > 0.0)
            .min_by(|a, b| a.excess().total_cmp(&b.excess()))
            .ok_or_else(|| {
                self.broke_down(
                    high.depth_m,
                    "a Floquet multiplier was lost while the interval of depth was halved",
                )
            })?;
        Ok(vec![DirectedCrossing {
            crossing: Crossing {
                depth_m: 0.5 * (low.depth_m + high.depth_m),
                multiplier: crossed.multiplier / crossed.multiplier.norm(),
            },
            outward,
        }])
    }

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
            ..SpeedLine::of_switches(self.rpm, depth_mm, start, switches)
        }
    }

    /// Error of the depth of a crossing, m: a distance at which |μ| of its branch differs from 1 by at least the error
    /// of the multiplier, on both sides in depth.
    ///
    /// The first try is slightly more than that error divided by d|μ|/dw; the distance doubles until |μ| confirms it.
    /// `deepest_m` if no smaller distance does.
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

/// Change of the number of multipliers outside the unit circle over the crossings `found`, from small to large depth.
fn balance(found: &[DirectedCrossing]) -> i32 {
    found
        .iter()
        .map(|found| {
            let count = StabilityLoss::of(found.crossing.multiplier).count();
            if found.outward { count } else { -count }
        })
        .sum()
}

/// True if a multiplier that lies on one side of the unit circle at both sampled depths may touch the circle in
/// between: the cubic interpolant of |μ| − 1 comes near zero.
fn may_touch(from: &Root, to: &Root, step_m: f64) -> bool {
    let (a, b) = (from.excess(), to.excess());
    let (da, db) = (from.excess_slope() * step_m, to.excess_slope() * step_m);
    // The cubic interpolant of |μ| − 1 can only touch zero if |μ| moves towards the unit circle from both ends of the
    // depth interval.
    if a.signum() * da >= 0.0 || b.signum() * db <= 0.0 {
        return false;
    }
    let side = a.signum();
    // The best of nine points of the cubic interpolant of |μ| − 1 misses its extremum by a few percent of its height at
    // most.
    let nearest = (1..10)
        .map(|i| {
            let t = f64::from(i) * 0.1;
            let (u, t2) = (1.0 - t, t * t);
            side * (u * u * ((1.0 + 2.0 * t) * a + t * da) + t2 * ((3.0 - 2.0 * t) * b - u * db))
        })
        .fold(f64::INFINITY, f64::min);
    nearest < TOUCHING * a.abs().min(b.abs())
}
