//! The damping differs from the case, by a relative change r or by an absolute value; see `linear_change`.

use super::linear_change::{Matrix, RELATIVE_CHANGE, build};
use super::{Argument, Class, EffectName, EffectSpec, Locations, Parameter, Prior, Treatment};

/// The specification.
pub(super) const DAMPING: EffectSpec = EffectSpec {
    id: EffectName::Damping,
    name: "damping",
    class: Class::RestoringForce(Argument::Velocity),
    locations: Locations::WholeOrDirection,
    parameters: &[
        Parameter::number(
            "damping_ns_per_m",
            "N s/m",
            "diagonal entry of the damping matrix",
        )
        .within(Prior::POSITIVE),
        Parameter::number("damping_ratio", "", "damping ratio of a single mode").within(Prior::POSITIVE),
        RELATIVE_CHANGE,
    ],
    treatment: Treatment::LinearStructure,
    candidates: &["the whole matrix, or one diagonal entry"],
    shares_term_with: &[],
    summary: "the damping differs from the case",
    equation: "C → C·(1 + r)",
    shows: "a receptance that differs at resonance, alike at all levels",
    hidden_by: "mass, stiffness and damping changed by one factor, which is a sensor gain",
    source: "Pintelon and Schoukens, System Identification (2012)",
    example: "relative_change = 0.3\ndirection = \"x\"",
    describing_function: None,
    build: |values| build(Matrix::Damping, values),
};
