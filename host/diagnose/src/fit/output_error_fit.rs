//! The prediction-error fit of candidate models that are simulated.

use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::candidates::closed_loop::Extended;
use crate::criteria::{FAR_BEHIND, FAR_START};
use crate::fit::candidate_model::{AfterRecords, CandidateModel, Simulated};
use crate::fit::closed_fit::ClosedFit;
use crate::fit::library::Library;
use crate::fit::output_error::OutputError;
use crate::fit::regression::{Regression, Subset};
use crate::fit::search::ROUNDS;
use crate::fit::unknowns::{
    FreeParameter, ParameterPoint, SearchResult, at_bounds, by_choice, energy, of_baseline,
};

/// Largest number of iterations for the initial states of the baseline.
const BASELINE_ROUNDS: usize = 6;

impl OutputError<'_> {
    fn accept(
        &self,
        library: &mut Library,
        regression: &mut Regression,
        model: &CandidateModel,
        found: SearchResult,
        covariance: Vec<DMatrix<f64>>,
        (baseline, steps): (Option<AfterRecords>, Vec<f64>),
    ) -> Option<CandidateModel> {
        let mut next = model.clone();
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
            baseline,
            steps,
            reading: None,
        });
        Some(next)
    }
}

impl OutputError<'_> {
    /// The baseline with the initial states and uncertain parameters that fit best.
    fn without_causes(
        &self,
        library: &Library,
        nothing: &CandidateModel,
    ) -> Option<(Vec<FreeParameter>, SearchResult, Extended)> {
        let (mut problem, mut point) = self.problem(library, nothing)?;
        point.baseline.clone_from(&self.study.uncertain.nearest);
        let whole = self.of_subset(Subset::Whole);
        // The free decay of a linear baseline is that of the regression. That of another begins where the measured motion with its
        // noise has it, which is far where forces remember their path.
        let is_linear = self.study.baseline.terms.is_empty();
        // Candidate models fit the uncertain parameters with all their iterations: so does what they are compared with.
        let rounds = if self.study.uncertain.len() > 0 || !is_linear {
            ROUNDS
        } else {
            BASELINE_ROUNDS
        };
        let mut found = self.search(&mut problem, &whole, point.clone(), rounds, f64::INFINITY)?;
        if self.is_free_decay && !is_linear {
            let near = self.near_to_far(&mut problem, point);
            let other = self.search(&mut problem, &whole, near, rounds, f64::INFINITY);
            if let Some(other) = other.filter(|other| other.left < found.left) {
                found = other;
            }
        }
        let slots: Vec<FreeParameter> = problem.slots.iter().map(|(slot, _)| *slot).collect();
        let extended = problem.extended(self.study, &found.point)?;
        Some((slots, found, extended))
    }

    /// Measured less simulated samples of the case alone, by record and channel, without the free decay and the offsets that then fit
    /// best; `None` if it cannot be simulated.
    pub(crate) fn left_by_case(&self) -> Option<Vec<Vec<Vec<f64>>>> {
        let nothing = CandidateModel::without_causes();
        let (_, found, extended) = self.without_causes(&Library::without_causes(), &nothing)?;
        let left = self.left_by(&extended, &found.point.starts)?;
        let records = self.study.records.iter().zip(left);
        Some(
            records
                .map(|(record, left)| record.without_decay(&left))
                .collect(),
        )
    }

    /// Measured less simulated samples, by record and channel.
    fn left_by(&self, extended: &Extended, starts: &[Vec<f64>]) -> Option<Vec<Vec<Vec<f64>>>> {
        self.study
            .records
            .par_iter()
            .enumerate()
            .map(|(index, record)| {
                let count = record.grid.count();
                let samples = self
                    .closed
                    .simulate(self.study, index, extended, &starts[index], count)?;
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
}

impl ClosedFit for OutputError<'_> {
    fn fit(
        &self,
        library: &mut Library,
        regression: &mut Regression,
        model: &CandidateModel,
        (rival, best_left): (f64, f64),
    ) -> Option<CandidateModel> {
        let whole = self.of_subset(Subset::Whole);
        let (mut problem, start) = self.problem(library, model)?;
        let guess = self
            .residuals(&problem, &whole, &start)
            .map_or(f64::INFINITY, |left| energy(&left, &start));
        let mut start = start;
        let by_regression = model.fit.left + regression.count(Subset::Whole) as f64;
        if guess > FAR_START * by_regression
            && model.fit.left < FAR_BEHIND * best_left.max(regression.count(Subset::Whole) as f64)
        {
            start = self.near_to_far(&mut problem, start);
        }
        let found = self.search(&mut problem, &whole, start.clone(), ROUNDS, rival)?;
        let count = regression.count(Subset::Whole);
        let found = self.restarted(&mut problem, &whole, &start, found, (rival, count));
        let slots: Vec<FreeParameter> = problem.slots.iter().map(|(slot, _)| *slot).collect();
        let covariance = by_choice(&slots, &found);
        let baseline = of_baseline(&slots, &found);
        let steps = problem.slots.iter().map(|(_, step)| *step).collect();
        self.accept(library, regression, model, found, covariance, (baseline, steps))
    }

    fn with_covariance(&self, library: &Library, model: &CandidateModel) -> Option<CandidateModel> {
        let simulated = model.simulated.as_ref()?;
        let (mut problem, mut point) = self.problem(library, model)?;
        place(&mut point, simulated);
        let whole = self.of_subset(Subset::Whole);
        let left = self.residuals(&problem, &whole, &point)?;
        for ((_, step), known) in problem.slots.iter_mut().zip(&simulated.steps) {
            *step = *known;
        }
        Self::widen_steps(&mut problem, &point);
        let columns = self.columns(&problem, &whole, &point, &left)?;
        let (mut normal, mut gradient) = self.normal(&mut problem, &columns, &point, &left);
        at_bounds(&problem, &point, &mut normal, &mut gradient);
        let slots: Vec<FreeParameter> = problem.slots.iter().map(|(slot, _)| *slot).collect();
        let found = SearchResult {
            point,
            left: model.fit.left,
            normal,
        };
        let mut next = model.clone();
        next.simulated = Some(Simulated {
            covariance: by_choice(&slots, &found),
            baseline: of_baseline(&slots, &found),
            ..simulated.clone()
        });
        Some(next)
    }

    fn spread_by_force_noise(&self, library: &Library, model: &CandidateModel) -> Option<CandidateModel> {
        self.spread(library, model)
    }

    fn left_by_baseline(&self, library: &Library, _: &Regression) -> Option<(f64, Option<AfterRecords>)> {
        let nothing = CandidateModel::without_causes();
        let (slots, found, _) = self.without_causes(library, &nothing)?;
        Some((found.left, of_baseline(&slots, &found)))
    }

    fn left_of(&self, library: &Library, model: &CandidateModel) -> Option<Vec<Vec<Vec<f64>>>> {
        let simulated = model.simulated.as_ref()?;
        let (problem, mut point) = self.problem(library, model)?;
        place(&mut point, simulated);
        let extended = problem.extended(self.study, &point)?;
        self.left_by(&extended, &simulated.starts)
    }

    fn left_held_out(&self, library: &Library, _: &Regression, model: &CandidateModel) -> Option<f64> {
        let simulated = model.simulated.as_ref()?;
        let (mut problem, mut point) = self.problem(library, model)?;
        place(&mut point, simulated);
        let fitted = self.of_subset(Subset::Fitted);
        let found = self.search(&mut problem, &fitted, point, 4, f64::INFINITY)?;
        // The initial states of held-out records have no influence on the fitted segments, and are fitted to the
        // held-out segments here.
        let held_out = self.of_subset(Subset::HeldOut);
        let only_here = |slot: &FreeParameter| match slot {
            FreeParameter::Start { record, .. } => !fitted.iter().any(|segment| segment.record == *record),
            FreeParameter::Baseline(_) | FreeParameter::Inner { .. } => false,
        };
        problem.slots.retain(|(slot, _)| only_here(slot));
        let found = self.search(&mut problem, &held_out, found.point, 4, f64::INFINITY)?;
        Some(found.left)
    }
}

/// Puts initial states and uncertain parameters of the baseline where a fit has found them.
pub(crate) fn place(point: &mut ParameterPoint, simulated: &Simulated) {
    point.starts.clone_from(&simulated.starts);
    if let Some((baseline, _)) = &simulated.baseline {
        point.baseline.clone_from(baseline);
    }
}
