//! Explicit derivatives of the equation of a forced orbit with respect to the varied parameters.
//!
//! On a subinterval of duration h the collocation equations contain h f(t, x; p). The derivative with respect to p of
//! that product, divided by h, is
//!
//!   depth w:   B (force per depth) − D x,
//!   speed n:   −(f + T ∂f/∂T)/n, since h is proportional to the tooth period T, T ∝ 1/n; only process damping D ∝ T
//!              makes f depend on T,
//!   feed:      B (w − z) Σ_teeth cutting·s·n_x, with the slope s of the chip law,
//!   κ, ν:      −N(x) of the cubic stiffness or damping with the factor 1,
//!
//! in the symbols of [`ForcedProblem`].

use nalgebra::{DMatrix, DVector};

use super::forced::ForcedProblem;
use super::parameter::Parameter;
use super::tooth_period::{Subinterval, ToothPeriod};

/// Parameters with respect to which a period is differentiated.
#[derive(Clone, Copy, Debug)]
pub(super) struct Explicit<'a> {
    /// Problem whose cubic terms have the factors κ = ν = 1.
    pub(super) base: &'a ForcedProblem,
    /// Parameters, in the order of the columns of derivatives.
    pub(super) parameters: &'a [Parameter],
}

/// State at a node of a subinterval, with its time derivative.
pub(super) struct AtNode<'a> {
    pub(super) subinterval: &'a Subinterval,
    pub(super) node: usize,
    pub(super) state: &'a [f64],
    pub(super) rate: &'a DVector<f64>,
    pub(super) depth_m: f64,
}

impl Explicit<'_> {
    /// Derivatives with respect to the parameters at a node, n states × number of parameters, in the units of
    /// computations.
    pub(super) fn columns(&self, map: &ToothPeriod<'_>, at: &AtNode<'_>) -> DMatrix<f64> {
        let mut columns = DMatrix::zeros(at.state.len(), self.parameters.len());
        for (mut column, parameter) in columns.column_iter_mut().zip(self.parameters) {
            column.copy_from(&self.derivative(map, at, *parameter));
        }
        columns
    }

    fn derivative(&self, map: &ToothPeriod<'_>, at: &AtNode<'_>, parameter: Parameter) -> DVector<f64> {
        let problem = map.problem;
        let structure = &problem.linear.structure;
        let state = DVector::from_column_slice(at.state);
        let damped = at
            .subinterval
            .damping
            .get(at.node)
            .map(|damping| damping * &state);
        match parameter {
            Parameter::Depth => {
                let push: DVector<f64> = &structure.b * at.subinterval.forces[at.node];
                match damped {
                    Some(damped) => push - damped,
                    None => push,
                }
            }
            Parameter::Rpm => {
                let flank = damped.map_or_else(|| DVector::zeros(state.len()), |damped| damped * at.depth_m);
                (flank - at.rate) / map.rpm
            }
            Parameter::Feed => {
                let phase = at.subinterval.phase + at.subinterval.turn * map.gauss.nodes[at.node];
                let per_feed = problem.force_per_depth_and_feed(at.subinterval.teeth, phase);
                &structure.b * (per_feed * problem.depth_at(&state, at.depth_m))
            }
            Parameter::Kappa | Parameter::Nu => -self.base.cubic_part(parameter, at.state),
        }
    }
}
