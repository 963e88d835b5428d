//! Bouc–Wen hysteresis: f_r += k_h·(z − x), ż = v·(1 − |z/z_y|ⁿ·(γ·sgn(v·z) + β)).
//!
//! γ and β are shape parameters with γ + β = 1, so that z saturates at ±z_y. At motion much smaller than z_y about
//! x = z = 0, z ≈ x and f_r ≈ 0.

use std::f64::consts::PI;
use std::sync::Arc;

use num_complex::Complex64;
use quietcut_numerics::roots::bisection;

use super::location::{along, axis_of};
use super::{
    Argument, Class, Effect, EffectError, EffectName, EffectSpec, Harmonic, Locations, Parameter, Prior,
    Treatment,
};
use crate::structure::{Direction, Structure};
use crate::{MotionState, Regime, RestoringForce};

/// The specification.
pub(super) const HYSTERESIS: EffectSpec = EffectSpec {
    id: EffectName::Hysteresis,
    name: "hysteresis",
    class: Class::RestoringForce(Argument::Velocity),
    locations: Locations::EachDirection,
    parameters: &[
        Parameter::number(
            "hysteretic_stiffness_n_per_m",
            "N/m",
            "stiffness of the loop before it yields, k_h",
        )
        .linear()
        .main(),
        Parameter::number("yield_m", "m", "largest elastic deflection, z_y").within(Prior::POSITIVE),
        Parameter::number(
            "exponent",
            "",
            "sharpness of the transition, n; 1 without the key",
        )
        .within(EXPONENT),
        Parameter::number(
            "gamma",
            "",
            "shape of the loop, γ, with β = 1 − γ; 0.5 without the key",
        )
        .within(ZERO_TO_ONE),
    ],
    treatment: Treatment::Equivalent,
    candidates: &["a Bouc–Wen loop"],
    shares_term_with: &[],
    summary: "a Bouc–Wen hysteresis loop",
    equation: "f_r += k_h·(z − x), ż = v·(1 − |z/z_y|ⁿ·(γ·sgn(v·z) + β))",
    shows: "loops of force over displacement that do not depend on speed; stiffness that falls, damping that rises and falls again with amplitude",
    hidden_by: "large slip, where it is friction and less stiffness; it has no even harmonics",
    source: "Wen, J. Eng. Mech. Div. ASCE 102 (1976)",
    example: "hysteretic_stiffness_n_per_m = 2e5\nyield_m = 1e-5\nexponent = 1.5\ngamma = 0.6\ndirection = \"x\"",
    describing_function: Some(describing_function),
    build: |values| {
        Ok(Arc::new(Hysteresis {
            stiffness: values.main("hysteretic_stiffness_n_per_m")?,
            yield_m: values.needed("yield_m")?,
            exponent: values.number("exponent")?.unwrap_or(1.0),
            gamma: values.number("gamma")?.unwrap_or(0.5),
            direction: values.direction()?,
        }))
    },
};

const EXPONENT: Prior = Prior::from(1.0, "a number of 1 or more");
const ZERO_TO_ONE: Prior = Prior {
    closed: [true; 2],
    ..Prior::open(0.0, 1.0, "a number from 0 to 1")
};

/// Describing function of z − x, a Bouc–Wen element of stiffness 1 N/m minus the linear spring, for n = 1 and
/// γ = β = ½.
///
/// With n = 1 and γ = β the element is linear while it unloads, and saturates exponentially while it loads.
fn describing_function(at: Harmonic) -> [Complex64; 2] {
    let (amplitude, yield_m) = (at.amplitude_m, at.bend_m);
    // Half a period from the upper to the lower peak of x: z unloads from +z₀ with slope 1 to 0, then loads over the
    // rest s = 2X − z₀ of the stroke as z = −z_y(1 − e^{−s/z_y}), to −z₀: in the steady loop, reached(z₀) = z₀.
    let stroke = 2.0 * amplitude;
    let reached = |z: f64| -yield_m * (-(stroke - z) / yield_m).exp_m1();
    let [low, high] = bisection([0.0, yield_m.min(stroke)], 0.0, |z| reached(z) > z);
    let top = 0.5 * (low + high);
    let count = 256;
    let mut sum = Complex64::ZERO;
    // Fourier integral over half a period, x = X·cos p from the upper peak down; the other half contributes the same by
    // symmetry.
    for k in 0..count {
        let p = PI * (f64::from(k) + 0.5) / f64::from(count);
        let gone = amplitude * (1.0 - p.cos());
        let z = if gone <= top {
            top - gone
        } else {
            yield_m * (-(gone - top) / yield_m).exp_m1()
        };
        let rest = z - amplitude * p.cos();
        // Products of z − x with cos p, as the displacement, and with −sin p, as the velocity.
        sum += Complex64::new(rest * p.cos(), -rest * p.sin());
    }
    [sum * (2.0 / (f64::from(count) * amplitude)), Complex64::ZERO]
}

#[derive(Clone, Copy, Debug)]
struct Hysteresis {
    stiffness: f64,
    yield_m: f64,
    exponent: f64,
    gamma: f64,
    direction: Option<Direction>,
}

#[derive(Debug)]
struct BoucWen {
    effect: Hysteresis,
    axis: usize,
}

/// Bit of a Bouc–Wen regime number that is set for negative velocity.
const BACKWARD: Regime = 1;
/// Bit of a Bouc–Wen regime number that is set for a negative hysteretic displacement z.
const NEGATIVE: Regime = 2;

impl Effect for Hysteresis {
    fn id(&self) -> EffectName {
        EffectName::Hysteresis
    }

    fn restoring_forces(&self, structure: &Structure) -> Result<Vec<Box<dyn RestoringForce>>, EffectError> {
        let axis = axis_of(structure, self.direction, self.name())?;
        Ok(vec![Box::new(BoucWen { effect: *self, axis })])
    }
}

impl BoucWen {
    fn signs(regime: Regime) -> (f64, f64) {
        let sign = |bit| if regime & bit == 0 { 1.0 } else { -1.0 };
        (sign(BACKWARD), sign(NEGATIVE))
    }
}

impl RestoringForce for BoucWen {
    fn states(&self) -> usize {
        1
    }

    fn restoring_n(&self, _: Regime, at: &MotionState, own: &[f64]) -> [f64; 3] {
        along(self.axis, self.effect.stiffness * (own[0] - at.x[self.axis]))
    }

    fn describing_function(&self, amplitude_m: f64, omega: f64) -> Option<Complex64> {
        let has_closed_form = self.effect.exponent == 1.0 && self.effect.gamma == 0.5;
        let at = Harmonic::new(amplitude_m, omega).with_bend_m(self.effect.yield_m);
        has_closed_form.then(|| self.effect.stiffness * describing_function(at)[0])
    }

    fn rate(&self, regime: Regime, at: &MotionState, own: &[f64], rate: &mut [f64]) {
        let (of_velocity, of_z) = Self::signs(regime);
        let Hysteresis {
            yield_m,
            exponent,
            gamma,
            ..
        } = self.effect;
        // Within a regime of the Bouc–Wen law the sign of z is constant. If a stage of the integrator lies beyond the
        // end of the regime, where z has the other sign, the power −|z/z_y|ⁿ continues the law without a kink.
        let share = of_z * own[0] / yield_m;
        let power = share.signum() * share.abs().powf(exponent);
        let shape = gamma * of_velocity * of_z + (1.0 - gamma);
        rate[0] = at.v[self.axis] * (1.0 - power * shape);
    }

    /// With γ + β = 1, z stays within ±z_y; only an integration error exceeds this range.
    fn confine(&self, own: &mut [f64]) {
        own[0] = own[0].clamp(-self.effect.yield_m, self.effect.yield_m);
    }

    fn margin(&self, regime: Regime, at: &MotionState, own: &[f64], _: f64) -> f64 {
        let (of_velocity, of_z) = Self::signs(regime);
        // Velocity and hysteretic displacement z have different units, but the smaller of them, each times its sign in
        // the regime, is negative exactly if at least one has changed its sign.
        (of_velocity * at.v[self.axis]).min(of_z * own[0])
    }

    fn next(&self, before: Option<Regime>, at: &MotionState, own: &[f64], _: f64) -> Regime {
        let mut regime = 0;
        if at.v[self.axis] < 0.0 {
            regime |= BACKWARD;
        }
        if own[0] < 0.0 {
            regime |= NEGATIVE;
        }
        let Some(before) = before else { return regime };
        // A Bouc–Wen regime ends where velocity or z becomes zero. Of the two, each times its sign in the ended regime,
        // the smaller has changed its sign in the next regime.
        let (of_velocity, of_z) = Self::signs(before);
        let (v, z) = (of_velocity * at.v[self.axis], of_z * own[0]);
        // One of the two is at zero, the other inside its regime: their units do not matter.
        if v < z {
            before ^ BACKWARD
        } else {
            before ^ NEGATIVE
        }
    }
}
