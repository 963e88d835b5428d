//! Derivatives of the stability limits by modal parameters and cutting force, and the corrected limit.
//!
//! To first order, limit(p + Δp) = limit(p) + Σ ∂limit/∂ln p · Δp/p. The parameters p are the natural frequencies and
//! damping ratios of a layer's modes, and the cutting force coefficient K_tc. Mode shapes and the ratios K_rc/K_tc
//! and K_ac/K_tc are fixed.

use serde::{Deserialize, Serialize};

use crate::units::{Hertz, Millimeters};

/// Largest number of modes per table layer by whose parameters limits are differentiated. It limits the size of a
/// table.
pub const MODES_MAX: usize = 4;

/// A mode of the structure with the natural frequency and damping ratio from which the table layer was computed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LayerMode {
    /// Natural frequency |λ|/2π.
    pub frequency: Hertz,
    /// Damping ratio −Re λ/|λ|.
    pub damping_ratio: f32,
}

/// Derivatives of one end of an unstable depth interval, in mm per relative change of a parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Slopes {
    /// Derivatives of the limit by the natural frequency of each mode of the layer, in the order of the modes, mm per
    /// relative change; 0 beyond the last mode.
    pub by_frequency: [f32; MODES_MAX],
    /// Derivatives of the limit by the damping ratio of each mode of the layer, in the order of the modes, mm per
    /// relative change; 0 beyond the last mode.
    pub by_damping_ratio: [f32; MODES_MAX],
    /// Derivative of the limit by the cutting force coefficient K_tc at constant ratios K_rc/K_tc and K_ac/K_tc, mm per
    /// relative change.
    pub by_cutting_force: f32,
}

/// Derivatives of both ends of an unstable depth interval; 0 for an end at the smallest or largest depth of the
/// table, or without a computed derivative.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct IntervalSlopes {
    /// Derivatives of the lower end.
    pub from: Slopes,
    /// Derivatives of the upper end.
    pub to: Slopes,
}

/// Relative changes of modal parameters and cutting force since the lobe table was computed. For example, 0.01 is an
/// increase by 1 %.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Learned {
    /// Relative change of the natural frequency of each mode, in the order of the modes of the layer, since the lobe
    /// table was computed.
    pub frequency: [f32; MODES_MAX],
    /// Relative change of the damping ratio of each mode, in the order of the modes of the layer, since the lobe table
    /// was computed.
    pub damping_ratio: [f32; MODES_MAX],
    /// Relative change of the cutting force coefficient K_tc since the lobe table was computed.
    pub cutting_force: f32,
}

impl Learned {
    /// The relative parameter changes if the mode with this index has the frequency and damping ratio of `now`
    /// instead of those of `table`. They are 0 for an index of [`MODES_MAX`] or more.
    pub fn of_mode(index: usize, table: &LayerMode, now: &LayerMode) -> Self {
        let mut learned = Self::default();
        if let Some(slot) = learned.frequency.get_mut(index) {
            *slot = (now.frequency.0 - table.frequency.0) / table.frequency.0;
        }
        // The relative change of a damping ratio of zero is undefined and stays 0.
        if let Some(slot) = learned.damping_ratio.get_mut(index)
            && table.damping_ratio > 0.0
        {
            *slot = (now.damping_ratio - table.damping_ratio) / table.damping_ratio;
        }
        learned
    }
}

impl Slopes {
    /// Shift of the end of an unstable interval in depth that the parameter changes cause, to first order. It is
    /// positive if the limit rises.
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

    /// The derivatives of a limit in the order of their bytes in the table, for `modes` modes.
    pub(super) fn numbers(&self, modes: usize) -> impl Iterator<Item = f32> + '_ {
        self.by_frequency
            .iter()
            .take(modes)
            .chain(self.by_damping_ratio.iter().take(modes))
            .copied()
            .chain(core::iter::once(self.by_cutting_force))
    }

    /// Reads the derivatives of a limit from numbers in the order of [`numbers`](Self::numbers); `None` if they are too
    /// few.
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

/// The stability limit (depth) corrected to first order for parameter changes, clamped to the depths from `from` to
/// `to`.
///
/// The correction is valid while it is small against the distance to the next cusp of the lobes, which allows changes
/// of a natural frequency by a few percent. A NaN correction leaves the limit unchanged.
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
