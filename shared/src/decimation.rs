//! Half-band cascade: one stream of counts in, the tool band and the structure band out.
//!
//! | band | flat | rate |
//! |---|---|---|
//! | tool | to 5 kHz | half the input where that still holds 5 kHz, else the input itself |
//! | structure | to 400 Hz | the input halved to the smallest rate of at least 1 600 Hz |
//!
//! Every stage is a symmetric half-band filter: y\[n\] = Σ h\[i\]·x\[2n − i\], i = 0 … 4m − 2, whose odd taps but the middle
//! one vanish. The taps are a Kaiser-windowed sinc, computed at compile time. What folds back into the flat
//! band is at least 90 dB down, the ripple is below 0.001 dB, and gain at 0 Hz is exactly 1. The bands keep their
//! upper ends with a sample clock up to 3 % slow.
//!
//! Samples are fixed point with [`FRACTION_BITS`] bits below one count. A stage sums its products in 64 bits without
//! error and rounds once.

use crate::acceleration::Counts;
use crate::units::Hertz;

/// Three axes x, y, z at one instant, in units of 2^−[`FRACTION_BITS`] counts.
pub type Sample = [i32; 3];

/// Bits below one count.
///
/// With them a full-scale count is 2²⁷; the 4 bits left above hold the overshoot of any input, which the taps' absolute
/// sums bound by 2³ over the whole cascade.
pub const FRACTION_BITS: u32 = 12;

/// Slowest input rate.
pub const MIN_RATE: Hertz = Hertz(1_000.0);
/// Fastest input rate.
pub const MAX_RATE: Hertz = Hertz(32_000.0);
/// Upper end of the tool band.
pub const TOOL_BAND: Hertz = Hertz(5_000.0);
/// Upper end of the structure band.
pub const STRUCTURE_BAND: Hertz = Hertz(400.0);

/// The filter to the tool band is flat to this fraction of its input rate.
const TOOL_FLAT: f32 = 0.195;

/// Rate of an input that the cascade does not take.
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

/// Non-zero taps of a half-band filter of length 4·M − 1 on one side of the middle, in Q31, nearest first; the middle tap is ½.
///
/// h\[2j+1\] = ±1/(π(2j+1)) times the Kaiser window I₀(β√(1 − r²))/I₀(β), r = (2j+1)/2M, scaled so that all taps sum to 1 exactly.
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

const TOOL_SIDE: usize = 15;
const EARLY_SIDE: usize = 5;
const LAST_SIDE: usize = 7;

// For each length the β that gives the most rejection over the stated band, found by trying.

/// To the tool band: flat to 0.195 of the input rate, shut from 0.305.
static TOOL_TAPS: [i32; TOOL_SIDE] = half_band(10.3);
/// To the structure band, all stages but the last: flat to 0.065 of the input rate, shut from 0.435.
static EARLY_TAPS: [i32; EARLY_SIDE] = half_band(11.4);
/// The last stage to the structure band: flat to 0.13 of the input rate, shut from 0.37.
static LAST_TAPS: [i32; LAST_SIDE] = half_band(10.6);

/// Input samples by which the middle tap of a filter lags its newest one.
const fn delay(side: usize) -> u32 {
    2 * side as u32 - 1
}

/// The last LENGTH = 4·M − 1 samples of a stage, kept twice so that they always lie in one piece; RING = 2·LENGTH.
#[derive(Clone, Debug)]
struct Stage<const RING: usize> {
    ring: [Sample; RING],
    /// Where the next sample goes, below RING/2.
    next: usize,
    /// The next sample completes a pair.
    odd: bool,
    filled: bool,
}

impl<const RING: usize> Stage<RING> {
    const fn new() -> Self {
        Self {
            ring: [[0; 3]; RING],
            next: 0,
            odd: false,
            filled: false,
        }
    }

    /// Takes a sample and returns the filtered one for the first of every two.
    fn step(&mut self, taps: &[i32], x: Sample) -> Option<Sample> {
        let length = RING / 2;
        if !self.filled {
            // As if the first sample had always been there: gravity makes no step.
            self.ring = [x; RING];
            self.filled = true;
        }
        let newest = self.next;
        if let Some(slot) = self.ring.get_mut(newest) {
            *slot = x;
        }
        if let Some(slot) = self.ring.get_mut(newest + length) {
            *slot = x;
        }
        self.next = if newest + 1 == length { 0 } else { newest + 1 };
        self.odd = !self.odd;
        if !self.odd {
            return None;
        }
        self.ring
            .get(newest + 1..=newest + length)
            .map(|window| filter(window, taps))
    }
}

/// Σ of the taps times the window, whose middle has the tap ½.
fn filter(window: &[Sample], taps: &[i32]) -> Sample {
    let middle = window.len() / 2;
    let (older, rest) = window.split_at(middle);
    let [centre, newer @ ..] = rest else { return [0; 3] };
    let mut sums = centre.map(|x| (i64::from(x) << 30) + (1 << 30));
    // Every second neighbour of the middle, going outwards.
    for ((a, b), &tap) in older
        .iter()
        .rev()
        .step_by(2)
        .zip(newer.iter().step_by(2))
        .zip(taps)
    {
        for axis in 0..3 {
            sums[axis] += i64::from(a[axis] + b[axis]) * i64::from(tap);
        }
    }
    sums.map(|sum| (sum >> 31) as i32)
}

/// The cascade for one nominal input rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Decimation {
    /// Whether the tool band has half the input rate.
    tool_halved: bool,
    /// Halvings from the tool band to the structure band, 0 to 4.
    structure_halvings: u8,
}

/// What the cascade remembers.
#[derive(Clone, Debug)]
pub struct State {
    tool: Stage<{ 2 * (4 * TOOL_SIDE - 1) }>,
    early: [Stage<{ 2 * (4 * EARLY_SIDE - 1) }>; 3],
    last: Stage<{ 2 * (4 * LAST_SIDE - 1) }>,
}

impl State {
    /// Before the first sample.
    pub const fn new() -> Self {
        Self {
            tool: Stage::new(),
            early: [const { Stage::new() }; 3],
            last: Stage::new(),
        }
    }

    /// Forgets the past, after a gap: the next sample counts as the first.
    pub fn reset(&mut self) {
        *self = Self::new();
    }
}

impl Default for State {
    fn default() -> Self {
        Self::new()
    }
}

/// What one input sample brought out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Output {
    /// The next sample of the tool band.
    pub tool: Option<Sample>,
    /// The next sample of the structure band.
    pub structure: Option<Sample>,
}

impl Decimation {
    /// The cascade for inputs of this nominal rate.
    pub fn new(nominal_rate: Hertz) -> Result<Self, RateOutOfRange> {
        if !(MIN_RATE.0..=MAX_RATE.0).contains(&nominal_rate.0) {
            return Err(RateOutOfRange(nominal_rate));
        }
        let tool_halved = nominal_rate.0 * TOOL_FLAT >= TOOL_BAND.0;
        let mut rate = if tool_halved {
            nominal_rate.0 / 2.0
        } else {
            nominal_rate.0
        };
        let mut structure_halvings = 0;
        while rate / 2.0 >= 4.0 * STRUCTURE_BAND.0 {
            rate /= 2.0;
            structure_halvings += 1;
        }
        Ok(Self {
            tool_halved,
            structure_halvings,
        })
    }

    /// Input samples per sample of the tool band: 1 or 2.
    pub fn tool_divisor(&self) -> u32 {
        if self.tool_halved { 2 } else { 1 }
    }

    /// Input samples per sample of the structure band: 1 to 16.
    pub fn structure_divisor(&self) -> u32 {
        self.tool_divisor() << self.structure_halvings
    }

    /// Group delay of the tool band in input samples, at all frequencies.
    ///
    /// The output that comes with input sample i shows the signal as it was at input sample i − delay.
    pub fn tool_delay(&self) -> u32 {
        if self.tool_halved { delay(TOOL_SIDE) } else { 0 }
    }

    /// Group delay of the structure band in input samples, as for [`tool_delay`](Self::tool_delay).
    pub fn structure_delay(&self) -> u32 {
        let mut total = self.tool_delay();
        for stage in 0..self.structure_halvings {
            let side = if stage + 1 == self.structure_halvings {
                LAST_SIDE
            } else {
                EARLY_SIDE
            };
            total += delay(side) * (self.tool_divisor() << stage);
        }
        total
    }

    /// Takes one sample of the sensor.
    pub fn step(&self, state: &mut State, counts: Counts) -> Output {
        let x = counts.map(|c| i32::from(c) << FRACTION_BITS);
        let tool = if self.tool_halved {
            state.tool.step(&TOOL_TAPS, x)
        } else {
            Some(x)
        };
        let mut structure = tool;
        if let Some(early) = self.structure_halvings.checked_sub(1) {
            for stage in state.early.iter_mut().take(usize::from(early)) {
                structure = structure.and_then(|x| stage.step(&EARLY_TAPS, x));
            }
            structure = structure.and_then(|x| state.last.step(&LAST_TAPS, x));
        }
        Output { tool, structure }
    }
}
