//! How a Floquet multiplier leaves the unit circle.

use num_complex::Complex64;
use serde::Serialize;

/// How a Floquet multiplier leaves the unit circle: the kind of bifurcation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StabilityLoss {
    /// As a complex pair: chatter with a frequency of its own (Neimark–Sacker, secondary Hopf, torus).
    Hopf,
    /// Through −1: period doubling.
    Flip,
    /// Through +1.
    Fold,
}

impl StabilityLoss {
    /// The kind of a multiplier. Real multipliers must be real to the last bit.
    pub fn of(multiplier: Complex64) -> Self {
        if multiplier.im != 0.0 {
            Self::Hopf
        } else if multiplier.re < 0.0 {
            Self::Flip
        } else {
            Self::Fold
        }
    }

    /// The word in answers.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hopf => "hopf",
            Self::Flip => "flip",
            Self::Fold => "fold",
        }
    }

    /// How many multipliers cross together.
    pub(crate) fn count(self) -> i32 {
        match self {
            Self::Hopf => 2,
            Self::Flip | Self::Fold => 1,
        }
    }
}
