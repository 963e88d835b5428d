//! The state of one frequency band of the signal chain.

use super::loudness::Loudness;
use crate::decimation::Sample;
use crate::detector::growth::Growth;
use crate::detector::lines::Lines;
use crate::detector::tone::{Background, Tone};
use crate::peaks::Rotation;
use crate::spectrum::{Overlap, PowerSpectrum};
use crate::synchronous::SamplerState;
use crate::units::Hertz;

/// The state of one frequency band: samples for the next spectrum, the newest spectrum, background spectrum, tracked
/// tone, and tooth periods with their growth.
#[derive(Clone, Debug)]
pub(super) struct BandState<const POINTS: usize, const BINS: usize> {
    pub(super) overlap: Overlap<POINTS>,
    pub(super) power: [f32; BINS],
    /// Width of a bin of the newest spectrum of the band; 0 before the first spectrum.
    pub(super) bin: Hertz,
    /// True if the newest block completed a spectrum of the band.
    pub(super) fresh: bool,
    pub(super) background: Background<BINS>,
    pub(super) tone: Option<Tone>,
    /// Lines of the spindle in the newest spectrum; `None` while its speed is measured or not known.
    pub(super) lines: Option<Lines>,
    pub(super) sampler: SamplerState,
    pub(super) growth: Growth,
    /// True if the newest block completed a tooth period of the band after which the growth of the vibration was
    /// evaluated.
    pub(super) passed: bool,
    /// Root mean square of the sensor noise in one value (one axis at one angle) of a tooth period, in m/s².
    pub(super) floor: f32,
    /// Number of samples of the band since the growth of its vibration was last evaluated.
    pub(super) samples_since_growth: u32,
    pub(super) loudness: Loudness,
    /// Time since a tooth period of the band was last complete, s.
    pub(super) since_passing_s: f32,
    /// Number of tooth periods still to come that contain lost samples or their echo in the filters.
    pub(super) spoiled: u8,
}

impl<const POINTS: usize, const BINS: usize> BandState<POINTS, BINS> {
    pub(super) const fn new() -> Self {
        Self {
            overlap: Overlap::new(),
            power: [0.0; BINS],
            bin: Hertz(0.0),
            fresh: false,
            background: Background::new(),
            tone: None,
            lines: None,
            sampler: SamplerState::new(),
            growth: Growth::new(1),
            passed: false,
            floor: 0.0,
            samples_since_growth: 0,
            loudness: Loudness::new(),
            since_passing_s: 0.0,
            spoiled: 0,
        }
    }

    /// Resets the band to its initial state. Buffers that are written before they are read keep their content.
    pub(super) fn reset(&mut self) {
        let Self {
            overlap,
            power: _,
            bin,
            fresh,
            background,
            tone,
            lines,
            sampler,
            growth,
            passed,
            floor,
            samples_since_growth,
            loudness,
            since_passing_s,
            spoiled,
        } = self;
        overlap.reset();
        *bin = Hertz(0.0);
        background.reset();
        *sampler = SamplerState::new();
        growth.reset();
        *lines = None;
        (*fresh, *tone, *passed, *floor, *samples_since_growth) = (false, None, false, 0.0, 0);
        (*loudness, *since_passing_s, *spoiled) = (Loudness::new(), 0.0, 0);
    }

    /// Takes a sample of the band for its next spectrum; a spectrum is due every `hop` samples.
    pub(super) fn take(&mut self, sample: Sample, hop: usize) {
        self.fresh |= self.overlap.push(sample, hop);
        self.loudness.take(sample);
        self.samples_since_growth = self.samples_since_growth.saturating_add(1);
    }

    /// Prepares for a block of `seconds`.
    pub(super) fn begin_block(&mut self, seconds: f32) {
        (self.passed, self.fresh) = (false, false);
        self.since_passing_s += seconds;
    }

    /// Discards the samples, tracked tone and tooth periods of the band after a gap in the samples. The newest
    /// spectrum and the background spectrum are kept.
    pub(super) fn interrupt(&mut self) {
        self.overlap.reset();
        (self.tone, self.lines) = (None, None);
        self.interrupt_angles();
    }

    /// Discards the tooth periods of the band and their growth, after the tachometer lost its lock.
    pub(super) fn interrupt_angles(&mut self) {
        self.sampler = SamplerState::new();
        self.growth.reset();
    }

    pub(super) fn spectrum(&self) -> Option<PowerSpectrum<'_>> {
        (self.bin.0 > 0.0).then_some(PowerSpectrum {
            power: &self.power,
            bin: self.bin,
        })
    }
}

/// Updates the tracked tone of a band from its new spectrum. Also updates the background spectrum unless there is
/// chatter. `noise` is the power of the sensor's noise in one bin, (m/s²)².
pub(super) fn follow_tone<const POINTS: usize, const BINS: usize>(
    band: &mut BandState<POINTS, BINS>,
    rotation: Option<Rotation>,
    (from, to): (Hertz, Hertz),
    chatter: bool,
    noise: f32,
    work: &mut [f32],
) {
    let spectrum = PowerSpectrum {
        power: &band.power,
        bin: band.bin,
    };
    let found = if band.background.is_learnt() {
        band.background
            .new_tone(&spectrum, rotation, (from, to), noise, work)
    } else {
        None
    };
    band.tone = Tone::follow(band.tone, found, &spectrum);
    if !chatter {
        band.background.learn(&band.power, noise);
    }
}
