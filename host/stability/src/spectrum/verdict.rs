//! The verdict on a cut, from its dominant Floquet multiplier (characteristic multiplier) and the error of that.

use serde::Serialize;

/// Verdict on a cut, from |μ| of its dominant multiplier and the error of |μ|.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// |μ| + error < 1.
    Stable,
    /// |μ| − error > 1.
    Unstable,
    /// The interval from |μ| − error to |μ| + error contains 1.
    Undecided,
}

impl Verdict {
    /// Verdict on a cut whose dominant Floquet multiplier has the absolute value `multiplier_abs` with this error.
    pub fn of(multiplier_abs: f64, error: f64) -> Self {
        if multiplier_abs + error < 1.0 {
            Self::Stable
        } else if multiplier_abs - error > 1.0 {
            Self::Unstable
        } else {
            Self::Undecided
        }
    }

    /// Name in results: `stable`, `unstable` or `undecided`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stable => "stable",
            Self::Unstable => "unstable",
            Self::Undecided => "undecided",
        }
    }
}
