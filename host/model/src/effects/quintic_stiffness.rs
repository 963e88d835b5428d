//! A quintic spring: f_r += k5·x⁵.

use std::sync::Arc;

use num_complex::Complex64;

use super::local_force::LocalForce;
use super::{Argument, Class, EffectName, EffectSpec, Harmonic, Locations, Parameter, Treatment};

/// The specification.
pub(super) const QUINTIC_STIFFNESS: EffectSpec = EffectSpec {
    id: EffectName::QuinticStiffness,
    name: "quintic-stiffness",
    class: Class::RestoringForce(Argument::Displacement),
    locations: Locations::EachDirection,
    parameters: &[Parameter::number("k5_n_per_m5", "N/m⁵", "quintic stiffness")
        .linear()
        .main()],
    treatment: Treatment::Smooth,
    candidates: &["one law along one direction, or a law along each"],
    shares_term_with: &[EffectName::SofteningHardening],
    summary: "a restoring force grows with the fifth power of the displacement",
    equation: "f_r += k5·x⁵",
    shows: "a natural frequency that moves with the fourth power of the amplitude, and odd harmonics up to the fifth, at three levels or in a free decay",
    hidden_by: "recordings at one level, where it is cubic stiffness; softening-hardening far beyond its turn; it shows no even harmonics, no offset and no damping that depends on amplitude",
    source: "Nayfeh and Mook, Nonlinear Oscillations (1979), ch. 4",
    example: "k5_n_per_m5 = 2e21\ndirection = \"x\"",
    describing_function: Some(describing_function),
    build: |values| {
        Ok(Arc::new(LocalForce {
            id: EffectName::QuinticStiffness,
            coefficients: [values.main("k5_n_per_m5")?, 0.0],
            law: |[k5, _], x, _| k5 * x.powi(5),
            slopes: |[k5, _], x, _| [5.0 * k5 * x.powi(4), 0.0],
            bends_at_rest: false,
            direction: values.direction()?,
        }))
    },
};

/// Describing function of k5·x⁵ for k5 = 1: ⅝X⁴.
pub(super) fn describing_function(Harmonic { amplitude_m, .. }: Harmonic) -> [Complex64; 2] {
    [Complex64::new(0.625 * amplitude_m.powi(4), 0.0), Complex64::ZERO]
}
