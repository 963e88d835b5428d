//! A depth interval of a lobe table that is not stable, and the kind of its stability loss.

use serde::{Deserialize, Serialize};

use crate::units::{Hertz, Millimeters};

/// Kind of stability loss in a depth interval.
///
/// The Floquet multipliers are those of one tooth period; for a tool with unequal pitch, of one revolution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum IntervalKind {
    /// Hopf (Neimark–Sacker): a complex pair of Floquet multipliers outside the unit circle.
    Hopf,
    /// Flip (period doubling): a real Floquet multiplier below −1; the vibration has twice the tooth period.
    Flip,
    /// Fold: a real Floquet multiplier above +1; the forced orbit does not persist.
    Fold,
    /// Undecided: the Floquet multiplier lies on the unit circle within its error bound, or the computation failed.
    Undecided,
    /// Bistable: the forced vibration is stable, and so is a larger one, such as the period-doubled vibration below a
    /// subcritical flip. The cut is stable unless something knocks the tool.
    Bistable,
}

/// A half-open interval [from, to) of axial depths at which the cut is not stable.
///
/// An interval that ends at the largest depth of the table includes that depth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Interval {
    /// Smallest depth of the interval, at which the cut is not stable.
    pub from: Millimeters,
    /// Upper end of the interval, which does not belong to it unless it is the largest depth of the table.
    pub to: Millimeters,
    /// Kind of stability loss.
    pub kind: IntervalKind,
    /// Chatter frequency; 0 if unknown.
    pub chatter: Hertz,
}
