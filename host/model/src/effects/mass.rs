//! The mass differs from the case: M → M·(1 + r).

use super::linear_change::{Matrix, RELATIVE_CHANGE, build};
use super::{Class, EffectName, EffectSpec, Locations, Parameter, Prior, Treatment};

/// The specification.
pub(super) const MASS: EffectSpec = EffectSpec {
    id: EffectName::Mass,
    name: "mass",
    class: Class::Inertia,
    locations: Locations::WholeOrDirection,
    parameters: &[
        Parameter::number("mass_kg", "kg", "diagonal entry of the mass matrix").within(Prior::POSITIVE),
        RELATIVE_CHANGE,
    ],
    treatment: Treatment::LinearStructure,
    candidates: &["the whole matrix, or one diagonal entry"],
    shares_term_with: &[],
    summary: "the mass differs from the case",
    equation: "M → M·(1 + r)",
    shows: "a receptance that differs above resonance, alike at all levels",
    hidden_by: "mass, stiffness and damping changed by one factor, which is a sensor gain",
    source: "Pintelon and Schoukens, System Identification (2012)",
    example: "relative_change = 0.1\ndirection = \"x\"",
    describing_function: None,
    build: |values| build(Matrix::Mass, values),
};
