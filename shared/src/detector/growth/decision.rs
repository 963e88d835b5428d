//! Whether the likelihood of growth is an alarm.

use super::likelihood::Candidate;
use crate::criteria::{
    CLASS_ANGLE, CLASS_HOLD, CLASS_UNITY, GROWTH_LIKELIHOOD, HOLD, LEAST_ABS, LEAST_ANGLE, LEAST_GROWTH,
    LEAST_RECENT, MOST_OF_AMPLITUDE, PERSISTENT_ABS, PERSISTENT_LIKELIHOOD,
};
use crate::math::round;

/// What the evaluation of a passing gave.
#[derive(Clone, Copy, Debug)]
pub(super) struct Observation {
    /// The likelier of both windows, and the one of the short window.
    pub(super) likeliest: Option<Candidate>,
    pub(super) recent: Option<Candidate>,
    /// Power of the last passings over the usual one, in the harmonic where it is largest.
    pub(super) excess: f32,
    /// Power of the last passings about their mean, and of the mean, summed over the channels.
    pub(super) power: f32,
    pub(super) mean_square: f32,
    pub(super) passings: u32,
    pub(super) teeth: usize,
}

/// Counts the passings for which growth has been likely.
#[derive(Clone, Copy, Debug)]
pub(super) struct Decision {
    held: u32,
    passings: u32,
}

impl Decision {
    pub(super) const fn new() -> Self {
        Self { held: 0, passings: 0 }
    }

    /// Takes the next evaluation; the multiplier that grows, once it is an alarm.
    pub(super) fn step(&mut self, observation: &Observation) -> Option<Candidate> {
        let grows = observation.growing();
        let passed = observation.passings.saturating_sub(self.passings);
        self.passings = observation.passings;
        self.held = match &grows {
            Some(_) if self.held == 0 => 1,
            Some(_) => self.held.saturating_add(passed),
            None => self.held.saturating_sub(passed),
        };
        grows.filter(|c| {
            let is_class = is_class(c, observation.teeth);
            self.held > if is_class { CLASS_HOLD } else { HOLD }
        })
    }
}

impl Observation {
    /// The multiplier whose growth is likely now.
    fn growing(&self) -> Option<Candidate> {
        let c = self.likeliest?;
        let is_sure = if is_class(&c, self.teeth) {
            self.mean_square <= self.power && c.against_unity > CLASS_UNITY
        } else {
            c.abs > LEAST_ABS
        };
        let amplitude = (0.5 * (self.excess - 1.0)).clamp(0.0, MOST_OF_AMPLITUDE);
        let recent = self.recent.map_or(0.0, |c| c.against_stable);
        (is_sure
            && recent > LEAST_RECENT
            && c.against_stable > LEAST_GROWTH
            && c.against_stable + amplitude > GROWTH_LIKELIHOOD)
            .then_some(c)
    }
}

/// True where the angle is that of a forced orbit that moves: of a class (a multiple of the revolution), or of what all teeth have in common.
fn is_class(c: &Candidate, teeth: usize) -> bool {
    let turns = c.angle_turns * teeth as f32;
    (turns - round(turns)).abs() < CLASS_ANGLE * teeth as f32 || c.angle_turns < LEAST_ANGLE + CLASS_ANGLE
}

/// True for a vibration that neither grows nor dies.
pub(super) fn persists(c: &Candidate, teeth: usize) -> bool {
    c.against_stable > PERSISTENT_LIKELIHOOD && c.abs > PERSISTENT_ABS && !is_class(c, teeth)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn observation(passings: u32, abs: f32, angle_turns: f32) -> Observation {
        let candidate = Some(Candidate {
            abs,
            angle_turns,
            against_stable: 12.0,
            against_unity: if abs > 1.0 { 3.0 } else { 0.0 },
        });
        Observation {
            likeliest: candidate,
            recent: candidate,
            excess: 5.0,
            power: 1.0,
            mean_square: 0.1,
            passings,
            teeth: 2,
        }
    }

    #[test]
    fn growth_needs_two_evaluations_and_decay_is_none() {
        let mut decision = Decision::new();
        assert_eq!(decision.step(&observation(50, 1.05, 0.3)), None);
        assert!(decision.step(&observation(51, 1.05, 0.3)).is_some());
        for passings in 52..80 {
            assert_eq!(decision.step(&observation(passings, 0.97, 0.3)), None);
        }
    }

    #[test]
    fn an_orbit_that_moves_does_not_grow_at_the_angle_of_a_class() {
        let moving = |passings| Observation {
            mean_square: 5.0,
            ..observation(passings, 1.05, 0.5)
        };
        let mut decision = Decision::new();
        assert!((50..80).all(|passings| decision.step(&moving(passings)).is_none()));
        // Alternating growth without it is a flip.
        let mut decision = Decision::new();
        assert!((50..60).any(|passings| decision.step(&observation(passings, 1.05, 0.5)).is_some()));
    }
}
