//! Thresholds of decisions about recordings; the comment of each states what it decides and where the number comes
//! from.

use super::unit::Quantity;

/// Largest deviation of a time stamp from even sampling, in sample intervals. It allows for stamps printed with few
/// digits, and detects a missing sample (deviation of about 0.5 or more in a long record). The value between the two is
/// unfounded.
pub(crate) const UNEVEN: f64 = 0.25;

/// Tolerance when a start or end time selects a sample, in sample intervals. It absorbs the rounding of printed times.
/// The value lies far below one interval; it is unfounded.
pub(crate) const SAME_SAMPLE: f64 = 1e-3;

/// Smallest change of the tachometer level that counts as an edge, as a fraction of the range of the level over the
/// recording. It lies above the noise of usual sensors. Unfounded.
pub(crate) const LEAST_SWING: f64 = 0.02;

/// Least number of equal samples in a row at the largest or smallest value of a channel that counts as clipping. Two
/// equal samples at a peak occur in unclipped signals with coarse counts; three need a peak flatter than one count over
/// two intervals. Unfounded beyond that.
pub(crate) const CLIPPED_RUN: usize = 3;

/// Distance of the largest or smallest sample of a channel from the median, as a share of the range of the samples,
/// above which equal samples there are clipping and not rest. A sensor clips far from rest; the force of an impact test
/// rests at its smallest value. Unfounded.
pub(crate) const FAR_FROM_REST: f64 = 0.1;

/// Least number of equal samples in a row, between the extremes of a channel that otherwise changes, that counts as a
/// dropout. Unfounded.
pub(crate) const DROPOUT_RUN: usize = 32;

/// Share of sample-to-sample steps without any change above which a channel is at rest or coarsely quantized, so that a
/// run of equal samples is no dropout. Unfounded.
pub(crate) const AT_REST: f64 = 0.2;

/// Largest correlation error, 1 − r, at which two channels of displacement, velocity or acceleration measure the same
/// motion. With r² the share of common energy, 0.98 leaves 4 % to noise and to the distance between the sensors.
/// Unfounded.
pub(crate) const SAME_MOTION: f64 = 0.02;

/// Largest relative distance of an amplitude ratio from a factor of units (9.80665, 1000, 10⁶) at which the unit is
/// called wrong. Calibration errors of accelerometers are below 5 %. Data sheets state 5 to 10 % for industrial
/// sensors; 5 % is unfounded.
pub(crate) const UNIT_FACTOR: f64 = 0.05;

/// Range of peak values, SI, that sensors on machine tools measure; `None` for quantities without a bound. A peak
/// outside suggests a unit that is wrong by a factor such as 1000.
///
/// Force: 10 mN, the resolution of piezoelectric force sensors, to 1 MN, above the largest dynamometers. Acceleration:
/// 0.1 mm/s² (10 µg), the noise of seismic accelerometers, to 10⁶ m/s², the range of shock accelerometers.
/// Displacement: 10 pm, the resolution of vibrometers, to 1 m. Velocity: 10 nm/s to 100 m/s likewise.
pub(crate) fn plausible_peak(quantity: Quantity) -> Option<(f64, f64)> {
    match quantity {
        Quantity::Force => Some((1e-2, 1e6)),
        Quantity::Acceleration => Some((1e-4, 1e6)),
        Quantity::Displacement => Some((1e-11, 1.0)),
        Quantity::Velocity => Some((1e-8, 1e2)),
        _ => None,
    }
}

/// Spindle speed, rev/min, above which the pulses of a tachometer are probably those of a wheel with more marks than
/// stated. Fast milling spindles reach 60 000 rev/min, and few, of micro milling, more than this. Unfounded.
pub(crate) const FASTEST_SPINDLE_RPM: f64 = 100_000.0;

/// Lowest sample rate, samples per second, at which a time column without unit is taken for seconds without a warning.
/// Milliseconds read as seconds give a rate that is a thousandth: below 50 for loggers of up to 50 kHz. Tests of
/// machine tools are sampled faster than that. Unfounded.
pub(crate) const LOWEST_RATE: f64 = 50.0;

/// Largest difference among the median levels between two tachometer pulses, as a fraction of the range of the level,
/// at which the base line of the tachometer is steady. Noise of some percent moves these medians by less; a base line
/// that wanders by a tenth of the range moves them by more. Unfounded.
pub(crate) const STEADY_MIDDLE: f64 = 0.1;

/// Largest compression factor that the deflate format allows (1032:1): two bits for a match of 258 bytes. Compressed data
/// that state more are damaged. Source: the technical notes of zlib.
pub(crate) const INFLATION_MAX: u64 = 1032;
