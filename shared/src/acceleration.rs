//! Raw acceleration: blocks of counts with sequence number, time stamp, and numbers of clipped and lost samples. The
//! sample clock of the sensor is fitted to the time stamps of the device.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::criteria::{
    LONGEST_COUNTED_GAP, SAMPLE_CLOCK_MEMORY_BLOCKS, SAMPLE_RATE_TOLERANCE, STAMP_JITTER_NS,
};
use crate::event_clock::{EventClock, EventClockState, Observation};
use crate::units::{Hertz, Nanoseconds};

/// Largest number of acceleration samples in one block.
pub const MAX_BLOCK_SAMPLES: usize = 64;

/// Raw counts of the three axes x, y, z of the sensor at one instant.
pub type Counts = [i16; 3];

/// A block of consecutive samples of the sensor.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Block {
    /// Sequence number, incremented by one per block; a jump means lost blocks.
    pub sequence: u32,
    /// Time of the first sample of the block, on the clock of the device.
    pub time: Nanoseconds,
    /// Number of samples lost between the preceding block and this one.
    pub lost: u32,
    /// Number of samples of this block in which at least one axis is at an end of the 16-bit range.
    pub clipped: u16,
    /// The samples, oldest first.
    pub counts: Vec<Counts, MAX_BLOCK_SAMPLES>,
}

/// The properties of the accelerometer that the signal chain uses.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sensor {
    /// Nominal sample rate of the accelerometer; its true rate is fitted to the time stamps of the device.
    pub nominal_rate: Hertz,
    /// Acceleration that one count of the sensor represents, in m/s².
    pub meters_per_second2_per_count: f32,
    /// Noise density of one axis of the sensor, in m/s² per √Hz; the noise is white.
    pub noise_meters_per_second2_per_root_hertz: f32,
}

impl Sensor {
    /// The IIS3DWB at ±16 g: 26 667 Hz, 0.488 mg per count, 75 µg/√Hz.
    pub const IIS3DWB_16G: Self = Self {
        nominal_rate: Hertz(26_667.0),
        meters_per_second2_per_count: 0.488e-3 * 9.806_65,
        noise_meters_per_second2_per_root_hertz: 75e-6 * 9.806_65,
    };

    /// The estimator of the true sample rate of this sensor, from the time stamps of its blocks.
    pub fn clock(&self) -> SampleClock {
        let period_ns = 1e9 / self.nominal_rate.0;
        SampleClock {
            nominal_period_ns: period_ns,
            line: EventClock {
                memory: SAMPLE_CLOCK_MEMORY_BLOCKS,
                period_uncertainty: 0.5 * SAMPLE_RATE_TOLERANCE * period_ns / STAMP_JITTER_NS,
            },
        }
    }
}

/// True if at least one axis of the sample is at an end of the 16-bit range.
pub fn is_clipped(counts: Counts) -> bool {
    counts.iter().any(|&c| c == i16::MAX || c == i16::MIN)
}

/// Estimator of the time of each sample.
///
/// The sensor's clock deviates by up to a few percent, and the device stamps the blocks with jitter. The line
/// `t(n) = a + b·n` is fitted to the time stamps of the blocks' first samples (n the number of the sample, b the
/// sample period).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleClock {
    nominal_period_ns: f32,
    line: EventClock,
}

/// State of a [`SampleClock`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SampleClockState {
    line: Option<EventClockState>,
    /// Sequence number that the next block of samples should have.
    next_sequence: u32,
    /// Number of samples in the block that was processed last.
    block_samples: u32,
    /// Number of samples with a clipped axis since the sample clock was started or reset.
    clipped: u32,
    /// Number of lost samples since the sample clock was started or reset. A gap of unknown length counts with the lost
    /// samples that its following block states.
    lost: u32,
    /// Number of gaps in the stream of samples, and of restarts of the fit without a gap, since the sample clock was
    /// started or reset.
    gaps: u32,
}

/// Relation of a block of samples to the preceding block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Continuity {
    /// No sample is missing between the preceding block and this one.
    Contiguous,
    /// This number of samples is missing between the preceding block and this one.
    Gap(u32),
    /// The sample clock is started anew: for example, at the first block, or after a gap that is too long or of unknown
    /// length.
    Restarted,
}

impl SampleClock {
    /// Processes a block of samples: updates the fitted sample clock and the counts of clipped and lost samples.
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
            let bound_ns = SAMPLE_RATE_TOLERANCE * self.nominal_period_ns;
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

    /// Updates the fitted line of the sample clock with the time stamp of a block, if the number of samples lost
    /// since the preceding block is known or can be estimated.
    fn follow(&self, state: &mut SampleClockState, block: &Block) -> Continuity {
        let Some(line) = &mut state.line else {
            return Continuity::Restarted;
        };
        let lost = if block.sequence == state.next_sequence {
            block.lost
        } else {
            // The number of samples in lost blocks is unknown. The fitted clock gives it, as long as the standard
            // deviation of its time is at most half a sample period.
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
    /// The state of the sample clock before the first block of samples.
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

    /// Fitted time at which sample `n` of the newest block was taken; n counts from 0. `None` before the first block.
    pub fn time_of(&self, n: u32) -> Option<Nanoseconds> {
        self.time_at(n as f32)
    }

    /// Fitted time at `samples` sample periods after the first sample of the newest block; fractions and negative
    /// values are allowed for `samples`. `None` before the first block.
    pub fn time_at(&self, samples: f32) -> Option<Nanoseconds> {
        self.line.map(|line| line.time_at(samples))
    }

    /// Sample rate of the sensor, fitted to the time stamps of the device's clock; `None` before the first block.
    pub fn rate(&self) -> Option<Hertz> {
        self.line.map(|line| Hertz(1e9 / line.period_ns()))
    }

    /// Number of samples with a clipped axis since the sample clock was started or reset.
    pub fn clipped(&self) -> u32 {
        self.clipped
    }

    /// Number of lost samples since the sample clock was started or reset. A gap of unknown length counts with the lost
    /// samples that its following block states.
    pub fn lost(&self) -> u32 {
        self.lost
    }

    /// Number of gaps in the stream of samples, and of restarts of the fit without a gap, since the sample clock was
    /// started or reset.
    pub fn gaps(&self) -> u32 {
        self.gaps
    }
}
