//! How sharp a multiplier may be stated, and whether the forced orbit stays where it is.

use crate::stroboscope::Window;

/// No |μ| is stated sharper than this: the cut itself does not stay the same to more.
pub(super) const LEAST_DEVIATION: f32 = 5e-4;
/// Standard deviations for what is no alarm.
pub(super) const LIKELY: f32 = 2.0;
/// The forced orbit may move by this part of itself within a window, or by this part of the deviation.
pub(super) const STEADY: f32 = 0.15;
pub(super) const STEADY_AGAINST_DEVIATION: f32 = 0.3;

/// Whether the forced orbit stays where it is within a window.
pub(super) fn is_steady(window: &Window<'_>, forced: f32, deviation: f32, noise: f32) -> bool {
    let drift = window.drift();
    let bound = (STEADY * forced).max(STEADY_AGAINST_DEVIATION * deviation);
    drift * drift < bound * bound + chance(noise, window.length() / 2)
}

/// Square of the difference of two means of so many passings that noise alone exceeds about never: of 24 channels
/// the mean square is within 2 of 1.
pub(super) fn chance(noise: f32, passings: usize) -> f32 {
    2.0 * 2.0 * noise / passings.max(1) as f32
}
