//! A damping force that grows with the cube of the velocity: f_r += c3·v³.

use std::sync::Arc;

use num_complex::Complex64;

use super::local_force::LocalForce;
use super::{Argument, Class, EffectName, EffectSpec, Locations, Parameter, Treatment};

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
    build: |values| {
        Ok(Arc::new(LocalForce {
            id: EffectName::CubicDamping,
            coefficients: [values.main("c3_ns3_per_m3")?, 0.0],
            law: |[c3, _], _, v| c3 * v.powi(3),
            slopes: |[c3, _], _, v| [0.0, 3.0 * c3 * v.powi(2)],
            describing_function: |[c3, _], amplitude, omega| c3 * describing_function(amplitude, omega),
            bends_at_rest: false,
            direction: values.direction()?,
        }))
    },
};

/// Describing function of c3·v³ for c3 = 1 at the displacement amplitude X, m, and ω, rad/s: ¾ω³X² in phase with the velocity.
pub fn describing_function(amplitude: f64, omega: f64) -> Complex64 {
    Complex64::new(0.0, 0.75 * omega.powi(3) * amplitude * amplitude)
}
