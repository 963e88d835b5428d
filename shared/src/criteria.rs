//! Thresholds by which the signal chain decides, and margins of advice.
//!
//! The comment of each constant states the source of its number. "Unfounded" marks numbers without a derivation and
//! without a campaign that set them. The thresholds of `detector`, `stroboscope` and `tachometer` stand in those
//! modules. Tolerances of pure numerics and sizes of memory stand where they are used.

use crate::units::Degrees;

// Sample clock.

/// Largest relative deviation of the fitted sample rate from the nominal one. Data sheets allow 3 %. The bound is
/// wider, so that a fit with an error does not end on it.
pub(crate) const SAMPLE_RATE_TOLERANCE: f32 = 0.05;

/// Number of blocks after which the weight of a time stamp in the fitted sample clock has decayed to 1/e: 0.6 s of
/// full blocks at 26 667 Hz. It averages the jitter and follows the thermal drift of the sensor's oscillator.
/// Unfounded.
pub(crate) const SAMPLE_CLOCK_MEMORY_BLOCKS: f32 = 256.0;

/// Initial estimate, in ns, of the standard deviation of the time stamps of sample blocks: the latency of an interrupt.
/// Unfounded.
pub(crate) const STAMP_JITTER_NS: f32 = 10_000.0;

/// Longest gap between two blocks, in samples, over which the fit of the sample clock continues. After a longer gap it
/// starts again. Unfounded.
pub(crate) const LONGEST_COUNTED_GAP: f32 = 20_000.0;

// Clock of numbered events.

/// Deviation of a time stamp from the fitted line above which the stamp is an outlier, in standard deviations. Normal
/// jitter exceeds it once in 16 000 stamps.
pub(crate) const OUTLIER_DEVIATIONS: f32 = 4.0;

/// Number of consecutive time stamps that are outliers after which the line fitted to the stamps starts again.
/// Unfounded.
pub(crate) const OUTLIERS_MAX: u8 = 4;

/// Number of time stamps after which the gain of the running variance of the stamps about their fitted line no longer
/// decreases. Unfounded.
pub(crate) const VARIANCE_MEMORY: f32 = 96.0;

/// Gain of the running mean of the deviations of time stamps. The standard deviation of this mean is √(0.25/1.75) =
/// 0.38 of that of a single deviation. Unfounded.
pub(crate) const BIAS_GAIN: f32 = 0.25;

/// Bound of one deviation in the running mean of deviations, in standard deviations. Up to three bounded deviations
/// in a row raise the mean from 0 to 3·(1 − 0.75³) = 1.7, which is below [`RATE_CHANGE_BIAS`]: three consecutive
/// outliers are no rate change.
pub(crate) const BIAS_BOUND: f32 = 3.0;

/// Running mean of the deviations of time stamps from the fitted line above which the rate of the events is changing,
/// in standard deviations of one time stamp. It is 5.3 standard deviations of the running mean itself.
pub(crate) const RATE_CHANGE_BIAS: f32 = 2.0;

/// Lower bound of the estimated standard deviation of time stamps, in ns: 1.6 ticks of the device's timer, which are
/// 12.5 ns on the STM32G474. The factor is unfounded.
pub(crate) const STAMP_RESOLUTION_NS: f32 = 20.0;

// Tones of a power spectrum.

/// Distance in bins from a peak of a spectrum up to which the bins on both sides give the noise floor, the median of
/// their powers; the nearest [`LOBE_HALF_WIDTH`] bins are left out. Unfounded.
pub(crate) const FLOOR_HALF_WIDTH: usize = 64;

/// Number of spectrum bins on each side of a peak that do not count for the noise floor: the main lobe of the Hann
/// window, ±2 bins, and one more.
pub(crate) const LOBE_HALF_WIDTH: usize = 3;

/// Smallest ratio of a tone's power to the noise floor: 14 dB. The power of white noise in a bin of one axis exceeds
/// 25 times its median with the probability 2⁻²⁵, once in 3·10⁷ bins.
pub const MIN_SNR: f32 = 25.0;

/// Distance in bins of the spectrum within which a tone counts as a harmonic of the spindle: the main lobes of closer
/// tones cannot be separated.
pub(crate) const HARMONIC_BINS: f32 = 1.0;

/// Largest tolerance around a harmonic of the spindle at which harmonics and other tones are distinguished, as a
/// share of the distance between two harmonics. A quarter of the distance then remains outside of the tolerances.
/// Unfounded.
pub(crate) const HARMONIC_TOLERANCE_MAX: f32 = 0.375;

/// Number of local maxima of a spectrum, strongest first, among which a tone is searched. It limits the computing time.
/// Unfounded.
pub(crate) const MAXIMA_SEARCHED: usize = 32;

// Spindle speed from a spectrum.

/// Relative uncertainty of an assumed spindle speed. Unfounded.
pub(crate) const ASSUMED_SPEED_UNCERTAINTY: f32 = 0.005;

/// Relative uncertainty of a spindle speed measured by the tachometer. Unfounded.
pub(crate) const MEASURED_SPEED_UNCERTAINTY: f32 = 5e-4;

/// Smallest ratio of power to noise floor of a tone that is accepted as the tooth-passing tone: 20 dB. Unfounded.
pub(crate) const SPEED_TONE_SNR: f32 = 100.0;

/// Uncertainty of a tooth-passing frequency read from a spectrum, in bins: three standard deviations of the frequency
/// of a tone 20 dB above the noise in its bin, 0.065 bins (`shared/tests/spectrum.rs`).
pub(crate) const SPEED_TONE_BINS: f32 = 0.2;

// Resampling at fixed spindle angles.

/// Fewest samples of the structure band per tooth period for resampling at fixed angles. A tooth period has 8 slots;
/// with fewer samples a slot may hold none.
pub(crate) const STRUCTURE_SAMPLES_PER_TOOTH: f32 = 8.0;

/// Fewest samples of the tool band per tooth period for resampling at fixed angles. The sampling theorem requires 2
/// for the tooth-passing frequency; the margin is unfounded.
pub(crate) const TOOL_SAMPLES_PER_TOOTH: f32 = 2.5;

/// Largest standard deviation of the spindle angle for resampling at fixed angles, in tooth periods. Unfounded.
pub(crate) const ANGLE_DEVIATION_MAX: f32 = 0.03;

/// Fewest samples of the tool band between two evaluations of the growth of its vibration: 4 ms at 13.3 kHz. It limits
/// the computing time. Unfounded.
pub(crate) const GROWTH_INTERVAL_SAMPLES: u32 = 53;

// A flip or runout (`detector::judge`).

/// G: the ratio of alternating to tooth-periodic vibration in a stable cut with two teeth, for a runout as large as the feed per tooth. The 99.9 %
/// quantile over drawn machines is 250, the largest value of the 614 cuts that `alternation_of_stable_cuts_with_runout` of
/// `shared/tests/detection` made with 1000 seeds; the median is 4, the 99 % quantile 57.
const ALTERNATION_OF_RUNOUT: f32 = 250.0;

/// Runout that is assumed of a tool, in mm: a large one.
const ASSUMED_RUNOUT_MM: f32 = 0.05;

/// Feed per tooth that is assumed of a cut, in mm.
const ASSUMED_FEED_MM: f32 = 0.1;

/// Ratio of alternating to tooth-periodic vibration above which "flip or runout" is an alarm: G · runout/feed.
pub(crate) const FLIP_ALARM: f32 = ALTERNATION_OF_RUNOUT * ASSUMED_RUNOUT_MM / ASSUMED_FEED_MM;

// Thresholds of the verdict and of the advice, which follow each block of samples.

/// Time constant, in blocks, of the running mean of the share of clipped or lost samples. Unfounded.
pub(crate) const DAMAGE_MEMORY_BLOCKS: f32 = 64.0;

/// Largest share of clipped or lost samples that still allows a verdict. Unfounded.
pub(crate) const DAMAGE_MAX: f32 = 0.05;

/// Largest relative change of the spindle speed from one revolution to the next at which tooth periods are comparable.
/// Unfounded.
pub(crate) const SPEED_CHANGE_MAX: f32 = 0.02;

/// Time without a complete tooth period after which what the last ones told is out of date, in s and in tooth periods at the
/// present speed, whichever is longer: a quarter of the second within which an alarm ends, and more than one missing tooth period.
pub(crate) const STALE_S: f32 = 0.25;
/// See [`STALE_S`].
pub(crate) const STALE_TOOTH_PERIODS: f32 = 3.0;

/// Relative change of the spindle speed after which advice is computed again: a fifth of [`SPEED_BAND`]. The share is
/// unfounded.
pub(crate) const ADVICE_SPEED_STEP: f32 = 0.002;

/// Relative change of the chatter frequency after which advice is computed again. The tooth-passing rule then moves
/// its speed by half of [`SPEED_BAND`]. The share is unfounded.
pub(crate) const ADVICE_FREQUENCY_STEP: f32 = 0.005;

// Margins of advice.

/// Relative depth margin of advice: all depths within ±10 % of the advised depth must be stable.
///
/// It covers the error of limits computed from measured dynamics and force coefficients, near the middle of a stable
/// pocket. Unfounded.
pub const DEPTH_MARGIN: f32 = 0.1;

/// Relative speed margin of advice: all speeds within ±1 % of the advised speed must be stable.
///
/// A natural frequency, and with it the speed of a pocket, is known to about 1 %. A spindle under load holds its
/// speed more closely.
pub const SPEED_BAND: f32 = 0.01;

/// Factor by which the quiet depth (stable with margin) at another spindle speed must exceed that at the present speed
/// for the other speed to be advised.
///
/// A change of both speed and depth must gain at least as much depth as [`DEPTH_MARGIN`].
pub const BETTER: f32 = 1.1;

/// Factor within which two quiet depths (stable with margin) count as equal, so that the one at the nearer speed is
/// advised. Unfounded.
pub(crate) const EQUAL_DEPTHS: f32 = 1.02;

/// Largest number of spindle speeds, besides the present one, at which the quiet depth (stable with margin) is
/// computed from interpolated entries of the lobe table. They are the speeds with the largest upper bounds of the
/// quiet depth. It limits the computing time. Unfounded.
pub(crate) const CANDIDATE_SPEEDS: usize = 8;

/// Relative speed step at which the stability between two speeds of the lobe table is interpolated and checked: four
/// steps per [`SPEED_BAND`]. Unfounded.
pub(crate) const QUIET_SPEED_STEP: f32 = SPEED_BAND / 4.0;

/// The largest lobe number k (whole vibrations per tooth period) of the tooth-passing rule.
///
/// Pockets k and k + 1 differ in speed by the relative amount 1/k. Beyond k = 20 that is below 5 %, most of it
/// unstable, so that a pocket is rarely as wide as the ±1 % of [`SPEED_BAND`].
pub const MAX_LOBE: u16 = 20;

// Thresholds for the validity of a layer of the lobe table.

/// Largest difference in degrees between the immersion angles of the cut and of a layer of the lobe table, at entry and
/// at exit, at which the layer is valid for the cut.
///
/// Half a degree changes the mean directional coefficients of a 90° cut by about 1 %, well below [`DEPTH_MARGIN`].
pub const IMMERSION_TOLERANCE: Degrees = Degrees(0.5);

/// Relative tolerance of the feed per tooth of a cut at the ends of the feed range of a table layer. It covers rounding
/// only.
pub const FEED_TOLERANCE: f32 = 1e-4;

/// Largest angle in degrees between the feed directions of two table layers between which a lookup interpolates.
/// Unfounded.
pub const FEED_DIRECTION_SPAN: Degrees = Degrees(45.0);

/// Largest angle in degrees between two feed directions that count as equal. Unfounded.
pub const FEED_DIRECTION_TOLERANCE: Degrees = Degrees(0.5);
