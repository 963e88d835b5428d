//! Dry friction: f_r += fc·sign(v); at rest, f_r balances any other force within ±fc.
//!
//! With a backlash of total width g in series, the friction acts on a slider at the position w, which the tool moves only while
//! |x − w| = g/2: after each reversal of the motion there is no force until the backlash is crossed.
//!
//! With a clearance whose contact is soft, the contact is indented by δ before it transmits fc, by Hertz's law for contacts of
//! non-conforming bodies (Lankarani & Nikravesh, J. Mech. Design 112, 1990; without their damping):
//! f_r = fc·((|x − w| − g/2)/δ)^1.5 towards w. The tool moves the slider while |x − w| = g/2 + δ.

use std::f64::consts::PI;
use std::sync::Arc;

use num_complex::Complex64;

use super::place::{along, axis_of};
use super::{
    Argument, Class, Effect, EffectError, EffectName, EffectSpec, Locations, Parameter, Prior, Treatment,
    Value, Values,
};
use crate::structure::{Direction, Structure};
use crate::{At, Branch, Term};

/// The specification.
pub(super) const COULOMB_FRICTION: EffectSpec = EffectSpec {
    id: EffectName::CoulombFriction,
    name: "coulomb-friction",
    class: Class::RestoringForce(Argument::Velocity),
    locations: Locations::EachDirection,
    parameters: &[
        Parameter::number("fc_n", "N", "friction force")
            .main()
            .linear()
            .within(FORCE),
        Parameter::number(
            "fc_minus_n",
            "N",
            "friction force against negative velocity, where it differs",
        )
        .linear()
        .within(FORCE),
        Parameter::number("play_mm", "mm", "total width of a backlash in series").within(LENGTH),
        Parameter::number(
            "contact_mm",
            "mm",
            "depth of a soft contact at the ends of that backlash",
        )
        .within(LENGTH),
    ],
    treatment: Treatment::Equivalent,
    candidates: &[
        "alike in both directions of motion",
        "another force in each direction of motion",
        "behind a backlash",
        "behind a clearance whose contact is soft",
    ],
    shares_term_with: &[],
    summary: "dry friction, sticking included",
    equation: "f_r += fc·sign(v); at rest any force within ±fc",
    shows: "damping that falls as 1/amplitude, sticking between moves at low levels, odd harmonics that fall slowly with their order",
    hidden_by: "large amplitudes; a hysteresis loop with very stiff pre-slip is the same; it moves no frequency while it slips",
    source: "Armstrong-Hélouvry, Dupont and Canudas de Wit, Automatica 30 (1994)",
    example: "fc_n = 3.0\ndirection = \"x\"",
    build: |values| {
        let plus_n = values.main("fc_n")?;
        let minus_n = values.number("fc_minus_n")?.unwrap_or(plus_n);
        let play_mm = values.number("play_mm")?.unwrap_or(0.0);
        let contact_mm = values.number("contact_mm")?.unwrap_or(0.0);
        if contact_mm > 0.0 && play_mm == 0.0 {
            let needed = "play_mm above 0: it is the contact at the ends of a play that";
            return Err(values.clash("contact_mm", contact_mm, needed));
        }
        Ok(Arc::new(CoulombFriction {
            plus_n,
            minus_n,
            half_play_m: 0.5e-3 * play_mm,
            contact_m: 1e-3 * contact_mm,
            direction: values.direction()?,
        }))
    },
};

const FORCE: Prior = Prior::not_negative("a force of 0 or more");
const LENGTH: Prior = Prior::not_negative("a length of 0 or more");

/// Describing function of Coulomb friction for fc = 1 N at the displacement amplitude X, m: 4/(πX) in phase with the velocity.
pub fn describing_function(amplitude: f64) -> Complex64 {
    Complex64::new(0.0, 4.0 / (PI * amplitude))
}

/// Moves gap and contact of a backlash in series with friction (`[extension.backlash]` with `before = "coulomb-friction"`) to the values
/// of the friction.
///
/// # Errors
/// The key `before` names another effect, or there is no friction.
pub(super) fn take_play(all: &mut Vec<Values>) -> Result<(), EffectError> {
    let Some(index) = all
        .iter()
        .position(|known| known.effect() == EffectName::Backlash)
    else {
        return Ok(());
    };
    let Some(before) = all[index].text("before")? else {
        return Ok(());
    };
    let friction = all
        .iter()
        .position(|known| known.effect() == EffectName::CoulombFriction);
    let Some(friction) = friction.filter(|_| before == EffectName::CoulombFriction.name()) else {
        let needed = "\"coulomb-friction\", and that effect too,";
        return Err(all[index].clash("before", before, needed));
    };
    let mut play = all[index].clone();
    let gap_mm = play.main("gap_mm")?;
    all[friction].put("play_mm", Value::Number(gap_mm));
    if let Some(contact_mm) = play.number("contact_mm")? {
        all[friction].put("contact_mm", Value::Number(contact_mm));
    }
    all.remove(index);
    Ok(())
}

#[derive(Clone, Copy, Debug)]
struct CoulombFriction {
    plus_n: f64,
    minus_n: f64,
    half_play_m: f64,
    contact_m: f64,
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

/// Slider of the friction, which the tool moves while their distance is `reach_m`.
#[derive(Debug)]
struct Slider {
    axis: usize,
    reach_m: f64,
}

/// Friction in series with a backlash: no force within the backlash; stick is possible at either of its ends.
#[derive(Debug)]
struct BehindPlay {
    friction: Friction,
    slider: Slider,
}

/// Friction in series with a clearance whose contact is soft: the tool never sticks, since the contact is elastic.
#[derive(Debug)]
struct BehindClearance {
    friction: Friction,
    /// Its `reach_m` is half the clearance plus the depth to which the friction force can indent the contact.
    slider: Slider,
    contact_m: f64,
}

const WITHIN: Branch = 0;
const STICKS_AHEAD: Branch = 3;
const STICKS_BEHIND: Branch = 4;

impl Effect for CoulombFriction {
    fn id(&self) -> EffectName {
        EffectName::CoulombFriction
    }

    fn terms(&self, structure: &Structure) -> Result<Vec<Box<dyn Term>>, EffectError> {
        let axis = axis_of(structure, self.direction, self.name())?;
        let friction = Friction {
            plus_n: self.plus_n,
            minus_n: self.minus_n,
            axis,
        };
        let slider = Slider {
            axis,
            reach_m: self.half_play_m + self.contact_m,
        };
        Ok(vec![if self.contact_m > 0.0 {
            Box::new(BehindClearance {
                friction,
                slider,
                contact_m: self.contact_m,
            })
        } else if self.half_play_m > 0.0 {
            Box::new(BehindPlay { friction, slider })
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

    /// If the friction force differs between the two directions of motion, the fundamental is that of their mean.
    fn describing_function(&self, amplitude_m: f64, _: f64) -> Option<Complex64> {
        Some(0.5 * (self.plus_n + self.minus_n) * describing_function(amplitude_m))
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
        // The integrator finds the end of stick, where the holding force equals fc, to rounding only. A relative margin of 1e-9
        // above rounding makes sure that slip follows.
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

impl Slider {
    /// Displacement of the tool minus that of the slider, m.
    fn ahead_m(&self, at: &At, own: &[f64]) -> f64 {
        at.x[self.axis] - own[0]
    }

    /// Initial position of the slider: if the tool moves, it trails the tool by `reach_m`; if the tool is at rest, it is taken to be at the tool.
    fn begin(&self, at: &At, own: &mut [f64]) {
        let moving = at.v[self.axis].signum() * f64::from(u8::from(at.v[self.axis] != 0.0));
        own[0] = at.x[self.axis] - self.reach_m * moving;
    }

    /// The play operator: the slider stays at rest while the tool is within `reach_m` of it, with a relative margin of 1e-9 for rounding.
    fn follow(&self, at: &At, own: &mut [f64]) {
        let reach_m = self.reach_m * (1.0 + 1e-9);
        let x = at.x[self.axis];
        own[0] = own[0].clamp(x - reach_m, x + reach_m);
    }

    fn rate(&self, branch: Branch, at: &At, rate: &mut [f64]) {
        rate[0] = match branch {
            FORWARD | BACKWARD => at.v[self.axis],
            _ => 0.0,
        };
    }

    fn margin(&self, branch: Branch, at: &At, own: &[f64]) -> f64 {
        match branch {
            FORWARD => at.v[self.axis],
            BACKWARD => -at.v[self.axis],
            _ => self.reach_m - self.ahead_m(at, own).abs(),
        }
    }

    /// Regime in which the tool moves the slider, if their distance is `reach_m`; `None` within the backlash.
    fn taken(&self, at: &At, own: &[f64]) -> Option<Branch> {
        let ahead_m = self.ahead_m(at, own);
        let is_at_end = ahead_m.abs() >= self.reach_m * (1.0 - 1e-9);
        is_at_end.then_some(if ahead_m > 0.0 { FORWARD } else { BACKWARD })
    }
}

impl Term for BehindPlay {
    fn states(&self) -> usize {
        1
    }

    fn begin(&self, at: &At, own: &mut [f64]) {
        self.slider.begin(at, own);
    }

    fn restoring_n(&self, branch: Branch, _: &At, _: &[f64]) -> [f64; 3] {
        self.friction.sliding(branch)
    }

    fn follow(&self, at: &At, own: &mut [f64]) -> bool {
        self.slider.follow(at, own);
        true
    }

    fn rate(&self, branch: Branch, at: &At, _: &[f64], rate: &mut [f64]) {
        self.slider.rate(branch, at, rate);
    }

    fn holds(&self) -> Option<usize> {
        Some(self.friction.axis)
    }

    fn locked(&self, branch: Branch) -> bool {
        branch == STICKS_AHEAD || branch == STICKS_BEHIND
    }

    fn margin(&self, branch: Branch, at: &At, own: &[f64], holding_n: f64) -> f64 {
        let Friction { plus_n, minus_n, .. } = self.friction;
        match branch {
            STICKS_AHEAD => (plus_n - holding_n).min(holding_n),
            STICKS_BEHIND => (minus_n + holding_n).min(-holding_n),
            _ => self.slider.margin(branch, at, own),
        }
    }

    fn next(&self, before: Option<Branch>, at: &At, own: &[f64], holding_n: f64) -> Branch {
        let Friction { plus_n, minus_n, .. } = self.friction;
        match before {
            None | Some(WITHIN) => self.slider.taken(at, own).unwrap_or(WITHIN),
            Some(FORWARD) if holding_n > 0.0 => STICKS_AHEAD,
            Some(BACKWARD) if holding_n < 0.0 => STICKS_BEHIND,
            Some(STICKS_AHEAD) if holding_n > 0.5 * plus_n => FORWARD,
            Some(STICKS_BEHIND) if holding_n < -0.5 * minus_n => BACKWARD,
            _ => WITHIN,
        }
    }
}

/// Exponent of Hertz's law, force over indentation, for contacts of non-conforming bodies.
const HERTZ: f64 = 1.5;

impl Term for BehindClearance {
    fn states(&self) -> usize {
        1
    }

    fn begin(&self, at: &At, own: &mut [f64]) {
        self.slider.begin(at, own);
    }

    fn restoring_n(&self, _: Branch, at: &At, own: &[f64]) -> [f64; 3] {
        let ahead_m = self.slider.ahead_m(at, own);
        let pressed_m = ahead_m.abs() - (self.slider.reach_m - self.contact_m);
        let share = (pressed_m / self.contact_m).clamp(0.0, 1.0).powf(HERTZ);
        let way = if ahead_m > 0.0 { FORWARD } else { BACKWARD };
        self.friction.sliding(way).map(|force| share * force)
    }

    fn follow(&self, at: &At, own: &mut [f64]) -> bool {
        self.slider.follow(at, own);
        true
    }

    fn rate(&self, branch: Branch, at: &At, _: &[f64], rate: &mut [f64]) {
        self.slider.rate(branch, at, rate);
    }

    fn margin(&self, branch: Branch, at: &At, own: &[f64], _: f64) -> f64 {
        self.slider.margin(branch, at, own)
    }

    fn next(&self, before: Option<Branch>, at: &At, own: &[f64], _: f64) -> Branch {
        match before {
            None | Some(WITHIN) => self.slider.taken(at, own).unwrap_or(WITHIN),
            _ => WITHIN,
        }
    }
}
