//! The ways in which a Floquet multiplier leaves the unit circle.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// How a Floquet multiplier leaves the unit circle: the kind of bifurcation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StabilityLoss {
    /// Complex pair (Neimark–Sacker, secondary Hopf, torus): chatter at a frequency independent of the tooth-passing
    /// frequency.
    Hopf,
    /// A real multiplier leaves through −1 (period doubling).
    Flip,
    /// A real multiplier leaves through +1.
    Fold,
}

impl StabilityLoss {
    /// Kind of stability loss by a Floquet multiplier: Hopf if its imaginary part is not exactly 0, otherwise flip if
    /// its real part is negative and fold if it is not.
    pub fn of(multiplier: Complex64) -> Self {
        if multiplier.im != 0.0 {
            Self::Hopf
        } else if multiplier.re < 0.0 {
            Self::Flip
        } else {
            Self::Fold
        }
    }

    /// Name in results: `hopf`, `flip` or `fold`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hopf => "hopf",
            Self::Flip => "flip",
            Self::Fold => "fold",
        }
    }

    /// Number of Floquet multipliers that cross the unit circle together: 2 for a complex pair, else 1.
    pub fn count(self) -> i32 {
        match self {
            Self::Hopf => 2,
            Self::Flip | Self::Fold => 1,
        }
    }
}
