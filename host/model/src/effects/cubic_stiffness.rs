//! A cubic spring: f_r += k3·x³.

use std::sync::Arc;

use num_complex::Complex64;

use super::local_force::LocalForce;
use super::{Argument, Class, EffectName, EffectSpec, Harmonic, Locations, Parameter, Treatment};

/// The specification.
pub(super) const CUBIC_STIFFNESS: EffectSpec = EffectSpec {
    id: EffectName::CubicStiffness,
    name: "cubic-stiffness",
    class: Class::RestoringForce(Argument::Displacement),
    locations: Locations::EachDirection,
    parameters: &[Parameter::number("k3_n_per_m3", "N/m³", "cubic stiffness")
        .linear()
        .main()],
    treatment: Treatment::Smooth,
    candidates: &["one law along one direction, or a law along each"],
    shares_term_with: &[EffectName::SofteningHardening],
    summary: "a restoring force grows with the cube of the displacement",
    equation: "f_r += k3·x³",
    shows: "a natural frequency that moves with the amplitude squared, and odd harmonics, the third first, at two levels or in a free decay",
    hidden_by: "recordings at one level; softening-hardening below its turn; it shows no even harmonics, no offset and no damping that depends on amplitude",
    source: "Worden and Tomlinson, Nonlinearity in Structural Dynamics (2001), ch. 2; Kerschen et al., MSSP 20 (2006)",
    example: "k3_n_per_m3 = -5e12\ndirection = \"x\"",
    describing_function: Some(describing_function),
    build: |values| {
        Ok(Arc::new(LocalForce {
            id: EffectName::CubicStiffness,
            coefficients: [values.main("k3_n_per_m3")?, 0.0],
            law: |[k3, _], x, _| k3 * x.powi(3),
            slopes: |[k3, _], x, _| [3.0 * k3 * x.powi(2), 0.0],
            bends_at_rest: false,
            direction: values.direction()?,
        }))
    },
};

/// Describing function of k3·x³ for k3 = 1: ¾X².
pub(super) fn describing_function(Harmonic { amplitude_m, .. }: Harmonic) -> [Complex64; 2] {
    [
        Complex64::new(0.75 * amplitude_m * amplitude_m, 0.0),
        Complex64::ZERO,
    ]
}
