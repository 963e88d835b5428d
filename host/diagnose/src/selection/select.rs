//! Selection of a candidate model: a further cause is accepted if it decreases χ² by more than the price of its
//! parameters, explains enough of the residual, and does not increase the held-out χ² beyond chance.

use crate::criteria::{
    CHANCE, EQUIVALENT, INTERPOLATION_ERROR, LEAST_GAIN, LEAST_SHARE, LEAST_SHARE_BESIDE_ENOUGH,
    NOISE_TOLERANCE, NOTHING_TO_EXPLAIN, OVER_COMPUTATION_ERROR, RELATIVE_ERROR_OF_CUTS, SAMPLING_RESIDUAL,
    SAMPLING_RESIDUAL_SIMULATED,
};
use crate::fit::candidate_model::{AfterRecords, CandidateModel};
use crate::fit::closed_fit::ClosedFit;
use crate::fit::library::Library;
use crate::fit::output_error::OutputError;
use crate::fit::refine::refine;
use crate::fit::regression::{Regression, Subset};
use crate::fit::relinearization::Relinearization;
use crate::progress::Stage;
use crate::records::study::Study;
use crate::selection::search::{pairs as best_pairs, singles, triples};
use crate::selection::stepwise::extended;
use quietcut_recording::Recording;

/// Largest number of causes in a candidate model.
const CAUSES: usize = 3;
/// Number of candidate models with the largest gain in the regression that are simulated, among models of one, of two
/// and of three causes; those that extend simulated models of fewer causes come in addition.
const SIMULATED: [usize; CAUSES] = [9, 5, 3];

/// The selected candidate model, and those that are equivalent to it.
pub(crate) struct Selection {
    pub(crate) best: Option<CandidateModel>,
    pub(crate) others: Vec<CandidateModel>,
    /// Lead of the selected candidate model: its gain (decrease of χ² minus the price of its parameters) minus the gain
    /// of its best rival; infinite without a rival, and if no model is selected.
    pub(crate) ahead: f64,
    /// Gain of the selected candidate model (decrease of χ² minus the price of its parameters) minus the gain of the
    /// model with fewer causes selected before it, if there is one; 0 if no model is selected.
    pub(crate) gained: f64,
}

/// The study with the quantities by which candidate models are compared.
pub(crate) struct SelectionCriteria<'a> {
    pub(crate) study: &'a Study<'a>,
    pub(crate) recordings: &'a [Recording],
    /// The prediction-error fit of candidate models; `None` if the records allow none.
    pub(crate) closed: Option<Box<dyn ClosedFit + 'a>>,
    /// χ² per degree of freedom that a fit of all columns of the library leaves along the measured motion, including
    /// the interpolation error; at least 1.
    inflation: f64,
    /// χ² of the baseline, with which the χ² of simulated candidate models is compared: from a simulation of the
    /// baseline if one is possible, otherwise along the measured motion.
    pub(crate) reference: f64,
    /// Uncertain parameters of the baseline after the records, without a cause; `None` if it has none or is not simulated.
    pub(crate) baseline: Option<AfterRecords>,
    /// χ² by errors of the computation of a cut, which are proportional to the signal: `RELATIVE_ERROR_OF_CUTS`
    /// squared, times the signal energy in units of the noise variance. A wrong cause can gain this much. Zero for
    /// tests of the structure.
    pub(crate) coherent: f64,
}

impl<'a> SelectionCriteria<'a> {
    pub(crate) fn new(
        study: &'a Study<'a>,
        recordings: &'a [Recording],
        library: &Library,
        regression: &Regression,
    ) -> Self {
        let closed: Option<Box<dyn ClosedFit + 'a>> = match OutputError::new(study) {
            Some(output_error) => Some(Box::new(output_error)),
            None => Relinearization::new(study, recordings).map(|closed| Box::new(closed) as Box<_>),
        };
        // Simulations fit their initial states and do not contain the noise of the measured motion. The baseline is
        // simulated too, for a comparison on equal terms.
        let by_baseline = closed
            .as_ref()
            .and_then(|closed| closed.left_by_baseline(library, regression));
        let (by_baseline, after) = by_baseline.unzip();
        let is_cut = study.records.iter().any(|record| record.cut.is_some());
        Self {
            study,
            recordings,
            closed,
            coherent: if is_cut {
                RELATIVE_ERROR_OF_CUTS * RELATIVE_ERROR_OF_CUTS * regression.signal(study)
            } else {
                0.0
            },
            inflation: inflation(regression),
            baseline: after.flatten(),
            reference: by_baseline.unwrap_or_else(|| regression.residual(Subset::Whole)),
        }
    }

    /// χ² per degree of freedom of the simulated candidate model `best`, at least 0.5; the field `inflation` if there
    /// is no `best` or if it is not simulated.
    pub(crate) fn inflation(&self, regression: &Regression, best: Option<&CandidateModel>) -> f64 {
        match best {
            Some(best) if best.simulated.is_some() => {
                let free = regression
                    .count(Subset::Whole)
                    .saturating_sub(best.parameter_count)
                    .max(1) as f64;
                (best.fit.left / free).max(0.5)
            }
            _ => self.inflation,
        }
    }

    /// Smallest increase of the gain (decrease of χ² minus the price of the parameters) that a further cause must
    /// bring, including what errors of the computation may gain. In a cut it is larger if fewer causes are already
    /// sufficient.
    pub(crate) fn least_gain(&self, regression: &Regression, fewer_are_enough: bool) -> f64 {
        let noise = regression.count(Subset::Whole) as f64;
        let share = if self.coherent > 0.0 && fewer_are_enough {
            LEAST_SHARE_BESIDE_ENOUGH
        } else {
            0.0
        };
        LEAST_GAIN + OVER_COMPUTATION_ERROR * self.coherent + share * noise
    }

    /// Gain of a candidate model: decrease of χ² from the baseline, over `inflation`, minus the price of its parameters
    /// (Schwarz).
    pub(crate) fn gain(&self, regression: &Regression, model: &CandidateModel, inflation: f64) -> f64 {
        let count = regression.count(Subset::Whole).max(2) as f64;
        // A simulated candidate model is compared with the simulated baseline.
        let reference = match model.simulated {
            Some(_) => self.reference,
            // What is not simulated must leave less than the baseline does with its uncertain parameters simulated.
            None if self.study.uncertain.len() > 0 => regression.residual(Subset::Whole).min(self.reference),
            None => regression.residual(Subset::Whole),
        };
        (reference - model.fit.left) / inflation - model.parameter_count as f64 * count.ln()
    }

    pub(crate) fn sort(&self, regression: &Regression, found: &mut [CandidateModel], inflation: f64) {
        found.sort_by(|a, b| {
            self.gain(regression, b, inflation)
                .total_cmp(&self.gain(regression, a, inflation))
        });
    }

    /// Residual energy of `best` above the noise and the errors of the computation: as a share of the noise, and as a
    /// share of the baseline's residual energy above the noise. Without `best`, that of the baseline.
    pub(crate) fn excess(&self, regression: &Regression, best: Option<&CandidateModel>) -> (f64, f64) {
        let noise = regression.count(Subset::Whole) as f64;
        let left = best.map_or(self.reference, |best| best.fit.left);
        let reference = self.reference.max(regression.residual(Subset::Whole));
        let beyond = (left - noise - OVER_COMPUTATION_ERROR * self.coherent).max(0.0);
        let there = (reference - noise).max(1e-9 * noise);
        (beyond / noise, beyond / there)
    }

    /// True if no further cause is needed: the residual of `best`, or of the baseline without `best`, is noise, or that
    /// of `best` is as small as the error that sampling causes.
    fn is_enough(&self, regression: &Regression, best: Option<&CandidateModel>) -> bool {
        let (of_noise, of_excess) = self.excess(regression, best);
        let count = regression.count(Subset::Whole) as f64;
        let simulated = best.is_some_and(|best| best.simulated.is_some());
        let (inflation, sampling) = if simulated {
            (1.0, SAMPLING_RESIDUAL_SIMULATED)
        } else {
            (self.inflation, SAMPLING_RESIDUAL)
        };
        of_noise / inflation < (CHANCE * (2.0 / count).sqrt()).min(NOISE_TOLERANCE)
            || (best.is_some() && of_excess < sampling)
    }

    /// True if a further cause, fitted to the residual of a simulated model, lowers χ² plus the price of the parameters
    /// by more than [`Self::least_gain`] from that of `best`. The simulated model is `best` or, if that is not
    /// simulated, the first simulated one of `found`.
    fn resembles_further_cause(
        &self,
        library: &mut Library,
        regression: &mut Regression,
        best: &CandidateModel,
        found: &[CandidateModel],
    ) -> bool {
        let base = if best.simulated.is_some() {
            Some(best)
        } else {
            found.iter().find(|other| other.simulated.is_some())
        };
        let closed = self.closed.as_ref();
        let Some((base, left)) = base
            .zip(closed)
            .and_then(|(base, closed)| Some((base, closed.left_of(library, base)?)))
        else {
            return false;
        };
        let inflation = self.inflation(regression, Some(base));
        let price = (regression.count(Subset::Whole).max(2) as f64).ln();
        let cost = |of: &CandidateModel| of.fit.left / inflation + of.parameter_count as f64 * price;
        extended(self.study, library, regression, base, &left)
            .first()
            .is_some_and(|more| cost(best) - cost(more) > self.least_gain(regression, true))
    }

    /// True if the candidate model `more` explains more than `LEAST_SHARE` of the residual energy that `fewer` (or the
    /// baseline) has above the noise, or if it has fewer parameters than `fewer`.
    fn explains_enough(
        &self,
        regression: &Regression,
        fewer: Option<&CandidateModel>,
        more: &CandidateModel,
    ) -> bool {
        if fewer.is_some_and(|fewer| more.parameter_count < fewer.parameter_count) {
            return true;
        }
        let noise = regression.count(Subset::Whole) as f64;
        let before = fewer.map_or_else(
            || match more.simulated {
                Some(_) => self.reference,
                None => regression.residual(Subset::Whole),
            },
            |fewer| fewer.fit.left,
        );
        before - more.fit.left > LEAST_SHARE * (before - noise).max(0.0)
    }

    /// χ² of a candidate model on the held-out segments, with parameters fitted to the other segments of the records.
    pub(crate) fn left_held_out(
        &self,
        library: &Library,
        regression: &Regression,
        model: &CandidateModel,
    ) -> f64 {
        self.closed
            .as_ref()
            .and_then(|closed| closed.left_held_out(library, regression, model))
            .unwrap_or_else(|| library.left_held_out(regression, model))
    }
}

/// χ² per degree of freedom after a fit of all columns of the library, plus the interpolation error; at least 1.
fn inflation(regression: &Regression) -> f64 {
    let whole = regression.count(Subset::Whole) as f64;
    let free = (whole - regression.columns() as f64).max(1.0);
    let sampling = INTERPOLATION_ERROR * (regression.residual(Subset::Whole) / whole - 1.0).max(0.0);
    (regression.left_by_all() / free + sampling).max(1.0)
}

/// Selects among single causes, then pairs, then triples. The search goes on to more causes if the residual is above
/// the noise or resembles a further cause, or if two causes may replace one cause with more parameters. It ends, for
/// example, if the last cause explains little.
pub(crate) fn select(
    criteria: &SelectionCriteria<'_>,
    library: &mut Library,
    regression: &mut Regression,
    watch: &dyn Fn(Stage),
) -> Selection {
    let mut selection = Selection {
        best: None,
        others: Vec::new(),
        ahead: f64::INFINITY,
        gained: 0.0,
    };
    let study = criteria.study;
    let mut pairs = Vec::new();
    let mut fewer: Vec<CandidateModel> = Vec::new();
    for (index, most) in SIMULATED.into_iter().enumerate() {
        let size = index + 1;
        // A baseline residual with less than half the energy of the assumed noise contains nothing to explain.
        let is_noise =
            regression.residual(Subset::Whole) < NOTHING_TO_EXPLAIN * regression.count(Subset::Whole) as f64;
        if is_noise {
            break;
        }
        let enough = size > 1 && criteria.is_enough(regression, selection.best.as_ref());
        // One cause with many parameters may imitate two causes with one parameter each: pairs with fewer parameters
        // are then tried.
        let mut imitated = None;
        if enough {
            let Some(best) = &selection.best else { break };
            let resembles = criteria.resembles_further_cause(library, regression, best, &fewer);
            imitated = (!resembles && size == 2 && best.parameter_count > size && criteria.closed.is_some())
                .then(|| best.clone());
            if !resembles && imitated.is_none() {
                break;
            }
        }
        watch(Stage::Causes(size));
        regression.complete();
        let mut found = match size {
            1 => singles(library, study, regression),
            2 => best_pairs(library, study, regression),
            _ => triples(library, study, regression, &pairs),
        };
        // If candidate models are simulated, pairs and triples keep the nonlinear parameters that were refined for the
        // best single causes.
        if size == 1 || criteria.closed.is_none() {
            refine(study, library, regression, &mut found);
        }
        criteria.sort(regression, &mut found, criteria.inflation);
        if size == 2 {
            pairs.clone_from(&found);
        }
        if let Some(imitated) = &imitated {
            found.retain(|model| model.parameter_count < imitated.parameter_count);
        }
        let extended = if imitated.is_some() { &[] } else { &fewer[..] };
        let mut found = criteria.simulated(library, regression, found, extended, most, imitated.as_ref());
        // If fewer causes are already sufficient, a model with one more cause counts only if it was simulated.
        found.retain(|model| !enough || model.simulated.is_some());
        found.sort_by(|a, b| a.fit.left.total_cmp(&b.fit.left));
        let inflation = criteria.inflation(regression, found.first());
        criteria.sort(regression, &mut found, inflation);
        // If fewer causes are already sufficient, the fit of more causes is not improved by a new linearization before
        // it is selected: it could win by errors of the computation.
        if !enough {
            criteria.polish(library, regression, &mut found, inflation);
        }
        let inflation = criteria.inflation(regression, found.first());
        log_best(criteria, library, regression, &found, inflation);
        let Some(best) = found.first() else { break };
        let best = simplest(criteria, regression, &found, best);
        let best = &criteria.pruned(library, regression, best);
        let earlier = std::mem::replace(&mut fewer, found.clone());
        let gained = criteria.gain(regression, best, inflation);
        let reached = selection
            .best
            .as_ref()
            .map_or(0.0, |best| criteria.gain(regression, best, inflation));
        let held_out = criteria.left_held_out(library, regression, best);
        // The held-out segments may contain no trace of an effect, as the end of a free decay does, so their χ² need
        // not decrease. But the candidate model must not increase it beyond chance.
        let chance = CHANCE * (2.0 * regression.count(Subset::HeldOut) as f64).sqrt();
        let explains_enough = criteria.explains_enough(regression, selection.best.as_ref(), best);
        // If the second of two causes explains little, the search ends: a third cause would only compensate for errors
        // of the other two.
        if size > 1 && !explains_enough {
            break;
        }
        if gained < reached + criteria.least_gain(regression, enough)
            || !explains_enough
            || held_out > regression.residual(Subset::HeldOut) + chance
        {
            continue;
        }
        let rivals: Vec<&CandidateModel> = found
            .iter()
            .chain(&earlier)
            .filter(|other| is_rival(library, best, other))
            .collect();
        let behind = |other: &CandidateModel| gained - criteria.gain(regression, other, inflation);
        selection.gained = gained - reached;
        selection.ahead = rivals
            .iter()
            .map(|other| behind(other))
            .fold(f64::INFINITY, f64::min);
        selection.others = rivals
            .iter()
            .filter(|other| behind(other) < EQUIVALENT)
            .map(|other| (*other).clone())
            .collect();
        let polished = criteria.closed.as_ref().filter(|_| enough);
        let polished = polished.and_then(|closed| closed.polished(library, regression, best));
        selection.best = Some(polished.unwrap_or_else(|| best.clone()));
    }
    selection
}

/// True for a rival of `best`: a candidate model of other causes with no more parameters, or of the same causes at
/// other locations with as many parameters.
fn is_rival(library: &Library, best: &CandidateModel, other: &CandidateModel) -> bool {
    if names(library, other) != names(library, best) {
        return other.parameter_count <= best.parameter_count;
    }
    other.parameter_count == best.parameter_count && !library.are_at_same_locations(best, other)
}

fn log_best(
    criteria: &SelectionCriteria<'_>,
    library: &Library,
    regression: &Regression,
    found: &[CandidateModel],
    inflation: f64,
) {
    for model in found.iter().take(6) {
        let names: Vec<String> = model
            .choices
            .iter()
            .map(|choice| {
                let known = &library.candidates[choice.candidate];
                let nonlinear_parameters = &known.variants[choice.variant].0;
                format!(
                    "{} {} {nonlinear_parameters:?}",
                    library.cause(choice.candidate).name(),
                    known.location
                )
            })
            .collect();
        tracing::debug!(
            gain = criteria.gain(regression, model, inflation),
            left = model.fit.left / regression.count(Subset::Whole) as f64,
            simulated = model.simulated.is_some(),
            "{}",
            names.join(" + ")
        );
    }
}

/// The first candidate model in `found` with fewer parameters than `best` that explains the records about as well along
/// the measured motion, otherwise `best`: further parameters may only compensate for aliasing. Simulated models do not
/// contain aliasing and are not taken as the simpler one.
fn simplest(
    criteria: &SelectionCriteria<'_>,
    regression: &Regression,
    found: &[CandidateModel],
    best: &CandidateModel,
) -> CandidateModel {
    let inflation = criteria.inflation;
    let apart = EQUIVALENT.max(INTERPOLATION_ERROR * regression.residual(Subset::Whole) / inflation);
    let as_good = |other: &&CandidateModel| {
        other.simulated.is_none()
            && other.parameter_count < best.parameter_count
            && criteria.excess(regression, Some(other)).1 < SAMPLING_RESIDUAL
            && criteria.gain(regression, other, inflation)
                > criteria.gain(regression, best, inflation) - apart
    };
    found.iter().find(as_good).unwrap_or(best).clone()
}

pub(crate) fn names(library: &Library, model: &CandidateModel) -> Vec<&'static str> {
    let mut names: Vec<&'static str> = model
        .choices
        .iter()
        .flat_map(|choice| library.cause(choice.candidate).names())
        .collect();
    names.sort_unstable();
    names
}
