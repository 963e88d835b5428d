//! Parameters that make the simulation agree with the records: equation error to start, output error to finish.
//!
//! Regression along the measured motion is biased by the noise in that motion and by what sampling hides between samples. The
//! simulation has neither: with r(θ) = y − y_simulated(θ) in units of the noise, Σ r² is minimal at the most likely θ
//! (Ljung, System Identification, 1999, chapter 7; Levenberg and Marquardt's steps with slopes by differences). Of a record
//! that begins anywhere its initial state is estimated beside θ. Where the whole record is too long for the first guess, its
//! beginning is fitted first.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::candidates::closed_loop::{ClosedLoop, starts_anywhere};
use crate::fit::candidate_model::{Explanation, Simulated};
use crate::fit::closed_fit::ClosedFit;
use crate::fit::library::Library;
use crate::fit::regression::{Fit, Regression};
use crate::fit::segment::{Part, Share, Unknown, split};
use crate::fit::unknowns::{Found, Point, Problem, Slot, at_bounds, by_choice, energy, predicted, stepped};
use crate::motion::free_decay::Decays;
use crate::records::study::Study;
use crate::signal::dot::dot;
use quietcut_simulate::Effects;

/// Steps of the search at most.
pub(crate) const ROUNDS: usize = 15;
/// A step that gains less than this of χ² is the last.
pub(crate) const SETTLED: f64 = 0.1;
/// Shares of a record that are fitted first where a guess is too far away for the whole.
const HORIZONS: [f64; 2] = [0.12, 0.35];
/// How many times what the regression leaves a guess may leave before it is too far away.
const FAR: f64 = 2.0;
/// How many times the least that the regression leaves an explanation may leave to have its start sought in steps.
const FAR_BEHIND: f64 = 4.0;
/// χ² by which an explanation may stay behind another before it is given up.
const HOPELESS: f64 = 300.0;

/// Least step of a difference, as a share of its parameter: rounding of the integration. Where friction holds and lets go,
/// accelerations jump, and a jump is before or after a sample: steps must move many of them.
pub(crate) const LEAST_STEP: f64 = 1e-7;
const LEAST_STEP_OF_FRICTION: f64 = 3e-3;

/// Simulations compared with records.
pub(crate) struct OutputError<'a> {
    pub(crate) study: &'a Study<'a>,
    pub(crate) closed: ClosedLoop,
    /// Parts of each share, in the order of the records.
    parts: Vec<Part>,
    pub(crate) horizons: Vec<Vec<Part>>,
    /// True where every record is of a structure that is let go.
    pub(crate) is_let_go: bool,
}

/// One column of the slopes: of which record, by which slot.
pub(crate) type Column = (usize, usize, Vec<f64>);

/// Jᵀ r for `size` slots.
pub(crate) fn projected(columns: &[Column], size: usize, residuals: &[Vec<f64>]) -> DVector<f64> {
    let mut sum = DVector::zeros(size);
    for (record, slot, column) in columns {
        sum[*slot] += dot(column, &residuals[*record]);
    }
    sum
}

impl<'a> OutputError<'a> {
    /// `None` where some record cannot be simulated.
    pub(crate) fn new(study: &'a Study<'a>) -> Option<Self> {
        let closed = ClosedLoop::new(study)?;
        // What is let go has its own start among the parameters.
        let unknown = |record: &crate::records::record::Record| {
            if starts_anywhere(record) {
                Unknown::Offsets
            } else {
                Unknown::StartAndOffsets
            }
        };
        let horizon = |share: f64| {
            (0..study.records.len())
                .map(|index| {
                    let record = &study.records[index];
                    let count = (share * record.grid.count() as f64) as usize;
                    Part::new(study, index, 0..count.max(16), Share::Whole, unknown(record))
                })
                .collect()
        };
        Some(Self {
            study,
            closed,
            parts: split(study, unknown),
            horizons: HORIZONS.map(horizon).into(),
            is_let_go: study.records.iter().all(starts_anywhere),
        })
    }

    pub(crate) fn of_share(&self, share: Share) -> Vec<&Part> {
        self.parts.iter().filter(|part| part.share == share).collect()
    }

    /// What is left of some parts of one record as `closed` drives it, in units of the noise.
    fn residual(
        &self,
        closed: &ClosedLoop,
        record: usize,
        parts: &[&Part],
        effects: &Effects,
        start: &[f64],
    ) -> Option<Vec<f64>> {
        let mine: Vec<&&Part> = parts.iter().filter(|part| part.record == record).collect();
        let Some(length) = mine.iter().map(|part| part.range.end).max() else {
            return Some(Vec::new());
        };
        let mut samples = closed.simulate(self.study, record, effects, start, length)?;
        for (channel, samples) in self.study.records[record].channels.iter().zip(&mut samples) {
            for (simulated, measured) in samples.iter_mut().zip(&channel.measured) {
                *simulated = measured - *simulated;
            }
        }
        Some(mine.iter().flat_map(|part| part.whiten(&samples)).collect())
    }

    pub(crate) fn residuals(
        &self,
        problem: &Problem<'_>,
        parts: &[&Part],
        point: &Point,
    ) -> Option<Vec<Vec<f64>>> {
        self.residuals_by(&self.closed, problem, parts, point)
    }

    /// The same where other forces drive the records.
    pub(crate) fn residuals_by(
        &self,
        closed: &ClosedLoop,
        problem: &Problem<'_>,
        parts: &[&Part],
        point: &Point,
    ) -> Option<Vec<Vec<f64>>> {
        let effects = problem.effects(self.study, point)?;
        (0..self.study.records.len())
            .into_par_iter()
            .map(|record| self.residual(closed, record, parts, &effects, &point.starts[record]))
            .collect()
    }

    /// The columns of J = ∂y_simulated/∂slot by differences, by record and slot; records one behind the other.
    pub(crate) fn columns(
        &self,
        problem: &Problem<'_>,
        parts: &[&Part],
        point: &Point,
        left: &[Vec<f64>],
    ) -> Option<Vec<Column>> {
        let effects: Vec<Option<(Effects, Point, f64)>> = problem
            .slots
            .iter()
            .map(|(slot, step)| {
                // Where a step leaves what is physical, the other way is taken.
                [*step, -step].into_iter().find_map(|step| {
                    let mut moved = point.clone();
                    *slot.of(&mut moved) += step;
                    let effects = problem.effects(self.study, &moved)?;
                    Some((effects, moved, step))
                })
            })
            .collect();
        let tasks: Vec<(usize, usize)> = (0..left.len())
            .flat_map(|record| (0..problem.slots.len()).map(move |slot| (record, slot)))
            .filter(|(record, slot)| problem.slots[*slot].0.is_felt_by(*record))
            .collect();
        tasks
            .into_par_iter()
            .map(|(record, slot)| {
                let (effects, moved, step) = effects[slot].as_ref()?;
                let mut column =
                    self.residual(&self.closed, record, parts, effects, &moved.starts[record])?;
                for (column, left) in column.iter_mut().zip(&left[record]) {
                    *column = (left - *column) / step;
                }
                Some((record, slot, column))
            })
            .collect()
    }

    /// Jᵀ J and Jᵀ r of these columns; steps become such that each moves χ² by about one.
    pub(crate) fn normal(
        &self,
        problem: &mut Problem<'_>,
        columns: &[Column],
        point: &Point,
        left: &[Vec<f64>],
    ) -> (DMatrix<f64>, DVector<f64>) {
        let size = problem.slots.len();
        let mut normal = DMatrix::<f64>::zeros(size, size);
        let gradient = projected(columns, size, left);
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
        for (index, (slot, step)) in problem.slots.iter_mut().enumerate() {
            let value = slot.of(&mut point.clone()).abs();
            let least = match slot {
                Slot::Inner { .. } => problem.least_step,
                Slot::Start { .. } => LEAST_STEP,
            };
            let natural = normal[(index, index)].sqrt().recip();
            let most = match slot {
                Slot::Inner {
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
        }
        (normal, gradient)
    }

    /// Levenberg and Marquardt's search from `start`; `None` where the start cannot be simulated. It ends early where it stays
    /// behind `rival`, a χ² that another explanation has reached.
    pub(crate) fn search(
        &self,
        problem: &mut Problem<'_>,
        parts: &[&Part],
        start: Point,
        rounds: usize,
        rival: f64,
    ) -> Option<Found> {
        let mut point = start;
        let mut residuals = self.residuals(problem, parts, &point)?;
        let mut left = energy(&residuals);
        let mut normal = DMatrix::zeros(0, 0);
        if problem.slots.is_empty() {
            return Some(Found { point, left, normal });
        }
        let mut trust = 1e-4;
        for round in 0..rounds {
            let columns = self.columns(problem, parts, &point, &residuals)?;
            let mut gradient;
            (normal, gradient) = self.normal(problem, &columns, &point, &residuals);
            at_bounds(problem, &point, &mut normal, &mut gradient);
            let before = left;
            // To first order most of it is of another shape.
            let promised = left - predicted(&normal, &gradient);
            if round >= 1 && promised - rival > HOPELESS && promised > 0.5 * left {
                break;
            }
            let mut accepted = false;
            for _ in 0..6 {
                if let Some(next) = stepped(problem, &point, &normal, &gradient, trust)
                    && let Some(after) = self.residuals(problem, parts, &next)
                    && energy(&after) < left
                {
                    (point, left, residuals) = (next, energy(&after), after);
                    trust = (0.1 * trust).max(1e-9);
                    accepted = true;
                    break;
                }
                trust = 10.0 * trust.max(1e-4);
            }
            let behind = |left: f64| left - rival - HOPELESS;
            let hopeless = round >= 1 && behind(left) > 0.0 && behind(left) > 0.6 * behind(before);
            if !accepted || before - left < SETTLED || hopeless {
                break;
            }
        }
        Some(Found { point, left, normal })
    }

    /// Where searches end in a growing part of every record, from `point` on.
    pub(crate) fn near_to_far(&self, problem: &mut Problem<'_>, mut point: Point) -> Point {
        for parts in &self.horizons {
            let parts: Vec<&Part> = parts.iter().collect();
            if let Some(found) = self.search(problem, &parts, point.clone(), 6, f64::INFINITY) {
                point = found.point;
            }
        }
        point
    }

    fn accept(
        &self,
        library: &mut Library,
        regression: &mut Regression,
        explanation: &Explanation,
        found: Found,
        covariance: Vec<DMatrix<f64>>,
    ) -> Option<Explanation> {
        let mut next = explanation.clone();
        let mut coefficients = Vec::new();
        for (position, inner) in found.point.inner.iter().enumerate() {
            let choice = next.choices[position];
            let count = library.candidates[choice.candidate].variants[choice.variant]
                .1
                .len();
            coefficients.extend_from_slice(&inner[..count]);
            let nonlinear_parameters = library
                .cause(choice.candidate)
                .settled(&inner[count..], &inner[..count])
                .unwrap_or_else(|| inner[count..].to_vec());
            next.choices[position] =
                library.add_variant(self.study, regression, choice.candidate, nonlinear_parameters)?;
        }
        next.fit.coefficients = coefficients;
        next.fit.left = found.left;
        next.simulated = Some(Simulated {
            covariance,
            starts: found.point.starts,
            reading: None,
        });
        Some(next)
    }

    /// What may move, from what the regression says.
    pub(crate) fn problem<'b>(
        &self,
        library: &'b Library,
        explanation: &'b Explanation,
    ) -> Option<(Problem<'b>, Point)> {
        let mut slots = Vec::new();
        let mut inner = Vec::new();
        for (position, choice) in explanation.choices.iter().enumerate() {
            let known = &library.candidates[choice.candidate];
            let cause = library.cause(choice.candidate);
            let coefficients = library.coefficients(explanation, position);
            let nonlinear_parameters = &known.variants[choice.variant].0;
            for (index, coefficient) in coefficients.iter().enumerate() {
                let slot = Slot::Inner {
                    choice: position,
                    index,
                    bounds: [f64::NEG_INFINITY, f64::INFINITY],
                };
                slots.push((slot, 1e-3 * coefficient.abs().max(f64::MIN_POSITIVE)));
            }
            if cause.settled(nonlinear_parameters, &coefficients).is_none() {
                let bounds = cause.bounds(self.study, &known.location);
                for (index, [low, high]) in bounds.into_iter().enumerate() {
                    let slot = Slot::Inner {
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
        let mut problem = Problem {
            library,
            choices: &explanation.choices,
            slots,
            least_step: LEAST_STEP,
        };
        let mut point = Point {
            inner,
            starts: vec![Vec::new(); self.study.records.len()],
        };
        let effects = problem.effects(self.study, &point)?;
        if self.closed.holds(self.study, &effects)? {
            problem.least_step = LEAST_STEP_OF_FRICTION;
        }
        for (record, start) in point.starts.iter_mut().enumerate() {
            if !starts_anywhere(&self.study.records[record]) {
                continue;
            }
            let state = self.state_at_start(library, explanation, record);
            let (states, sizes) = self.closed.begin(self.study, record, &effects, &state)?;
            let amplitude = states
                .iter()
                .zip(&sizes)
                .filter_map(|(state, size)| Some((state / (*size)?).abs()))
                .fold(0.0, f64::max);
            for (index, size) in sizes.iter().enumerate() {
                if let Some(size) = size {
                    let slot = Slot::Start { record, index };
                    problem.slots.push((slot, 1e-3 * amplitude * size));
                }
            }
            *start = states;
        }
        Some((problem, point))
    }

    /// The state of the baseline at the start of a record, once what the explanation adds is taken off.
    fn state_at_start(&self, library: &Library, explanation: &Explanation, index: usize) -> Vec<f64> {
        let record = &self.study.records[index];
        let explained = library.explained(self.study, record, explanation);
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

impl ClosedFit for OutputError<'_> {
    fn fit(
        &self,
        library: &mut Library,
        regression: &mut Regression,
        explanation: &Explanation,
        (rival, best_left): (f64, f64),
    ) -> Option<Explanation> {
        let whole = self.of_share(Share::Whole);
        let (mut problem, start) = self.problem(library, explanation)?;
        let guess = self
            .residuals(&problem, &whole, &start)
            .map_or(f64::INFINITY, |left| energy(&left));
        let mut start = start;
        let by_regression = explanation.fit.left + regression.count(Share::Whole) as f64;
        if guess > FAR * by_regression
            && explanation.fit.left < FAR_BEHIND * best_left.max(regression.count(Share::Whole) as f64)
        {
            start = self.near_to_far(&mut problem, start);
        }
        let found = self.search(&mut problem, &whole, start.clone(), ROUNDS, rival)?;
        let count = regression.count(Share::Whole);
        let found = self.looked_at_again(&mut problem, &whole, &start, found, (rival, count));
        let slots: Vec<Slot> = problem.slots.iter().map(|(slot, _)| *slot).collect();
        let covariance = by_choice(&slots, &found);
        self.accept(library, regression, explanation, found, covariance)
    }

    fn spread_by_force_noise(&self, library: &Library, explanation: &Explanation) -> Option<Explanation> {
        self.spread(library, explanation)
    }

    fn left_by_baseline(&self, library: &Library, _: &Regression) -> Option<f64> {
        let nothing = Explanation {
            choices: Vec::new(),
            fit: Fit {
                coefficients: Vec::new(),
                covariance: DMatrix::zeros(0, 0),
                left: 0.0,
            },
            parameter_count: 0,
            simulated: None,
        };
        let (mut problem, point) = self.problem(library, &nothing)?;
        let whole = self.of_share(Share::Whole);
        let found = self.search(&mut problem, &whole, point, 6, f64::INFINITY)?;
        Some(found.left)
    }

    fn left_of(&self, library: &Library, explanation: &Explanation) -> Option<Vec<Vec<Vec<f64>>>> {
        let simulated = explanation.simulated.as_ref()?;
        let (problem, point) = self.problem(library, explanation)?;
        let effects = problem.effects(self.study, &point)?;
        self.study
            .records
            .par_iter()
            .enumerate()
            .map(|(index, record)| {
                let count = record.grid.count();
                let start = &simulated.starts[index];
                let samples = self.closed.simulate(self.study, index, &effects, start, count)?;
                let left = record.channels.iter().zip(samples).map(|(channel, samples)| {
                    channel
                        .measured
                        .iter()
                        .zip(samples)
                        .map(|(measured, simulated)| measured - simulated)
                        .collect()
                });
                Some(left.collect())
            })
            .collect()
    }

    fn left_held_out(&self, library: &Library, _: &Regression, explanation: &Explanation) -> Option<f64> {
        let simulated = explanation.simulated.as_ref()?;
        let (mut problem, mut point) = self.problem(library, explanation)?;
        point.starts.clone_from(&simulated.starts);
        let fitted = self.of_share(Share::Fitted);
        // States of records that are held out stay where they are: the fitted parts do not feel them.
        let found = self.search(&mut problem, &fitted, point, 4, f64::INFINITY)?;
        let held_out = self.of_share(Share::HeldOut);
        let only_here = |slot: &Slot| match slot {
            Slot::Start { record, .. } => !fitted.iter().any(|part| part.record == *record),
            Slot::Inner { .. } => false,
        };
        problem.slots.retain(|(slot, _)| only_here(slot));
        let found = self.search(&mut problem, &held_out, found.point, 4, f64::INFINITY)?;
        Some(found.left)
    }
}
