//! The time of a report.

use quietcut_core::monitor::Report;

/// The time of a report in seconds: whole nanoseconds of the first 104 days are exact in an `f64`.
pub fn seconds(report: &Report) -> f64 {
    report.time.0 as f64 / 1e9
}
