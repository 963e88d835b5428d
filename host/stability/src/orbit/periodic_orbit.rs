//! Forced periodic orbit at one speed and depth: the fixed point of a map over a period, by Newton's method.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::collocated::Advanced;
use super::forced::ForcedProblem;
use super::parameter::{Parameter, Place};
use crate::error::Breakdown;
use quietcut_numerics::eigenvalues::EigenvalueError;
use quietcut_numerics::quadrature::Gauss;

/// Reason why a forced periodic orbit or its Floquet multipliers were not found.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum OrbitError {
    /// Newton's method did not converge or failed in a subinterval, or the branch of orbits cannot be followed further.
    #[error("no periodic orbit was found near the guess at {place}: the iteration does not settle")]
    NoConvergence {
        /// Varied parameter and its value.
        place: Place,
    },
    /// The branch of orbits turns back (fold) before the requested value of the varied parameter is reached.
    #[error("the forced orbit is lost in a fold at {place}")]
    Lost {
        /// Varied parameter and its value at the fold.
        place: Place,
    },
    /// The equations of the periodic orbit, or those linearized about it, cannot be solved, for example at a fold or a
    /// branch point; or no preceding tooth cuts the surface in front of some tooth.
    #[error("the equations of the periodic orbit are singular at {place}")]
    Singular {
        /// Varied parameter and its value.
        place: Place,
    },
    /// The problem has a feature that branches of forced orbits do not cover.
    #[error("branches of forced orbits do not cover {what}")]
    NotCovered {
        /// The feature, and what to do instead.
        what: &'static str,
    },
    /// The orbits of a branch cannot be recorded, or the recorded ones are none of this branch.
    #[error("the orbit at {place} cannot be recorded, or the recorded orbits are none of this branch")]
    Journal {
        /// Varied parameter and its value.
        place: Place,
    },
    /// The Floquet multipliers about a forced orbit cannot be computed.
    #[error("the Floquet multipliers about the orbit at {place} cannot be computed: {cause}")]
    Eigenvalues {
        /// Varied parameter and its value.
        place: Place,
        /// Reason from the eigenvalue iteration.
        cause: EigenvalueError,
    },
}

impl OrbitError {
    /// Error if the multipliers about an orbit at a place cannot be computed.
    pub(super) fn of_multipliers(cause: Breakdown, place: Place) -> Self {
        match cause {
            Breakdown::Eigenvalues(cause) => Self::Eigenvalues { place, cause },
            Breakdown::NoSolution | Breakdown::TooManyMultipliers => Self::Singular { place },
        }
    }
}

/// Forced periodic orbit, given by its state at the start of the period, where a tooth enters.
#[derive(Clone, Debug, PartialEq)]
pub struct Orbit {
    /// Value of the varied parameter in the unit of [`Parameter`]; for the axial depth m.
    pub value: f64,
    /// State of the orbit at the start of the period: states of the structure, then, for an orbit of the revolution,
    /// the displacements along the chip normals with which the preceding revolution left the surface that this one
    /// cuts.
    pub start: DVector<f64>,
    /// States of the orbit at the nodes of each subinterval, n states × m nodes.
    pub(super) states: Vec<DMatrix<f64>>,
}

/// Newton step over the period from a start and a value of the varied parameter, with the equations linearized about the states at the nodes.
pub(super) struct PeriodIntegration {
    pub(super) end: DVector<f64>,
    /// Derivative of the state at the end of the period with respect to the state at its start and the varied
    /// parameters, which have the last columns.
    pub(super) by: DMatrix<f64>,
    /// States at the nodes of each subinterval after the Newton step over the period.
    pub(super) states: Vec<DMatrix<f64>>,
    /// Derivatives of the states at the nodes of each subinterval with respect to the state at the start of the period
    /// and the varied parameters, (n m) × number of these variables.
    pub(super) values: Vec<DMatrix<f64>>,
    /// Largest change of a state at a node by the Newton step, relative to the largest state in its subinterval.
    pub(super) moved: f64,
}

impl PeriodIntegration {
    /// Integration before the first subinterval: the state at the start of the period, with derivatives with respect to
    /// `columns` variables, the first of which are the components of that state.
    pub(super) fn from(start: DVector<f64>, columns: usize) -> Self {
        Self {
            by: DMatrix::identity(start.len(), columns),
            end: start,
            states: Vec::new(),
            values: Vec::new(),
            moved: 0.0,
        }
    }

    /// Appends the result of the next subinterval.
    pub(super) fn take(&mut self, subinterval: Advanced) {
        self.end = subinterval.end;
        self.by = subinterval.end_by;
        self.states.push(subinterval.states);
        self.values.push(subinterval.values);
        self.moved = self.moved.max(subinterval.moved);
    }

    /// Matrix I − ∂end/∂start of the periodicity condition, with the states at start and end of the period.
    pub(super) fn periodic(&self) -> DMatrix<f64> {
        let size = self.end.len();
        let mut periodic = -self.by.columns(0, size);
        for i in 0..size {
            periodic[(i, i)] += 1.0;
        }
        periodic
    }
}

/// Tangent of a branch of orbits over the varied parameter, at one orbit.
#[derive(Clone, Debug)]
pub(super) struct Tangent {
    /// Unit tangent of the branch: changes of the orbit's start state and of the parameter, each divided by its [`Scale`].
    pub(super) along: DVector<f64>,
    /// Change of the states at the nodes of each subinterval per unit of length along the branch, n states × m nodes.
    pub(super) states: Vec<DMatrix<f64>>,
}

/// Orbit one step before another one on a branch.
#[derive(Clone, Debug)]
pub(super) struct Predecessor {
    pub(super) orbit: Orbit,
    pub(super) tangent: Tangent,
    /// Length of the step to the next orbit, along this orbit's tangent.
    pub(super) step: f64,
}

/// Subinterval of the period without entry or exit of a tooth: its start, duration and Gauss nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct SubintervalNodes<'a> {
    pub(super) start_s: f64,
    pub(super) duration_s: f64,
    pub(super) gauss: &'a Gauss,
}

/// Size of a Newton step, or predicted size of the next one, relative to the orbit, below which the iteration stops.
/// Newton steps shrink as e' = C e², so that two successive steps e and e' predict the next one: C e'² = e'³/e².
const SETTLED: f64 = 1e-12;

/// Size of the preceding Newton step, relative to the orbit, from which on the size of the next step is not predicted
/// yet. A choice.
const NEAR: f64 = 1e-3;

/// Least cosine of the angle between the tangents of two successive orbits from which on the next one is predicted by
/// a cubic. Where the branch turns faster, the tangent predicts it. A choice: the correction does not depend on it.
const EXTRAPOLATED: f64 = 0.9;

/// Map of a forced problem over a period on one mesh, with one varied parameter; forced orbits are its fixed points.
pub(super) trait PeriodMap: Sized {
    /// Parameter that the map varies.
    fn parameter(&self) -> Parameter;

    /// Forced problem of the map.
    fn problem(&self) -> &ForcedProblem;

    /// Number of components of the map's state; the first ones are the states of the structure.
    fn size(&self) -> usize;

    /// Subintervals of the period on this mesh, in order of time.
    fn subinterval_nodes(&self) -> Vec<SubintervalNodes<'_>>;

    /// Applies the map over the period, with derivatives, linearized about the states `guess` at the nodes. The result
    /// is exact if `guess` contains the states of the motion from `start`. `None` if a subinterval fails.
    fn integrate(
        &self,
        start: &DVector<f64>,
        value: f64,
        guess: &[DMatrix<f64>],
    ) -> Option<PeriodIntegration>;

    /// State of the map at the start of the period, for a motion with the given structural state there and the given
    /// states at the nodes.
    fn start_of(&self, state: DVector<f64>, states: &[DMatrix<f64>]) -> DVector<f64>;

    /// All Floquet multipliers about a forced orbit, largest first.
    ///
    /// # Errors
    /// The linearized equations are singular, or the eigenvalues cannot be computed.
    fn multipliers(&self, orbit: &Orbit) -> Result<Vec<Complex64>, Breakdown>;

    /// Vibration frequency of a Floquet multiplier about a forced orbit, Hz; `None` if it cannot be computed.
    fn chatter_hz(&self, orbit: &Orbit, multiplier: Complex64) -> Option<f64>;

    /// The same map over the period on a finer mesh, for error estimates; `None` if there is no such mesh.
    fn finer(&self) -> Option<Self>;

    /// True if a branch of orbits of several tooth periods passes an orbit of one tooth period between two of its orbits,
    /// and ends there.
    fn has_rejoined(&self, _from: &Orbit, _to: &Orbit) -> bool {
        false
    }
}

impl Orbit {
    /// Rest: the orbit at depth 0.
    pub(super) fn rest(map: &impl PeriodMap) -> Self {
        let order = map.problem().order();
        let states = map.subinterval_nodes().into_iter();
        Self {
            value: 0.0,
            start: DVector::zeros(map.size()),
            states: states
                .map(|subinterval| DMatrix::zeros(order, subinterval.gauss.nodes.len()))
                .collect(),
        }
    }

    /// True if an orbit has as many states as this one, on as many subintervals.
    pub(super) fn has_form_of(&self, other: &Self) -> bool {
        let shapes = self.states.iter().zip(&other.states);
        self.start.len() == other.start.len()
            && self.states.len() == other.states.len()
            && shapes
                .into_iter()
                .all(|(own, other)| own.shape() == other.shape())
    }

    /// Interpolates the orbit from the nodes of one mesh to those of another.
    pub(super) fn onto(&self, own: &impl PeriodMap, other: &impl PeriodMap) -> Self {
        let subintervals = own.subinterval_nodes();
        let at = |time_s: f64| -> DVector<f64> {
            let index = subintervals
                .partition_point(|subinterval| subinterval.start_s <= time_s)
                .saturating_sub(1);
            let subinterval = &subintervals[index];
            let weights = subinterval
                .gauss
                .lagrange((time_s - subinterval.start_s) / subinterval.duration_s);
            &self.states[index] * DVector::from_vec(weights)
        };
        let states = other.subinterval_nodes().into_iter().map(|subinterval| {
            let times = subinterval.gauss.nodes.iter();
            let columns: Vec<DVector<f64>> = times
                .map(|node| at(subinterval.start_s + subinterval.duration_s * node))
                .collect();
            DMatrix::from_columns(&columns)
        });
        let states: Vec<DMatrix<f64>> = states.collect();
        let state = self.start.rows(0, own.problem().order()).into_owned();
        Self {
            value: self.value,
            start: other.start_of(state, &states),
            states,
        }
    }

    /// Forced orbit of a problem whose equation of motion is linear, by one linear solution.
    pub(super) fn of_linear(map: &impl PeriodMap, depth_m: f64) -> Result<Self, OrbitError> {
        let singular = OrbitError::Singular {
            place: map.parameter().at(depth_m),
        };
        let rest = Self::rest(map);
        let from_rest = map
            .integrate(&rest.start, depth_m, &rest.states)
            .ok_or(singular)?;
        let periodic = from_rest.periodic();
        let start = periodic.lu().solve(&from_rest.end).ok_or(singular)?;
        let around = map.integrate(&start, depth_m, &rest.states).ok_or(singular)?;
        Ok(Self {
            value: depth_m,
            start,
            states: around.states,
        })
    }

    /// Predicted orbit a given arc length further along the branch.
    pub(super) fn along(&self, tangent: &Tangent, length: f64, scale: Scale) -> Self {
        let order = self.start.len();
        let states = self.states.iter().zip(&tangent.states);
        Self {
            value: self.value + tangent.along[order] * length * scale.value,
            start: &self.start + tangent.along.rows(0, order) * (length * scale.state),
            states: states.map(|(states, by)| states + by * length).collect(),
        }
    }

    /// Predicted orbit a given arc length further along the branch, from the cubic through this orbit and its
    /// predecessor with their tangents.
    ///
    /// It lies in the hyperplane normal to the tangent in which [`along`](Self::along) predicts it on the tangent.
    pub(super) fn extrapolated(
        &self,
        tangent: &Tangent,
        before: &Predecessor,
        length: f64,
        scale: Scale,
    ) -> Self {
        let mut predicted = self.along(tangent, length, scale);
        let cosine = before.tangent.along.dot(&tangent.along);
        if cosine < EXTRAPOLATED {
            return predicted;
        }
        // Position on the cubic: 0 at the predecessor and 1 at this orbit. There the derivative is the tangent times
        // `own`, at the predecessor times `step`.
        let share = length * cosine / before.step;
        let (step, own) = (before.step, before.step / cosine);
        let x = 1.0 + share;
        let by_orbit = x * x * (2.0 * x - 3.0) + 1.0;
        let by_before = x * (x - 1.0).powi(2) * step;
        let by_own = (x * x * (x - 1.0) - share) * own;
        let order = self.start.len();
        let mut bend = &before.tangent.along * by_before + &tangent.along * by_own;
        let mut start = bend.rows_mut(0, order);
        start += (&before.orbit.start - &self.start) * (by_orbit / scale.state);
        bend[order] += (before.orbit.value - self.value) * (by_orbit / scale.value);
        let along = tangent.along.dot(&bend);
        let change = scale.unscaled(&(bend - &tangent.along * along));
        predicted.start += change.rows(0, order);
        predicted.value += change[order];
        for (index, states) in predicted.states.iter_mut().enumerate() {
            *states += (&before.orbit.states[index] - &self.states[index]) * by_orbit
                + &before.tangent.states[index] * by_before
                + &tangent.states[index] * (by_own - along);
        }
        predicted
    }

    /// Corrects a predicted orbit on the hyperplane ⟨normal, z − z_guess⟩ = 0, where z holds the start state and the
    /// varied parameter, each divided by its unit in `scale`.
    ///
    /// With a normal along the parameter this is Newton's method at its fixed value; with the tangent it passes folds. States
    /// at the nodes are corrected together with the start. Returns the orbit and its tangent, oriented along `normal`.
    ///
    /// The iteration is not that of `quietcut_numerics::newton`: the states at the nodes are unknowns without equations
    /// of their own, and the last decomposition gives the tangent.
    pub(super) fn correct(
        map: &impl PeriodMap,
        guess: &Self,
        scale: Scale,
        normal: &DVector<f64>,
    ) -> Result<(Self, Tangent), OrbitError> {
        let order = map.size();
        let mut orbit = guess.clone();
        let mut distance = 0.0;
        let mut last = f64::INFINITY;
        for iteration in 0..25 {
            let place = map.parameter().at(orbit.value);
            let integration = map
                .integrate(&orbit.start, orbit.value, &orbit.states)
                .ok_or(OrbitError::NoConvergence { place })?;
            let mut matrix = DMatrix::zeros(order + 1, order + 1);
            matrix
                .view_mut((0, 0), (order, order))
                .copy_from(&integration.periodic());
            matrix
                .view_mut((0, order), (order, 1))
                .copy_from(&(integration.by.column(order) * (-scale.value / scale.state)));
            matrix.row_mut(order).copy_from(&normal.transpose());
            let lu = matrix.lu();
            let mut residual = DVector::zeros(order + 1);
            residual
                .rows_mut(0, order)
                .copy_from(&((&integration.end - &orbit.start) / scale.state));
            residual[order] = -distance;
            let step = lu.solve(&residual).ok_or(OrbitError::Singular { place })?;
            let change = scale.unscaled(&step);
            orbit.start += change.rows(0, order);
            orbit.value += change[order];
            distance += normal.dot(&step);
            orbit.states = integration.states;
            for (states, values) in orbit.states.iter_mut().zip(&integration.values) {
                *states += shaped(values * &change, states.nrows());
            }
            let size = step.norm().max(integration.moved);
            if !size.is_finite() || (iteration > 4 && size > 2.0 * last) {
                return Err(OrbitError::NoConvergence { place });
            }
            if size < SETTLED || (last < NEAR && size * (size / last).powi(2) < SETTLED) {
                let mut unit = DVector::zeros(order + 1);
                unit[order] = 1.0;
                let tangent = lu.solve(&unit).ok_or(OrbitError::Singular { place })?;
                let along = tangent.normalize();
                let change = scale.unscaled(&along);
                let states = integration.values.iter().zip(&orbit.states);
                let states = states.map(|(values, states)| shaped(values * &change, states.nrows()));
                let states = states.collect();
                return Ok((orbit, Tangent { along, states }));
            }
            last = size;
        }
        Err(OrbitError::NoConvergence {
            place: map.parameter().at(orbit.value),
        })
    }
}

/// Reshapes stacked states at the nodes of a subinterval to n states × m nodes.
fn shaped(values: DVector<f64>, order: usize) -> DMatrix<f64> {
    let nodes = values.len() / order;
    DMatrix::from_column_slice(order, nodes, values.as_slice())
}

/// Units of the start state and of the varied parameter in which the arc length along a branch of forced orbits is measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    pub(super) state: f64,
    pub(super) value: f64,
}

impl Scale {
    /// Converts a change of the orbit's start and parameter from units of this scale to their own units.
    pub(super) fn unscaled(&self, step: &DVector<f64>) -> DVector<f64> {
        let mut change = step * self.state;
        change[step.len() - 1] = step[step.len() - 1] * self.value;
        change
    }
}
