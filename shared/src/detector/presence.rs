//! Whether anything is cut, against the quietest the machine has been.

use crate::detector::finding::{Finding, beyond};

/// Whether anything is cut, from the levels of one band.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Presence {
    /// The quietest this band has been, in m/s²; 0 before it is known.
    quiet: f32,
    /// Residual while it was quiet, in m/s².
    quiet_residual: f32,
    /// Passings about as quiet as that, up to [`QUIET_PASSINGS`].
    calm: u8,
    /// Passings well above the quietest, up to [`CONTRAST_PASSINGS`].
    loud: u8,
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
/// The quietest creeps up by this part per passing: a minute at 30 passings per second makes 10 %.
const CREEP: f32 = 5e-5;

impl Presence {
    /// Knows nothing.
    pub const fn new() -> Self {
        Self {
            quiet: 0.0,
            quiet_residual: 0.0,
            calm: 0,
            loud: 0,
        }
    }

    /// Takes what a new passing says.
    pub fn update(&mut self, finding: &Finding) {
        let activity = finding.activity;
        if AIR * activity < self.quiet {
            // What was taken for quiet was none.
            self.calm = 0;
        }
        if self.quiet == 0.0 || activity < self.quiet {
            self.quiet = activity;
        }
        self.quiet *= 1.0 + CREEP;
        if activity > CUT * self.quiet {
            self.loud = (self.loud + 1).min(CONTRAST_PASSINGS);
        } else if activity < AIR * self.quiet {
            self.calm = (self.calm + 1).min(QUIET_PASSINGS);
            self.quiet_residual += (finding.levels.residual - self.quiet_residual) / f32::from(self.calm);
        }
    }

    fn has_contrast(&self) -> bool {
        self.loud >= CONTRAST_PASSINGS
    }

    /// Whether this finding is that of a tool in air. `noise` is that of the sensor, root mean square in one channel.
    pub fn is_air(&self, finding: &Finding, noise: f32) -> bool {
        let activity = finding.activity;
        activity < NOISE * noise || self.has_contrast() && activity < AIR * self.quiet
    }

    /// What the residual of the machine that does not cut has beyond the noise of the sensor; 0 where it is not known.
    pub fn idle(&self, noise: f32) -> f32 {
        if self.has_contrast() && self.calm >= LEAST_QUIET_PASSINGS {
            beyond(self.quiet_residual, noise)
        } else {
            0.0
        }
    }
}
