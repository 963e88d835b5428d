//! Raw acceleration: blocks of counts with sequence number, time stamp, clips and gaps, and the
//! sensor's clock fitted against the device's.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::event_clock::{EventClock, EventClockState, Observation};
use crate::units::{Hertz, Nanoseconds};

/// The most samples in one block.
pub const MAX_BLOCK_SAMPLES: usize = 64;

/// Raw counts of the three axes x, y, z of the sensor at one instant.
pub type Counts = [i16; 3];

/// A block of consecutive samples as they come from the sensor.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Block {
    /// Counts up by one per block; a jump means lost blocks.
    pub sequence: u32,
    /// When the first sample of the block was taken, on the device's clock.
    pub time: Nanoseconds,
    /// Samples that the sensor or the link lost between the block before and this one.
    pub lost: u32,
    /// Samples of this block in which at least one axis stood at the end of its range.
    pub clipped: u16,
    /// The samples, oldest first.
    pub counts: Vec<Counts, MAX_BLOCK_SAMPLES>,
}

/// What is known of the accelerometer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sensor {
    /// The rate the sensor is meant to have; the true one is fitted from the time stamps.
    pub nominal_rate: Hertz,
    /// Acceleration of one count, in m/s².
    pub meters_per_second2_per_count: f32,
    /// White noise of one axis, in m/s² per √Hz: below it nothing is a signal.
    pub noise_meters_per_second2_per_root_hertz: f32,
}

impl Sensor {
    /// The IIS3DWB at ±16 g: 26 667 Hz, 0.488 mg per count, 75 µg/√Hz.
    pub const IIS3DWB_16G: Self = Self {
        nominal_rate: Hertz(26_667.0),
        meters_per_second2_per_count: 0.488e-3 * 9.806_65,
        noise_meters_per_second2_per_root_hertz: 75e-6 * 9.806_65,
    };

    /// The clock that follows the true sample rate of this sensor.
    pub fn clock(&self) -> SampleClock {
        let period_ns = 1e9 / self.nominal_rate.0;
        SampleClock {
            nominal_period_ns: period_ns,
            line: EventClock {
                memory: CLOCK_MEMORY_BLOCKS,
                period_uncertainty: 0.5 * RATE_TOLERANCE * period_ns / STAMP_JITTER_NS,
            },
        }
    }
}

/// True where one axis stands at an end of the 16-bit range.
pub fn is_clipped(counts: Counts) -> bool {
    counts.iter().any(|&c| c == i16::MAX || c == i16::MIN)
}

/// The sensor's rate is believed within this fraction of the nominal one: data sheets allow 3 %, and the
/// fit must not stand at the edge of it.
const RATE_TOLERANCE: f32 = 0.05;
/// Blocks after which a stamp weighs 1/e: 0.6 s of full blocks at 26 667 Hz. Long against jitter, short
/// against the warming-up of the sensor's oscillator.
const CLOCK_MEMORY_BLOCKS: f32 = 256.0;
/// Jitter of the stamps expected before any was seen: the latency of an interrupt.
const STAMP_JITTER_NS: f32 = 10_000.0;
/// A gap of more samples than this is not counted over: the stream begins anew.
const LONGEST_COUNTED_GAP: f32 = 20_000.0;

/// Numbers the samples of a stream of blocks and says when each was taken.
///
/// The sample clock of the sensor is off by up to a few percent, and the blocks are stamped by the
/// device's clock with jitter. `t(n) = a + b·n` is fitted to the stamps of the first samples of the blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleClock {
    nominal_period_ns: f32,
    line: EventClock,
}

/// Where the [`SampleClock`] stands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SampleClockState {
    line: Option<EventClockState>,
    /// Sequence number the next block should have.
    next_sequence: u32,
    /// Samples of the block before.
    block_samples: u32,
    /// Samples with a clipped axis since the start.
    clipped: u32,
    /// Samples lost since the start, as far as they could be counted.
    lost: u32,
    /// Times the stream was broken.
    gaps: u32,
}

/// How a block follows the one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Continuity {
    /// Its first sample is the next one.
    Contiguous,
    /// This many samples are missing before its first one.
    Gap(u32),
    /// The first block, or one whose distance to the one before cannot be counted.
    Restarted,
}

impl SampleClock {
    /// Takes note of a block.
    pub fn observe(&self, state: &mut SampleClockState, block: &Block) -> Continuity {
        let continuity = self.follow(state, block);
        match continuity {
            Continuity::Contiguous => {}
            Continuity::Gap(samples) => {
                state.gaps = state.gaps.saturating_add(1);
                state.lost = state.lost.saturating_add(samples);
            }
            Continuity::Restarted => {
                if state.line.is_some() {
                    state.gaps = state.gaps.saturating_add(1);
                    state.lost = state.lost.saturating_add(block.lost);
                }
                let period_ns = state.line.map_or(self.nominal_period_ns, |line| line.period_ns());
                state.line = Some(self.line.start(block.time, period_ns, STAMP_JITTER_NS));
            }
        }
        if let Some(line) = &mut state.line {
            let bound_ns = RATE_TOLERANCE * self.nominal_period_ns;
            line.limit_period(
                self.nominal_period_ns - bound_ns,
                self.nominal_period_ns + bound_ns,
            );
        }
        state.next_sequence = block.sequence.wrapping_add(1);
        state.block_samples = block.counts.len() as u32;
        state.clipped = state.clipped.saturating_add(u32::from(block.clipped));
        continuity
    }

    /// Continues the line with a block, where its distance to the one before can be counted.
    fn follow(&self, state: &mut SampleClockState, block: &Block) -> Continuity {
        let Some(line) = &mut state.line else {
            return Continuity::Restarted;
        };
        let lost = if block.sequence == state.next_sequence {
            block.lost
        } else {
            // Lost blocks say nothing of their lengths: the clock does, while its error stays below half a sample.
            let samples = line.events_to(block.time) - state.block_samples as f32;
            let error_ns2 = line.variance_at_ns2(samples);
            let half_ns = 0.5 * line.period_ns();
            if !(0.5..=LONGEST_COUNTED_GAP).contains(&samples) || error_ns2 > half_ns * half_ns {
                return Continuity::Restarted;
            }
            (samples + 0.5) as u32
        };
        if lost as f32 > LONGEST_COUNTED_GAP {
            return Continuity::Restarted;
        }
        match self.line.observe(line, state.block_samples + lost, block.time) {
            Observation::Restarted => Continuity::Restarted,
            _ if lost == 0 => Continuity::Contiguous,
            _ => Continuity::Gap(lost),
        }
    }
}

impl SampleClockState {
    /// Before the first block.
    pub const fn new() -> Self {
        Self {
            line: None,
            next_sequence: 0,
            block_samples: 0,
            clipped: 0,
            lost: 0,
            gaps: 0,
        }
    }

    /// Fitted time of sample number `n` of the newest block; 0 is its first.
    pub fn time_of(&self, n: u32) -> Option<Nanoseconds> {
        self.time_at(n as f32)
    }

    /// Fitted time `samples` (which may be a fraction, or negative) after the first sample of the newest block.
    pub fn time_at(&self, samples: f32) -> Option<Nanoseconds> {
        self.line.map(|line| line.time_at(samples))
    }

    /// Fitted sample rate against the device's clock.
    pub fn rate(&self) -> Option<Hertz> {
        self.line.map(|line| Hertz(1e9 / line.period_ns()))
    }

    /// Samples clipped since the start.
    pub fn clipped(&self) -> u32 {
        self.clipped
    }

    /// Samples lost since the start, as far as they could be counted.
    pub fn lost(&self) -> u32 {
        self.lost
    }

    /// Times the stream was broken since the start.
    pub fn gaps(&self) -> u32 {
        self.gaps
    }
}
