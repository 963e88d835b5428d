//! Bouc–Wen hysteresis: f_r += k_h·(z − x), ż = v·(1 − |z/z_y|ⁿ·(γ·sgn(v·z) + β)).
//!
//! γ and β are shape numbers with γ + β = 1, so that z saturates at ±z_y; at small motion z = x and nothing is added.

use std::sync::Arc;

use super::place::{along, axis_of};
use super::{Effect, EffectError, Kind};
use crate::structure::{Direction, Structure};
use crate::{At, Branch, Term};

pub(super) const KIND: Kind = Kind {
    name: "hysteresis",
    keys: "hysteretic_stiffness_n_per_m, yield_m, exponent, gamma (beta is 1 − gamma) and direction",
    build: |parameters| {
        let stiffness = parameters.main("hysteretic_stiffness_n_per_m")?;
        let yield_m = parameters.positive("yield_m")?.ok_or(EffectError::Missing {
            name: "hysteresis".into(),
            key: "yield_m",
        })?;
        let exponent = parameters.number("exponent", |n| n >= 1.0, "a number of 1 or more")?;
        let gamma = parameters.number("gamma", |g| (0.0..=1.0).contains(&g), "a number from 0 to 1")?;
        Ok(Arc::new(Hysteresis {
            stiffness,
            yield_m,
            exponent: exponent.unwrap_or(1.0),
            gamma: gamma.unwrap_or(0.5),
            direction: parameters.direction("direction")?,
        }))
    },
};

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

/// Bits of a branch: the signs of velocity and of z.
const BACKWARD: Branch = 1;
const NEGATIVE: Branch = 2;

impl Effect for Hysteresis {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn terms(&self, structure: &Structure) -> Result<Vec<Box<dyn Term>>, EffectError> {
        let axis = axis_of(structure, self.direction, KIND.name)?;
        Ok(vec![Box::new(BoucWen { effect: *self, axis })])
    }
}

impl BoucWen {
    fn signs(branch: Branch) -> (f64, f64) {
        let sign = |bit| if branch & bit == 0 { 1.0 } else { -1.0 };
        (sign(BACKWARD), sign(NEGATIVE))
    }
}

impl Term for BoucWen {
    fn states(&self) -> usize {
        1
    }

    fn restoring_n(&self, _: Branch, at: &At, own: &[f64]) -> [f64; 3] {
        along(self.axis, self.effect.stiffness * (own[0] - at.x[self.axis]))
    }

    fn rate(&self, branch: Branch, at: &At, own: &[f64], rate: &mut [f64]) {
        let (of_velocity, of_z) = Self::signs(branch);
        let Hysteresis {
            yield_m,
            exponent,
            gamma,
            ..
        } = self.effect;
        // On its branch z has its sign; a stage beyond the end of the branch goes on smoothly where n is odd.
        let share = of_z * own[0] / yield_m;
        let power = share.signum() * share.abs().powf(exponent);
        let shape = gamma * of_velocity * of_z + (1.0 - gamma);
        rate[0] = at.v[self.axis] * (1.0 - power * shape);
    }

    /// With γ + β = 1 no z beyond ±z_y is reached.
    fn confine(&self, own: &mut [f64]) {
        own[0] = own[0].clamp(-self.effect.yield_m, self.effect.yield_m);
    }

    fn margin(&self, branch: Branch, at: &At, own: &[f64], _: f64) -> f64 {
        let (of_velocity, of_z) = Self::signs(branch);
        // Both as shares of something of their size; only the signs count.
        (of_velocity * at.v[self.axis]).min(of_z * own[0])
    }

    fn next(&self, before: Option<Branch>, at: &At, own: &[f64], _: f64) -> Branch {
        let mut branch = 0;
        if at.v[self.axis] < 0.0 {
            branch |= BACKWARD;
        }
        if own[0] < 0.0 {
            branch |= NEGATIVE;
        }
        let Some(before) = before else { return branch };
        // At the end of a branch one of the two is at zero: that one changes its sign.
        let (of_velocity, of_z) = Self::signs(before);
        let (v, z) = (of_velocity * at.v[self.axis], of_z * own[0]);
        if v * self.effect.yield_m.recip() < z * self.effect.yield_m.recip() {
            before ^ BACKWARD
        } else {
            before ^ NEGATIVE
        }
    }
}
