//! A damping force that grows with the cube of the velocity: f_r += c3·v³.

use std::sync::Arc;

use num_complex::Complex64;

use super::local_force::LocalForce;
use super::{Argument, Class, EffectName, EffectSpec, Harmonic, Locations, Parameter, Treatment};

/// The specification.
pub(super) const CUBIC_DAMPING: EffectSpec = EffectSpec {
    id: EffectName::CubicDamping,
    name: "cubic-damping",
    class: Class::RestoringForce(Argument::Velocity),
    locations: Locations::EachDirection,
    parameters: &[Parameter::number("c3_ns3_per_m3", "N s³/m³", "cubic damping")
        .linear()
        .main()],
    treatment: Treatment::Smooth,
    candidates: &["one law along one direction, or a law along each"],
    shares_term_with: &[],
    summary: "a damping force grows with the cube of the velocity",
    equation: "f_r += c3·v³",
    shows: "damping that grows with the velocity squared, and a third harmonic in phase with the velocity, at two levels or in a free decay",
    hidden_by: "recordings at one level, where it is damping; it moves no frequency",
    source: "Worden and Tomlinson, Nonlinearity in Structural Dynamics (2001), ch. 2",
    example: "c3_ns3_per_m3 = 4e6\ndirection = \"y\"",
    describing_function: Some(describing_function),
    build: |values| {
        Ok(Arc::new(LocalForce {
            id: EffectName::CubicDamping,
            coefficients: [values.main("c3_ns3_per_m3")?, 0.0],
            law: |[c3, _], _, v| c3 * v.powi(3),
            slopes: |[c3, _], _, v| [0.0, 3.0 * c3 * v.powi(2)],
            bends_at_rest: false,
            direction: values.direction()?,
        }))
    },
};

/// Describing function of c3·v³ for c3 = 1: ¾ω³X² in phase with the velocity.
fn describing_function(at: Harmonic) -> [Complex64; 2] {
    let damping = 0.75 * at.omega.powi(3) * at.amplitude_m * at.amplitude_m;
    [Complex64::new(0.0, damping), Complex64::ZERO]
}
