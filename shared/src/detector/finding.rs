//! What one look at the passings of a band says.

use crate::synchronous::Levels;

/// The kinds of growth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GrowthKind {
    /// A complex pair of multipliers.
    Hopf,
    /// A real multiplier below −1.
    Flip,
}

/// The largest multiplier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Multiplier {
    /// |μ| over one tooth period.
    pub abs: f32,
    /// Its standard deviation.
    pub deviation: f32,
    /// arg μ in turns, 0 to ½.
    pub angle_turns: f32,
    /// What it is, if it is outside the unit circle.
    pub kind: GrowthKind,
    /// What it multiplies: root mean square of the deviation over slots and axes, the noise of the sensor taken off, in m/s².
    pub level: f32,
}

/// What one look at the passings says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// Levels, in m/s²: means over some turns.
    pub levels: Levels,
    /// Root mean square of all that moves, over the last few passings, in m/s².
    pub activity: f32,
    /// Passings since the conditions last changed.
    pub passings: u32,
    /// The largest multiplier, where it could be estimated with some certainty.
    pub multiplier: Option<Multiplier>,
    /// What surely grows.
    pub growing: Option<Multiplier>,
    /// What surely dies out: the largest multiplier is below 1.
    pub decaying: bool,
    /// What neither grows nor dies, over the longest window.
    pub persistent: Option<Multiplier>,
    /// Cycles of what grows or persists per tooth period, from its shape within the period.
    pub cycles: Option<f32>,
    /// Interval of confidence of |μ| of the alternating part, where one moves.
    pub alternating: Option<(f32, f32)>,
}

impl Finding {
    /// Before anything was seen.
    pub const NOTHING: Self = Self {
        levels: Levels {
            forced: 0.0,
            runout: 0.0,
            alternating: 0.0,
            residual: 0.0,
        },
        activity: 0.0,
        passings: 0,
        multiplier: None,
        growing: None,
        decaying: false,
        persistent: None,
        cycles: None,
        alternating: None,
    };

    /// Two turns are needed before levels mean anything.
    pub fn is_valid(&self, teeth: u8) -> bool {
        self.passings > 2 * u32::from(teeth)
    }

    /// Level of what chatters, the noise of the sensor (root mean square in one channel) taken off, in m/s². A flip of an even number of
    /// teeth comes back with each turn.
    pub fn level_of(&self, kind: GrowthKind, teeth: u8, noise: f32) -> f32 {
        if kind == GrowthKind::Flip && teeth.is_multiple_of(2) {
            self.levels.alternating
        } else {
            beyond(self.levels.residual, noise)
        }
    }
}

/// Root of what a mean square has beyond that of noise.
pub(crate) fn beyond(level: f32, noise: f32) -> f32 {
    crate::math::sqrt((level * level - noise * noise).max(0.0))
}
