//! Thresholds of decisions about recordings. Each says what it decides and where the number comes from.

/// Largest deviation of a time stamp from even sampling, in sample intervals. It allows for stamps printed with few digits, and detects a
/// missing sample (deviation 1). The value is a choice between the two.
pub(crate) const UNEVEN: f64 = 0.25;

/// Tolerance when a start or end time selects a sample, in sample intervals. It absorbs the rounding of printed times. The value is a
/// choice, far below one interval.
pub(crate) const SAME_SAMPLE: f64 = 1e-3;

/// Smallest change of the tachometer level that counts as an edge, as a fraction of its range over the recording. A choice, above the noise
/// of usual sensors.
pub(crate) const LEAST_SWING: f64 = 0.02;
