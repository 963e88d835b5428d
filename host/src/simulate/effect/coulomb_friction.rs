//! Dry friction: f_r += fc·sign(v); at rest it holds whatever is within ±fc.
//!
//! Through a play of total width g in series (a damper that its rod takes along only after the play) the friction follows a
//! slider w that moves with the tool only where |x − w| = g/2: after each reversal there is no force until the play is crossed.

use std::sync::Arc;

use super::place::{along, axis_of};
use super::{Effect, EffectError, Kind, Parameters, Value};
use crate::simulate::{At, Branch, Term};
use crate::structure::{Direction, Structure};

pub(super) const KIND: Kind = Kind {
    name: "coulomb-friction",
    keys: "fc_n, fc_minus_n (against negative velocity, where it differs), play_mm and direction",
    build: |parameters| {
        let plus_n = parameters.main("fc_n")?;
        let minus_n = parameters.finite("fc_minus_n")?.unwrap_or(plus_n);
        let play_mm = parameters.finite("play_mm")?.unwrap_or(0.0);
        if plus_n < 0.0 || minus_n < 0.0 {
            return Err(EffectError::Value {
                effect: "coulomb-friction".into(),
                found: plus_n.min(minus_n).to_string(),
                needed: "a force of 0 or more",
            });
        }
        if play_mm < 0.0 {
            return Err(EffectError::Value {
                effect: "coulomb-friction.play_mm".into(),
                found: play_mm.to_string(),
                needed: "a play of 0 or more",
            });
        }
        Ok(Arc::new(CoulombFriction {
            plus_n,
            minus_n,
            half_play_m: 0.5e-3 * play_mm,
            direction: parameters.direction("direction")?,
        }))
    },
};

/// A backlash that stands before the friction (`[extension.backlash]` with `before = "coulomb-friction"`) is a play of it.
///
/// # Errors
/// It stands before something else, or there is no friction.
pub(super) fn take_play(all: &mut Vec<Parameters>) -> Result<(), EffectError> {
    let Some(index) = all.iter().position(|known| known.effect() == "backlash") else {
        return Ok(());
    };
    let Some(before) = all[index].text("before")? else {
        return Ok(());
    };
    let friction = all.iter().position(|known| known.effect() == KIND.name);
    let Some(friction) = friction.filter(|_| before == KIND.name) else {
        return Err(EffectError::Value {
            effect: "backlash.before".into(),
            found: before,
            needed: "\"coulomb-friction\", and that effect too,",
        });
    };
    let mut play = all[index].clone();
    let gap_mm = play.main("gap_mm")?;
    all[friction].put("play_mm", Value::Number(gap_mm));
    all.remove(index);
    Ok(())
}

#[derive(Clone, Copy, Debug)]
struct CoulombFriction {
    plus_n: f64,
    minus_n: f64,
    half_play_m: f64,
    direction: Option<Direction>,
}

#[derive(Debug)]
struct Friction {
    plus_n: f64,
    minus_n: f64,
    axis: usize,
}

const STICKS: Branch = 0;
const FORWARD: Branch = 1;
const BACKWARD: Branch = 2;

/// Behind a play: the same, and free within it; at rest it holds at one end or the other.
#[derive(Debug)]
struct BehindPlay {
    friction: Friction,
    half_play_m: f64,
}

const WITHIN: Branch = 0;
const STICKS_AHEAD: Branch = 3;
const STICKS_BEHIND: Branch = 4;

impl Effect for CoulombFriction {
    fn name(&self) -> &'static str {
        KIND.name
    }

    fn terms(&self, structure: &Structure) -> Result<Vec<Box<dyn Term>>, EffectError> {
        let axis = axis_of(structure, self.direction, KIND.name)?;
        let friction = Friction {
            plus_n: self.plus_n,
            minus_n: self.minus_n,
            axis,
        };
        Ok(vec![if self.half_play_m > 0.0 {
            Box::new(BehindPlay {
                friction,
                half_play_m: self.half_play_m,
            })
        } else {
            Box::new(friction)
        }])
    }
}

impl Friction {
    fn sliding(&self, branch: Branch) -> [f64; 3] {
        let force = match branch {
            FORWARD => self.plus_n,
            BACKWARD => -self.minus_n,
            _ => 0.0,
        };
        along(self.axis, force)
    }
}

impl Term for Friction {
    fn restoring_n(&self, branch: Branch, _: &At, _: &[f64]) -> [f64; 3] {
        self.sliding(branch)
    }

    fn holds(&self) -> Option<usize> {
        Some(self.axis)
    }

    fn locked(&self, branch: Branch) -> bool {
        branch == STICKS
    }

    fn margin(&self, branch: Branch, at: &At, _: &[f64], holding_n: f64) -> f64 {
        match branch {
            FORWARD => at.v[self.axis],
            BACKWARD => -at.v[self.axis],
            _ => (self.plus_n - holding_n).min(self.minus_n + holding_n),
        }
    }

    fn next(&self, before: Option<Branch>, at: &At, _: &[f64], holding_n: f64) -> Branch {
        let moving = before.is_none() && at.v[self.axis] != 0.0;
        // A hair beyond the limit still counts as held: the end of sticking is found there to rounding only.
        let beyond = if before == Some(STICKS) { -1e-9 } else { 0.0 };
        if moving {
            if at.v[self.axis] > 0.0 { FORWARD } else { BACKWARD }
        } else if holding_n > self.plus_n * (1.0 + beyond) {
            FORWARD
        } else if holding_n < -self.minus_n * (1.0 + beyond) {
            BACKWARD
        } else {
            STICKS
        }
    }
}

impl BehindPlay {
    /// How far the tool is from the slider.
    fn ahead_m(&self, at: &At, own: &[f64]) -> f64 {
        at.x[self.friction.axis] - own[0]
    }
}

impl Term for BehindPlay {
    fn states(&self) -> usize {
        1
    }

    fn begin(&self, at: &At, own: &mut [f64]) {
        // In motion the play has been crossed; at rest nobody knows.
        let axis = self.friction.axis;
        let moving = at.v[axis].signum() * f64::from(u8::from(at.v[axis] != 0.0));
        own[0] = at.x[axis] - self.half_play_m * moving;
    }

    fn restoring_n(&self, branch: Branch, _: &At, _: &[f64]) -> [f64; 3] {
        self.friction.sliding(branch)
    }

    /// The play operator: the slider stays where it is as long as the tool is no further from it than half the play. A hair
    /// beyond that is the end of the play.
    fn follow(&self, at: &At, own: &mut [f64]) -> bool {
        let reach_m = self.half_play_m * (1.0 + 1e-9);
        let x = at.x[self.friction.axis];
        own[0] = own[0].clamp(x - reach_m, x + reach_m);
        true
    }

    fn rate(&self, branch: Branch, at: &At, _: &[f64], rate: &mut [f64]) {
        rate[0] = match branch {
            FORWARD | BACKWARD => at.v[self.friction.axis],
            _ => 0.0,
        };
    }

    fn holds(&self) -> Option<usize> {
        Some(self.friction.axis)
    }

    fn locked(&self, branch: Branch) -> bool {
        branch == STICKS_AHEAD || branch == STICKS_BEHIND
    }

    fn margin(&self, branch: Branch, at: &At, own: &[f64], holding_n: f64) -> f64 {
        let Friction {
            plus_n,
            minus_n,
            axis,
        } = self.friction;
        match branch {
            FORWARD => at.v[axis],
            BACKWARD => -at.v[axis],
            STICKS_AHEAD => (plus_n - holding_n).min(holding_n),
            STICKS_BEHIND => (minus_n + holding_n).min(-holding_n),
            _ => self.half_play_m - self.ahead_m(at, own).abs(),
        }
    }

    fn next(&self, before: Option<Branch>, at: &At, own: &[f64], holding_n: f64) -> Branch {
        let Friction { plus_n, minus_n, .. } = self.friction;
        match before {
            // The far end of the play, or a start there.
            None | Some(WITHIN) if self.ahead_m(at, own).abs() >= self.half_play_m * (1.0 - 1e-9) => {
                if self.ahead_m(at, own) > 0.0 {
                    FORWARD
                } else {
                    BACKWARD
                }
            }
            None => WITHIN,
            Some(FORWARD) if holding_n > 0.0 => STICKS_AHEAD,
            Some(BACKWARD) if holding_n < 0.0 => STICKS_BEHIND,
            Some(STICKS_AHEAD) if holding_n > 0.5 * plus_n => FORWARD,
            Some(STICKS_BEHIND) if holding_n < -0.5 * minus_n => BACKWARD,
            _ => WITHIN,
        }
    }
}
