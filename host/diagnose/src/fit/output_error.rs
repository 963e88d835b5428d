//! Residuals of simulated candidate models, and the Jacobian of the simulated samples (output error).
//!
//! Regression along the measured motion is biased by the noise in that motion and by aliasing. A simulation does not
//! use that motion: with r(θ) = y − y_simulated(θ) in units of the noise, Σ r² is minimal at the most likely θ (Ljung,
//! System Identification, 1999, chapter 7). The Jacobian is computed by finite differences. The unknown initial state
//! of a free decay is fitted with the parameters. If a simulation with the start values fits the whole records much
//! worse than the linear regression does, the start values are first improved on the beginning of each record, unless
//! the regression is far behind that of the best candidate model.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::candidates::closed_loop::{ClosedLoop, Extended, starts_anywhere};
use crate::fit::candidate_model::CandidateModel;
use crate::fit::library::Library;
use crate::fit::segment::{Nuisance, Segment, Subset, split};
use crate::fit::unknowns::{FitProblem, FreeParameter, ParameterPoint};
use crate::motion::free_decay::Decays;
use crate::records::study::Study;
use crate::signal::dot::dot;

/// Shares of each record, from its beginning, on which poor start values of the parameters are fitted first, one share
/// after the other.
const HORIZONS: [f64; 2] = [0.12, 0.35];

/// Smallest step of the finite difference by which a simulated response is differentiated by a parameter or an initial
/// state, relative to the value of that parameter or state. Smaller steps drown in the rounding errors of the
/// integration.
pub(crate) const LEAST_STEP: f64 = 1e-7;

/// Step of a finite difference for intervals, in conditional standard deviations of its parameter, as long as it is no larger than
/// [`WIDE_STEP_SHARE`] of the parameter. An integration whose steps err by 1e-7 of the amplitude errs by some 1e-5 in all,
/// which is 1e-3 of a noise of 1 %, or 0.2 standard deviations over 25 000 samples: a difference over one standard deviation is then off
/// by a fifth, and two parameters of almost the same effect, as softening and exponent of a joint, seem better separated than they are.
const WIDE_STEP: f64 = 30.0;

/// A forward difference over this share of a parameter is off by about this share.
const WIDE_STEP_SHARE: f64 = 1e-3;

/// First step of an uncertain parameter of the baseline, in its standard deviations.
const FIRST_STEP: f64 = 0.01;

/// Smallest step of the finite difference by which a simulated response with dry friction is differentiated by a
/// parameter of a cause, relative to the parameter. Accelerations jump when friction slips or sticks, and the time of a
/// jump changes by whole samples: a step must shift it by many samples.
const LEAST_STEP_OF_FRICTION: f64 = 3e-3;
/// The same by an uncertain parameter of the baseline, in its standard deviations: as much of a parameter known to 3 %.
const LEAST_BASELINE_STEP_OF_FRICTION: f64 = 0.1;

/// Compares simulations of candidate models with the records of a study.
pub(crate) struct OutputError<'a> {
    pub(crate) study: &'a Study<'a>,
    pub(crate) closed: ClosedLoop,
    /// Whole, fitted and held-out segments of all records, in the order of the records.
    segments: Vec<Segment>,
    pub(crate) horizons: Vec<Vec<Segment>>,
    /// True if every record of the study is a free decay.
    pub(crate) is_free_decay: bool,
}

/// One column of the Jacobian of a simulation, in one record: index of the record, index of the free parameter, and the
/// derivatives of the whitened samples.
pub(crate) type Column = (usize, usize, Vec<f64>);

/// Jᵀ r, the product of the Jacobian's columns with the residuals, for `size` free parameters; `residuals` by record.
pub(crate) fn projected(columns: &[Column], size: usize, residuals: &[Vec<f64>]) -> DVector<f64> {
    let mut sum = DVector::zeros(size);
    for (record, slot, column) in columns {
        sum[*slot] += dot(column, &residuals[*record]);
    }
    sum
}

impl<'a> OutputError<'a> {
    /// Prepares the simulations of a study; `None` if one of its records cannot be simulated.
    pub(crate) fn new(study: &'a Study<'a>) -> Option<Self> {
        let closed = ClosedLoop::new(study)?;
        // The unknown initial state of a free decay is fitted with the parameters, so only sensor offsets are projected
        // out there.
        let nuisance = |record: &crate::records::record::Record| {
            if starts_anywhere(record) {
                Nuisance::Offsets
            } else {
                Nuisance::StartAndOffsets
            }
        };
        let horizon = |share: f64| {
            (0..study.records.len())
                .map(|index| {
                    let record = &study.records[index];
                    let count = (share * record.grid.count() as f64) as usize;
                    Segment::new(study, index, 0..count.max(16), Subset::Whole, nuisance(record))
                })
                .collect()
        };
        Some(Self {
            study,
            closed,
            segments: split(study, nuisance),
            horizons: HORIZONS.map(horizon).into(),
            is_free_decay: study.records.iter().all(starts_anywhere),
        })
    }

    pub(crate) fn of_subset(&self, subset: Subset) -> Vec<&Segment> {
        self.segments
            .iter()
            .filter(|segment| segment.subset == subset)
            .collect()
    }

    /// Whitened difference between the measured samples of one record and those of its simulation under the forces of
    /// `closed`, in those of the `segments` that belong to the record; `None` if the simulation fails.
    fn residual(
        &self,
        closed: &ClosedLoop,
        record: usize,
        segments: &[&Segment],
        extended: &Extended,
        start: &[f64],
    ) -> Option<Vec<f64>> {
        let of_record: Vec<&&Segment> = segments
            .iter()
            .filter(|segment| segment.record == record)
            .collect();
        let Some(length) = of_record.iter().map(|segment| segment.range.end).max() else {
            return Some(Vec::new());
        };
        let mut samples = closed.simulate(self.study, record, extended, start, length)?;
        for (channel, samples) in self.study.records[record].channels.iter().zip(&mut samples) {
            for (simulated, measured) in samples.iter_mut().zip(&channel.measured) {
                *simulated = measured - *simulated;
            }
        }
        Some(
            of_record
                .iter()
                .flat_map(|segment| segment.whiten(&samples))
                .collect(),
        )
    }

    pub(crate) fn residuals(
        &self,
        problem: &FitProblem<'_>,
        segments: &[&Segment],
        point: &ParameterPoint,
    ) -> Option<Vec<Vec<f64>>> {
        self.residuals_by(&self.closed, problem, segments, point)
    }

    /// The same residuals as [`Self::residuals`], but simulated with the forces of `closed` instead of the measured
    /// forces.
    pub(crate) fn residuals_by(
        &self,
        closed: &ClosedLoop,
        problem: &FitProblem<'_>,
        segments: &[&Segment],
        point: &ParameterPoint,
    ) -> Option<Vec<Vec<f64>>> {
        let extended = problem.extended(self.study, point)?;
        (0..self.study.records.len())
            .into_par_iter()
            .map(|record| self.residual(closed, record, segments, &extended, &point.starts[record]))
            .collect()
    }

    /// Columns of the Jacobian J = ∂y_simulated/∂θ of the simulated samples by finite differences, record after record.
    /// `left` is the residual at the parameter values `point`. `None` if a simulation fails, or if both a step of a
    /// parameter and its opposite lead to values that are not physical.
    pub(crate) fn columns(
        &self,
        problem: &FitProblem<'_>,
        segments: &[&Segment],
        point: &ParameterPoint,
        left: &[Vec<f64>],
    ) -> Option<Vec<Column>> {
        let extended: Vec<Option<(Extended, ParameterPoint, f64)>> = problem
            .slots
            .iter()
            .map(|(slot, step)| {
                // If the step of a parameter leads to values that are not physical, the opposite step is taken.
                [*step, -step].into_iter().find_map(|step| {
                    let mut moved = point.clone();
                    *slot.of(&mut moved) += step;
                    let extended = problem.extended(self.study, &moved)?;
                    Some((extended, moved, step))
                })
            })
            .collect();
        let tasks: Vec<(usize, usize)> = (0..left.len())
            .flat_map(|record| (0..problem.slots.len()).map(move |slot| (record, slot)))
            .filter(|(record, slot)| problem.slots[*slot].0.affects(*record))
            .collect();
        tasks
            .into_par_iter()
            .map(|(record, slot)| {
                let (extended, moved, step) = extended[slot].as_ref()?;
                let mut column =
                    self.residual(&self.closed, record, segments, extended, &moved.starts[record])?;
                for (column, left) in column.iter_mut().zip(&left[record]) {
                    *column = (left - *column) / step;
                }
                Some((record, slot, column))
            })
            .collect()
    }

    /// Computes Jᵀ J and Jᵀ r of the simulated candidate model from the Jacobian's `columns`, with what the case states of uncertain
    /// parameters, and adapts the steps of
    /// the finite differences so that, within limits, each step changes χ² by about one near its minimum.
    pub(crate) fn normal(
        &self,
        problem: &mut FitProblem<'_>,
        columns: &[Column],
        point: &ParameterPoint,
        left: &[Vec<f64>],
    ) -> (DMatrix<f64>, DVector<f64>) {
        let size = problem.slots.len();
        let mut normal = DMatrix::<f64>::zeros(size, size);
        let mut gradient = projected(columns, size, left);
        for (index, (record, slot, column)) in columns.iter().enumerate() {
            for (_, other, second) in columns[..=index]
                .iter()
                .rev()
                .take_while(|other| other.0 == *record)
            {
                let product = dot(column, second);
                normal[(*slot, *other)] += product;
                if slot != other {
                    normal[(*other, *slot)] += product;
                }
            }
        }
        for (index, (slot, _)) in problem.slots.iter().enumerate() {
            if let FreeParameter::Baseline(variable) = slot {
                normal[(index, index)] += 1.0;
                gradient[index] -= point.baseline[*variable];
            }
        }
        for (index, (slot, step)) in problem.slots.iter_mut().enumerate() {
            let value = slot.of(&mut point.clone()).abs();
            let least = match slot {
                FreeParameter::Inner { .. } => problem.least_step,
                FreeParameter::Baseline(_) | FreeParameter::Start { .. } => LEAST_STEP,
            };
            let natural = normal[(index, index)].sqrt().recip();
            let most = match slot {
                FreeParameter::Inner {
                    bounds: [low, high], ..
                } if high.is_finite() => 0.05 * if *low > 0.0 { value } else { *high - *low },
                _ => f64::INFINITY,
            };
            if natural.is_finite() {
                *step = natural
                    .clamp(1e-3 * *step, 1e3 * *step)
                    .min(most)
                    .max(least * value);
            }
            if let FreeParameter::Baseline(_) = slot {
                *step = step.max(problem.least_baseline_step);
            }
        }
        (normal, gradient)
    }

    /// Widens the steps of the parameters of causes and of the baseline to [`WIDE_STEP`] standard deviations where that is little
    /// beside the parameter.
    pub(crate) fn widen_steps(problem: &mut FitProblem<'_>, point: &ParameterPoint) {
        for (slot, step) in &mut problem.slots {
            let widest = match slot {
                FreeParameter::Baseline(_) => FIRST_STEP,
                FreeParameter::Inner { .. } => WIDE_STEP_SHARE * slot.of(&mut point.clone()).abs(),
                FreeParameter::Start { .. } => continue,
            };
            *step = step.max((WIDE_STEP * *step).min(widest));
        }
    }

    /// The free parameters of a candidate model and their start values from its linear regression; `None` if the start
    /// values are not physical or cannot be simulated.
    pub(crate) fn problem<'b>(
        &self,
        library: &'b Library,
        model: &'b CandidateModel,
    ) -> Option<(FitProblem<'b>, ParameterPoint)> {
        let mut slots = Vec::new();
        let mut inner = Vec::new();
        for (position, choice) in model.choices.iter().enumerate() {
            let known = &library.candidates[choice.candidate];
            let cause = library.cause(choice.candidate);
            let coefficients = library.coefficients(model, position);
            let nonlinear_parameters = &known.variants[choice.variant].0;
            for (index, coefficient) in coefficients.iter().enumerate() {
                let slot = FreeParameter::Inner {
                    choice: position,
                    index,
                    bounds: [f64::NEG_INFINITY, f64::INFINITY],
                };
                slots.push((slot, 1e-3 * coefficient.abs().max(f64::MIN_POSITIVE)));
            }
            if cause.settled(nonlinear_parameters, &coefficients).is_none() {
                let bounds = cause.bounds(self.study, &known.location);
                for (index, [low, high]) in bounds.into_iter().enumerate() {
                    let slot = FreeParameter::Inner {
                        choice: position,
                        index: coefficients.len() + index,
                        bounds: [low, high],
                    };
                    let size = if low > 0.0 {
                        nonlinear_parameters[index]
                    } else {
                        high - low
                    };
                    slots.push((slot, 1e-3 * size));
                }
            }
            inner.push(coefficients.iter().chain(nonlinear_parameters).copied().collect());
        }
        let uncertain = &self.study.uncertain;
        slots.extend((0..uncertain.len()).map(|index| (FreeParameter::Baseline(index), FIRST_STEP)));
        let mut problem = FitProblem {
            library,
            choices: &model.choices,
            slots,
            least_step: LEAST_STEP,
            least_baseline_step: 0.0,
        };
        let mut point = ParameterPoint {
            baseline: uncertain.at.clone(),
            inner,
            starts: vec![Vec::new(); self.study.records.len()],
        };
        let extended = problem.extended(self.study, &point)?;
        if self.closed.holds(self.study, &extended)? {
            problem.least_step = LEAST_STEP_OF_FRICTION;
            problem.least_baseline_step = LEAST_BASELINE_STEP_OF_FRICTION;
        }
        for (record, start) in point.starts.iter_mut().enumerate() {
            if !starts_anywhere(&self.study.records[record]) {
                continue;
            }
            let state = self.state_at_start(library, model, record);
            let (states, sizes) = self.closed.begin(self.study, record, &extended, &state)?;
            let amplitude = states
                .iter()
                .zip(&sizes)
                .filter_map(|(state, size)| Some((state / (*size)?).abs()))
                .fold(0.0, f64::max);
            for (index, size) in sizes.iter().enumerate() {
                if let Some(size) = size {
                    let slot = FreeParameter::Start { record, index };
                    problem.slots.push((slot, 1e-3 * amplitude * size));
                }
            }
            *start = states;
        }
        Some((problem, point))
    }

    /// Initial state of the baseline in a record, whose free decay best fits the measured samples minus the baseline's
    /// forced response and the candidate model's contribution.
    fn state_at_start(&self, library: &Library, model: &CandidateModel, index: usize) -> Vec<f64> {
        let record = &self.study.records[index];
        let explained = library.explained(self.study, record, model);
        let mut decays: Decays = record.decays.clone();
        let sizes: Vec<f64> = record.channels.iter().map(|channel| channel.deviation).collect();
        let left: Vec<Vec<f64>> = record
            .channels
            .iter()
            .enumerate()
            .map(|(index, channel)| {
                let forced = record.decays.without(index, &channel.predicted);
                channel
                    .measured
                    .iter()
                    .zip(forced)
                    .zip(&explained[index])
                    .map(|((measured, forced), explained)| measured - forced - explained)
                    .collect()
            })
            .collect();
        decays.fit(&left, &sizes);
        decays.start
    }
}
