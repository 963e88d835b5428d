//! What deviations of the parameters make of a limit: its distribution, and the probability that a cut is stable.
//!
//! Limits have cusps where lobes cross, and islands come and go: linearization alone is wrong there. So machines are drawn
//! from the distribution of the parameters and the first limit of each is computed, by the method itself. Exact derivatives
//! make few draws do: the space of the parameters is turned so that its first axes are those along which the limits move, and
//! along these the draws are stratified. They also say how deep a line must be searched.
//!
//! Where limits jump (machines with and without a flip island at the same speed) derivatives at the nominal machine say little. So
//! the first batches are a pilot: the mean of the machines whose limit lies below a percentile points, by Stein's lemma, along
//! the mean gradient of the share of such machines, and later batches are stratified along that.
//!
//! Percentiles have confidence intervals by Woodruff's method: the scatter of the share below, from batch to batch, says between
//! which ranks the percentile lies. That holds where the distribution has a gap, in which no percentile is known well,
//! and is as wide there as it must be. Batches are drawn until the intervals are narrow.

use nalgebra::DVector;
use rayon::prelude::*;
use serde::Serialize;

use super::StabilityError;
use super::line::SpeedLine;
use super::method::Method;
use super::plane::{Linearized, Plane};
use super::sampling::{Basis, Variable};
use quietcut_model::case::Case;

/// Machines in a batch: a power of 2.
const BATCH: u32 = 64;

/// Batches that are drawn at least, so that their scatter can be told, and at most: 8 192 machines.
const BATCHES: std::ops::RangeInclusive<u32> = 4..=128;

/// Batches of the pilot.
const PILOT: u32 = 4;

/// Half the width of the interval of every percentile, relative to it, with which no further batch is drawn.
const SETTLED: f64 = 7e-3;

/// Two-sided quantile of the standard normal distribution for 90 % confidence.
const CONFIDENCE_90: f64 = 1.644_853_626_951_473;

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

/// For each of the [`Percentiles`] the depths, mm, between which it lies with 90 % confidence; `None` beyond the last depth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PercentileIntervals {
    /// Of the 5 % limit.
    #[serde(rename = "5")]
    pub low: [Option<f64>; 2],
    /// Of the median.
    #[serde(rename = "50")]
    pub median: [Option<f64>; 2],
    /// Of the 95 % limit.
    #[serde(rename = "95")]
    pub high: [Option<f64>; 2],
}

/// One percentile of the limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Percentile {
    /// The depth, mm; `None` beyond the last depth.
    pub depth_mm: Option<f64>,
    /// Between which depths, mm, it lies with 90 % confidence; `None` beyond the last depth.
    pub ci90_mm: [Option<f64>; 2],
}

impl Percentile {
    /// How far it may be off, mm, with 90 % confidence: the farther end of its interval, which ends at `deepest_mm` where it
    /// goes beyond. `None` where the percentile itself lies beyond.
    pub fn error_mm(&self, deepest_mm: f64) -> Option<f64> {
        let depth_mm = self.depth_mm?;
        let [from, to] = self.ci90_mm.map(|end| end.unwrap_or(deepest_mm));
        Some((depth_mm - from).max(to - depth_mm))
    }
}

/// What is known of the limit at one speed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LimitSpread {
    /// Of the first limit.
    pub limit_percentiles_mm: Percentiles,
    /// Between which depths each percentile lies with 90 % confidence, mm.
    pub limit_percentiles_ci90_mm: PercentileIntervals,
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
    /// How limits move with the variables: where draws are stratified.
    linear: Option<Linearized>,
    seed: u64,
}

impl<'a> Uncertainty<'a> {
    /// `None` where the case has no deviations.
    pub fn new(case: &'a Case, maker: &'a Maker<'a>, seed: u64) -> Option<Self> {
        let variables = Variable::of_case(case);
        (!variables.is_empty()).then(|| Self {
            linear: Linearized::new(case, &variables),
            case,
            maker,
            variables,
            seed,
        })
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
        let lines: Vec<&SpeedLine> = batches.lines().collect();
        let stable = |cell_mm: &f64| {
            let is_stable = |line: &&&SpeedLine| is_stable(line, *cell_mm);
            lines.iter().filter(is_stable).count() as f64 / lines.len() as f64
        };
        let limits = batches.limits();
        let [low, median, high] = SHARES.map(|share| limits.all.quantile(share));
        let [low_ci, median_ci, high_ci] = SHARES.map(|share| limits.interval(share));
        Ok(LimitSpread {
            limit_percentiles_mm: Percentiles { low, median, high },
            limit_percentiles_ci90_mm: PercentileIntervals {
                low: low_ci,
                median: median_ci,
                high: high_ci,
            },
            machines: batches.0.iter().map(Vec::len).sum(),
            stable_share: cells_mm.iter().map(stable).collect(),
        })
    }

    /// The depth below which this share of all machines has its first limit at the speed of a line.
    ///
    /// # Errors
    /// As [`spread`](Self::spread).
    pub fn percentile(
        &self,
        nominal: &SpeedLine,
        depth_mm: f64,
        share: f64,
    ) -> Result<Percentile, StabilityError> {
        let batches = self.batches(nominal, depth_mm, false, *BATCHES.start(), &[share])?;
        let limits = batches.limits();
        Ok(Percentile {
            depth_mm: limits.all.quantile(share),
            ci90_mm: limits.interval(share),
        })
    }

    /// Lines of batches of machines, at least `least`, until the percentiles of these shares have settled.
    fn batches(
        &self,
        nominal: &SpeedLine,
        depth_mm: f64,
        whole: bool,
        least: u32,
        shares: &[f64],
    ) -> Result<Batches, StabilityError> {
        let planes = self
            .linear
            .as_ref()
            .map_or_else(Vec::new, |linear| linear.planes(nominal));
        let gradients: Vec<DVector<f64>> = planes.iter().map(|plane| plane.gradient.clone()).collect();
        let mut basis = Basis::new(self.variables.len(), &gradients);
        let mut batches = Batches(Vec::new());
        for batch in 0..*BATCHES.end() {
            // The speed takes part in the stream: neighbouring speeds draw other machines.
            let stream = nominal.rpm.to_bits().rotate_left(8) ^ u64::from(batch);
            let machines = basis.points(BATCH, self.seed, stream, batch);
            let lines: Vec<Result<Drawn, StabilityError>> = machines
                .into_par_iter()
                .map(|machine| {
                    let line = self.line(&machine, nominal.rpm, depth_mm, &planes, whole)?;
                    Ok(Drawn { machine, line })
                })
                .collect();
            batches.0.push(lines.into_iter().collect::<Result<_, _>>()?);
            if batch + 1 >= least {
                self.check_possible(&batches)?;
                let limits = batches.limits();
                if shares.iter().all(|share| limits.is_settled(*share, depth_mm)) {
                    break;
                }
            }
            if batch + 1 == PILOT {
                let mut leading = batches.directions(shares, depth_mm);
                leading.extend_from_slice(&gradients);
                basis = Basis::new(self.variables.len(), &leading);
            }
        }
        Ok(batches)
    }

    fn check_possible(&self, batches: &Batches) -> Result<(), StabilityError> {
        let drawn = batches.0.iter().map(Vec::len).sum::<usize>();
        let impossible = 1.0 - batches.lines().count() as f64 / drawn as f64;
        if impossible > IMPOSSIBLE_MAX {
            return Err(StabilityError::Deviations {
                path: self.case.path.clone(),
                percent: 100.0 * impossible,
            });
        }
        Ok(())
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

/// A machine, by its standard normal variables, and its line; `None` where there is no such machine.
struct Drawn {
    machine: DVector<f64>,
    line: Option<SpeedLine>,
}

/// Batches of machines, each evenly spread.
struct Batches(Vec<Vec<Drawn>>);

impl Batches {
    fn lines(&self) -> impl Iterator<Item = &SpeedLine> {
        self.0.iter().flatten().filter_map(|drawn| drawn.line.as_ref())
    }

    fn limits(&self) -> Limits {
        let of_batch = |batch: &Vec<Drawn>| Sorted::new(batch.iter().filter_map(|drawn| drawn.line.as_ref()));
        Limits {
            all: Sorted::new(self.lines()),
            by_batch: self.0.iter().map(of_batch).collect(),
        }
    }

    /// The directions along which the share of limits below each percentile changes, those of percentiles that are known worst
    /// first.
    fn directions(&self, shares: &[f64], depth_mm: f64) -> Vec<DVector<f64>> {
        let limits = self.limits();
        let mut shares = shares.to_vec();
        let width = |share: &f64| limits.relative_width(*share, depth_mm);
        shares.sort_by(|a, b| width(b).total_cmp(&width(a)));
        let toward = |share: f64| {
            let percentile_mm = limits.all.quantile(share).unwrap_or(f64::INFINITY);
            let below = self.0.iter().flatten().filter(|drawn| {
                let limit = drawn
                    .line
                    .as_ref()
                    .map(|line| limit_of(line).unwrap_or(f64::INFINITY));
                limit.is_some_and(|limit_mm| limit_mm < percentile_mm)
            });
            let size = self
                .0
                .iter()
                .flatten()
                .next()
                .map_or(0, |drawn| drawn.machine.len());
            below.fold(DVector::zeros(size), |sum, drawn| sum + &drawn.machine)
        };
        shares.into_iter().map(toward).collect()
    }
}

/// First limits of all machines and of every batch.
struct Limits {
    all: Sorted,
    by_batch: Vec<Sorted>,
}

impl Limits {
    /// The depths, mm, between which the percentile lies with 90 % confidence (Woodruff 1952); `None` beyond the last depth.
    fn interval(&self, share: f64) -> [Option<f64>; 2] {
        let all = &self.all.0;
        let least = 1.0 / all.len().max(1) as f64;
        let percentile_mm = self.all.quantile(share).unwrap_or(f64::INFINITY);
        let below: Vec<f64> = self
            .by_batch
            .iter()
            .map(|batch| batch.share_below(percentile_mm))
            .collect();
        // A machine is the finest that shares can tell.
        let reach = (student_90(below.len()) * standard_error(&below)).max(least);
        [share - reach, share + reach].map(|share| self.all.quantile(share.clamp(0.0, 1.0)))
    }

    /// Half the width of the interval relative to the percentile; what lies beyond the last depth counts as there.
    fn relative_width(&self, share: f64, depth_mm: f64) -> f64 {
        let [low, high] = self.interval(share).map(|end| end.unwrap_or(depth_mm));
        let percentile_mm = self.all.quantile(share).unwrap_or(depth_mm);
        if high > low {
            0.5 * (high - low) / percentile_mm
        } else {
            0.0
        }
    }

    fn is_settled(&self, share: f64, depth_mm: f64) -> bool {
        self.relative_width(share, depth_mm) <= SETTLED
    }
}

/// Two-sided quantile of Student's distribution for 90 % confidence with `count` − 1 degrees of freedom, to 2 % from 4 values
/// on (Abramowitz & Stegun 26.7.5).
fn student_90(count: usize) -> f64 {
    let freedom = count.saturating_sub(1).max(1) as f64;
    let z = CONFIDENCE_90;
    let (first, second) = (
        (z.powi(2) + 1.0) / 4.0,
        (5.0 * z.powi(4) + 16.0 * z.powi(2) + 3.0) / 96.0,
    );
    z * (1.0 + first / freedom + second / freedom.powi(2))
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

    /// The share of all that lies below a depth; a half of what lies at it.
    fn share_below(&self, depth_mm: f64) -> f64 {
        let below = self.0.partition_point(|limit| *limit < depth_mm);
        let up_to = self.0.partition_point(|limit| *limit <= depth_mm);
        0.5 * (below + up_to) as f64 / self.0.len().max(1) as f64
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

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    /// Nine of ten in [1, 2], the others in [4, 5]: a gap in which no percentile is known.
    fn limit_mm(share: f64) -> f64 {
        if share < 0.9 {
            1.0 + share / 0.9
        } else {
            4.0 + (share - 0.9) / 0.1
        }
    }

    #[test]
    fn nine_of_ten_intervals_hold_the_percentile_also_beside_a_gap() {
        let seed = 20_261_121;
        println!("seed {seed}");
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        for batches in [4, 16, 64] {
            for share in [0.05, 0.5, 0.89, 0.91, 0.95] {
                let repeats = 400;
                let mut held = 0;
                for _ in 0..repeats {
                    let by_batch: Vec<Sorted> = (0..batches)
                        .map(|_| {
                            let mut limits: Vec<f64> =
                                (0..BATCH).map(|_| limit_mm(rng.random::<f64>())).collect();
                            limits.sort_by(f64::total_cmp);
                            Sorted(limits)
                        })
                        .collect();
                    let mut all: Vec<f64> = by_batch.iter().flat_map(|batch| batch.0.clone()).collect();
                    all.sort_by(f64::total_cmp);
                    let limits = Limits {
                        all: Sorted(all),
                        by_batch,
                    };
                    let [low, high] = limits.interval(share).map(Option::unwrap);
                    held += i32::from(low <= limit_mm(share) && limit_mm(share) <= high);
                }
                let coverage = f64::from(held) / f64::from(repeats);
                // 400 repeats tell 90 % to 1.5 %; few batches know their own scatter badly, few machines are coarse steps.
                assert!(coverage > 0.84, "{batches} batches, {share}: {coverage}");
            }
        }
    }

    #[test]
    fn students_quantiles_are_those_of_the_tables() {
        // Abramowitz & Stegun, table 26.10.
        for (count, expected) in [(4, 2.353), (6, 2.015), (11, 1.812), (31, 1.697), (121, 1.658)] {
            assert!((student_90(count) - expected).abs() < 0.02 * expected, "{count}");
        }
    }
}
