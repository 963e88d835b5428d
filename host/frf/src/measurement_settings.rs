//! How receptances are measured from recordings.

use std::ops::Range;

use super::estimate::Estimator;
use super::excitation::Excitation;
use super::hammer::HammerWindows;
use super::window::Window;

/// How to measure.
#[derive(Clone, Debug)]
pub struct MeasurementSettings {
    /// How it was driven; by the kind of each recording where it is not given.
    pub excitation: Option<Excitation>,
    /// How spectra become an FRF.
    pub estimator: Estimator,
    /// Distance of the frequencies, Hz. Where it is not given: for random excitation eight half-overlapping segments
    /// for each force, for sweeps eight frequencies averaged for each force.
    pub resolution_hz: Option<f64>,
    /// Part by which segments overlap.
    pub overlap: f64,
    /// Window of the segments of random excitation.
    pub window: Window,
    /// First and last frequency, Hz; all where it is not given.
    pub band_hz: Option<(f64, f64)>,
    /// Names of channels where not all are meant.
    pub channels: Vec<String>,
    /// Windows of hammer blows.
    pub hammer: HammerWindows,
    /// The force that is meant, N, where a step-sine test has several levels.
    pub force_n: Option<f64>,
}

impl Default for MeasurementSettings {
    fn default() -> Self {
        Self {
            excitation: None,
            estimator: Estimator::H1,
            resolution_hz: None,
            overlap: 0.5,
            window: Window::Hann,
            band_hz: None,
            channels: Vec::new(),
            hammer: HammerWindows::default(),
            force_n: None,
        }
    }
}

/// Lines of a transform within the band; never 0 Hz.
pub(super) fn band(settings: &MeasurementSettings, rate: f64, length: usize) -> Range<usize> {
    let line = |hertz: f64| hertz * length as f64 / rate;
    match settings.band_hz {
        Some((first, last)) => {
            (line(first).ceil().max(1.0) as usize)..(line(last).floor().max(0.0) as usize + 1)
        }
        None => 1..length / 2,
    }
}
