//! Levenberg–Marquardt search for the parameters of a simulated candidate model.

use nalgebra::{DMatrix, DVector};
use quietcut_numerics::Stop;
use quietcut_numerics::least_squares::{Damping, Idle, LevenbergMarquardt, NormalSums, Objective};

use crate::criteria::{HOPELESS_LAG, HOPELESS_PREDICTED_SHARE, SEARCH_SETTLED, SLOW_CATCHING_UP};
use crate::fit::output_error::OutputError;
use crate::fit::projection::Projection;
use crate::fit::segment::Segment;
use crate::fit::unknowns::{
    FitProblem, ParameterPoint, RIDGE, SearchResult, at_bounds, energy, predicted, stepped,
};

/// Largest number of Levenberg–Marquardt iterations of the full search for a candidate model's parameters; searches
/// that prepare, rank or check take fewer.
pub(crate) const ROUNDS: usize = 15;

/// Damping of the search. It never falls to zero, since parameters of a candidate model may depend on each other.
const DAMPING: Damping = Damping {
    first: 1e-4,
    shrink: 0.1,
    growth: 10.0,
    least: 1e-9,
    least_retried: 1e-3,
};

/// Largest number of Levenberg–Marquardt steps, with increasing damping, that are tried from one point: the last one
/// has a damping of 10 or more. It limits the computing time.
const TRIALS: usize = 6;

/// Whitened residuals of a simulated candidate model at given parameter values, by record, and their energy χ².
struct Residuals {
    of_segments: Vec<Vec<f64>>,
    left: f64,
}

/// χ² of the simulated candidate model as a function of its free parameters.
struct Search<'a, 'b, 'c> {
    fit: &'a OutputError<'a>,
    problem: &'b mut FitProblem<'c>,
    segments: &'b [&'b Segment],
    rival: f64,
    /// Normal matrix of the last linearization.
    normal: DMatrix<f64>,
    projection: Option<Projection>,
}

impl Search<'_, '_, '_> {
    /// Lag of a search: its χ² minus the χ² of the rival candidate model minus [`HOPELESS_LAG`]. A positive lag may end
    /// the search.
    fn behind(&self, left: f64) -> f64 {
        left - self.rival - HOPELESS_LAG
    }
}

impl Objective for Search<'_, '_, '_> {
    type Point = ParameterPoint;
    type Value = Residuals;

    fn value(&mut self, point: &ParameterPoint) -> Option<Residuals> {
        let of_segments = self.fit.residuals(self.problem, self.segments, point)?;
        let left = energy(&of_segments, point);
        Some(Residuals { of_segments, left })
    }

    fn linearize(&mut self, point: &ParameterPoint, residuals: &Residuals) -> Option<NormalSums> {
        let residuals = &residuals.of_segments;
        let columns = self.fit.columns(self.problem, self.segments, point, residuals)?;
        let (mut matrix, mut gradient) = self.fit.normal(self.problem, &columns, point, residuals);
        at_bounds(self.problem, point, &mut matrix, &mut gradient);
        self.normal.clone_from(&matrix);
        self.projection = Projection::new(self.problem, &matrix);
        if let Some(projection) = &self.projection {
            projection.separate(&mut matrix, &mut gradient);
        }
        Some(NormalSums { matrix, gradient })
    }

    fn moved(&self, point: &ParameterPoint, step: &DVector<f64>) -> ParameterPoint {
        match &self.projection {
            Some(projection) => stepped(self.problem, point, &projection.whole(step)),
            None => stepped(self.problem, point, step),
        }
    }

    fn is_no_worse(&self, next: &Residuals, now: &Residuals) -> bool {
        next.left < now.left
    }

    fn has_converged(&self, _: f64, next: &Residuals, now: &Residuals) -> bool {
        next.left < now.left && now.left - next.left < SEARCH_SETTLED
    }

    /// Gives the search up, after two iterations or more, if its lag (χ² minus that of the rival candidate model minus
    /// [`HOPELESS_LAG`]) is positive and the last iteration has left more of it than the share [`SLOW_CATCHING_UP`].
    fn gives_up(&self, round: usize, now: &Residuals, before: Option<&Residuals>) -> bool {
        let behind = self.behind(now.left);
        round >= 2
            && behind > 0.0
            && before.is_some_and(|before| behind > SLOW_CATCHING_UP * self.behind(before.left))
    }

    /// Gives the search up, after one iteration or more, if even the χ² that the linearized model predicts exceeds that
    /// of the rival candidate model by more than [`HOPELESS_LAG`], and the present χ² times the share
    /// [`HOPELESS_PREDICTED_SHARE`].
    fn gives_up_linearized(&self, round: usize, now: &Residuals, sums: &NormalSums) -> bool {
        let promised = now.left - predicted(&sums.matrix, &sums.gradient);
        round >= 1 && self.behind(promised) > 0.0 && promised > HOPELESS_PREDICTED_SHARE * now.left
    }
}

impl OutputError<'_> {
    /// Levenberg–Marquardt search from `start`; `None` if the start cannot be simulated or a Jacobian cannot be
    /// computed. The search ends early if its χ² stays far above `rival`, the χ² that another candidate model has
    /// reached.
    pub(crate) fn search(
        &self,
        problem: &mut FitProblem<'_>,
        segments: &[&Segment],
        start: ParameterPoint,
        rounds: usize,
        rival: f64,
    ) -> Option<SearchResult> {
        if problem.slots.is_empty() {
            let left = energy(&self.residuals(problem, segments, &start)?, &start);
            return Some(SearchResult {
                point: start,
                left,
                normal: DMatrix::zeros(0, 0),
            });
        }
        let mut search = Search {
            fit: self,
            problem,
            segments,
            rival,
            normal: DMatrix::zeros(0, 0),
            projection: None,
        };
        let iteration = LevenbergMarquardt {
            damping: DAMPING,
            iterations_max: rounds,
            trials_max: TRIALS,
            ridge: RIDGE,
            idle: Idle::Hold,
        };
        let found = iteration.minimize(&mut search, start)?;
        let normal = found.sums.map_or(DMatrix::zeros(0, 0), |_| search.normal);
        (found.stop != Stop::LeftDomain).then_some(SearchResult {
            point: found.point,
            left: found.value.left,
            normal,
        })
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
