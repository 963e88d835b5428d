//! Stability charts with a progress bar, for methods that need seconds a speed.

use super::progress;
use crate::stability::{self, Chart, Method, StabilityError, chart};

/// Computes a stability chart as [`chart()`]; for a method that needs seconds a speed a progress bar counts the speeds.
///
/// # Errors
/// As [`chart()`].
pub(super) fn counted_chart(
    method: &dyn Method,
    speeds_rpm: &[f64],
    depth_mm: f64,
    samples: usize,
) -> Result<Chart, StabilityError> {
    if !method.takes_seconds() {
        return chart(method, speeds_rpm, depth_mm, samples);
    }
    progress::clear();
    let bar = progress::bar(
        Some(speeds_rpm.len() as u64),
        "{spinner} limits {bar:40} {pos}/{len} {elapsed}",
    );
    let found = stability::counted_chart(method, speeds_rpm, depth_mm, samples, || bar.inc(1));
    bar.finish_and_clear();
    found
}
