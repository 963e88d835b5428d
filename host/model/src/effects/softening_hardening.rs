//! A spring that, for k3 < 0 < k5, softens and then hardens: f_r += k3·x³ + k5·x⁵. The ratio (k3·x³ + k5·x⁵)/x is then
//! least at x² = −k3/(2·k5).

use std::sync::Arc;

use num_complex::Complex64;

use super::local_force::LocalForce;
use super::{Argument, Class, EffectName, EffectSpec, Harmonic, Locations, Parameter, Treatment};
use super::{cubic_stiffness, quintic_stiffness};

/// The specification.
pub(super) const SOFTENING_HARDENING: EffectSpec = EffectSpec {
    id: EffectName::SofteningHardening,
    name: "softening-hardening",
    class: Class::RestoringForce(Argument::Displacement),
    locations: Locations::EachDirection,
    parameters: &[
        Parameter::number("k3_n_per_m3", "N/m³", "cubic stiffness, below 0")
            .linear()
            .main(),
        Parameter::number("k5_n_per_m5", "N/m⁵", "quintic stiffness, above 0").linear(),
    ],
    treatment: Treatment::Smooth,
    candidates: &["one law along one direction"],
    shares_term_with: &[EffectName::CubicStiffness, EffectName::QuinticStiffness],
    summary: "a spring softens at small and hardens at large displacement",
    equation: "f_r += k3·x³ + k5·x⁵, k3 < 0 < k5",
    shows: "a natural frequency that falls with the amplitude X and rises again beyond X² = −0.6·k3/k5; odd harmonics up to the fifth",
    hidden_by: "levels below the turn, where it is cubic stiffness; levels far beyond it, where it is quintic stiffness; two regimes with an edge between them are backlash",
    source: "Nayfeh and Mook, Nonlinear Oscillations (1979), ch. 4",
    example: "k3_n_per_m3 = -5e12\nk5_n_per_m5 = 2e21\ndirection = \"x\"",
    describing_function: Some(describing_function),
    build: |values| {
        Ok(Arc::new(LocalForce {
            id: EffectName::SofteningHardening,
            coefficients: [values.main("k3_n_per_m3")?, values.needed("k5_n_per_m5")?],
            law: |[k3, k5], x, _| x * x * x * (k3 + k5 * x * x),
            slopes: |[k3, k5], x, _| [x * x * (3.0 * k3 + 5.0 * k5 * x * x), 0.0],
            bends_at_rest: false,
            direction: values.direction()?,
        }))
    },
};

/// Describing functions at the displacement amplitude X: ¾X² of k3·x³ for k3 = 1, and ⅝X⁴ of k5·x⁵ for k5 = 1.
fn describing_function(at: Harmonic) -> [Complex64; 2] {
    let [cubic, _] = cubic_stiffness::describing_function(at);
    let [quintic, _] = quintic_stiffness::describing_function(at);
    [cubic, quintic]
}
