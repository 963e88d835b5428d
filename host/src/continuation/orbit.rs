//! The forced periodic orbit at one speed and depth: the fixed point of a map over a period, by Newton.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::forced::ForcedProblem;
use crate::stability::gauss::Gauss;

/// Why there is no orbit.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum OrbitError {
    /// Newton did not settle.
    #[error("no periodic orbit was found near the guess at {depth_mm} mm: the iteration does not settle")]
    NoConvergence {
        /// Axial depth, mm.
        depth_mm: f64,
    },
    /// The branch turns back before the depth is reached.
    #[error("the forced orbit is lost in a fold at {depth_mm} mm")]
    Lost {
        /// Axial depth of the fold, mm.
        depth_mm: f64,
    },
    /// The equations are singular: a fold or a branch point.
    #[error("the equations of the periodic orbit are singular at {depth_mm} mm")]
    Singular {
        /// Axial depth, mm.
        depth_mm: f64,
    },
}

/// An orbit, by what it is at the start of the period, where a tooth enters.
#[derive(Clone, Debug)]
pub struct Orbit {
    /// Axial depth, m.
    pub depth_m: f64,
    /// What the map over the period takes: the states of the structure, and behind them what else of the past acts.
    pub start: DVector<f64>,
    /// For each piece the states at its nodes, n × m.
    pub(super) states: Vec<DMatrix<f64>>,
}

/// The map over the period at a start and a depth.
pub(super) struct Passage {
    pub(super) end: DVector<f64>,
    /// ∂end/∂start.
    pub(super) by_start: DMatrix<f64>,
    /// ∂end/∂depth, 1/m.
    pub(super) by_depth: DVector<f64>,
    pub(super) states: Vec<DMatrix<f64>>,
}

/// A part of the period without a switch: when, and where its nodes are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span<'a> {
    pub(super) start_s: f64,
    pub(super) duration_s: f64,
    pub(super) gauss: &'a Gauss,
}

/// Newton stops at steps below this, relative to the orbit: the step after it would be far below rounding, and the states at the
/// nodes, which are those before it, are as good as the collocation.
const SETTLED: f64 = 1e-10;

/// The map of a forced problem over a period at one speed, on one mesh. Orbits are its fixed points.
pub(super) trait PeriodMap: Sized {
    /// What it is the map of.
    fn problem(&self) -> &ForcedProblem;

    /// How many numbers it maps; the first are the states of the structure.
    fn size(&self) -> usize;

    /// The pieces of the period, in order.
    fn spans(&self) -> Vec<Span<'_>>;

    /// The map, with derivatives; `guess` holds states at the nodes to begin with. `None` where Newton does not settle.
    fn pass(&self, start: &DVector<f64>, depth_m: f64, guess: &[DMatrix<f64>]) -> Option<Passage>;

    /// What the map takes of a motion with a state at the start and with states at the nodes.
    fn start_of(&self, state: DVector<f64>, states: &[DMatrix<f64>]) -> DVector<f64>;

    /// All multipliers about an orbit, largest first.
    fn multipliers(&self, orbit: &Orbit) -> Option<Vec<Complex64>>;

    /// The frequency of the vibration of a multiplier about an orbit, Hz.
    fn chatter_hz(&self, orbit: &Orbit, multiplier: Complex64) -> Option<f64>;

    /// The same map on a finer mesh, to tell errors by; `None` where it cannot be cut.
    fn finer(&self) -> Option<Self>;
}

impl Orbit {
    /// Rest: the orbit at no depth.
    pub(super) fn rest(map: &impl PeriodMap) -> Self {
        let order = map.problem().order();
        let states = map.spans().into_iter();
        Self {
            depth_m: 0.0,
            start: DVector::zeros(map.size()),
            states: states
                .map(|span| DMatrix::zeros(order, span.gauss.nodes.len()))
                .collect(),
        }
    }

    /// The orbit of one mesh on the nodes of another.
    pub(super) fn onto(&self, own: &impl PeriodMap, other: &impl PeriodMap) -> Self {
        let spans = own.spans();
        let at = |time_s: f64| -> DVector<f64> {
            let index = spans
                .partition_point(|span| span.start_s <= time_s)
                .saturating_sub(1);
            let span = &spans[index];
            let weights = span.gauss.lagrange((time_s - span.start_s) / span.duration_s);
            &self.states[index] * DVector::from_vec(weights)
        };
        let states = other.spans().into_iter().map(|span| {
            let times = span.gauss.nodes.iter();
            let columns: Vec<DVector<f64>> = times
                .map(|node| at(span.start_s + span.duration_s * node))
                .collect();
            DMatrix::from_columns(&columns)
        });
        let states: Vec<DMatrix<f64>> = states.collect();
        let state = self.start.rows(0, own.problem().order()).into_owned();
        Self {
            depth_m: self.depth_m,
            start: other.start_of(state, &states),
            states,
        }
    }

    /// The orbit of a problem whose equations are linear.
    pub(super) fn of_linear(map: &impl PeriodMap, depth_m: f64) -> Result<Self, OrbitError> {
        let depth_mm = depth_m * 1e3;
        let singular = OrbitError::Singular { depth_mm };
        let rest = Self::rest(map);
        let from_rest = map.pass(&rest.start, depth_m, &rest.states).ok_or(singular)?;
        let mut periodic = -from_rest.by_start;
        for i in 0..map.size() {
            periodic[(i, i)] += 1.0;
        }
        let start = periodic.lu().solve(&from_rest.end).ok_or(singular)?;
        let around = map.pass(&start, depth_m, &rest.states).ok_or(singular)?;
        Ok(Self {
            depth_m,
            start,
            states: around.states,
        })
    }

    /// Corrects a guess to the orbit on the hyperplane ⟨normal, (start/size, depth/depth_size) − guess⟩ = 0.
    ///
    /// With a normal along depth alone this is Newton at fixed depth; with the tangent it passes folds. Returns
    /// the orbit and the unit tangent there, oriented along `normal`.
    pub(super) fn correct(
        map: &impl PeriodMap,
        guess: &Self,
        scale: Scale,
        normal: &DVector<f64>,
    ) -> Result<(Self, DVector<f64>), OrbitError> {
        let order = map.size();
        let mut orbit = guess.clone();
        let mut distance = 0.0;
        let mut last = f64::INFINITY;
        for iteration in 0..25 {
            let depth_mm = orbit.depth_m * 1e3;
            let passage = map
                .pass(&orbit.start, orbit.depth_m, &orbit.states)
                .ok_or(OrbitError::NoConvergence { depth_mm })?;
            orbit.states = passage.states;
            let mut matrix = DMatrix::zeros(order + 1, order + 1);
            let mut periodic = passage.by_start;
            for i in 0..order {
                periodic[(i, i)] -= 1.0;
            }
            matrix.view_mut((0, 0), (order, order)).copy_from(&periodic);
            matrix
                .view_mut((0, order), (order, 1))
                .copy_from(&(passage.by_depth * (scale.depth_m / scale.state)));
            matrix.row_mut(order).copy_from(&normal.transpose());
            let lu = matrix.lu();
            let mut residual = DVector::zeros(order + 1);
            residual
                .rows_mut(0, order)
                .copy_from(&((&orbit.start - passage.end) / scale.state));
            residual[order] = -distance;
            let step = lu.solve(&residual).ok_or(OrbitError::Singular { depth_mm })?;
            orbit.start += step.rows(0, order) * scale.state;
            orbit.depth_m += step[order] * scale.depth_m;
            distance += normal.dot(&step);
            let size = step.norm();
            if !size.is_finite() || (iteration > 4 && size > 2.0 * last) {
                return Err(OrbitError::NoConvergence { depth_mm });
            }
            last = size;
            if size < SETTLED {
                let mut along = DVector::zeros(order + 1);
                along[order] = 1.0;
                let tangent = lu.solve(&along).ok_or(OrbitError::Singular { depth_mm })?;
                return Ok((orbit, tangent.normalize()));
            }
        }
        Err(OrbitError::NoConvergence {
            depth_mm: orbit.depth_m * 1e3,
        })
    }
}

/// What states and depth are divided by before lengths along a branch are taken.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    pub(super) state: f64,
    pub(super) depth_m: f64,
}
