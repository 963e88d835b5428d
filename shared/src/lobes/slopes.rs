//! How a limit moves with what the device learns: derivatives beside the entries, and the corrected limit.
//!
//! To first order limit(p + Δp) = limit(p) + Σ ∂limit/∂ln p · Δp/p, with p the natural frequencies and damping ratios of a
//! layer's modes (shapes kept) and the cutting force coefficient K_tc (K_rc and K_ac in fixed ratio to it).

use serde::{Deserialize, Serialize};

use crate::units::{Hertz, Millimeters};

/// The most modes of a table whose derivatives are kept: those that matter most.
pub const MODES_MAX: usize = 4;

/// A mode as the table was computed with it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LayerMode {
    /// Natural frequency |λ|/2π.
    pub frequency: Hertz,
    /// Damping ratio −Re λ/|λ|.
    pub damping_ratio: f32,
}

/// Derivatives of one end of an interval, mm per relative change of a parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Slopes {
    /// By the natural frequency of each mode; 0 for those that the table has not.
    pub by_frequency: [f32; MODES_MAX],
    /// By the damping ratio of each mode.
    pub by_damping_ratio: [f32; MODES_MAX],
    /// By the cutting force coefficient.
    pub by_cutting_force: f32,
}

/// Derivatives of both ends of an interval; 0 for an end at the first or last depth of the table.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct IntervalSlopes {
    /// Of the first depth that is not stable.
    pub from: Slopes,
    /// Of the first depth that is stable again.
    pub to: Slopes,
}

/// What was learned since the table was computed: relative changes, such as 0.01 for 1 % more.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Learned {
    /// Of the natural frequency of each mode of the layer.
    pub frequency: [f32; MODES_MAX],
    /// Of the damping ratio of each mode.
    pub damping_ratio: [f32; MODES_MAX],
    /// Of the cutting force coefficient.
    pub cutting_force: f32,
}

impl Learned {
    /// Nothing but new values of one mode of a layer; a number that is no mode of the table changes nothing.
    pub fn of_mode(index: usize, table: &LayerMode, now: &LayerMode) -> Self {
        let mut learned = Self::default();
        if let Some(slot) = learned.frequency.get_mut(index) {
            *slot = (now.frequency.0 - table.frequency.0) / table.frequency.0;
        }
        // A mode without damping has no relative change of it.
        if let Some(slot) = learned.damping_ratio.get_mut(index)
            && table.damping_ratio > 0.0
        {
            *slot = (now.damping_ratio - table.damping_ratio) / table.damping_ratio;
        }
        learned
    }
}

impl Slopes {
    /// By how much the depth moves, to first order.
    pub fn shift(&self, learned: &Learned) -> Millimeters {
        let mut shift_mm = self.by_cutting_force * learned.cutting_force;
        for (slope, change) in self.by_frequency.iter().zip(&learned.frequency) {
            shift_mm += slope * change;
        }
        for (slope, change) in self.by_damping_ratio.iter().zip(&learned.damping_ratio) {
            shift_mm += slope * change;
        }
        Millimeters(shift_mm)
    }

    /// The numbers in the order of the table's bytes, for so many modes.
    pub(super) fn numbers(&self, modes: usize) -> impl Iterator<Item = f32> + '_ {
        self.by_frequency
            .iter()
            .take(modes)
            .chain(self.by_damping_ratio.iter().take(modes))
            .copied()
            .chain(core::iter::once(self.by_cutting_force))
    }

    /// The reverse of [`numbers`](Self::numbers).
    pub(super) fn of_numbers(mut numbers: impl Iterator<Item = f32>, modes: usize) -> Option<Self> {
        let mut slopes = Self::default();
        for slot in slopes.by_frequency.iter_mut().take(modes) {
            *slot = numbers.next()?;
        }
        for slot in slopes.by_damping_ratio.iter_mut().take(modes) {
            *slot = numbers.next()?;
        }
        slopes.by_cutting_force = numbers.next()?;
        Some(slopes)
    }
}

/// The limit with what was learned, to first order, kept within depths `from` to `to`.
///
/// Good while the correction is small against the distance to the next cusp; who learns must not correct by more than a
/// few percent of a frequency. A correction that is no number leaves the limit as it is.
pub fn corrected_limit(
    limit: Millimeters,
    slopes: &Slopes,
    learned: &Learned,
    (from, to): (Millimeters, Millimeters),
) -> Millimeters {
    let moved_mm = limit.0 + slopes.shift(learned).0;
    if moved_mm.is_nan() {
        return limit;
    }
    Millimeters(f32::min(f32::max(moved_mm, from.0), to.0))
}
