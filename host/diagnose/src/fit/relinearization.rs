//! Cuts: parameters at which the extended case leaves least, each time linearized anew.
//!
//! Along the measured motion what a cause adds to a cut is exact only to first order: a late sensor, a lighter structure or runout
//! change the motion that the chip is computed from. So the recordings are read again with the extended case, which gives the
//! residual r(θ) itself, and the columns of the regression its slopes: θ ← θ + (JᵀJ)⁻¹Jᵀ r(θ), Gauss and Newton's steps with the
//! slopes of the first (the chord method). The motion is each time the one that the extended case has in closed loop
//! (`mean_slopes`), so that the noise of the sensors is not in it; where it would be amplified (`amplification`) the measured one.

use std::sync::Arc;

use crate::candidates::extension_tables::joined;
use crate::criteria::{
    FIRST_PREDICTION_LAG, HOPELESS_LAG, HOPELESS_PREDICTED_SHARE, RELINEARIZATION_SETTLED,
};
use crate::fit::candidate_model::ExtendedPrediction;
use crate::fit::candidate_model::{AfterRecords, CandidateModel, Choice, Simulated};
use crate::fit::closed_fit::ClosedFit;
use crate::fit::covariance::covariance;
use crate::fit::library::Library;
use crate::fit::regression::{Regression, Subset};
use crate::records::record::{Clean, Known, Record};
use crate::records::study::Study;
use quietcut_recording::Recording;

/// Readings with an extended case at most.
const ROUNDS: usize = 5;

/// Residuals by record and channel.
type Residuals = Vec<Vec<Vec<f64>>>;

/// The recordings, to be read again with extended cases.
pub(crate) struct Relinearization<'a> {
    pub(crate) study: &'a Study<'a>,
    recordings: &'a [Recording],
}

impl<'a> Relinearization<'a> {
    /// `None` where no record is a cut.
    pub(crate) fn new(study: &'a Study<'a>, recordings: &'a [Recording]) -> Option<Self> {
        let is_cut = study.records.iter().any(|record| record.cut.is_some());
        is_cut.then_some(Self { study, recordings })
    }

    /// Reads the recordings with `extensions` more in the case, along the motion that was `predicted` before if there is one.
    pub(crate) fn read(
        &self,
        extensions: &[(&'static str, toml::Table)],
        predicted: Option<&[Clean]>,
    ) -> Option<ExtendedPrediction> {
        let mut case = self.study.baseline.case.clone();
        let tables = extensions.iter().map(|(name, table)| (*name, table));
        case.extensions.extend(joined(tables));
        // As the case alone has it: an explanation is not compared with another along another motion.
        let known = |index: usize| {
            let amplifies = self.study.records[index].amplifies;
            let predicted = predicted.filter(|_| !amplifies);
            Known {
                clean: predicted.map(|predicted| predicted[index].clone()),
                amplifies: Some(amplifies),
            }
        };
        let read = Study::with(&case, self.recordings, known).ok()?;
        let residuals: Residuals = read
            .records
            .iter()
            .map(|record| {
                let of = |(index, skipped): (usize, &Vec<usize>)| {
                    let mut residual = record.channels[index].residual();
                    skipped.iter().for_each(|&sample| residual[sample] = 0.0);
                    residual
                };
                record.skipped.iter().enumerate().map(of).collect()
            })
            .collect();
        let finite = residuals
            .iter()
            .flatten()
            .flatten()
            .all(|sample| sample.is_finite());
        finite.then(|| ExtendedPrediction {
            predicted: read.records.iter().map(Record::predicted).collect(),
            residuals,
        })
    }

    /// The explanation with coefficients, and the shapes that settle by themselves with them, moved by `change`; behind the
    /// coefficients of all choices those of the shapes in `slopes`. `None` where that is not physical.
    pub(crate) fn moved(
        &self,
        library: &mut Library,
        regression: &mut Regression,
        explanation: &CandidateModel,
        slopes: &[Vec<usize>],
        change: &[f64],
    ) -> Option<CandidateModel> {
        let mut next = explanation.clone();
        let (of_coefficients, mut of_shapes) = change.split_at(explanation.fit.coefficients.len());
        for (coefficient, change) in next.fit.coefficients.iter_mut().zip(of_coefficients) {
            *coefficient += change;
        }
        for (position, slopes) in slopes.iter().enumerate() {
            let Choice { candidate, variant } = next.choices[position];
            let coefficients = library.coefficients(&next, position);
            let nonlinear_parameters = &library.candidates[candidate].variants[variant].0;
            let cause = library.cause(candidate);
            let moved = match cause.settled(nonlinear_parameters, &coefficients) {
                Some(settled) => settled,
                None if slopes.is_empty() => continue,
                None => {
                    let bounds = cause.bounds(self.study, &library.candidates[candidate].location);
                    let (own, rest) = of_shapes.split_at(slopes.len());
                    of_shapes = rest;
                    let moved = nonlinear_parameters.iter().zip(own).zip(bounds);
                    moved
                        .map(|((value, change), [low, high])| (value + change).clamp(low, high))
                        .collect()
                }
            };
            next.choices[position] = library.add_variant(self.study, regression, candidate, moved)?;
        }
        library.parameters(self.study, &next).map(|_| next)
    }
}

impl ClosedFit for Relinearization<'_> {
    fn fit(
        &self,
        library: &mut Library,
        regression: &mut Regression,
        explanation: &CandidateModel,
        (rival, _): (f64, f64),
    ) -> Option<CandidateModel> {
        let slopes = library.slopes_of(self.study, regression, explanation);
        let mut columns = library.columns_of(explanation);
        columns.extend(slopes.iter().flatten());
        let mut at = explanation.clone();
        let mut predicted: Option<Arc<ExtendedPrediction>> = None;
        let mut best: Option<(CandidateModel, Arc<ExtendedPrediction>)> = None;
        for round in 0..ROUNDS {
            let Some(reading) = self.read(
                &library.extensions(self.study, &at)?,
                predicted.as_ref().map(|reading| &reading.predicted[..]),
            ) else {
                break;
            };
            let refit = regression.refit(Subset::Whole, &columns, &reading.residuals)?;
            at.fit.left = refit.before;
            // The first one follows the measured motion still: it is compared with none.
            let is_better = round <= 1 || best.as_ref().is_none_or(|(best, _)| at.fit.left < best.fit.left);
            let reading = Arc::new(reading);
            if is_better {
                best = Some((at.clone(), reading.clone()));
            }
            let promised = refit.before - refit.taken;
            let first = if round == 0 {
                FIRST_PREDICTION_LAG * rival
            } else {
                0.0
            };
            let hopeless =
                promised - rival > HOPELESS_LAG + first && promised > HOPELESS_PREDICTED_SHARE * refit.before;
            if !is_better || hopeless || (round > 0 && refit.taken < RELINEARIZATION_SETTLED) {
                break;
            }
            predicted = Some(reading);
            match self.moved(library, regression, &at, &slopes, &refit.change) {
                Some(next) => at = next,
                None => break,
            }
        }
        let (mut found, reading) = best?;
        found.simulated = Some(Simulated {
            covariance: covariance(self.study, library, regression, &found, 1.0),
            starts: Vec::new(),
            baseline: None,
            steps: Vec::new(),
            reading: Some(reading),
        });
        Some(found)
    }

    fn is_needed(&self) -> bool {
        true
    }

    fn polished(
        &self,
        library: &mut Library,
        regression: &mut Regression,
        explanation: &CandidateModel,
    ) -> Option<CandidateModel> {
        self.by_own_slopes(library, regression, explanation)
    }

    fn left_by_baseline(&self, _: &Library, regression: &Regression) -> Option<(f64, Option<AfterRecords>)> {
        let known: Vec<Clean> = self.study.records.iter().map(Record::predicted).collect();
        let reading = self.read(&[], Some(&known))?;
        let left = regression.refit(Subset::Whole, &[], &reading.residuals)?.before;
        Some((left, None))
    }

    fn left_of(&self, _: &Library, explanation: &CandidateModel) -> Option<Residuals> {
        let reading = explanation.simulated.as_ref()?.reading.as_ref()?;
        Some(reading.residuals.clone())
    }

    fn left_held_out(
        &self,
        library: &Library,
        regression: &Regression,
        explanation: &CandidateModel,
    ) -> Option<f64> {
        let left = &explanation.simulated.as_ref()?.reading.as_ref()?.residuals;
        let columns = library.columns_of(explanation);
        let change = regression.refit(Subset::Fitted, &columns, left)?.change;
        Some(regression.left_with(Subset::HeldOut, &columns, left, &change))
    }
}
