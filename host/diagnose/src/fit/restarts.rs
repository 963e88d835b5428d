//! Restarts a prediction-error search that is stuck: with dry friction near the parameter values at which it ended, for
//! free decays from multiples of the start values of the parameters.

use crate::criteria::{SEARCH_SETTLED, STUCK};
use crate::fit::output_error::{LEAST_STEP, OutputError};
use crate::fit::search::ROUNDS;
use crate::fit::segment::Segment;
use crate::fit::unknowns::{FitProblem, FreeParameter, ParameterPoint, SearchResult, energy};

/// Relative changes of one parameter, up and down from its value at the end of a search with dry friction. The search
/// restarts from the change with the smallest χ².
const NEARBY: [f64; 6] = [5e-4, 1e-3, 2e-3, 4e-3, 8e-3, 0.016];
/// Factors on the start value of each parameter of a single cause, from which the search for free decays restarts; two
/// parameters take every pair of factors.
const SIZES: [f64; 6] = [0.1, 0.25, 0.5, 1.0, 2.0, 4.0];
/// Largest number of parameters with which a search restarts from multiples of the start values: the number of restarts
/// grows exponentially with it.
const MOST_PARAMETERS: usize = 2;
/// Number of restarts that are searched to the end: those with the smallest χ² on the beginning of each record.
const COMPLETED: usize = 3;
/// Largest number of iterations of the search on the beginning of each record that ranks the starts.
const RANKING_ROUNDS: usize = 4;

impl OutputError<'_> {
    /// The search result `found` from `start`, or the better result of a restart. `count` is the number of compared
    /// values, `rival` the smallest χ² that another candidate model has reached.
    pub(crate) fn restarted(
        &self,
        problem: &mut FitProblem<'_>,
        segments: &[&Segment],
        start: &ParameterPoint,
        mut found: SearchResult,
        (rival, count): (f64, usize),
    ) -> SearchResult {
        let stuck = STUCK * count as f64;
        let is_simple = problem.choices.len() == 1 && problem.inner().count() <= MOST_PARAMETERS;
        if self.is_free_decay && found.left > stuck && is_simple {
            found = self.restarted_elsewhere(problem, segments, start, found, rival);
        }
        if problem.least_step > LEAST_STEP && found.left > stuck && found.left < STUCK * rival {
            found = self.restarted_nearby(problem, segments, found, rival);
        }
        found
    }

    /// Restarts the prediction-error search from the best of some parameter values near those at which it ended, if χ²
    /// is smaller there: χ² as a function of the parameters jumps where friction begins to slip. The better of both
    /// results.
    fn restarted_nearby(
        &self,
        problem: &mut FitProblem<'_>,
        segments: &[&Segment],
        ended: SearchResult,
        rival: f64,
    ) -> SearchResult {
        let mut best: Option<(f64, ParameterPoint)> = None;
        for slot in problem.inner() {
            for share in NEARBY.into_iter().flat_map(|share| [share, -share]) {
                let mut moved = ended.point.clone();
                *slot.of(&mut moved) *= 1.0 + share;
                let least = best.as_ref().map_or(ended.left, |best| best.0);
                if let Some(left) = self
                    .residuals(problem, segments, &moved)
                    .map(|left| energy(&left, &moved))
                    && left < least - SEARCH_SETTLED
                {
                    best = Some((left, moved));
                }
            }
        }
        let again = best.and_then(|(_, point)| self.search(problem, segments, point, ROUNDS, rival));
        again.filter(|again| again.left < ended.left).unwrap_or(ended)
    }

    /// The best of the result `ended` and those of searches that start at multiples of the parameters' start values. In
    /// a free decay of a nonlinear structure the phase depends on the parameters, and χ² has several minima.
    fn restarted_elsewhere(
        &self,
        problem: &mut FitProblem<'_>,
        segments: &[&Segment],
        start: &ParameterPoint,
        ended: SearchResult,
        rival: f64,
    ) -> SearchResult {
        let mut best = ended;
        let mut grid: Vec<Vec<f64>> = vec![Vec::new()];
        for _ in problem.inner() {
            grid = grid
                .into_iter()
                .flat_map(|known| SIZES.map(|size| [known.clone(), vec![size]].concat()))
                .collect();
        }
        let first: Vec<&Segment> = self.horizons[0].iter().collect();
        let mut tried: Vec<(f64, ParameterPoint)> = grid
            .into_iter()
            .filter_map(|sizes| {
                let mut point = start.clone();
                for (slot, size) in problem.inner().zip(sizes) {
                    let value = slot.of(&mut point);
                    *value *= size;
                    if let FreeParameter::Inner {
                        bounds: [low, high], ..
                    } = slot
                    {
                        *value = value.clamp(low, high);
                    }
                }
                let found = self.search(problem, &first, point, RANKING_ROUNDS, f64::INFINITY)?;
                Some((found.left, found.point))
            })
            .collect();
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, point) in tried.into_iter().take(COMPLETED) {
            let point = self.near_to_far(problem, point);
            let rival = rival.min(best.left);
            if let Some(found) = self.search(problem, segments, point, ROUNDS, rival)
                && found.left < best.left
            {
                best = found;
            }
        }
        best
    }
}
