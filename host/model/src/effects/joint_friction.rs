//! Microslip of bolted and clamped joints: f_r += F_J(x) − K_T·x.
//!
//! The joint is a sum of elastic sliders in parallel (Iwan), F_J = ∫ρ(φ)·(x − x_φ) dφ: the slider of the strength φ, m,
//! sticks at x_φ and slips while |x − x_φ| = φ. Its stiffness at rest, K_T = ∫ρ dφ, is part of the structure. Below the
//! displacement slip_m of complete slip the density is ρ = R·φ^χ, −1 < χ ≤ 0, and the backbone of the force is
//! −s·x·(|x|/x_ref)^e with e = χ + 1 and R = s·e·(e + 1)/x_ref^e. At slip_m stand further sliders,
//! S·δ(φ − slip_m), β = S·e/(R·slip_m^e): then K_T = s·(e + 1)·(1 + β)·(slip_m/x_ref)^e, and beyond slip_m
//! F_J stays at s·slip_m·(slip_m/x_ref)^e·(e + β·(e + 1)). After a reversal the force follows Masing's rules, which are
//! exact for this sum.

use std::f64::consts::PI;
use std::sync::Arc;

use num_complex::Complex64;
use quietcut_numerics::quadrature::Gauss;

use super::location::{along, axis_of};
use super::masing_memory::{self, Branch, STATES};
use super::{
    Argument, Class, Effect, EffectError, EffectName, EffectSpec, Locations, Parameter, Prior, Treatment,
};
use crate::structure::{Direction, Structure};
use crate::{MotionState, Regime, RestoringForce};

/// The specification.
pub(super) const JOINT_FRICTION: EffectSpec = EffectSpec {
    id: EffectName::JointFriction,
    name: "joint-friction",
    class: Class::RestoringForce(Argument::Velocity),
    locations: Locations::EachDirection,
    parameters: &[
        Parameter::number(
            "softening_n_per_m",
            "N/m",
            "secant stiffness that is lost at the displacement reference_m of first loading, s",
        )
        .linear()
        .main()
        .within(Prior::not_negative("a stiffness of 0 or more")),
        Parameter::number(
            "exponent",
            "",
            "power of the amplitude with which stiffness is lost, e",
        )
        .within(UP_TO_ONE),
        Parameter::number("reference_m", "m", "displacement of softening_n_per_m, x_ref")
            .within(Prior::POSITIVE),
        Parameter::number(
            "slip_m",
            "m",
            "displacement from which the whole joint slips; none without the key",
        )
        .within(Prior::POSITIVE),
        Parameter::number(
            "beta",
            "",
            "stiffness of the sliders that slip only at slip_m over that of the others, β; 0 without the key",
        )
        .within(Prior::not_negative("a number of 0 or more")),
    ],
    treatment: Treatment::Equivalent,
    candidates: &["microslip alone", "microslip, and slip of the whole joint"],
    shares_term_with: &[],
    summary: "microslip of a bolted or clamped joint",
    equation: "f_r += F_J(x) − K_T·x; backbone −s·x·(|x|/x_ref)^e with Masing's rules; F_J constant beyond slip_m",
    shows: "loss cω and softening that both grow with the power e of the amplitude X, in the ratio 4e/(π(e + 2)) to the softening s·(X/x_ref)^e, at two levels or in a free decay",
    hidden_by: "recordings at one level, where it is less stiffness and more damping; it does not depend on speed and has no even harmonics",
    source: "Segalman, J. Appl. Mech. 72 (2005); Iwan, J. Appl. Mech. 33 (1966)",
    example: "softening_n_per_m = 2e5\nexponent = 0.6\nreference_m = 1e-5\nslip_m = 4e-5\nbeta = 0.5\ndirection = \"x\"",
    describing_function: None,
    build: |values| {
        let softening = values.main("softening_n_per_m")?;
        let slip_m = values.number("slip_m")?;
        let beta = values.number("beta")?;
        if let (None, Some(beta)) = (slip_m, beta) {
            return Err(values.clash("beta", beta, "slip_m: those sliders slip there, so that it"));
        }
        Ok(Arc::new(JointFriction {
            law: Law {
                softening,
                exponent: values.needed("exponent")?,
                reference_m: values.needed("reference_m")?,
                slip_m: slip_m.unwrap_or(f64::INFINITY),
                beta: beta.unwrap_or(0.0),
            },
            direction: values.direction()?,
        }))
    },
};

const UP_TO_ONE: Prior = Prior {
    closed: [false, true],
    ..Prior::open(0.0, 1.0, "a number above 0 and up to 1")
};

#[derive(Clone, Copy, Debug)]
struct Law {
    softening: f64,
    exponent: f64,
    reference_m: f64,
    /// Infinite without complete slip.
    slip_m: f64,
    beta: f64,
}

#[derive(Clone, Copy, Debug)]
struct JointFriction {
    law: Law,
    direction: Option<Direction>,
}

#[derive(Debug)]
struct Joint {
    law: Law,
    axis: usize,
}

/// Regime of positive velocity.
const FORWARD: Regime = 0;
const BACKWARD: Regime = 1;

impl Effect for JointFriction {
    fn id(&self) -> EffectName {
        EffectName::JointFriction
    }

    fn restoring_forces(&self, structure: &Structure) -> Result<Vec<Box<dyn RestoringForce>>, EffectError> {
        let axis = axis_of(structure, self.direction, self.name())?;
        Ok(vec![Box::new(Joint { law: self.law, axis })])
    }
}

impl Law {
    /// Backbone of the force over the softening s, m.
    fn backbone(&self, x: f64) -> f64 {
        let (size, e) = (x.abs(), self.exponent);
        if size <= self.slip_m {
            return -x * (size / self.reference_m).powf(e);
        }
        let at_slip = (self.slip_m / self.reference_m).powf(e);
        let stiffness = at_slip * (e + 1.0) * (1.0 + self.beta);
        let slipping_m = at_slip * self.slip_m * (e + self.beta * (e + 1.0));
        (slipping_m - stiffness * size) * x.signum()
    }

    /// Describing function over the softening s, by quadrature of the branch from x = X·cos p down to −X. Below slip_m
    /// its imaginary part is 4e/(π(e + 2))·(X/x_ref)^e, and its real part −c₁·(X/x_ref)^e with
    /// c₁ = 4(e + 1)·Γ(e + 3/2)/(√π·(e + 2)·Γ(e + 2)), between 1 and 1.02.
    fn describing_function(&self, amplitude_m: f64) -> Complex64 {
        let top = self.backbone(amplitude_m);
        // The branch bends where all sliders slip: (X − x)/2 = slip_m.
        let bend = (1.0 - 2.0 * self.slip_m / amplitude_m).max(-1.0).acos();
        let gauss = Gauss::shared(40);
        let mut sum = Complex64::ZERO;
        for [from, to] in [[0.0, bend], [bend, PI]] {
            for (node, weight) in gauss.nodes.iter().zip(&gauss.weights) {
                let (sin, cos) = (from + (to - from) * node).sin_cos();
                let value = top - 2.0 * self.backbone(0.5 * amplitude_m * (1.0 - cos));
                sum += weight * (to - from) * value * Complex64::new(cos, -sin);
            }
        }
        sum * (2.0 / (PI * amplitude_m))
    }
}

impl Joint {
    fn branch(&self, own: &[f64]) -> Branch {
        Branch::of(own, &|x| self.law.backbone(x))
    }
}

impl RestoringForce for Joint {
    fn states(&self) -> usize {
        STATES
    }

    fn remembers(&self) -> bool {
        true
    }

    fn begin(&self, at: &MotionState, own: &mut [f64]) {
        masing_memory::begin(own, at.x[self.axis], at.v[self.axis]);
    }

    fn enter(&self, regime: Regime, at: &MotionState, own: &mut [f64]) {
        let forward = regime == FORWARD;
        masing_memory::turn(own, at.x[self.axis], forward, &|x| self.law.backbone(x));
    }

    fn follow(&self, at: &MotionState, own: &mut [f64]) -> bool {
        masing_memory::follow(own, at.x[self.axis], &|x| self.law.backbone(x));
        true
    }

    fn restoring_n(&self, _: Regime, at: &MotionState, own: &[f64]) -> [f64; 3] {
        let value = self.branch(own).value(at.x[self.axis], &|x| self.law.backbone(x));
        along(self.axis, self.law.softening * value)
    }

    fn describing_function(&self, amplitude_m: f64, _: f64) -> Option<Complex64> {
        Some(self.law.softening * self.law.describing_function(amplitude_m))
    }

    fn rate(&self, _: Regime, _: &MotionState, _: &[f64], rate: &mut [f64]) {
        rate.fill(0.0);
    }

    /// A regime ends where the velocity changes its sign or a loop closes. Of velocity and distance to the closure one is
    /// at zero: their units do not matter.
    fn margin(&self, regime: Regime, at: &MotionState, own: &[f64], _: f64) -> f64 {
        velocity(regime, at.v[self.axis]).min(self.branch(own).left_m(at.x[self.axis]))
    }

    fn next(&self, before: Option<Regime>, at: &MotionState, own: &[f64], _: f64) -> Regime {
        let v = at.v[self.axis];
        match before {
            None if v < 0.0 => BACKWARD,
            None => FORWARD,
            Some(before) if velocity(before, v) > self.branch(own).left_m(at.x[self.axis]) => before,
            Some(FORWARD) => BACKWARD,
            Some(_) => FORWARD,
        }
    }
}

/// The velocity, positive where it has the sign of the regime.
fn velocity(regime: Regime, v: f64) -> f64 {
    if regime == FORWARD { v } else { -v }
}
