//! Dry friction: f_r += fc·sign(v); at rest, f_r balances any other force within ±fc. For negative velocity fc may have
//! another value.
//!
//! With a backlash of total width g in series, the friction acts on a slider at the position w, which the tool moves
//! only while |x − w| = g/2: after each reversal of the motion there is no force until the backlash is crossed.
//!
//! With a clearance whose contact is soft, the contact is indented by δ before it transmits fc, by Hertz's law for
//! contacts of non-conforming bodies (Lankarani & Nikravesh, J. Mech. Design 112, 1990; without their damping):
//! f_r = fc·((|x − w| − g/2)/δ)^1.5·sgn(x − w) for |x − w| ≥ g/2. The tool moves the slider while |x − w| = g/2 + δ.

use std::f64::consts::PI;
use std::sync::Arc;

use num_complex::Complex64;

use super::location::{along, axis_of};
use super::{
    Argument, Class, Effect, EffectError, EffectName, EffectSpec, Harmonic, Locations, Parameter, Prior,
    Treatment, Value, Values,
};
use crate::structure::{Direction, Structure};
use crate::{MotionState, Regime, RestoringForce};

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
    describing_function: Some(describing_function),
    build: |values| {
        let plus_n = values.main("fc_n")?;
        let minus_n = values.number("fc_minus_n")?.unwrap_or(plus_n);
        let play_mm = values.number("play_mm")?.unwrap_or(0.0);
        let contact_mm = values.number("contact_mm")?.unwrap_or(0.0);
        if contact_mm > 0.0 && play_mm == 0.0 {
            let needed = "play_mm above 0: it is the contact at the ends of a backlash that";
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

/// Describing function of Coulomb friction for fc = 1 N: 4/(πX) in phase with the velocity.
fn describing_function(at: Harmonic) -> [Complex64; 2] {
    [Complex64::new(0.0, 4.0 / (PI * at.amplitude_m)), Complex64::ZERO]
}

/// Moves gap and contact of a backlash in series with friction (`[extension.backlash]` with
/// `before = "coulomb-friction"`) to the values of the friction, and removes the backlash. Without the key `before`
/// nothing changes.
///
/// # Errors
/// The key `before` is no word or names another effect; there is no friction; the friction has the keys `play_mm` or
/// `contact_mm` too; the gap is missing, or gap or contact are not possible; the two directions differ; or the backlash
/// has another key.
pub(super) fn take_backlash(all: &mut Vec<Values>) -> Result<(), EffectError> {
    let Some(index) = all
        .iter()
        .position(|known| known.effect() == EffectName::Backlash)
    else {
        return Ok(());
    };
    let Some(before) = all[index].text("before")? else {
        return Ok(());
    };
    let mut backlash = all.remove(index);
    let friction = all
        .iter_mut()
        .find(|known| known.effect() == EffectName::CoulombFriction);
    let Some(friction) = friction.filter(|_| before == EffectName::CoulombFriction.name()) else {
        let needed = "\"coulomb-friction\", and that effect too,";
        return Err(backlash.clash("before", before, needed));
    };
    for key in ["play_mm", "contact_mm"] {
        if let Some(found) = friction.given(key) {
            let needed = "gap_mm or contact_mm of the backlash before this friction alone";
            return Err(friction.clash(key, found.in_words(), needed));
        }
    }
    let gap_mm = backlash.main("gap_mm")?;
    friction.put("play_mm", Value::Number(gap_mm));
    if let Some(contact_mm) = backlash.number("contact_mm")? {
        friction.put("contact_mm", Value::Number(contact_mm));
    }
    if let Some(direction) = backlash.take("direction") {
        let own = friction.given("direction").map(Value::in_words);
        if own.is_some_and(|own| own != direction.in_words()) {
            let needed = "the direction of the friction behind it";
            return Err(backlash.clash("direction", direction.in_words(), needed));
        }
        friction.put("direction", direction);
    }
    backlash.finish()
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

const STICK: Regime = 0;
const SLIP_FORWARD: Regime = 1;
const SLIP_BACKWARD: Regime = 2;

/// Slider on which the dry friction acts: the tool moves it while tool and slider are `reach_m`, m, apart.
#[derive(Debug)]
struct Slider {
    axis: usize,
    reach_m: f64,
}

/// Friction in series with a backlash: no friction force within the backlash; stick is possible at either of its ends.
#[derive(Debug)]
struct FrictionBehindBacklash {
    friction: Friction,
    slider: Slider,
}

/// Friction in series with a clearance whose contact is soft: the tool never sticks, since the contact is elastic.
#[derive(Debug)]
struct FrictionBehindClearance {
    friction: Friction,
    /// Slider of the friction. Its `reach_m` is half the clearance plus the largest depth to which the friction force
    /// indents the contact, m.
    slider: Slider,
    contact_m: f64,
}

const WITHIN: Regime = 0;
const STICKS_AT_FRONT: Regime = 3;
const STICKS_AT_BACK: Regime = 4;

impl Effect for CoulombFriction {
    fn id(&self) -> EffectName {
        EffectName::CoulombFriction
    }

    fn restoring_forces(&self, structure: &Structure) -> Result<Vec<Box<dyn RestoringForce>>, EffectError> {
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
            Box::new(FrictionBehindClearance {
                friction,
                slider,
                contact_m: self.contact_m,
            })
        } else if self.half_play_m > 0.0 {
            Box::new(FrictionBehindBacklash { friction, slider })
        } else {
            Box::new(friction)
        }])
    }
}

impl Friction {
    fn sliding(&self, regime: Regime) -> [f64; 3] {
        let force = match regime {
            SLIP_FORWARD => self.plus_n,
            SLIP_BACKWARD => -self.minus_n,
            _ => 0.0,
        };
        along(self.axis, force)
    }
}

impl RestoringForce for Friction {
    fn restoring_n(&self, regime: Regime, _: &MotionState, _: &[f64]) -> [f64; 3] {
        self.sliding(regime)
    }

    /// If the friction force differs between the two directions of motion, the fundamental of the force is that of the
    /// mean friction force.
    fn describing_function(&self, amplitude_m: f64, omega: f64) -> Option<Complex64> {
        let at = Harmonic::new(amplitude_m, omega);
        Some(0.5 * (self.plus_n + self.minus_n) * describing_function(at)[0])
    }

    fn holds(&self) -> Option<usize> {
        Some(self.axis)
    }

    fn locked(&self, regime: Regime) -> bool {
        regime == STICK
    }

    fn margin(&self, regime: Regime, at: &MotionState, _: &[f64], holding_n: f64) -> f64 {
        match regime {
            SLIP_FORWARD => at.v[self.axis],
            SLIP_BACKWARD => -at.v[self.axis],
            _ => (self.plus_n - holding_n).min(self.minus_n + holding_n),
        }
    }

    fn next(&self, before: Option<Regime>, at: &MotionState, _: &[f64], holding_n: f64) -> Regime {
        let moving = before.is_none() && at.v[self.axis] != 0.0;
        // The integrator finds the end of stick, where the holding force equals fc, only to rounding. At the end of
        // stick the threshold is therefore fc·(1 − 1e-9), so that slip follows.
        let rounding = if before == Some(STICK) { -1e-9 } else { 0.0 };
        if moving {
            if at.v[self.axis] > 0.0 {
                SLIP_FORWARD
            } else {
                SLIP_BACKWARD
            }
        } else if holding_n > self.plus_n * (1.0 + rounding) {
            SLIP_FORWARD
        } else if holding_n < -self.minus_n * (1.0 + rounding) {
            SLIP_BACKWARD
        } else {
            STICK
        }
    }
}

impl Slider {
    /// Displacement of the tool minus that of the friction's slider, m.
    fn lead_m(&self, at: &MotionState, own: &[f64]) -> f64 {
        at.x[self.axis] - own[0]
    }

    /// Initial position of the slider: if the tool moves, it trails the tool by `reach_m`; if the tool is at rest, it
    /// is taken to be at the tool.
    fn begin(&self, at: &MotionState, own: &mut [f64]) {
        let moving = at.v[self.axis].signum() * f64::from(u8::from(at.v[self.axis] != 0.0));
        own[0] = at.x[self.axis] - self.reach_m * moving;
    }

    /// The play operator: the slider stays at rest while the tool is within `reach_m` of it, with a relative margin of
    /// 1e-9 for rounding.
    fn follow(&self, at: &MotionState, own: &mut [f64]) {
        let reach_m = self.reach_m * (1.0 + 1e-9);
        let x = at.x[self.axis];
        own[0] = own[0].clamp(x - reach_m, x + reach_m);
    }

    fn rate(&self, regime: Regime, at: &MotionState, rate: &mut [f64]) {
        rate[0] = match regime {
            SLIP_FORWARD | SLIP_BACKWARD => at.v[self.axis],
            _ => 0.0,
        };
    }

    fn margin(&self, regime: Regime, at: &MotionState, own: &[f64]) -> f64 {
        match regime {
            SLIP_FORWARD => at.v[self.axis],
            SLIP_BACKWARD => -at.v[self.axis],
            _ => self.reach_m - self.lead_m(at, own).abs(),
        }
    }

    /// Slip regime in which the tool moves the friction's slider, if their distance has reached `reach_m`; `None`
    /// within the backlash.
    fn dragged(&self, at: &MotionState, own: &[f64]) -> Option<Regime> {
        let lead_m = self.lead_m(at, own);
        let is_at_end = lead_m.abs() >= self.reach_m * (1.0 - 1e-9);
        is_at_end.then_some(if lead_m > 0.0 { SLIP_FORWARD } else { SLIP_BACKWARD })
    }
}

impl RestoringForce for FrictionBehindBacklash {
    fn states(&self) -> usize {
        1
    }

    fn begin(&self, at: &MotionState, own: &mut [f64]) {
        self.slider.begin(at, own);
    }

    fn restoring_n(&self, regime: Regime, _: &MotionState, _: &[f64]) -> [f64; 3] {
        self.friction.sliding(regime)
    }

    fn follow(&self, at: &MotionState, own: &mut [f64]) -> bool {
        self.slider.follow(at, own);
        true
    }

    fn rate(&self, regime: Regime, at: &MotionState, _: &[f64], rate: &mut [f64]) {
        self.slider.rate(regime, at, rate);
    }

    fn holds(&self) -> Option<usize> {
        Some(self.friction.axis)
    }

    fn locked(&self, regime: Regime) -> bool {
        regime == STICKS_AT_FRONT || regime == STICKS_AT_BACK
    }

    fn margin(&self, regime: Regime, at: &MotionState, own: &[f64], holding_n: f64) -> f64 {
        let Friction { plus_n, minus_n, .. } = self.friction;
        match regime {
            STICKS_AT_FRONT => (plus_n - holding_n).min(holding_n),
            STICKS_AT_BACK => (minus_n + holding_n).min(-holding_n),
            _ => self.slider.margin(regime, at, own),
        }
    }

    fn next(&self, before: Option<Regime>, at: &MotionState, own: &[f64], holding_n: f64) -> Regime {
        let Friction { plus_n, minus_n, .. } = self.friction;
        match before {
            None | Some(WITHIN) => self.slider.dragged(at, own).unwrap_or(WITHIN),
            Some(SLIP_FORWARD) if holding_n > 0.0 => STICKS_AT_FRONT,
            Some(SLIP_BACKWARD) if holding_n < 0.0 => STICKS_AT_BACK,
            Some(STICKS_AT_FRONT) if holding_n > 0.5 * plus_n => SLIP_FORWARD,
            Some(STICKS_AT_BACK) if holding_n < -0.5 * minus_n => SLIP_BACKWARD,
            _ => WITHIN,
        }
    }
}

/// Exponent of Hertz's law, force over indentation, for contacts of non-conforming bodies.
const HERTZ: f64 = 1.5;

impl RestoringForce for FrictionBehindClearance {
    fn states(&self) -> usize {
        1
    }

    fn begin(&self, at: &MotionState, own: &mut [f64]) {
        self.slider.begin(at, own);
    }

    fn restoring_n(&self, _: Regime, at: &MotionState, own: &[f64]) -> [f64; 3] {
        let lead_m = self.slider.lead_m(at, own);
        let pressed_m = lead_m.abs() - (self.slider.reach_m - self.contact_m);
        let share = (pressed_m / self.contact_m).clamp(0.0, 1.0).powf(HERTZ);
        let direction = if lead_m > 0.0 { SLIP_FORWARD } else { SLIP_BACKWARD };
        self.friction.sliding(direction).map(|force| share * force)
    }

    fn follow(&self, at: &MotionState, own: &mut [f64]) -> bool {
        self.slider.follow(at, own);
        true
    }

    fn rate(&self, regime: Regime, at: &MotionState, _: &[f64], rate: &mut [f64]) {
        self.slider.rate(regime, at, rate);
    }

    fn margin(&self, regime: Regime, at: &MotionState, own: &[f64], _: f64) -> f64 {
        self.slider.margin(regime, at, own)
    }

    fn next(&self, before: Option<Regime>, at: &MotionState, own: &[f64], _: f64) -> Regime {
        match before {
            None | Some(WITHIN) => self.slider.dragged(at, own).unwrap_or(WITHIN),
            _ => WITHIN,
        }
    }
}
