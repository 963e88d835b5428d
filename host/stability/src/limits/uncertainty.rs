//! Distribution of a limit under deviations of the parameters, and the probability that a cut is stable.
//!
//! Limits have cusps where lobes cross, and islands appear and vanish, so that linearization alone is wrong there.
//! Therefore machines are drawn from the distribution of the parameters, and the method computes the first limit of
//! each. Derivatives of the limits reduce the number of draws: the parameter space is rotated so that its first axes
//! are those along which the limits move, and draws are stratified along these. The derivatives also predict down to
//! which depth the limit of a machine must be searched.
//!
//! Where limits jump (machines with and without a flip island at the same speed), derivatives at the nominal machine
//! are not sufficient. The first batches are therefore a pilot: by Stein's lemma, the mean of the machines whose limit
//! lies below a percentile points along the mean gradient of the share of such machines, and later batches are
//! stratified along it.
//!
//! With a single uncertain variable, machines are computed where limits bend along it, and those of the drawn machines are
//! interpolated.
//!
//! Confidence intervals of percentiles follow Woodruff's method: the scatter between batches of the share below gives
//! the ranks between which the percentile lies. This also holds if the distribution has a gap, in which no percentile
//! is well defined; the interval is as wide as the gap there. Batches are drawn until the intervals are narrow, up to a
//! largest number.

use nalgebra::DVector;
use rayon::prelude::*;

use super::along_variable::{LinesAlong, MachineLine};
use super::method::Method;
use super::percentiles::{Limits, Sorted, is_stable, limit_of};
use super::plane::{Linearized, Plane};
use super::sampling::{Basis, Variable};
use super::speed_line::SpeedLine;
use super::spread::{LimitSpread, Percentile, PercentileIntervals, Percentiles};
use crate::criteria::{
    BATCH, BATCHES, BATCHES_OF_CELLS, IMPOSSIBLE_MAX, PILOT, SEARCHED_BEYOND, SHALLOWEST_SEARCH,
    WORTH_SEARCHING_NEAR,
};
use crate::error::StabilityError;
use quietcut_model::case::Case;

/// Shares of the drawn machines that define the percentiles of the limit: 5, 50 and 95 %.
const SHARES: [f64; 3] = [0.05, 0.5, 0.95];

/// Number of depth steps of the first search for a machine's limit, from 0 to beyond the limit predicted from
/// derivatives. If it finds none, the whole depth is searched.
const SAMPLES_NEAR: usize = 16;

/// Number of depth steps of a search for a machine's limit over the whole depth: the least number of a chart.
const SAMPLES: usize = 40;

/// Function that builds the stability method for a case; the reason if the case is not a valid machine.
pub type MethodOfCase<'a> = dyn Fn(&Case) -> Result<Box<dyn Method>, String> + Sync + 'a;

/// Case with standard deviations or a covariance of its parameters, and the stability method for machines that are
/// drawn from these.
pub struct Uncertainty<'a> {
    case: &'a Case,
    method_of: &'a MethodOfCase<'a>,
    variables: Vec<Variable>,
    /// Delay problem with its derivatives along the uncertain variables, for the directions of stratification; `None`
    /// if it cannot be built.
    linear: Option<Linearized>,
    seed: u64,
}

impl<'a> Uncertainty<'a> {
    /// Prepares draws of machines from a case; `None` if the case states no uncertainty of its parameters.
    pub fn new(case: &'a Case, method_of: &'a MethodOfCase<'a>, seed: u64) -> Option<Self> {
        let variables = Variable::of_case(case);
        (!variables.is_empty()).then(|| Self {
            // Without derivatives of the limits the first draws are not stratified along the directions in which limits
            // move: more of them are needed, and the result holds as well.
            linear: Linearized::new(case, &variables).ok(),
            case,
            method_of,
            variables,
            seed,
        })
    }

    /// Spread of the first limit over drawn machines at one spindle speed, searched up to `depth_mm`, and the share of
    /// stable machines at `cells_mm`.
    ///
    /// The result depends on the seed and the speed, not on the number of threads.
    ///
    /// # Errors
    /// The limits of a machine cannot be computed, or more than a fifth of the machines are not physical.
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

    /// Percentile of the first limit at one spindle speed: the depth below which the given share of the drawn machines
    /// that are physical loses stability.
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

    /// Draws batches of machines and computes their limits at the spindle speed of `nominal`: at least `least` batches,
    /// and more, up to the most of [`BATCHES`], until the percentiles at the given shares have settled.
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
        // A limit without a derivative, for example at the tip of an island, gives no direction of stratification.
        let planes: Vec<Plane> = planes.into_iter().filter_map(Result::ok).collect();
        let gradients: Vec<DVector<f64>> = planes.iter().map(|plane| plane.gradient.clone()).collect();
        let mut basis = Basis::new(self.variables.len(), &gradients);
        let along = self.along(nominal.rpm, depth_mm)?;
        let mut batches = Batches(Vec::new());
        for batch in 0..*BATCHES.end() {
            // The random stream depends on the spindle speed, so that neighbouring speeds draw different machines.
            let stream = nominal.rpm.to_bits().rotate_left(8) ^ u64::from(batch);
            let machines = basis.points(BATCH, self.seed, stream, batch);
            let lines: Vec<Result<Drawn, StabilityError>> = machines
                .into_par_iter()
                .map(|machine| {
                    let line = match &along {
                        Some(along) => along.at(machine[0]),
                        None => self.line(&machine, nominal.rpm, depth_mm, &planes, whole)?,
                    };
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

    /// Stability at a spindle speed along the uncertain variable, if there is a single one: between machines that are
    /// computed, limits are interpolated. `None` for several variables.
    fn along(&self, rpm: f64, depth_mm: f64) -> Result<Option<LinesAlong>, StabilityError> {
        if self.variables.len() != 1 {
            return Ok(None);
        }
        let line = |value: f64| self.line(&DVector::from_element(1, value), rpm, depth_mm, &[], true);
        LinesAlong::new(line).map(Some)
    }

    fn check_possible(&self, batches: &Batches) -> Result<(), StabilityError> {
        let drawn = batches.0.iter().map(Vec::len).sum::<usize>();
        let impossible = 1.0 - batches.lines().count() as f64 / drawn as f64;
        if impossible > IMPOSSIBLE_MAX {
            return Err(StabilityError::Deviations {
                path: self.case.path.clone(),
                percent: 100.0 * impossible,
                reason: batches.first_reason().unwrap_or_default().into(),
            });
        }
        Ok(())
    }

    /// Stability of a drawn machine at one spindle speed, at least up to its first limit; the reason if the machine is
    /// not valid.
    fn line(
        &self,
        machine: &DVector<f64>,
        rpm: f64,
        depth_mm: f64,
        planes: &[Plane],
        whole: bool,
    ) -> Result<MachineLine, StabilityError> {
        let mut case = self.case.clone();
        if !Variable::shift_all(&self.variables, machine, &mut case) {
            return Ok(Err("a parameter lies outside of its bounds".into()));
        }
        let method = match (self.method_of)(&case) {
            Ok(method) => method,
            Err(reason) => return Ok(Err(reason)),
        };
        let predicted_mm = planes
            .iter()
            .map(|plane| plane.depth_mm + plane.gradient.dot(machine))
            .fold(f64::INFINITY, f64::min);
        // Linearization may predict a limit below depth 0 where a limit is steep; at least a share of the nominal limit
        // is searched.
        let shallowest_mm = planes
            .first()
            .map_or(depth_mm, |plane| SHALLOWEST_SEARCH * plane.depth_mm);
        let near_mm = SEARCHED_BEYOND * predicted_mm.max(shallowest_mm);
        if !whole && near_mm < WORTH_SEARCHING_NEAR * depth_mm {
            let line = method.line(rpm, near_mm, SAMPLES_NEAR)?;
            if limit_of(&line).is_some() {
                return Ok(Ok(line));
            }
        }
        method.line(rpm, depth_mm, SAMPLES).map(Ok)
    }
}

/// Drawn machine, given by its standard normal variables, with its stability at one spindle speed; the reason if the
/// machine is not valid.
struct Drawn {
    machine: DVector<f64>,
    line: MachineLine,
}

/// Batches of machines, each stratified.
struct Batches(Vec<Vec<Drawn>>);

impl Batches {
    fn lines(&self) -> impl Iterator<Item = &SpeedLine> {
        self.0
            .iter()
            .flatten()
            .filter_map(|drawn| drawn.line.as_ref().ok())
    }

    /// Reason why the first drawn machine that is not physical is impossible; `None` if all are physical.
    fn first_reason(&self) -> Option<&str> {
        let reasons = self
            .0
            .iter()
            .flatten()
            .filter_map(|drawn| drawn.line.as_ref().err());
        reasons.map(String::as_str).next()
    }

    fn limits(&self) -> Limits {
        let of_batch =
            |batch: &Vec<Drawn>| Sorted::new(batch.iter().filter_map(|drawn| drawn.line.as_ref().ok()));
        Limits {
            all: Sorted::new(self.lines()),
            by_batch: self.0.iter().map(of_batch).collect(),
        }
    }

    /// Directions of the uncertain variables along which the share of machines with a limit below each percentile
    /// changes, those of the least certain percentiles first.
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
                    .ok()
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
