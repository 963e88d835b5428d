//! Candidate tests of a plan, each with its Fisher information about the unknown parameters.

use std::f64::consts::{FRAC_2_PI, PI};
use std::fmt::Display;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rayon::prelude::*;
use serde::Serialize;

use super::chart::{KnownChart, KnownLimit};
use super::means::Means;
use super::unknowns::Unknowns;
use quietcut_model::CuttingLoad;
use quietcut_model::case::Case;
use quietcut_model::structure::{Direction, FirstOrder, Structure, StructureError};
use quietcut_simulate::STANDARD_GRAVITY;
use quietcut_stability::{CubicTerms, Problem, Variable};

/// Step of the central differences of a test's response by an unknown parameter, in prior standard deviations of the
/// parameter. A choice.
const STEP: f64 = 0.05;

/// Number of angles at which the cutting force is evaluated in each subinterval of the tooth-passing period in which
/// the number of engaged teeth is constant and not zero. A choice.
const PHASES: usize = 90;

/// Largest number of spindle speeds at which candidate tests of a plan bracket the stability limit by trial cuts. A
/// choice that bounds the computing time.
const BRACKETS: usize = 40;

/// A test at the machine that a plan may contain.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Test {
    /// Hammer impacts at the tool tip at standstill, with the acceleration measured there in every direction of the
    /// structure.
    Hammer {
        /// Direction of the impact.
        direction: String,
        /// Number of impacts.
        #[serde(rename = "blows")]
        impacts: usize,
    },
    /// A stable cut at one speed and depth on a dynamometer, which records the cutting force.
    Force {
        /// Spindle speed, rev/min.
        rpm: f64,
        /// Axial depth, mm.
        depth_mm: f64,
        /// Duration of the force recording, s.
        seconds: f64,
    },
    /// A series of cuts at one speed that bracket the stability limit in depth, each halving the interval. The chatter
    /// frequency is measured in those that chatter.
    Cuts {
        /// Spindle speed, rev/min.
        rpm: f64,
        /// Expected depth of the stability limit, mm.
        about_mm: f64,
        /// Final width of the interval of depth that contains the stability limit, mm.
        bracket_mm: f64,
    },
}

/// A candidate test and its Fisher information.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub(super) test: Test,
    /// Fisher information matrix J of the test about the unknown parameters, each in units of its prior standard
    /// deviation.
    pub(super) information: DMatrix<f64>,
    /// Index of the chart's stability limit that the test brackets; `None` for other tests.
    pub(super) limit: Option<usize>,
}

/// Reason why the Fisher information of a test cannot be computed.
#[derive(Debug, thiserror::Error)]
pub(super) enum CandidateError {
    /// The nominal structure has no equation of motion.
    #[error("{0}")]
    Structure(#[from] StructureError),
    /// After a change of an unknown parameter by one step of the central differences the case is invalid, or a quantity
    /// of it cannot be computed.
    #[error("a change of an unknown ({unknown}) by a twentieth of its standard deviation gives {what}")]
    Invalid {
        /// Name of the unknown.
        unknown: String,
        /// Reason why the case is invalid.
        what: String,
    },
}

/// All candidate tests of a plan: hammer tests, a force test, and cuts that bracket stability limits, as far as the
/// spindle can drive them.
///
/// # Errors
/// A structure or a cut cannot be computed, for the nominal parameters or after one step of an unknown.
pub(super) fn candidates(
    case: &Case,
    problem: &Problem,
    unknowns: &Unknowns,
    chart: &KnownChart,
    means: &Means,
) -> Result<Vec<Candidate>, CandidateError> {
    let mut candidates = hammers(case, unknowns, means)?;
    candidates.extend(force(case, problem, unknowns, chart, means)?);
    let count = chart.limits.len();
    let step = count.div_ceil(BRACKETS).max(1);
    candidates.extend(
        chart
            .limits
            .iter()
            .enumerate()
            .step_by(step)
            .map(|(index, limit)| cuts(index, limit, means)),
    );
    // Without the load, as of a tool without diameter, every depth counts as possible.
    if let Ok(Some(load)) = CuttingLoad::of_limited(case) {
        candidates.retain(|candidate| can_be_driven(&candidate.test, &load));
    }
    Ok(candidates)
}

/// True if the spindle can drive the cuts of a test: a force test at its depth, a bracket up to its upper end.
fn can_be_driven(test: &Test, load: &CuttingLoad) -> bool {
    let (rpm, deepest_mm) = match test {
        Test::Hammer { .. } => return true,
        Test::Force { rpm, depth_mm, .. } => (*rpm, *depth_mm),
        Test::Cuts {
            rpm,
            about_mm,
            bracket_mm,
        } => (*rpm, about_mm + 0.5 * bracket_mm),
    };
    let driven = load.driven_depth(rpm).ok().flatten();
    driven.is_none_or(|driven| deepest_mm <= driven.depth_mm)
}

/// Candidate test that brackets a stability limit by cuts. It measures the depth of the limit, uniformly distributed
/// within the final bracket width w (variance w²/12), and the chatter frequency.
fn cuts(index: usize, limit: &KnownLimit, means: &Means) -> Candidate {
    let plane = &limit.planes[0];
    let bracket_mm = means.bracket * plane.depth_mm;
    let depth = &plane.gradient * (12.0_f64.sqrt() / bracket_mm);
    let mut information = &depth * depth.transpose();
    if let Some((hz, gradient)) = &plane.chatter_hz {
        let frequency = gradient / (means.chatter_frequency * hz);
        information += &frequency * frequency.transpose();
    }
    Candidate {
        test: Test::Cuts {
            rpm: limit.rpm,
            about_mm: plane.depth_mm,
            bracket_mm,
        },
        information,
        limit: Some(index),
    }
}

/// A quantity `of` the case after a change of each of `variables` by one step downwards and upwards, in the order of
/// `variables`; `names` are their names.
///
/// # Errors
/// One of the changed cases is invalid, or has no such quantity.
fn shifted<'a, T, E: Display>(
    case: &Case,
    variables: impl Iterator<Item = &'a Variable>,
    names: &[String],
    of: impl Fn(&Case) -> Result<T, E>,
) -> Result<Vec<[T; 2]>, CandidateError> {
    variables
        .zip(names)
        .map(|(variable, name)| {
            let invalid = |what: String| CandidateError::Invalid {
                unknown: name.clone(),
                what,
            };
            let at = |deviations: f64| {
                let mut moved = case.clone();
                if variable.shift(&mut moved, deviations) {
                    of(&moved).map_err(|error| invalid(format!("an invalid case: {error}")))
                } else {
                    Err(invalid("a value outside its physical range".into()))
                }
            };
            Ok([at(-STEP)?, at(STEP)?])
        })
        .collect()
}

/// Candidate hammer tests, one for each direction of the structure; none without a structure or an oscillating mode.
///
/// An acceleration a = −ω²H(ω)F(ω), measured in white noise of one-sided density S, holds the Fisher information J_ij =
/// 4/S ∫₀^∞ Re(∂_i a* ∂_j a) dω/2π per impact, with F the transform of a half-sine force.
fn hammers(case: &Case, unknowns: &Unknowns, means: &Means) -> Result<Vec<Candidate>, CandidateError> {
    let Some(structure) = &case.structure else {
        return Ok(Vec::new());
    };
    let nominal = structure.first_order()?;
    let grid = frequency_grid(&nominal);
    let Some(&(highest_hz, _)) = grid.last() else {
        return Ok(Vec::new());
    };
    // The spectrum of a half-sine pulse has its first zero at 1.5/pulse length, here twice the highest frequency of the
    // grid, so that the pulse excites all modes.
    let pulse_s = 0.75 / highest_hz;
    let structures = shifted(
        case,
        unknowns.variables.iter().chain(&unknowns.standstill),
        &unknowns.names,
        |case: &Case| {
            case.structure
                .as_ref()
                .map_or(Ok(nominal.clone()), Structure::first_order)
        },
    )?;
    let density = (means.accelerometer_g_per_root_hertz * STANDARD_GRAVITY).powi(2);
    let axes = Direction::ALL.into_iter().filter_map(|direction| {
        let axis = direction.axis()?;
        structure
            .directions
            .contains(&direction)
            .then_some((direction, axis))
    });
    let axes: Vec<(Direction, usize)> = axes.collect();
    Ok(axes
        .par_iter()
        .map(|&(direction, axis)| {
            let mut information = DMatrix::zeros(unknowns.len(), unknowns.len());
            for &(hz, weight_hz) in &grid {
                let omega = 2.0 * PI * hz;
                let Some(response) = nominal.receptance(omega) else {
                    continue;
                };
                let force = half_sine(means.peak_n, pulse_s, hz);
                let scale = omega * omega * force * (4.0 * means.impacts as f64 * weight_hz / density).sqrt();
                for output in axes.iter().map(|&(_, axis)| axis) {
                    let slope = |index: usize| match structures.get(index) {
                        Some([low, high]) => {
                            let of = |structure: &FirstOrder| {
                                structure.receptance(omega).map(|h| h[(output, axis)])
                            };
                            match (of(low), of(high)) {
                                (Some(low), Some(high)) => (high - low) / (2.0 * STEP),
                                _ => Complex64::ZERO,
                            }
                        }
                        _ if index == unknowns.hammer_gain() => response[(output, axis)] * means.calibration,
                        _ => Complex64::ZERO,
                    };
                    let slopes: Vec<Complex64> =
                        (0..unknowns.len()).map(|index| slope(index) * scale).collect();
                    let part = |of: fn(&Complex64) -> f64| {
                        DVector::from_iterator(slopes.len(), slopes.iter().map(of))
                    };
                    for row in [part(|slope| slope.re), part(|slope| slope.im)] {
                        information.ger(1.0, &row, &row, 1.0);
                    }
                }
            }
            Candidate {
                test: Test::Hammer {
                    direction: direction.name().into(),
                    impacts: means.impacts,
                },
                information,
                limit: None,
            }
        })
        .collect())
}

/// Quadrature nodes and weights for integrals over frequency, Hz: from half the lowest to twice the highest natural
/// frequency, dense at resonances.
fn frequency_grid(structure: &FirstOrder) -> Vec<(f64, f64)> {
    let modes: Vec<(f64, f64)> = structure
        .poles()
        .iter()
        .filter(|pole| pole.im > 0.0)
        .map(|pole| (pole.norm() / (2.0 * PI), -pole.re / (2.0 * PI)))
        .collect();
    let (Some(lowest), Some(highest)) = (
        modes.iter().map(|mode| mode.0).reduce(f64::min),
        modes.iter().map(|mode| mode.0).reduce(f64::max),
    ) else {
        return Vec::new();
    };
    let coarse = (0..=200).map(|i| lowest * 0.5 * (4.0 * highest / lowest).powf(f64::from(i) / 200.0));
    // The tangent places the nodes at equal steps of the phase of a resonance.
    let fine = modes.iter().flat_map(|&(hz, half_width_hz)| {
        (-60..=60).map(move |i| hz + half_width_hz * (PI / 2.0 * f64::from(i) / 61.0).tan())
    });
    let mut frequencies: Vec<f64> = coarse
        .chain(fine)
        .filter(|&hz| hz >= 0.5 * lowest && hz <= 2.0 * highest)
        .collect();
    frequencies.sort_by(f64::total_cmp);
    let last = frequencies.len().saturating_sub(1);
    (0..frequencies.len())
        .map(|i| {
            let width = frequencies[(i + 1).min(last)] - frequencies[i.saturating_sub(1)];
            (frequencies[i], 0.5 * width)
        })
        .collect()
}

/// Magnitude |F(f)| of the transform of a half-sine impact, N s, at `hz`.
fn half_sine(peak_n: f64, pulse_s: f64, hz: f64) -> f64 {
    let turns = hz * pulse_s;
    let from_pole = 1.0 - 4.0 * turns * turns;
    if from_pole.abs() < 1e-6 {
        // At half the inverse pulse length numerator and denominator of the transform vanish; this is the limit of
        // their ratio.
        return peak_n * pulse_s * 0.5;
    }
    peak_n * pulse_s * FRAC_2_PI * ((PI * turns).cos() / from_pole).abs()
}

/// Candidate cut on a dynamometer at half the lowest stability limit of the chart: it is stable, so that the feed alone
/// sets the chip thickness. `None` if the chart has no limits.
///
/// The force F measured over the time T in noise of one-sided density S holds the Fisher information J_ij = 2T/S · mean
/// over the tooth-passing period of ∂_i F · ∂_j F.
fn force(
    case: &Case,
    problem: &Problem,
    unknowns: &Unknowns,
    chart: &KnownChart,
    means: &Means,
) -> Result<Option<Candidate>, CandidateError> {
    let Some(lowest) = chart
        .limits
        .iter()
        .min_by(|a, b| a.depth_mm().total_cmp(&b.depth_mm()))
    else {
        return Ok(None);
    };
    let depth_m = 0.5e-3 * lowest.depth_mm();
    let problems = shifted(case, unknowns.variables.iter(), &unknowns.names, |case: &Case| {
        Problem::new(case, CubicTerms::LeaveOut)
    })?;
    let engagement = problem.process.engagement;
    let density = means.dynamometer_n_per_root_hertz.powi(2);
    let mut information = DMatrix::zeros(unknowns.len(), unknowns.len());
    let intervals = engagement.subintervals();
    let phases = intervals
        .iter()
        .filter(|interval| interval.teeth > 0)
        .flat_map(|interval| {
            let length = interval.to - interval.from;
            let phase = move |index: usize| interval.from + (index as f64 + 0.5) / PHASES as f64 * length;
            (0..PHASES).map(move |index| (interval.teeth, phase(index), length / PHASES as f64))
        });
    for (teeth, phase, width) in phases {
        let scale = (2.0 * means.seconds / density * width / engagement.pitch).sqrt();
        let of = |problem: &Problem| problem.process.forced(teeth, phase) * depth_m;
        let nominal = of(problem);
        for axis in 0..3 {
            let slope = |index: usize| match problems.get(index) {
                Some([low, high]) => (of(high)[axis] - of(low)[axis]) / (2.0 * STEP),
                _ if index == unknowns.dynamometer_gain() => nominal[axis] * means.calibration,
                _ => 0.0,
            };
            let row = DVector::from_fn(unknowns.len(), |index, _| scale * slope(index));
            information.ger(1.0, &row, &row, 1.0);
        }
    }
    Ok(Some(Candidate {
        test: Test::Force {
            rpm: lowest.rpm,
            depth_mm: 1e3 * depth_m,
            seconds: means.seconds,
        },
        information,
        limit: None,
    }))
}
