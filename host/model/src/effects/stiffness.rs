//! The stiffness differs from the case: K → K·(1 + r).

use super::linear_change::{Matrix, RELATIVE_CHANGE, build};
use super::{Argument, Class, EffectName, EffectSpec, Locations, Parameter, Prior, Treatment};

/// The specification.
pub(super) const STIFFNESS: EffectSpec = EffectSpec {
    id: EffectName::Stiffness,
    name: "stiffness",
    class: Class::RestoringForce(Argument::Displacement),
    locations: Locations::WholeOrDirection,
    parameters: &[
        Parameter::number(
            "stiffness_n_per_m",
            "N/m",
            "diagonal entry of the stiffness matrix",
        )
        .within(Prior::POSITIVE),
        Parameter::number("frequency_hz", "Hz", "frequency of a single mode").within(Prior::POSITIVE),
        RELATIVE_CHANGE,
    ],
    treatment: Treatment::LinearStructure,
    candidates: &["the whole matrix, or one diagonal entry"],
    shares_term_with: &[],
    summary: "the stiffness differs from the case",
    equation: "K → K·(1 + r)",
    shows: "a receptance that differs below resonance, alike at all levels",
    hidden_by: "mass, stiffness and damping changed by one factor, which is a sensor gain",
    source: "Pintelon and Schoukens, System Identification (2012)",
    example: "relative_change = -0.1\ndirection = \"y\"",
    describing_function: None,
    build: |values| build(Matrix::Stiffness, values),
};
