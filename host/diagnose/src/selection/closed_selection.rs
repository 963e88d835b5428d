//! Which explanations are fitted in closed loop, where the records can be, and which of them to the end.

use std::collections::VecDeque;

use crate::criteria::{
    EQUIVALENT, MOST_EXTENDED, MOST_REBASELINED, MOST_REFINED, NEARLY_EXPLAINED, REGRESSION_FAR_BEHIND,
    REGRESSION_FAR_BEHIND_SIMPLER,
};
use crate::fit::candidate_model::CandidateModel;
use crate::fit::closed_fit::ClosedFit;
use crate::fit::library::Library;
use crate::fit::regression::{Regression, Subset};
use crate::selection::rebaselined::extended_rebaselined;
use crate::selection::select::SelectionCriteria;
use crate::selection::stepwise::{distinct, extended, nested, without};

impl SelectionCriteria<'_> {
    /// The first of `found` as simulation has them, where it can; else all as they are. `fewer` are the best with one cause
    /// less; what stays behind `rival` is given up.
    pub(crate) fn simulated(
        &self,
        library: &mut Library,
        regression: &mut Regression,
        found: Vec<CandidateModel>,
        fewer: &[CandidateModel],
        most: usize,
        rival: Option<&CandidateModel>,
    ) -> Vec<CandidateModel> {
        let Some(closed) = &self.closed else {
            return found;
        };
        let (tried, extended) = self.beside(closed.as_ref(), library, regression, fewer);
        let tried = distinct(
            tried
                .into_iter()
                .chain(found.iter().take(2 * most).cloned())
                .collect(),
        );
        let mut tried = VecDeque::from(tried);
        let mut spare = tried.split_off((extended + most).min(tried.len())).into_iter();
        let (mut rival, mut parameter_count) = rival.map_or((f64::INFINITY, 0), |rival| {
            (rival.fit.left, rival.parameter_count)
        });
        // The same causes along more axes are simulated only where more axes gain something.
        let mut leading: Option<CandidateModel> = None;
        let mut simulated = Vec::new();
        let noise = regression.count(Subset::Whole) as f64;
        let best_left = tried
            .iter()
            .map(|explanation| explanation.fit.left)
            .fold(f64::INFINITY, f64::min);
        while let Some(explanation) = tried.pop_front() {
            // Where one explains nearly all, what is far from that along the measured motion need not be simulated.
            // But a simpler one may be the truth that the other holds as a part.
            let far_off = if explanation.parameter_count < parameter_count {
                REGRESSION_FAR_BEHIND_SIMPLER
            } else {
                REGRESSION_FAR_BEHIND
            };
            if rival < NEARLY_EXPLAINED * noise && explanation.fit.left > far_off * rival.max(noise) {
                continue;
            }
            if leading.as_ref().is_some_and(|leading| {
                library.are_same_causes(leading, &explanation)
                    && leading.parameter_count < explanation.parameter_count
                    && self.gain(regression, leading, 1.0) > self.gain(regression, &explanation, 1.0)
            }) {
                continue;
            }
            let Some(fitted) = closed.fit(library, regression, &explanation, (rival, best_left)) else {
                // What cannot be simulated, but might be true, stays as the regression has it; and the next has its turn.
                if !closed.is_needed() {
                    simulated.push(explanation);
                }
                tried.extend(spare.next());
                continue;
            };
            if fitted.fit.left < rival {
                (rival, parameter_count) = (fitted.fit.left, fitted.parameter_count);
                leading = Some(explanation);
            }
            simulated.push(fitted);
        }
        if simulated.is_empty() && !closed.is_needed() {
            found
        } else {
            simulated
        }
    }

    /// What the best explanations with one cause less ask for beside them, and how many these are.
    fn beside(
        &self,
        closed: &dyn ClosedFit,
        library: &mut Library,
        regression: &mut Regression,
        fewer: &[CandidateModel],
    ) -> (Vec<CandidateModel>, usize) {
        let mut tried = Vec::new();
        let bases = || fewer.iter().filter(|base| base.simulated.is_some());
        // Cuts, whose libraries are costly, go without.
        if let Some(base) = bases().next().filter(|_| self.coherent == 0.0) {
            let around = extended_rebaselined(self.study, self.recordings, library, regression, base);
            tried.extend(around.into_iter().take(MOST_REBASELINED));
        }
        for (base, most) in bases().zip(MOST_EXTENDED) {
            if let Some(left) = closed.left_of(library, base) {
                tried.extend(
                    extended(self.study, library, regression, base, &left)
                        .into_iter()
                        .take(most),
                );
            }
        }
        let count = tried.len();
        (tried, count)
    }

    /// The best of `found`, and what may come up to it, at the parameters where their own slopes end; sorted anew.
    pub(crate) fn polish(
        &self,
        library: &mut Library,
        regression: &mut Regression,
        found: &mut [CandidateModel],
        inflation: f64,
    ) {
        let Some(closed) = &self.closed else { return };
        let before: Vec<f64> = found
            .iter()
            .map(|explanation| self.gain(regression, explanation, inflation))
            .collect();
        let mut gained = 0.0;
        for position in 0..found.len().min(MOST_REFINED) {
            // What was behind by more than twice what the best gained will not come up to it, unless it is simpler: of that the other
            // may have mended what the slopes of the baseline got wrong.
            let is_simpler = found[position].parameter_count < found[0].parameter_count
                && found[position].fit.left < NEARLY_EXPLAINED * found[0].fit.left;
            if position > 0 && !is_simpler && before[0] - before[position] > EQUIVALENT + 2.0 * gained {
                continue;
            }
            if let Some(polished) = closed.polished(library, regression, &found[position]) {
                if position == 0 {
                    gained = (self.gain(regression, &polished, inflation) - before[0]).max(0.0);
                }
                found[position] = polished;
            }
        }
        self.sort(regression, found, inflation);
    }

    /// The explanation without causes that others have made needless, and with simpler causes where these are enough.
    pub(crate) fn pruned(
        &self,
        library: &mut Library,
        regression: &mut Regression,
        best: CandidateModel,
    ) -> CandidateModel {
        let Some(closed) = self.closed.as_ref().filter(|_| best.simulated.is_some()) else {
            return best;
        };
        let mut kept = best;
        loop {
            let inflation = self.inflation(regression, Some(&kept));
            let reached = self.gain(regression, &kept, inflation);
            let places = 0..kept.choices.len();
            let fewer = places.clone().filter(|_| kept.choices.len() > 1);
            let mut simpler: Vec<CandidateModel> =
                fewer.map(|position| without(library, &kept, position)).collect();
            simpler.extend(places.flat_map(|position| nested(self.study, library, &kept, position)));
            let needless = simpler.into_iter().find_map(|fewer| {
                let fewer = closed.fit(library, regression, &fewer, (kept.fit.left, f64::INFINITY))?;
                let enough = |regression: &Regression, fewer: &CandidateModel| {
                    self.gain(regression, fewer, inflation) > reached - self.least_gain(regression, true)
                };
                if enough(regression, &fewer) {
                    return Some(fewer);
                }
                if fewer.fit.left > NEARLY_EXPLAINED * kept.fit.left {
                    return None;
                }
                closed
                    .polished(library, regression, &fewer)
                    .filter(|fewer| enough(regression, fewer))
            });
            match needless {
                Some(fewer) => kept = fewer,
                None => break,
            }
        }
        kept
    }
}
