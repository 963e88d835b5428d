//! Time of a report in seconds.

use quietcut_core::monitor::Report;

/// Converts the time stamp of a report from ns to s.
pub fn seconds(report: &Report) -> f64 {
    report.time.0 as f64 / 1e9
}
