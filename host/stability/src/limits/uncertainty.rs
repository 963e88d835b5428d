//! Distribution of a limit under deviations of the parameters, and the probability that a cut is stable.
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

use super::method::Method;
use super::percentiles::{Limits, Sorted, is_stable, limit_of};
use super::plane::{Linearized, Plane};
use super::sampling::{Basis, Variable};
use super::speed_line::SpeedLine;
use super::spread::{LimitSpread, Percentile, PercentileIntervals, Percentiles};
use crate::criteria::{BATCHES_OF_CELLS, IMPOSSIBLE_MAX};
use crate::error::StabilityError;
use quietcut_model::case::Case;

/// Machines in a batch: a power of 2.
const BATCH: u32 = 64;

/// Batches that are drawn at least, so that their scatter can be told, and at most: 8 192 machines.
const BATCHES: std::ops::RangeInclusive<u32> = 4..=128;

/// Batches of the pilot.
const PILOT: u32 = 4;

/// The shares of machines whose limits are told.
const SHARES: [f64; 3] = [0.05, 0.5, 0.95];

/// Steps in depth up to the limit that derivatives predict, with some room; where nothing is found the whole depth is searched.
const SAMPLES_NEAR: usize = 16;

/// Steps over the whole depth, as in a chart.
const SAMPLES: usize = 40;

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
