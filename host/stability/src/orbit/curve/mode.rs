//! The Floquet mode about a forced orbit at a stability loss, as the solution of an ordinary differential equation.
//!
//! The delay equals the tooth period, so that a Floquet mode v with the multiplier μ has v_τ = v/μ, and
//!
//!   v̇ = G v,   G = J(x) + (1 − 1/μ) R(x),   v(T) = μ v(0),
//!
//! with the Jacobian J of the equation of the orbit x and the regenerative matrix R = B (w − z) Σ_teeth s·cutting·nᵀ C,
//! in the symbols of [`ForcedProblem`] and with the slope s of the chip law. On the unit circle μ = e^{iθ} and 1 − 1/μ =
//! 1 − cos θ + i sin θ: 2 at a flip and 0 at a fold, where v is real.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector, DVectorView};

use super::super::explicit::Explicit;
use super::super::forced::ForcedProblem;
use super::super::parameter::Parameter;
use super::super::tooth_period::{Subinterval, ToothPeriod};
use crate::spectrum::stability_loss::StabilityLoss;

/// Arrangement of real and imaginary part of a mode in one real vector: those of the first half of the states, then
/// those of the second half, so that a second-order structure keeps the form (displacements, velocities).
#[derive(Clone, Copy, Debug)]
pub(super) struct ModeLayout {
    order: usize,
    /// 2 for a complex mode, 1 for a real one.
    parts: usize,
}

impl ModeLayout {
    pub(super) fn new(order: usize, kind: StabilityLoss) -> Self {
        Self {
            order,
            parts: kind.count() as usize,
        }
    }

    /// Number of real components of a mode.
    pub(super) fn size(self) -> usize {
        self.order * self.parts
    }

    fn index(self, state: usize, part: usize) -> usize {
        let half = self.order / 2;
        if state < half {
            part * half + state
        } else {
            self.parts * half + part * (self.order - half) + state - half
        }
    }

    /// Mode times the complex number `factor[0]` + i `factor[1]`.
    pub(super) fn times(self, factor: [f64; 2], mode: DVectorView<'_, f64>) -> DVector<f64> {
        let mut product = DVector::zeros(self.size());
        for state in 0..self.order {
            let re = self.index(state, 0);
            if self.parts == 1 {
                product[re] = factor[0] * mode[re];
                continue;
            }
            let im = self.index(state, 1);
            product[re] = factor[0] * mode[re] - factor[1] * mode[im];
            product[im] = factor[0] * mode[im] + factor[1] * mode[re];
        }
        product
    }

    /// Product of a real matrix with both parts of a mode.
    pub(super) fn product(self, matrix: &DMatrix<f64>, mode: DVectorView<'_, f64>) -> DVector<f64> {
        let mut product = DVector::zeros(self.size());
        for part in 0..self.parts {
            for column in 0..self.order {
                let entry = mode[self.index(column, part)];
                for row in 0..self.order {
                    product[self.index(row, part)] += matrix[(row, column)] * entry;
                }
            }
        }
        product
    }

    /// The real matrix that acts on a mode as `own` + (factor[0] + i factor[1])·`turned`.
    fn matrix(self, own: &DMatrix<f64>, turned: &DMatrix<f64>, factor: [f64; 2]) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(self.size(), self.size());
        for column in 0..self.order {
            for row in 0..self.order {
                let turned = turned[(row, column)];
                let same = own[(row, column)] + factor[0] * turned;
                for part in 0..self.parts {
                    matrix[(self.index(row, part), self.index(column, part))] = same;
                }
                if self.parts == 2 {
                    matrix[(self.index(row, 0), self.index(column, 1))] = -factor[1] * turned;
                    matrix[(self.index(row, 1), self.index(column, 0))] = factor[1] * turned;
                }
            }
        }
        matrix
    }
}

/// Critical multiplier μ = e^{iθ}.
#[derive(Clone, Copy, Debug)]
pub(super) struct CriticalAngle(pub(super) f64);

impl CriticalAngle {
    /// The angle at which a multiplier leaves the unit circle: that of the multiplier for a torus, π or 0 otherwise.
    pub(super) fn of(kind: StabilityLoss, torus_angle: f64) -> Self {
        Self(match kind {
            StabilityLoss::Hopf => torus_angle,
            StabilityLoss::Flip => PI,
            StabilityLoss::Fold => 0.0,
        })
    }

    /// Real and imaginary part of 1/μ.
    pub(super) fn inverse(self) -> [f64; 2] {
        [self.0.cos(), -self.0.sin()]
    }

    /// Derivative of 1/μ with respect to θ.
    pub(super) fn inverse_by_angle(self) -> [f64; 2] {
        [-self.0.sin(), -self.0.cos()]
    }

    /// 1 − 1/μ.
    fn regeneration(self) -> [f64; 2] {
        let [re, im] = self.inverse();
        [1.0 - re, -im]
    }

    /// Derivative of 1 − 1/μ with respect to θ.
    fn regeneration_by_angle(self) -> [f64; 2] {
        self.inverse_by_angle().map(|part| -part)
    }
}

/// Mode equation at a node of a subinterval, linearized.
pub(super) struct AtModeNode<'a> {
    pub(super) map: &'a ToothPeriod<'a>,
    pub(super) subinterval: &'a Subinterval,
    pub(super) node: usize,
    pub(super) depth_m: f64,
    /// State of the orbit.
    pub(super) state: DVectorView<'a, f64>,
    /// Jacobian J of the equation of the orbit.
    pub(super) jacobian: &'a DMatrix<f64>,
    pub(super) layout: ModeLayout,
    pub(super) angle: CriticalAngle,
}

/// Matrix G and right-hand side of the mode equation at a node, with its explicit derivatives.
pub(super) struct ModeNode {
    /// Matrix G, real form.
    pub(super) matrix: DMatrix<f64>,
    /// Rate G v.
    pub(super) rate: DVector<f64>,
    /// Derivative of G v with respect to the state of the orbit, size × n.
    pub(super) by_state: DMatrix<f64>,
    /// Derivatives of G v with respect to the varied parameters, in their order.
    pub(super) by_parameter: DMatrix<f64>,
    /// Derivative of G v with respect to the angle θ.
    pub(super) by_angle: DVector<f64>,
}

impl AtModeNode<'_> {
    fn problem(&self) -> &ForcedProblem {
        self.map.problem
    }

    /// The mode equation at this node about a mode, with derivatives with respect to the parameters of `explicit`.
    pub(super) fn evaluate(&self, explicit: &Explicit<'_>, mode: DVectorView<'_, f64>) -> ModeNode {
        let (problem, layout) = (self.problem(), self.layout);
        let state = self.state.clone_owned();
        let per_depth = self.map.chip_per_depth(self.subinterval, self.node);
        let depth_m = problem.depth_at(&state, self.depth_m);
        let chip = &per_depth * depth_m;
        let regeneration = self.angle.regeneration();
        let turned = layout.product(&chip, mode);
        let rate = layout.product(self.jacobian, mode) + layout.times(regeneration, turned.as_view());
        let per_depth = layout.times(regeneration, layout.product(&per_depth, mode).as_view());
        let mut by_parameter = DMatrix::zeros(layout.size(), explicit.parameters.len());
        for (mut column, parameter) in by_parameter.column_iter_mut().zip(explicit.parameters) {
            column.copy_from(&self.by(*parameter, explicit.base, mode, &rate, &per_depth));
        }
        ModeNode {
            matrix: layout.matrix(self.jacobian, &chip, regeneration),
            by_state: self.by_state(mode, &per_depth),
            by_parameter,
            by_angle: layout.times(self.angle.regeneration_by_angle(), turned.as_view()),
            rate,
        }
    }

    /// ∂(G v)/∂x: the cubic terms −N″(x) v, and under axial-depth modulation the change of the depth. `per_depth` is the
    /// regenerative part of G v per axial depth.
    fn by_state(&self, mode: DVectorView<'_, f64>, per_depth: &DVector<f64>) -> DMatrix<f64> {
        let (problem, layout) = (self.problem(), self.layout);
        let mut by_state = DMatrix::zeros(layout.size(), layout.order);
        if let Some(cubic) = problem.cubic.as_ref() {
            let size = cubic.size();
            let state = self.state.as_slice();
            let (q, v) = (&state[..size], &state[size..2 * size]);
            for (i, j) in (0..size).flat_map(|i| (0..size).map(move |j| (i, j))) {
                let [by_q, by_v] = cubic.curvatures((i, j), q, v);
                for part in 0..layout.parts {
                    let row = layout.index(size + i, part);
                    by_state[(row, j)] -= by_q * mode[layout.index(j, part)];
                    by_state[(row, size + j)] -= by_v * mode[layout.index(size + j, part)];
                }
            }
        }
        if problem.linear.process.axial_depth_modulation {
            by_state -= per_depth * problem.linear.structure.c.row(2);
        }
        by_state
    }

    /// Explicit derivative of G v with respect to a parameter, as in [`explicit`](super::super::explicit) that of f.
    fn by(
        &self,
        parameter: Parameter,
        base: &ForcedProblem,
        mode: DVectorView<'_, f64>,
        rate: &DVector<f64>,
        per_depth: &DVector<f64>,
    ) -> DVector<f64> {
        let layout = self.layout;
        let damped = self
            .subinterval
            .damping
            .get(self.node)
            .map(|damping| layout.product(damping, mode));
        match parameter {
            Parameter::Depth => match damped {
                Some(damped) => per_depth - damped,
                None => per_depth.clone(),
            },
            Parameter::Rpm => {
                let flank =
                    damped.map_or_else(|| DVector::zeros(layout.size()), |damped| damped * self.depth_m);
                (flank - rate) / self.map.rpm
            }
            Parameter::Feed => self.by_feed(mode, per_depth),
            Parameter::Kappa | Parameter::Nu => {
                let slopes = base.cubic_slopes(parameter, self.state.as_slice());
                let mut by = layout.product(&slopes, mode);
                by.neg_mut();
                by
            }
        }
    }

    /// Derivative with respect to the feed per tooth f: that of the force under axial-depth modulation, and that of the
    /// slope of a power law of the chip, s ∝ f^(p − 1).
    fn by_feed(&self, mode: DVectorView<'_, f64>, per_depth: &DVector<f64>) -> DVector<f64> {
        let (problem, layout) = (self.problem(), self.layout);
        let mut by = DVector::zeros(layout.size());
        if let Some(exponent) = problem.chip_exponent() {
            let depth_m = problem.depth_at(&self.state.clone_owned(), self.depth_m);
            by += per_depth * (depth_m * (exponent - 1.0) / problem.linear.process.feed_per_tooth_m);
        }
        if problem.linear.process.axial_depth_modulation {
            let structure = &problem.linear.structure;
            let phase = self.subinterval.phase + self.subinterval.turn * self.map.gauss.nodes[self.node];
            let per_feed = problem.force_per_depth_and_feed(self.subinterval.teeth, phase);
            let matrix = (&structure.b * per_feed) * structure.c.row(2);
            by -= layout.product(&matrix, mode);
        }
        by
    }
}

/// Column of a matrix of values at the nodes.
pub(super) fn at_node(values: &DMatrix<f64>, node: usize) -> DVectorView<'_, f64> {
    let size = values.nrows();
    DVectorView::from_slice(&values.as_slice()[node * size..(node + 1) * size], size)
}
