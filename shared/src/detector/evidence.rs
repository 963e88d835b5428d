//! What one step of the pipeline knows.

use crate::detector::finding::Finding;
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
    /// The speed is moving too fast for the passings to be compared.
    pub changing: bool,
    /// Too many samples are clipped or lost.
    pub damaged: bool,
    /// Number of teeth.
    pub teeth: u8,
    /// Findings of structure and tool band; `None` where the band cannot be sampled at fixed angles.
    pub findings: [Option<&'a Finding>; BANDS],
    /// New passings since the step before.
    pub new_passings: [bool; BANDS],
    /// Noise of the sensor in one channel of a passing, in m/s².
    pub floors: [f32; BANDS],
    /// The newest spectra.
    pub spectra: [Option<PowerSpectrum<'a>>; BANDS],
    /// The tones that stand out of the background.
    pub tones: [Option<&'a Tone>; BANDS],
    /// A spectrum has a background to stand out of.
    pub heard: bool,
    /// New spectra since the step before.
    pub new_spectra: [bool; BANDS],
}
