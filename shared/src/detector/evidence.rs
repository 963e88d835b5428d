//! What one step of the pipeline knows.

use crate::detector::finding::Finding;
use crate::detector::lines::Lines;
use crate::detector::tone::Tone;
use crate::spectrum::PowerSpectrum;
use crate::units::Hertz;

/// Number of bands: structure, tool.
pub const BANDS: usize = 2;

/// What one step of the pipeline knows.
#[derive(Clone, Copy, Debug)]
pub struct Evidence<'a> {
    /// Revolutions per second; `None` where no one knows.
    pub speed: Option<Hertz>,
    /// Time since the step before, s.
    pub seconds: f32,
    /// Root mean square of the samples of each band about their mean, in any unit that stays.
    pub loudness: [f32; BANDS],
    /// The speed is moving too fast for the passings to be compared.
    pub changing: bool,
    /// Too many samples are clipped or lost.
    pub damaged: bool,
    /// Number of teeth.
    pub teeth: u8,
    /// Findings of structure and tool band; `None` where the band is not sampled at fixed angles.
    pub findings: [Option<&'a Finding>; BANDS],
    /// New passings since the step before.
    pub new_passings: [bool; BANDS],
    /// Noise of the sensor in one channel of a passing, in m/s².
    pub floors: [f32; BANDS],
    /// The newest spectra.
    pub spectra: [Option<PowerSpectrum<'a>>; BANDS],
    /// The lines of the spindle in these spectra; `None` where its speed is measured or not known.
    pub lines: [Option<&'a Lines>; BANDS],
    /// The tones that stand out of the background.
    pub tones: [Option<&'a Tone>; BANDS],
    /// New spectra since the step before.
    pub new_spectra: [bool; BANDS],
}
