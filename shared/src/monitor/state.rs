//! The state of the signal chain.

use heapless::Vec;

use super::band_state::BandState;
use super::{Band, MAX_BLOCK_STROBES, Strobe};
use crate::acceleration::{Counts, SampleClockState};
use crate::advice::Advice;
use crate::decimation;
use crate::detector::Verdict;
use crate::detector::finding::Finding;
use crate::detector::judge::Detector;
use crate::peaks::Rotation;
use crate::spectrum::{PowerSpectrum, STRUCTURE_BINS, STRUCTURE_POINTS, TOOL_BINS, TOOL_POINTS};
use crate::tachometer::TachometerState;
use crate::units::{Degrees, Hertz, Rpm};
use crate::working_point::WorkingPoint;

/// The state of the signal chain: everything learned from the blocks of samples so far.
#[derive(Clone, Debug)]
pub struct State {
    pub(super) sample_clock: SampleClockState,
    pub(super) tachometer: TachometerState,
    /// Number of times that the tachometer had lost its lock up to the preceding block.
    pub(super) losses: u32,
    /// The newest sample of the sensor.
    pub(super) last_counts: Counts,
    pub(super) decimation: decimation::State,
    pub(super) structure: BandState<STRUCTURE_POINTS, STRUCTURE_BINS>,
    pub(super) tool: BandState<TOOL_POINTS, TOOL_BINS>,
    pub(super) tool_work: [i32; TOOL_POINTS],
    pub(super) work: [f32; STRUCTURE_POINTS],
    /// Running mean over the blocks of the share of samples that are clipped or lost.
    pub(super) damage: f32,
    /// Rotation of the spindle estimated from the newest spectrum of the tool band; `None` if the
    /// tachometer measures the speed, or if no tooth-passing tone was found.
    pub(super) tone_speed: Option<Rotation>,
    pub(super) detector: Detector,
    pub(super) advice: Option<Advised>,
    pub(super) strobes: Vec<Strobe, MAX_BLOCK_STROBES>,
}

/// The newest advice, with the inputs from which it was computed and whose change requires a new one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Advised {
    pub(super) advice: Advice,
    pub(super) verdict: Verdict,
    pub(super) chatter: Option<Hertz>,
    pub(super) speed: Rpm,
    pub(super) working_point: Option<WorkingPoint>,
    /// CRC-32 of the lobe table, from its header; `None` without a table.
    pub(super) table: Option<u32>,
    /// Feed direction of the cut for which the advice was computed, if it is set.
    pub(super) feed_direction: Option<Degrees>,
}

impl Default for State {
    fn default() -> Self {
        Self::new()
    }
}

impl State {
    /// The initial state.
    pub const fn new() -> Self {
        Self {
            sample_clock: SampleClockState::new(),
            tachometer: TachometerState::new(),
            losses: 0,
            last_counts: [0; 3],
            decimation: decimation::State::new(),
            structure: BandState::new(),
            tool: BandState::new(),
            tool_work: [0; TOOL_POINTS],
            work: [0.0; STRUCTURE_POINTS],
            damage: 0.0,
            tone_speed: None,
            detector: Detector::new(),
            advice: None,
            strobes: Vec::new(),
        }
    }

    /// Resets the signal chain to its initial state in place. A state is too large for the stack of a microcontroller.
    pub fn reset(&mut self) {
        let Self {
            sample_clock,
            tachometer,
            losses,
            last_counts,
            decimation,
            structure,
            tool,
            tool_work: _,
            work: _,
            damage,
            tone_speed,
            detector,
            advice,
            strobes,
        } = self;
        *sample_clock = SampleClockState::new();
        *tachometer = TachometerState::new();
        *last_counts = [0; 3];
        *decimation = decimation::State::new();
        structure.reset();
        tool.reset();
        *detector = Detector::new();
        strobes.clear();
        (*losses, *damage, *tone_speed, *advice) = (0, 0.0, None, None);
    }

    /// The points of the stroboscopic map from the newest block, oldest first. They come from the structure band if
    /// the tooth period is long enough for it, else from the tool band.
    pub fn strobes(&self) -> &[Strobe] {
        &self.strobes
    }

    /// The newest power spectrum of a band, summed over the axes; `None` before the first.
    pub fn spectrum(&self, band: Band) -> Option<PowerSpectrum<'_>> {
        match band {
            Band::Structure => self.structure.spectrum(),
            Band::Tool => self.tool.spectrum(),
        }
    }

    /// True if the newest block of samples completed a spectrum of the band.
    pub fn has_fresh_spectrum(&self, band: Band) -> bool {
        match band {
            Band::Structure => self.structure.fresh,
            Band::Tool => self.tool.fresh,
        }
    }

    /// The newest finding of the estimators of vibration growth, from the tooth periods of a band.
    pub fn finding(&self, band: Band) -> &Finding {
        match band {
            Band::Structure => self.structure.growth.finding(),
            Band::Tool => self.tool.growth.finding(),
        }
    }

    /// The sample clock of the accelerometer: fitted rate, clipped and lost samples.
    pub fn sample_clock(&self) -> &SampleClockState {
        &self.sample_clock
    }

    /// The tachometer estimator: speed per revolution, rejected and missing edges.
    pub fn tachometer(&self) -> &TachometerState {
        &self.tachometer
    }
}
