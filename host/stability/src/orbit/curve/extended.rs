//! The extended system of a forced orbit at a stability loss: orbit and Floquet mode together.
//!
//! Unknowns are the state x₀ of the orbit at the start of the tooth period, two parameters p, the mode v₀ there, and at
//! a torus the angle θ of the multiplier μ = e^{iθ}:
//!
//!   x(T) − x₀ = 0,   v(T)/μ − v₀ = 0,   cᴴ v₀ = 1,
//!
//! with a constant vector c. These are one equation less than unknowns, so that solutions form a curve. The equations of
//! x and v over the period (see [`mode`](super::mode)) are collocated in each subinterval; their node values are
//! eliminated, with exact derivatives. The system is regular at folds of the orbit, and where a second multiplier meets
//! the critical one.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector};

use super::super::collocated::{Advanced, Linearized};
use super::super::explicit::{AtNode, Explicit};
use super::super::forced::ForcedProblem;
use super::super::parameter::{Parameter, Setting};
use super::super::tooth_period::{SUBINTERVAL_ANGLE, Subinterval, ToothPeriod, jacobians, rates};
use super::mode::{AtModeNode, CriticalAngle, ModeLayout, at_node};
use crate::spectrum::stability_loss::StabilityLoss;

/// Extended system of one kind of stability loss over two parameters.
pub(super) struct ExtendedSystem<'a> {
    pub(super) base: &'a ForcedProblem,
    pub(super) setting: Setting,
    pub(super) parameters: [Parameter; 2],
    pub(super) kind: StabilityLoss,
    /// Slowest spindle speed of the curve, rev/min, for which the mesh is made.
    pub(super) slowest_rpm: f64,
    pub(super) subinterval_angle: f64,
    pub(super) layout: ModeLayout,
}

/// Orbit with a critical Floquet mode.
#[derive(Clone, Debug)]
pub(super) struct CriticalOrbit {
    /// Unknowns (x₀, p, v₀, θ), the last one at a torus only; parameters in the unit of computations.
    pub(super) unknowns: DVector<f64>,
    /// States of the orbit at the nodes of each subinterval, n × nodes.
    pub(super) states: Vec<DMatrix<f64>>,
    /// Mode at the nodes of each subinterval, size of the mode × nodes.
    pub(super) modes: Vec<DMatrix<f64>>,
}

/// Residual of the extended system with its derivatives at a guess, after a Newton step of the node values.
pub(super) struct LinearizedSystem {
    /// Residual of the equations other than the arc length.
    pub(super) residual: DVector<f64>,
    /// Derivatives of the residual with respect to the unknowns.
    pub(super) jacobian: DMatrix<f64>,
    /// Node values after the Newton step at fixed unknowns, for each subinterval.
    pub(super) states: Vec<DMatrix<f64>>,
    pub(super) modes: Vec<DMatrix<f64>>,
    /// Derivatives of the states with respect to (x₀, p), and of the modes with respect to all unknowns.
    pub(super) states_by: Vec<DMatrix<f64>>,
    pub(super) modes_by: Vec<DMatrix<f64>>,
    /// Largest change of a node value, relative to the largest value in its subinterval.
    pub(super) moved: f64,
}

impl<'a> ExtendedSystem<'a> {
    pub(super) fn new(
        base: &'a ForcedProblem,
        setting: Setting,
        parameters: [Parameter; 2],
        kind: StabilityLoss,
        slowest_rpm: f64,
    ) -> Self {
        Self {
            layout: ModeLayout::new(base.order(), kind),
            subinterval_angle: SUBINTERVAL_ANGLE,
            base,
            setting,
            parameters,
            kind,
            slowest_rpm,
        }
    }

    /// The same system on a finer mesh, for error estimates.
    pub(super) fn finer(&self) -> Self {
        Self {
            subinterval_angle: 0.5 * self.subinterval_angle,
            ..*self
        }
    }

    pub(super) fn order(&self) -> usize {
        self.base.order()
    }

    /// Place of the first parameter among the unknowns.
    pub(super) fn first_parameter(&self) -> usize {
        self.order()
    }

    /// Place of the mode among the unknowns.
    pub(super) fn first_of_mode(&self) -> usize {
        self.order() + 2
    }

    /// Place of the angle θ among the unknowns; `None` if it is fixed.
    pub(super) fn angle_at(&self) -> Option<usize> {
        (self.kind == StabilityLoss::Hopf).then(|| self.first_of_mode() + self.layout.size())
    }

    /// Number of unknowns.
    pub(super) fn size(&self) -> usize {
        self.first_of_mode() + self.layout.size() + usize::from(self.angle_at().is_some())
    }

    /// Setting of the parameters of an orbit.
    pub(super) fn setting_of(&self, unknowns: &DVector<f64>) -> Setting {
        let first = self.first_parameter();
        self.setting
            .at(self.parameters[0], unknowns[first])
            .at(self.parameters[1], unknowns[first + 1])
    }

    pub(super) fn angle_of(&self, unknowns: &DVector<f64>) -> CriticalAngle {
        CriticalAngle::of(self.kind, self.angle_at().map_or(PI, |index| unknowns[index]))
    }

    /// Tooth period of a problem at a setting on the mesh of the curve.
    pub(super) fn period<'b>(&self, problem: &'b ForcedProblem, rpm: f64) -> ToothPeriod<'b> {
        ToothPeriod::on_mesh_of(self.slowest_rpm, problem, rpm, self.subinterval_angle)
    }

    /// Linearizes the system about a guess; `phase` is the vector c of the condition on the mode. `None` if a
    /// subinterval is singular or a value is not finite.
    pub(super) fn linearize(&self, guess: &CriticalOrbit, phase: &DVector<f64>) -> Option<LinearizedSystem> {
        let setting = self.setting_of(&guess.unknowns);
        let problem = self.base.at(&setting);
        let map = self.period(&problem, setting.rpm);
        let explicit = Explicit {
            base: self.base,
            parameters: &self.parameters,
        };
        let (order, size) = (self.order(), self.size());
        let start = guess.unknowns.rows(0, order).into_owned();
        let mode_start = guess
            .unknowns
            .rows(self.first_of_mode(), self.layout.size())
            .into_owned();
        let mut mode_by = DMatrix::zeros(self.layout.size(), size);
        for i in 0..self.layout.size() {
            mode_by[(i, self.first_of_mode() + i)] = 1.0;
        }
        let mut ends = Ends {
            state: start.clone(),
            state_by: DMatrix::identity(order, order + 2),
            mode: mode_start.clone(),
            mode_by,
        };
        let mut system = LinearizedSystem::empty(map.subintervals.len());
        let angle = self.angle_of(&guess.unknowns);
        for (index, subinterval) in map.subintervals.iter().enumerate() {
            let at = InSubinterval {
                system: self,
                map: &map,
                subinterval,
                explicit: &explicit,
                depth_m: setting.depth_m(),
                angle,
            };
            let (states, modes) = at.advance(&ends, &guess.states[index], &guess.modes[index])?;
            ends.take(&states, &modes);
            system.take(states, modes);
        }
        self.close(&mut system, &ends, [&start, &mode_start], angle, phase);
        Some(system)
    }

    /// Residual and Jacobian of the conditions at the ends of the period and of the phase.
    fn close(
        &self,
        system: &mut LinearizedSystem,
        ends: &Ends,
        [start, mode_start]: [&DVector<f64>; 2],
        angle: CriticalAngle,
        phase: &DVector<f64>,
    ) {
        let (order, size, mode_size) = (self.order(), self.size(), self.layout.size());
        let mode_at = self.first_of_mode();
        let mut residual = DVector::zeros(size - 1);
        let mut jacobian = DMatrix::zeros(size - 1, size);
        residual.rows_mut(0, order).copy_from(&(&ends.state - start));
        let mut by_state = jacobian.view_mut((0, 0), (order, order + 2));
        by_state.copy_from(&ends.state_by);
        for i in 0..order {
            by_state[(i, i)] -= 1.0;
        }
        let turned = self.layout.times(angle.inverse(), ends.mode.as_view());
        residual
            .rows_mut(order, mode_size)
            .copy_from(&(turned - mode_start));
        for column in 0..size {
            let turned = self
                .layout
                .times(angle.inverse(), ends.mode_by.column(column).as_view());
            jacobian
                .view_mut((order, column), (mode_size, 1))
                .copy_from(&turned);
        }
        for i in 0..mode_size {
            jacobian[(order + i, mode_at + i)] -= 1.0;
        }
        if let Some(angle_at) = self.angle_at() {
            let by_angle = self.layout.times(angle.inverse_by_angle(), ends.mode.as_view());
            let mut column = jacobian.view_mut((order, angle_at), (mode_size, 1));
            column += by_angle;
        }
        let rows = order + mode_size;
        residual[rows] = phase.dot(mode_start) - 1.0;
        jacobian
            .view_mut((rows, mode_at), (1, mode_size))
            .copy_from(&phase.transpose());
        if self.angle_at().is_some() {
            let turned = self.layout.times([0.0, 1.0], phase.as_view());
            residual[rows + 1] = turned.dot(mode_start);
            jacobian
                .view_mut((rows + 1, mode_at), (1, mode_size))
                .copy_from(&turned.transpose());
        }
        (system.residual, system.jacobian) = (residual, jacobian);
    }
}

/// State and mode at the end of the subintervals so far, with derivatives.
struct Ends {
    state: DVector<f64>,
    state_by: DMatrix<f64>,
    mode: DVector<f64>,
    mode_by: DMatrix<f64>,
}

impl Ends {
    fn take(&mut self, states: &Advanced, modes: &Advanced) {
        self.state.copy_from(&states.end);
        self.state_by.copy_from(&states.end_by);
        self.mode.copy_from(&modes.end);
        self.mode_by.copy_from(&modes.end_by);
    }
}

impl LinearizedSystem {
    fn empty(subintervals: usize) -> Self {
        Self {
            residual: DVector::zeros(0),
            jacobian: DMatrix::zeros(0, 0),
            states: Vec::with_capacity(subintervals),
            modes: Vec::with_capacity(subintervals),
            states_by: Vec::with_capacity(subintervals),
            modes_by: Vec::with_capacity(subintervals),
            moved: 0.0,
        }
    }

    fn take(&mut self, states: Advanced, modes: Advanced) {
        self.moved = self.moved.max(states.moved).max(modes.moved);
        self.states.push(states.states);
        self.states_by.push(states.values);
        self.modes.push(modes.states);
        self.modes_by.push(modes.values);
    }
}

/// One subinterval of the extended system.
struct InSubinterval<'a> {
    system: &'a ExtendedSystem<'a>,
    map: &'a ToothPeriod<'a>,
    subinterval: &'a Subinterval,
    explicit: &'a Explicit<'a>,
    depth_m: f64,
    angle: CriticalAngle,
}

impl InSubinterval<'_> {
    /// Newton step of orbit and mode in the subinterval.
    fn advance(
        &self,
        ends: &Ends,
        states: &DMatrix<f64>,
        modes: &DMatrix<f64>,
    ) -> Option<(Advanced, Advanced)> {
        let problem = self.map.problem;
        let order = self.system.order();
        let jacobians = jacobians(problem, self.subinterval, states, self.depth_m);
        let rates = rates(problem, self.subinterval, states, self.depth_m);
        let forces: Vec<DMatrix<f64>> = rates
            .iter()
            .enumerate()
            .map(|(node, rate)| {
                let at = AtNode {
                    subinterval: self.subinterval,
                    node,
                    state: &states.as_slice()[node * order..(node + 1) * order],
                    rate,
                    depth_m: self.depth_m,
                };
                let mut force = DMatrix::zeros(order, order + 2);
                force
                    .columns_mut(order, 2)
                    .copy_from(&self.explicit.columns(self.map, &at));
                force
            })
            .collect();
        let (gauss, duration_s) = (&self.map.gauss, self.subinterval.duration);
        let orbit = Linearized::new(gauss, duration_s, jacobians.clone());
        let orbit = orbit.advance(&ends.state, &ends.state_by, states, &rates, &forces)?;
        let (mut matrices, mut rates, mut forces) = (Vec::new(), Vec::new(), Vec::new());
        for (node, jacobian) in jacobians.iter().enumerate() {
            let at = AtModeNode {
                map: self.map,
                subinterval: self.subinterval,
                node,
                depth_m: self.depth_m,
                state: at_node(states, node),
                jacobian,
                layout: self.system.layout,
                angle: self.angle,
            };
            let equation = at.evaluate(self.explicit, at_node(modes, node));
            let moved = at_node(&orbit.states, node) - at_node(states, node);
            rates.push(&equation.rate + &equation.by_state * moved);
            let mut force = DMatrix::zeros(self.system.layout.size(), self.system.size());
            let by_state = &equation.by_state * orbit.values.rows(node * order, order);
            force.columns_mut(0, order + 2).copy_from(&by_state);
            let mut by_parameter = force.columns_mut(order, 2);
            by_parameter += &equation.by_parameter;
            if let Some(angle_at) = self.system.angle_at() {
                force.set_column(angle_at, &equation.by_angle);
            }
            forces.push(force);
            matrices.push(equation.matrix);
        }
        let mode = Linearized::new(gauss, duration_s, matrices);
        let mode = mode.advance(&ends.mode, &ends.mode_by, modes, &rates, &forces)?;
        Some((orbit, mode))
    }
}
