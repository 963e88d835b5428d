//! Whether anything is cut, against the quietest the machine has been at about the same speed.

use crate::detector::finding::{Finding, beyond};
use crate::math::{ln, round};
use crate::units::Hertz;

/// The quietest that a band has been within a range of speeds.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Quiet {
    /// Activity, in m/s²; 0 before it is known.
    level: f32,
    /// Residual while it was quiet, in m/s².
    residual: f32,
    /// Passings about as quiet as that, up to [`QUIET_PASSINGS`].
    calm: u8,
    /// Passings well above the quietest, up to [`CONTRAST_PASSINGS`].
    loud: u8,
    /// Time since it was quiet, s.
    age_s: f32,
}

impl Quiet {
    const UNKNOWN: Self = Self {
        level: 0.0,
        residual: 0.0,
        calm: 0,
        loud: 0,
        age_s: 0.0,
    };
}

/// Whether anything is cut, from the levels of one band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Presence {
    /// One for each range of speeds.
    quiet: [Quiet; RANGES],
}

impl Default for Presence {
    fn default() -> Self {
        Self::new()
    }
}

/// Activity this many times the quietest is a cut,
const CUT: f32 = 3.0;
/// below this many times it is none.
const AIR: f32 = 1.8;
/// Activity within this many times the noise of the sensor is none either.
const NOISE: f32 = 2.0;
/// So many passings of a cut and the quietest is known to be none.
const CONTRAST_PASSINGS: u8 = 8;
/// What the residual of the quiet machine is a mean of, at most, and the fewest passings that tell it: 8 passings of 24 channels tell the
/// power of noise to 10 %.
const QUIET_PASSINGS: u8 = 20;
const LEAST_QUIET_PASSINGS: u8 = 8;
/// Ranges of speed with levels of their own: each is a factor of √2 wide, from 1 to 512 revolutions per second. The forced vibration of an
/// unbalanced rotor goes with the square of the speed, so that a level differs by 2 within a range, about as air does from a cut.
const RANGES: usize = 18;
/// While it is quiet, the quietest creeps up by this part per passing: a minute at 30 passings per second makes 10 %.
const CREEP: f32 = 5e-5;
/// A level that was not met for this time, in s, is forgotten: the machine may have become louder, and then its air is no cut. A level
/// that rose by itself instead would make air of a long cut.
const FORGOTTEN_S: f32 = 600.0;

impl Presence {
    /// Knows nothing.
    pub const fn new() -> Self {
        Self {
            quiet: [Quiet::UNKNOWN; RANGES],
        }
    }

    /// Lets `seconds` pass.
    pub fn wait(&mut self, seconds: f32) {
        for quiet in &mut self.quiet {
            quiet.age_s += seconds;
            if quiet.age_s > FORGOTTEN_S {
                *quiet = Quiet::UNKNOWN;
            }
        }
    }

    /// Takes what a new passing says. `noise` is that of the sensor, root mean square in one channel: no machine is quieter.
    pub fn update(&mut self, finding: &Finding, speed: Option<Hertz>, noise: f32) {
        let Some(quiet) = self.quiet.get_mut(range(speed)) else {
            return;
        };
        let activity = finding.activity;
        if AIR * activity < quiet.level {
            // What was taken for quiet was none.
            quiet.calm = 0;
        }
        if quiet.level == 0.0 || activity < quiet.level {
            quiet.level = activity;
        }
        quiet.level = quiet.level.max(noise).max(f32::MIN_POSITIVE);
        if activity > CUT * quiet.level {
            quiet.loud = (quiet.loud + 1).min(CONTRAST_PASSINGS);
        } else if activity < AIR * quiet.level {
            quiet.age_s = 0.0;
            quiet.level *= 1.0 + CREEP;
            quiet.calm = (quiet.calm + 1).min(QUIET_PASSINGS);
            quiet.residual += (finding.levels.residual - quiet.residual) / f32::from(quiet.calm);
        }
    }

    /// Whether this finding is that of a tool in air. `noise` is that of the sensor, root mean square in one channel.
    pub fn is_air(&self, finding: &Finding, speed: Option<Hertz>, noise: f32) -> bool {
        let known = self.quiet.get(range(speed)).filter(|quiet| quiet.has_contrast());
        let activity = finding.activity;
        activity < NOISE * noise || known.is_some_and(|quiet| activity < AIR * quiet.level)
    }

    /// What the residual of the machine that does not cut has beyond the noise of the sensor; 0 where it is not known.
    pub fn idle(&self, speed: Option<Hertz>, noise: f32) -> f32 {
        self.quiet
            .get(range(speed))
            .filter(|quiet| quiet.has_contrast() && quiet.calm >= LEAST_QUIET_PASSINGS)
            .map_or(0.0, |quiet| beyond(quiet.residual, noise))
    }
}

impl Quiet {
    fn has_contrast(&self) -> bool {
        self.loud >= CONTRAST_PASSINGS
    }
}

/// Number of the range of a speed.
fn range(speed: Option<Hertz>) -> usize {
    let half_octaves = speed.map_or(0.0, |speed| 2.0 * ln(speed.0.max(1.0)) / core::f32::consts::LN_2);
    (round(half_octaves) as usize).min(RANGES - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finding(activity: f32) -> Finding {
        Finding {
            activity,
            passings: 100,
            ..Finding::NOTHING
        }
    }

    #[test]
    fn air_at_a_high_speed_is_no_cut_at_a_low_one() {
        let mut presence = Presence::new();
        let (slow, fast) = (Some(Hertz(10.0)), Some(Hertz(100.0)));
        for _ in 0..30 {
            presence.update(&finding(0.1), slow, 0.01);
        }
        for _ in 0..30 {
            presence.update(&finding(2.0), slow, 0.01);
        }
        assert!(presence.is_air(&finding(0.1), slow, 0.01));
        // Fast air is ten times as loud, and a cut there ten times louder again.
        for _ in 0..30 {
            presence.update(&finding(1.0), fast, 0.01);
        }
        for _ in 0..30 {
            presence.update(&finding(10.0), fast, 0.01);
        }
        assert!(presence.is_air(&finding(1.0), fast, 0.01));
        assert!(!presence.is_air(&finding(10.0), fast, 0.01));
    }

    #[test]
    fn a_level_of_long_ago_is_forgotten_and_none_is_0() {
        let mut presence = Presence::new();
        let speed = Some(Hertz(20.0));
        presence.update(&finding(0.0), speed, 0.01);
        assert!(
            presence
                .quiet
                .iter()
                .all(|quiet| quiet.level == 0.0 || quiet.level >= 0.01)
        );
        for _ in 0..30 {
            presence.update(&finding(1.0), speed, 0.01);
        }
        // A quarter of an hour later the level of the dead sensor makes no cut of air, and a long cut is no air either.
        for _ in 0..900 {
            presence.wait(1.0);
            presence.update(&finding(1.0), speed, 0.01);
            assert!(!presence.is_air(&finding(1.0), speed, 0.01));
        }
        for _ in 0..30 {
            presence.update(&finding(10.0), speed, 0.01);
        }
        assert!(presence.is_air(&finding(1.0), speed, 0.01));
    }
}
