//! The usual power of each harmonic in the stable cut.

use super::rows::GROUPS;
use crate::criteria::{USUAL_FALLS, USUAL_FIRST, USUAL_RISES, USUAL_STEP};

/// Power of each harmonic while all multipliers decay, (m/s²)².
#[derive(Clone, Copy, Debug)]
pub(super) struct Usual {
    power: [f32; GROUPS],
    /// Evaluations that went into it, up to [`USUAL_FIRST`].
    count: u8,
}

impl Usual {
    pub(super) const fn new() -> Self {
        Self {
            power: [0.0; GROUPS],
            count: 0,
        }
    }

    /// Takes the power of the last passings. It falls quickly; it rises slowly, and only where all multipliers decay: growth does not
    /// become usual.
    pub(super) fn follow(&mut self, power: &[f32; GROUPS], decays: bool) {
        if self.count < USUAL_FIRST {
            (self.power, self.count) = (*power, self.count + 1);
            return;
        }
        for (usual, &power) in self.power.iter_mut().zip(power) {
            if power < *usual {
                *usual += USUAL_FALLS * (power - *usual);
            } else if decays {
                *usual += (USUAL_RISES * (power - *usual)).min(USUAL_STEP * *usual);
            }
        }
    }

    /// Largest ratio of a harmonic's power to its usual one. `floor` is the least power that the sensor's noise gives.
    pub(super) fn excess(&self, power: &[f32; GROUPS], floor: f32) -> f32 {
        let ratios = power
            .iter()
            .zip(&self.power)
            .map(|(power, usual)| power / usual.max(floor));
        ratios.fold(0.0, f32::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_does_not_become_usual_and_a_louder_stable_cut_does() {
        let mut usual = Usual::new();
        for _ in 0..20 {
            usual.follow(&[1.0; GROUPS], true);
        }
        for _ in 0..1000 {
            usual.follow(&[50.0; GROUPS], false);
        }
        assert!(usual.excess(&[50.0; GROUPS], 0.1) > 49.0);
        for _ in 0..1500 {
            usual.follow(&[50.0; GROUPS], true);
        }
        assert!(usual.excess(&[50.0; GROUPS], 0.1) < 1.5);
    }
}
