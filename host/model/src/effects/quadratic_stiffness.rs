//! A spring that is stiffer to one side: f_r += k2·x².

use std::sync::Arc;

use num_complex::Complex64;

use super::local_force::LocalForce;
use super::{Argument, Class, EffectName, EffectSpec, Locations, Parameter, Treatment};

/// The specification.
pub(super) const QUADRATIC_STIFFNESS: EffectSpec = EffectSpec {
    id: EffectName::QuadraticStiffness,
    name: "quadratic-stiffness",
    class: Class::RestoringForce(Argument::Displacement),
    locations: Locations::EachDirection,
    parameters: &[Parameter::number("k2_n_per_m2", "N/m²", "quadratic stiffness")
        .linear()
        .main()],
    treatment: Treatment::Smooth,
    candidates: &["one law along one direction"],
    shares_term_with: &[],
    summary: "a spring that is stiffer to one side",
    equation: "f_r += k2·x²",
    shows: "a second harmonic and an offset, both with the amplitude squared",
    hidden_by: "it moves no frequency to first order and has no odd harmonics; a static preload on a cubic spring has the same term",
    source: "Worden and Tomlinson, Nonlinearity in Structural Dynamics (2001), ch. 2",
    example: "k2_n_per_m2 = 2e9\ndirection = \"x\"",
    // An even function of x has no component at the fundamental frequency.
    describing_function: Some(|_| [Complex64::ZERO; 2]),
    build: |values| {
        Ok(Arc::new(LocalForce {
            id: EffectName::QuadraticStiffness,
            coefficients: [values.main("k2_n_per_m2")?, 0.0],
            law: |[k2, _], x, _| k2 * x.powi(2),
            slopes: |[k2, _], x, _| [2.0 * k2 * x, 0.0],
            bends_at_rest: false,
            direction: values.direction()?,
        }))
    },
};
