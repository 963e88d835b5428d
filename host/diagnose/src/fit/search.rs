//! Levenberg–Marquardt search for the parameters of a simulated candidate model.

use nalgebra::DMatrix;

use crate::criteria::{HOPELESS_LAG, SEARCH_SETTLED};
use crate::fit::output_error::OutputError;
use crate::fit::segment::Segment;
use crate::fit::unknowns::{FitProblem, ParameterPoint, SearchResult, at_bounds, energy, predicted, stepped};

/// Largest number of Levenberg–Marquardt iterations of a search.
pub(crate) const ROUNDS: usize = 15;

impl OutputError<'_> {
    /// Levenberg–Marquardt search from `start`; `None` if the start cannot be simulated. The search ends early if its χ² stays behind
    /// `rival`, the χ² that another candidate model has reached.
    pub(crate) fn search(
        &self,
        problem: &mut FitProblem<'_>,
        segments: &[&Segment],
        start: ParameterPoint,
        rounds: usize,
        rival: f64,
    ) -> Option<SearchResult> {
        let mut point = start;
        let mut residuals = self.residuals(problem, segments, &point)?;
        let mut left = energy(&residuals);
        let mut normal = DMatrix::zeros(0, 0);
        if problem.slots.is_empty() {
            return Some(SearchResult { point, left, normal });
        }
        let mut trust = 1e-4;
        for round in 0..rounds {
            let columns = self.columns(problem, segments, &point, &residuals)?;
            let mut gradient;
            (normal, gradient) = self.normal(problem, &columns, &point, &residuals);
            at_bounds(problem, &point, &mut normal, &mut gradient);
            let before = left;
            // The search is hopeless if, to first order, a whole step leaves χ² behind the rival and most of the residual unexplained.
            let promised = left - predicted(&normal, &gradient);
            if round >= 1 && promised - rival > HOPELESS_LAG && promised > 0.5 * left {
                break;
            }
            let mut accepted = false;
            for _ in 0..6 {
                if let Some(next) = stepped(problem, &point, &normal, &gradient, trust)
                    && let Some(after) = self.residuals(problem, segments, &next)
                    && energy(&after) < left
                {
                    (point, left, residuals) = (next, energy(&after), after);
                    trust = (0.1 * trust).max(1e-9);
                    accepted = true;
                    break;
                }
                trust = 10.0 * trust.max(1e-4);
            }
            let behind = |left: f64| left - rival - HOPELESS_LAG;
            let hopeless = round >= 1 && behind(left) > 0.0 && behind(left) > 0.6 * behind(before);
            if !accepted || before - left < SEARCH_SETTLED || hopeless {
                break;
            }
        }
        Some(SearchResult { point, left, normal })
    }

    /// Improves `point` by searches on the beginning of every record, first on a short part, then on a longer one.
    pub(crate) fn near_to_far(
        &self,
        problem: &mut FitProblem<'_>,
        mut point: ParameterPoint,
    ) -> ParameterPoint {
        for segments in &self.horizons {
            let segments: Vec<&Segment> = segments.iter().collect();
            if let Some(found) = self.search(problem, &segments, point.clone(), 6, f64::INFINITY) {
                point = found.point;
            }
        }
        point
    }
}
