//! Decimation by a cascade of half-band filters: from raw counts to the tool band and the structure band.
//!
//! | band | flat | rate |
//! |---|---|---|
//! | tool | to 5 kHz | input rate halved as often as 5 kHz allows; slower inputs are not decimated |
//! | structure | to 400 Hz | input rate halved to the smallest rate of at least 1 600 Hz; slower inputs are kept |
//!
//! Every stage is a symmetric half-band filter: y\[n\] = Σ h\[i\]·x\[2n − i\], i = 0 … 4m − 2, whose odd taps vanish
//! except the middle one. The taps are a Kaiser-windowed sinc, computed at compile time. Aliases in the flat band are
//! attenuated by at least 90 dB, the ripple is below 0.001 dB, and the gain at 0 Hz is exactly 1. With a sample clock
//! that is up to 3 % slow the structure band still reaches its upper end, and so does the tool band of the IIS3DWB
//! (26 667 Hz).
//!
//! Samples are fixed-point numbers with [`FRACTION_BITS`] fractional bits per count. A stage sums its products
//! exactly in 64 bits and rounds once.

use crate::acceleration::Counts;
use crate::units::Hertz;

/// A filtered acceleration sample of the axes x, y, z, in units of 2^−[`FRACTION_BITS`] sensor counts.
pub type Sample = [i32; 3];

/// Number of fractional bits per sensor count in the fixed-point samples of the filters.
///
/// Full scale is 2²⁷. Of the 4 bits above it, one holds the overshoot of the filters, less than twice full scale in
/// both bands, and one the sum of two samples.
pub const FRACTION_BITS: u32 = 12;

/// Smallest input rate.
pub const MIN_RATE: Hertz = Hertz(1_000.0);
/// Largest input rate.
pub const MAX_RATE: Hertz = Hertz(102_400.0);
/// Upper end of the frequency range of the tool band.
pub const TOOL_BAND: Hertz = Hertz(5_000.0);
/// Upper end of the frequency range of the structure band.
pub const STRUCTURE_BAND: Hertz = Hertz(400.0);

/// Upper end of the flat band of the sharp half-band filter, as a fraction of its input rate.
const SHARP_FLAT: f32 = 0.195;
/// Upper end of the flat band of the medium half-band filter, as a fraction of its input rate.
const MEDIUM_FLAT: f32 = 0.13;

/// Error of a sample rate of the sensor that is outside the range that the decimation supports.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RateOutOfRange(pub Hertz);

impl core::fmt::Display for RateOutOfRange {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(
            f,
            "a sample rate of {} cannot be used: it must lie from {MIN_RATE} to {MAX_RATE}",
            self.0
        )
    }
}

impl core::error::Error for RateOutOfRange {}

/// Non-zero taps of a half-band filter of length 4·M − 1 on one side of the middle, in Q31, nearest first; the middle
/// tap is ½.
///
/// h\[2j+1\] = ±1/(π(2j+1)) times the Kaiser window I₀(β√(1 − r²))/I₀(β), r = (2j+1)/2M, scaled so that all taps sum
/// to 1 exactly.
const fn half_band<const M: usize>(beta: f64) -> [i32; M] {
    let mut ideal = [0.0; M];
    let mut sum = 0.0;
    let mut j = 0;
    while j < M {
        let offset = (2 * j + 1) as f64;
        let r = offset / (2 * M) as f64;
        let window = bessel_i0(beta * beta * (1.0 - r * r)) / bessel_i0(beta * beta);
        let sign = if j % 2 == 0 { 1.0 } else { -1.0 };
        ideal[j] = sign * window / (core::f64::consts::PI * offset);
        sum += ideal[j];
        j += 1;
    }
    let mut taps = [0; M];
    let mut left = 1 << 29;
    let mut j = M;
    while j > 0 {
        j -= 1;
        let scaled = ideal[j] / sum * 536_870_912.0;
        taps[j] = if scaled < 0.0 {
            (scaled - 0.5) as i32
        } else {
            (scaled + 0.5) as i32
        };
        left -= taps[j];
    }
    taps[0] += left;
    taps
}

/// Modified Bessel function I₀(√`square`) by its power series Σ (square/4)^k/(k!)².
const fn bessel_i0(square: f64) -> f64 {
    let (mut sum, mut term, mut k) = (1.0, 1.0, 1.0);
    while k < 60.0 {
        term *= square / (4.0 * k * k);
        sum += term;
        k += 1.0;
    }
    sum
}

/// Length in taps of a half-band filter with `side` non-zero taps on each side of its middle tap.
const fn length(side: usize) -> usize {
    4 * side - 1
}

/// Group delay in input samples of a half-band filter with `side` non-zero taps on each side: the distance of its
/// middle tap from the newest sample.
const fn delay(side: usize) -> u32 {
    2 * side as u32 - 1
}

const SHARP_SIDE: usize = 15;
const MEDIUM_SIDE: usize = 7;
const EASY_SIDE: usize = 5;

// The argument of `half_band` is the β of the Kaiser window. For each filter length, β is the value with the largest
// stop-band attenuation, found by trial.

/// Sharp filter, pass band to 0.195 and stop band from 0.305 of its input rate: the last stage before the tool band.
static SHARP: [i32; SHARP_SIDE] = half_band(10.3);
/// Medium filter, pass band to 0.13 and stop band from 0.37 of its input rate: the earlier stages before the tool
/// band, and the last stage before the structure band.
static MEDIUM: [i32; MEDIUM_SIDE] = half_band(10.6);
/// Easy filter, pass band to 0.065 and stop band from 0.435 of its input rate: the stages between tool band and
/// structure band, except for the last one.
static EASY: [i32; EASY_SIDE] = half_band(11.4);

/// State of one filter stage of the decimation: its last LENGTH input samples. They are stored twice in a row, so that
/// every window of LENGTH samples is contiguous.
#[derive(Clone, Debug)]
struct Stage<const LENGTH: usize> {
    samples: [[Sample; LENGTH]; 2],
    /// Index, within each of the two copies, at which the next input sample is stored.
    next: usize,
    /// True if the next input sample is the second of a pair, for which the filter gives no output sample.
    second: bool,
    filled: bool,
}

impl<const LENGTH: usize> Stage<LENGTH> {
    const fn new() -> Self {
        Self {
            samples: [[[0; 3]; LENGTH]; 2],
            next: 0,
            second: false,
            filled: false,
        }
    }

    /// Takes an input sample of the filter. Returns an output sample for the first of every two inputs, `None` for the
    /// second.
    fn step<const SIDE: usize>(&mut self, taps: &[i32; SIDE], x: Sample) -> Option<Sample> {
        if !self.filled {
            // The filter starts as if all earlier samples equalled the first one, so that gravity causes no step
            // response.
            self.samples.as_flattened_mut().fill(x);
            self.filled = true;
        }
        let newest = self.next;
        for copy in &mut self.samples {
            *copy.get_mut(newest)? = x;
        }
        self.next = if newest + 1 == LENGTH { 0 } else { newest + 1 };
        self.second = !self.second;
        if !self.second {
            return None;
        }
        let window = self.samples.as_flattened().get(newest + 1..)?.first_chunk()?;
        // `black_box` keeps the compiler from replacing the products with the constant taps by slower shifts and sums.
        let taps = core::hint::black_box(taps);
        Some([0, 1, 2].map(|axis| filter::<LENGTH, SIDE>(window, axis, taps)))
    }
}

/// Output of a half-band filter for one axis: the sum of taps times samples of the window, with the middle tap ½.
#[inline(always)]
fn filter<const LENGTH: usize, const SIDE: usize>(
    window: &[Sample; LENGTH],
    axis: usize,
    taps: &[i32; SIDE],
) -> i32 {
    const { assert!(LENGTH == length(SIDE)) };
    let middle = LENGTH / 2;
    let mut sum = (i64::from(window[middle][axis]) << 30) + (1 << 30);
    for (j, &tap) in taps.iter().enumerate() {
        // The filter taps at even distances from the middle are zero; those at the odd distance 2j + 1 are equal on
        // both sides.
        let pair = window[middle - 1 - 2 * j][axis] + window[middle + 1 + 2 * j][axis];
        sum += i64::from(pair) * i64::from(tap);
    }
    (sum >> 31) as i32
}

/// The cascade of decimation filters, configured for one nominal sample rate of the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Decimation {
    /// Number of halvings of the sample rate with the medium filter before the tool band, 0 to 2.
    medium_halvings: u8,
    /// True if one halving of the sample rate with the sharp filter comes last before the tool band.
    sharp_halving: bool,
    /// Number of halvings of the sample rate from the tool band to the structure band, 0 to 4. The last uses the medium
    /// filter, all others the easy one.
    structure_halvings: u8,
}

/// State of the decimation cascade: the samples stored in its filter stages.
#[derive(Clone, Debug)]
pub struct State {
    medium: [Stage<{ length(MEDIUM_SIDE) }>; 2],
    sharp: Stage<{ length(SHARP_SIDE) }>,
    easy: [Stage<{ length(EASY_SIDE) }>; 3],
    last: Stage<{ length(MEDIUM_SIDE) }>,
}

impl State {
    /// The state of the decimation cascade before the first sample.
    pub const fn new() -> Self {
        Self {
            medium: [const { Stage::new() }; 2],
            sharp: Stage::new(),
            easy: [const { Stage::new() }; 3],
            last: Stage::new(),
        }
    }

    /// Resets the decimation filters to the initial state, after a gap in the samples.
    pub fn reset(&mut self) {
        *self = Self::new();
    }
}

impl Default for State {
    fn default() -> Self {
        Self::new()
    }
}

/// Output of the decimation cascade for one input sample: a sample of the tool band and one of the structure band,
/// each only when due.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Output {
    /// A sample of the tool band, if this input sample completes one.
    pub tool: Option<Sample>,
    /// A sample of the structure band, if this input sample completes one.
    pub structure: Option<Sample>,
}

impl Decimation {
    /// Configures the decimation cascade for a nominal sample rate of the sensor.
    pub fn new(nominal_rate: Hertz) -> Result<Self, RateOutOfRange> {
        if !(MIN_RATE.0..=MAX_RATE.0).contains(&nominal_rate.0) {
            return Err(RateOutOfRange(nominal_rate));
        }
        let mut rate = nominal_rate.0;
        let mut halvings_while = |possible: &dyn Fn(f32) -> bool| {
            let mut halvings = 0;
            while possible(rate) {
                rate /= 2.0;
                halvings += 1;
            }
            halvings
        };
        Ok(Self {
            medium_halvings: halvings_while(&|rate| rate * MEDIUM_FLAT >= TOOL_BAND.0),
            sharp_halving: halvings_while(&|rate| rate * SHARP_FLAT >= TOOL_BAND.0) == 1,
            structure_halvings: halvings_while(&|rate| rate / 2.0 >= 4.0 * STRUCTURE_BAND.0),
        })
    }

    /// Number of sensor samples per sample of the tool band: 1, 2 or 4.
    pub fn tool_divisor(&self) -> u32 {
        1 << (self.medium_halvings + u8::from(self.sharp_halving))
    }

    /// Number of sensor samples per sample of the structure band: 1 to 64.
    pub fn structure_divisor(&self) -> u32 {
        self.tool_divisor() << self.structure_halvings
    }

    /// Group delay of the filters before the tool band, in sensor samples, equal at all frequencies.
    ///
    /// The output with input sample i corresponds to the signal at input sample i − delay.
    pub fn tool_delay(&self) -> u32 {
        let medium = delay(MEDIUM_SIDE) * ((1 << self.medium_halvings) - 1);
        let sharp = if self.sharp_halving {
            delay(SHARP_SIDE) << self.medium_halvings
        } else {
            0
        };
        medium + sharp
    }

    /// Group delay of the filters before the structure band, in sensor samples, equal at all frequencies; counted as in
    /// [`tool_delay`](Self::tool_delay).
    pub fn structure_delay(&self) -> u32 {
        let Some(easy) = self.structure_halvings.checked_sub(1) else {
            return self.tool_delay();
        };
        let after_tool_band = delay(EASY_SIDE) * ((1 << easy) - 1) + (delay(MEDIUM_SIDE) << easy);
        self.tool_delay() + self.tool_divisor() * after_tool_band
    }

    /// Decimates one sample of the sensor.
    #[inline(never)]
    pub fn step(&self, state: &mut State, counts: Counts) -> Output {
        let mut tool = Some(counts.map(|c| i32::from(c) << FRACTION_BITS));
        for stage in state.medium.iter_mut().take(self.medium_halvings.into()) {
            tool = tool.and_then(|x| stage.step(&MEDIUM, x));
        }
        if self.sharp_halving {
            tool = tool.and_then(|x| state.sharp.step(&SHARP, x));
        }
        let mut structure = tool;
        if let Some(easy) = self.structure_halvings.checked_sub(1) {
            for stage in state.easy.iter_mut().take(easy.into()) {
                structure = structure.and_then(|x| stage.step(&EASY, x));
            }
            structure = structure.and_then(|x| state.last.step(&MEDIUM, x));
        }
        Output { tool, structure }
    }
}
