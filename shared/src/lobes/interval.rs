//! An interval of depths that is not stable, and how stability is lost there.

use serde::{Deserialize, Serialize};

use crate::units::{Hertz, Millimeters};

/// What a depth interval is, if it is not stable.
///
/// Multipliers are those over a tooth period; of a tool with teeth at unequal pitch over a revolution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum IntervalKind {
    /// Chatter at a frequency of its own: a complex pair of multipliers outside the unit circle.
    Hopf,
    /// Chatter with twice the tooth period: a multiplier below −1.
    Flip,
    /// The forced orbit itself is lost: a multiplier above +1.
    Fold,
    /// The computation could not decide (its error bar crosses the unit circle, or it failed).
    Undecided,
}

/// A range of depths [from, to) that is not stable.
///
/// An interval that ends at the last depth of the table includes it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Interval {
    /// The first depth that is not stable.
    pub from: Millimeters,
    /// The first depth that is stable again, or the last depth of the table.
    pub to: Millimeters,
    /// What it is.
    pub kind: IntervalKind,
    /// The chatter frequency; 0 where it is not known.
    pub chatter: Hertz,
}
