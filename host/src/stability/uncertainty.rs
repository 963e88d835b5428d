//! What deviations of the parameters make of a limit: its distribution, and the probability that a cut is stable.
//!
//! Limits have cusps where lobes cross, and islands come and go: linearization alone is wrong there. So machines are drawn
//! from the distribution of the parameters and the first limit of each is computed, by the method itself. Exact derivatives
//! make few draws do: the space of the parameters is turned so that its first axes are those along which the limits move, and
//! along these the draws are stratified. They also say how deep a line must be searched. Batches are drawn until their
//! scatter says that the percentiles have settled.

use nalgebra::DVector;
use rayon::prelude::*;
use serde::Serialize;

use super::line::SpeedLine;
use super::method::Method;
use super::sampling::{Basis, Variable};
use super::sensitivity::{Sensitivity, Tangent};
use super::{CubicTerms, Problem, StabilityError};
use crate::case::Case;

/// Machines in a batch: a power of 2.
const BATCH: u32 = 64;

/// Batches that are drawn at least, so that their scatter can be told, and at most: 2 048 machines.
const BATCHES: std::ops::RangeInclusive<u32> = 4..=32;

/// Standard error of every percentile, relative to it, with which no further batch is drawn.
const SETTLED: f64 = 3e-3;

/// The shares of machines whose limits are told.
const SHARES: [f64; 3] = [0.05, 0.5, 0.95];

/// Steps in depth up to the limit that derivatives predict, with some room; where nothing is found the whole depth is searched.
const SAMPLES_NEAR: usize = 16;

/// Steps over the whole depth, as in a chart.
const SAMPLES: usize = 40;

/// Share of machines that may be impossible (negative damping, indefinite matrices) and are left out.
const IMPOSSIBLE_MAX: f64 = 0.2;

/// Batches for the probability of stability, 256 machines: its standard error is 3 % at most.
const BATCHES_OF_CELLS: u32 = 4;

/// 5, 50 and 95 % of all machines have a first limit below these depths, mm; `None` beyond the last depth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Percentiles {
    /// Nineteen machines of twenty are stable up to here.
    #[serde(rename = "5")]
    pub low: Option<f64>,
    /// The median.
    #[serde(rename = "50")]
    pub median: Option<f64>,
    /// One machine of twenty is stable up to here.
    #[serde(rename = "95")]
    pub high: Option<f64>,
}

/// What is known of the limit at one speed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LimitSpread {
    /// Of the first limit.
    pub limit_percentiles_mm: Percentiles,
    /// The largest standard error of the percentiles, mm, from the scatter of the batches.
    pub limit_percentiles_error_mm: f64,
    /// How many machines were drawn.
    pub machines: usize,
    /// Share of machines that are stable at each depth asked for; empty where none was.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub stable_share: Vec<f64>,
}

/// Makes the method on a case; `None` where the case is no machine.
pub type Maker<'a> = dyn Fn(&Case) -> Option<Box<dyn Method>> + Sync + 'a;

/// A case with deviations.
pub struct Uncertainty<'a> {
    case: &'a Case,
    maker: &'a Maker<'a>,
    variables: Vec<Variable>,
    /// The linear problem with its change along each variable, per standard deviation: where draws are stratified.
    linear: Option<(Problem, Vec<Tangent>)>,
    seed: u64,
}

/// A limit as a plane over the variables: depth, mm, and its gradient, mm per standard deviation.
struct Plane {
    depth_mm: f64,
    gradient: DVector<f64>,
}

impl<'a> Uncertainty<'a> {
    /// `None` where the case has no deviations.
    pub fn new(case: &'a Case, maker: &'a Maker<'a>, seed: u64) -> Option<Self> {
        let variables = Variable::of_case(case);
        (!variables.is_empty()).then(|| Self {
            linear: Self::linear(case, &variables),
            case,
            maker,
            variables,
            seed,
        })
    }

    fn linear(case: &Case, variables: &[Variable]) -> Option<(Problem, Vec<Tangent>)> {
        let problem = Problem::new(case, CubicTerms::LeaveOut).ok()?;
        // A difference over a tenth of a deviation; where only one side is a machine, over that side.
        const STEP: f64 = 0.05;
        let tangents = variables.iter().map(|variable| {
            let at = |deviations: f64| {
                let mut moved = case.clone();
                let is_possible = variable.shift(&mut moved, deviations);
                is_possible.then(|| Problem::new(&moved, CubicTerms::LeaveOut).ok())?
            };
            match (at(-STEP), at(STEP)) {
                (Some(low), Some(high)) => Some(Tangent::between(&low, &high, 2.0 * STEP)),
                (None, Some(high)) => Some(Tangent::between(&problem, &high, STEP)),
                (Some(low), None) => Some(Tangent::between(&low, &problem, STEP)),
                (None, None) => None,
            }
        });
        let tangents = tangents.collect::<Option<Vec<_>>>()?;
        Some((problem, tangents))
    }

    /// The spread of the first limit at the speed of a line, searched up to `depth_mm`, and the probability of stability at
    /// `cells_mm`.
    ///
    /// The result depends on the seed and the speed alone.
    ///
    /// # Errors
    /// A line of a machine cannot be computed, or more than a fifth of the machines is impossible.
    pub fn spread(
        &self,
        nominal: &SpeedLine,
        depth_mm: f64,
        cells_mm: &[f64],
    ) -> Result<LimitSpread, StabilityError> {
        let least = if cells_mm.is_empty() {
            *BATCHES.start()
        } else {
            BATCHES_OF_CELLS
        };
        let batches = self.batches(nominal, depth_mm, !cells_mm.is_empty(), least, &SHARES)?;
        let all = Sorted::new(batches.iter().flatten().flatten());
        let lines: Vec<&SpeedLine> = batches.iter().flatten().flatten().collect();
        let stable = |cell_mm: &f64| {
            let is_stable = |line: &&&SpeedLine| is_stable(line, *cell_mm);
            lines.iter().filter(is_stable).count() as f64 / lines.len() as f64
        };
        let [low, median, high] = SHARES.map(|share| all.quantile(share));
        Ok(LimitSpread {
            limit_percentiles_mm: Percentiles { low, median, high },
            limit_percentiles_error_mm: SHARES
                .into_iter()
                .map(|share| error(&batches, share))
                .fold(0.0, f64::max),
            machines: batches.iter().map(Vec::len).sum(),
            stable_share: cells_mm.iter().map(stable).collect(),
        })
    }

    /// The depth, mm, below which this share of all machines has its first limit at the speed of a line; `None` where it lies
    /// beyond `depth_mm`.
    ///
    /// # Errors
    /// As [`spread`](Self::spread).
    pub fn percentile(
        &self,
        nominal: &SpeedLine,
        depth_mm: f64,
        share: f64,
    ) -> Result<Option<f64>, StabilityError> {
        let batches = self.batches(nominal, depth_mm, false, *BATCHES.start(), &[share])?;
        Ok(Sorted::new(batches.iter().flatten().flatten()).quantile(share))
    }

    /// Lines of batches of machines, at least `least`, until the percentiles of these shares have settled.
    fn batches(
        &self,
        nominal: &SpeedLine,
        depth_mm: f64,
        whole: bool,
        least: u32,
        shares: &[f64],
    ) -> Result<Vec<Vec<Option<SpeedLine>>>, StabilityError> {
        let planes = self.planes(nominal);
        let gradients: Vec<DVector<f64>> = planes.iter().map(|plane| plane.gradient.clone()).collect();
        let basis = Basis::new(self.variables.len(), &gradients);
        let mut batches: Vec<Vec<Option<SpeedLine>>> = Vec::new();
        for batch in 0..*BATCHES.end() {
            // The speed takes part in the stream: neighbouring speeds draw other machines.
            let stream = nominal.rpm.to_bits().rotate_left(8) ^ u64::from(batch);
            let machines = basis.points(BATCH, self.seed, stream, batch);
            let lines: Vec<Result<Option<SpeedLine>, StabilityError>> = machines
                .par_iter()
                .map(|machine| self.line(machine, nominal.rpm, depth_mm, &planes, whole))
                .collect();
            batches.push(lines.into_iter().collect::<Result<_, _>>()?);
            if batch + 1 >= least {
                self.check_possible(&batches)?;
                let all = Sorted::new(batches.iter().flatten().flatten());
                let is_settled = |share: &f64| {
                    let value = all.quantile(*share).unwrap_or(depth_mm);
                    error(&batches, *share) <= SETTLED * value
                };
                if shares.iter().all(is_settled) {
                    break;
                }
            }
        }
        Ok(batches)
    }

    fn check_possible(&self, batches: &[Vec<Option<SpeedLine>>]) -> Result<(), StabilityError> {
        let drawn = batches.iter().map(Vec::len).sum::<usize>();
        let possible = batches.iter().flatten().flatten().count();
        let impossible = 1.0 - possible as f64 / drawn as f64;
        if impossible > IMPOSSIBLE_MAX {
            return Err(StabilityError::Deviations {
                path: self.case.path.clone(),
                percent: 100.0 * impossible,
            });
        }
        Ok(())
    }

    /// The losses of stability along the nominal line with their gradients, the first limit first.
    fn planes(&self, nominal: &SpeedLine) -> Vec<Plane> {
        let Some((problem, tangents)) = &self.linear else {
            return Vec::new();
        };
        let losses = nominal.switches.iter().filter(|switch| !switch.gain);
        let plane = |switch| {
            let sensitivity = Sensitivity::new(problem, nominal.rpm, switch).ok()?;
            let slopes: Option<Vec<f64>> = tangents
                .iter()
                .map(|tangent| Some(sensitivity.slope(tangent)?.depth_mm))
                .collect();
            Some(Plane {
                depth_mm: switch.depth_mm,
                gradient: DVector::from_vec(slopes?),
            })
        };
        losses.filter_map(plane).collect()
    }

    /// The line of a machine, at least up to its first limit; `None` where there is no such machine.
    fn line(
        &self,
        machine: &DVector<f64>,
        rpm: f64,
        depth_mm: f64,
        planes: &[Plane],
        whole: bool,
    ) -> Result<Option<SpeedLine>, StabilityError> {
        let mut case = self.case.clone();
        let mut moves = self.variables.iter().zip(machine.iter());
        if !moves.all(|(variable, deviations)| variable.shift(&mut case, *deviations)) {
            return Ok(None);
        }
        let Some(method) = (self.maker)(&case) else {
            return Ok(None);
        };
        let predicted_mm = planes
            .iter()
            .map(|plane| plane.depth_mm + plane.gradient.dot(machine))
            .fold(f64::INFINITY, f64::min);
        // Gradients of a steep limit can point below 0; a quarter of the nominal one is then a fair try.
        let shallowest_mm = planes.first().map_or(depth_mm, |plane| 0.25 * plane.depth_mm);
        let near_mm = 1.2 * predicted_mm.max(shallowest_mm);
        if !whole && near_mm < 0.7 * depth_mm {
            let line = method.line(rpm, near_mm, SAMPLES_NEAR)?;
            if limit_of(&line).is_some() {
                return Ok(Some(line));
            }
        }
        method.line(rpm, depth_mm, SAMPLES).map(Some)
    }
}

/// The standard error of a percentile, mm, from the scatter of the batches; 0 where it lies beyond the last depth.
fn error(batches: &[Vec<Option<SpeedLine>>], share: f64) -> f64 {
    let all = Sorted::new(batches.iter().flatten().flatten()).quantile(share);
    let each: Option<Vec<f64>> = batches
        .iter()
        .map(|batch| Sorted::new(batch.iter().flatten()).quantile(share))
        .collect();
    match (all, each) {
        (None, _) => 0.0,
        (Some(_), Some(values)) => standard_error(&values),
        // Some batches see no limit where others do: not settled.
        (Some(value), None) => value,
    }
}

/// The first depth that is not surely stable: where stability is lost, or where a second stable orbit begins.
pub(super) fn limit_of(line: &SpeedLine) -> Option<f64> {
    // Where not even depth 0 is stable nothing can be lost.
    if line.stable_mm.first().is_none_or(|interval| interval[0] > 0.0) {
        return Some(0.0);
    }
    let lost = line.first_limit.map(|limit| limit.depth_mm);
    let split = line.bistable_mm.first().map(|interval| interval[0]);
    match (lost, split) {
        (Some(lost), Some(split)) => Some(lost.min(split)),
        (lost, split) => lost.or(split),
    }
}

fn is_stable(line: &SpeedLine, depth_mm: f64) -> bool {
    let within = |intervals: &[[f64; 2]]| {
        intervals
            .iter()
            .any(|&[from, to]| from <= depth_mm && depth_mm <= to)
    };
    within(&line.stable_mm) && !within(&line.bistable_mm)
}

/// First limits in order; infinite where nothing is lost.
struct Sorted(Vec<f64>);

impl Sorted {
    fn new<'l>(lines: impl Iterator<Item = &'l SpeedLine>) -> Self {
        let mut limits: Vec<f64> = lines
            .map(|line| limit_of(line).unwrap_or(f64::INFINITY))
            .collect();
        limits.sort_by(f64::total_cmp);
        Self(limits)
    }

    /// The value below which a share of all lies, between the neighbours at (i + 1/2)/n (Hazen); `None` where it is infinite.
    fn quantile(&self, share: f64) -> Option<f64> {
        let position = (share * self.0.len() as f64 - 0.5).max(0.0);
        let (below, rest) = (position.floor(), position.fract());
        let at = |index: f64| self.0.get(index as usize).or(self.0.last()).copied();
        let (low, high) = (at(below)?, at(below + 1.0)?);
        let value = if rest == 0.0 {
            low
        } else {
            low + (high - low) * rest
        };
        value.is_finite().then_some(value)
    }
}

fn standard_error(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let square = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
    (square / (count * (count - 1.0).max(1.0))).sqrt()
}
