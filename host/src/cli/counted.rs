//! Stability charts with a progress bar, for methods that need seconds a speed.

use indicatif::ProgressBar;

use super::progress;
use crate::stability::{Cell, Chart, CutStability, Method, SpeedLine, StabilityError, chart};

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
    let found = chart(&Counted { method, bar: &bar }, speeds_rpm, depth_mm, samples);
    bar.finish_and_clear();
    found
}

/// Stability method that counts the spindle speeds of its limits.
struct Counted<'a> {
    method: &'a dyn Method,
    bar: &'a ProgressBar,
}

impl Method for Counted<'_> {
    fn name(&self) -> &'static str {
        self.method.name()
    }

    fn blind_to(&self) -> Option<&'static str> {
        self.method.blind_to()
    }

    fn settings(&self) -> Option<String> {
        self.method.settings()
    }

    fn takes_seconds(&self) -> bool {
        self.method.takes_seconds()
    }

    fn point(&self, rpm: f64, depth_mm: f64) -> Result<CutStability, StabilityError> {
        self.method.point(rpm, depth_mm)
    }

    fn line(&self, rpm: f64, depth_mm: f64, samples: usize) -> Result<SpeedLine, StabilityError> {
        let line = self.method.line(rpm, depth_mm, samples);
        self.bar.inc(1);
        line
    }

    fn cells(&self, rpm: f64, depths_mm: &[f64]) -> Result<Vec<Cell>, StabilityError> {
        self.method.cells(rpm, depths_mm)
    }
}
