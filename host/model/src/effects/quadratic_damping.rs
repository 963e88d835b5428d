//! A damping force that grows with the square of the velocity: f_r += c2·|v|·v.

use std::f64::consts::PI;
use std::sync::Arc;

use num_complex::Complex64;

use super::local_force::LocalForce;
use super::{Argument, Class, EffectName, EffectSpec, Harmonic, Locations, Parameter, Treatment};

/// The specification.
pub(super) const QUADRATIC_DAMPING: EffectSpec = EffectSpec {
    id: EffectName::QuadraticDamping,
    name: "quadratic-damping",
    class: Class::RestoringForce(Argument::Velocity),
    locations: Locations::EachDirection,
    parameters: &[Parameter::number("c2_ns2_per_m2", "N s²/m²", "quadratic damping")
        .linear()
        .main()],
    // The force is smooth enough for a Jacobian: the derivative 2·|v| of |v|·v is continuous. Only the second
    // derivative of |v|·v jumps, at v = 0.
    treatment: Treatment::Smooth,
    candidates: &["one law along one direction, or a law along each"],
    shares_term_with: &[],
    summary: "a damping force grows with the square of the velocity",
    equation: "f_r += c2·|v|·v",
    shows: "damping that grows in proportion to the velocity, and odd harmonics in phase with it, at two levels or in a free decay",
    hidden_by: "recordings at one level, where it is damping; it moves no frequency",
    source: "Worden and Tomlinson, Nonlinearity in Structural Dynamics (2001), ch. 2",
    example: "c2_ns2_per_m2 = 600.0\ndirection = \"x\"",
    describing_function: Some(describing_function),
    build: |values| {
        Ok(Arc::new(LocalForce {
            id: EffectName::QuadraticDamping,
            coefficients: [values.main("c2_ns2_per_m2")?, 0.0],
            law: |[c2, _], _, v| c2 * v.abs() * v,
            slopes: |[c2, _], _, v| [0.0, 2.0 * c2 * v.abs()],
            bends_at_rest: true,
            direction: values.direction()?,
        }))
    },
};

/// Describing function of c2·|v|·v for c2 = 1: 8/(3π)·ω²·X in phase with the velocity, which is an equivalent damping
/// of 8/(3π)·ω·X.
fn describing_function(at: Harmonic) -> [Complex64; 2] {
    let damping = 8.0 / (3.0 * PI) * at.omega * at.omega * at.amplitude_m;
    [Complex64::new(0.0, damping), Complex64::ZERO]
}
