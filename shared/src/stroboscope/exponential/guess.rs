//! From where a fit starts.

/// The angles in turns that are looked at: nearer to 0 a forced orbit that moves is seen, nearer to a half turn a
/// flip, of which [`Window::alternation`](crate::stroboscope::Window::alternation) tells.
pub const ANGLES: (f32, f32) = (0.03, 0.485);
/// Steps shorter than these are not taken: over the longest window they come to 3 % of the amplitude and 0.04 rad.
const SHORTEST_STEP: (f32, f32) = (5e-4, 1e-4);
/// A deviation from where the fit starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guess {
    /// ln|μ| per tooth period.
    pub rate: f32,
    /// arg μ in turns.
    pub angle_turns: f32,
}

impl Guess {
    /// Whether a step from here to there is not worth while.
    pub(super) fn is_near(&self, other: Self) -> bool {
        (self.rate - other.rate).abs() < SHORTEST_STEP.0
            && (self.angle_turns - other.angle_turns).abs() < SHORTEST_STEP.1
    }
}
