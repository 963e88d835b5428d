//! Parameters of the structure that the case states as uncertain.

use nalgebra::DVector;

use quietcut_model::case::{Case, Parameter};
use quietcut_model::structure::Structure;
use quietcut_stability::Variable;

/// Independent variables of a structure, standard normal before the records are seen, and where a baseline is among them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Uncertain {
    /// Parameters that vary together.
    pub variables: Vec<Variable>,
    /// Values of the variables at the baseline: zero for the case as it is.
    pub at: DVector<f64>,
    /// Their most probable values if the case has no cause.
    pub nearest: DVector<f64>,
}

impl Uncertain {
    /// The uncertain parameters of the structure of a case.
    pub(crate) fn of_case(case: &Case) -> Self {
        let is_of_structure = |variable: &Variable| {
            variable
                .parts()
                .iter()
                .any(|part| part.parameter.value(case).is_some() && is_of_structure(part.parameter))
        };
        let variables: Vec<Variable> = Variable::of_case(case)
            .into_iter()
            .filter(is_of_structure)
            .collect();
        Self {
            at: DVector::zeros(variables.len()),
            nearest: DVector::zeros(variables.len()),
            variables,
        }
    }

    /// Number of variables.
    pub(crate) fn len(&self) -> usize {
        self.variables.len()
    }

    /// The case of a baseline at other values `z` of the variables; `None` if a parameter is then not possible.
    pub(crate) fn moved(&self, baseline: &Case, z: &DVector<f64>) -> Option<Case> {
        let mut case = baseline.clone();
        Variable::shift_all(&self.variables, &(z - &self.at), &mut case).then_some(case)
    }

    /// The structure of a baseline at other values `z` of the variables; `None` if a parameter is then not possible.
    pub(crate) fn structure(&self, baseline: &Case, z: &DVector<f64>) -> Option<Structure> {
        self.moved(baseline, z)?.structure
    }
}

fn is_of_structure(parameter: Parameter) -> bool {
    use Parameter as P;
    match parameter {
        P::Mass(..)
        | P::Damping(..)
        | P::Stiffness(..)
        | P::CubicDamping(..)
        | P::CubicStiffness(..)
        | P::Frequency(..)
        | P::DampingRatio(..)
        | P::Left(..)
        | P::Right(..)
        | P::JointStiffness(..)
        | P::JointDamping(..)
        | P::JointCubicStiffness(..)
        | P::JointCubicDamping(..)
        | P::LinkMass(..) => true,
        P::EdgeAngle
        | P::RunoutOffset
        | P::RunoutAngle
        | P::Ktc
        | P::Krc
        | P::Kac
        | P::Kte
        | P::Kre
        | P::Kae
        | P::Start
        | P::Exit
        | P::FeedPerTooth
        | P::FeedDirection => false,
    }
}
