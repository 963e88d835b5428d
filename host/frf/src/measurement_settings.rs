//! Settings of an FRF measurement.

use std::ops::Range;

use super::estimate::Estimator;
use super::excitation::Excitation;
use super::hammer::HammerWindows;
use super::window::Window;

/// Settings of an FRF measurement from recordings.
#[derive(Clone, Debug)]
pub struct MeasurementSettings {
    /// Kind of excitation of all recordings; `None` determines it for each recording from its sidecar and its force.
    pub excitation: Option<Excitation>,
    /// FRF estimator.
    pub estimator: Estimator,
    /// Frequency resolution (line spacing), Hz, without effect on periodic excitation and step-sine tests. In a hammer
    /// test it sets the segment length if [`HammerWindows`] does not. `None` selects, for each force, about eight
    /// segments at half overlap in the shortest recording with random excitation, and an average over eight lines in a
    /// sweep.
    pub resolution_hz: Option<f64>,
    /// Overlap of the segments of random excitation, as a fraction of their length.
    pub overlap: f64,
    /// Time window of the segments of random excitation.
    pub window: Window,
    /// First and last frequency to evaluate, Hz; `None` for all frequencies above 0 Hz.
    pub band_hz: Option<(f64, f64)>,
    /// Names of the channels to evaluate. If forces are among them, no other force counts; the same holds for
    /// responses.
    pub channels: Vec<String>,
    /// Segment length and exponential window of hammer tests.
    pub hammer: HammerWindows,
    /// Mass of the accelerometer, kg, whose effect on the receptances is removed; `None` removes nothing.
    pub accelerometer_mass_kg: Option<f64>,
    /// Period of periodic excitation, s; `None` finds it from the force.
    pub period_s: Option<f64>,
    /// True if force and sensor of one direction are at one point, so that its receptance is that of a drive point: its sign
    /// is checked, and the mass of the accelerometer is estimated from it.
    pub has_drive_points: bool,
    /// Force level of a step-sine test to evaluate, N; `None` takes the only level, and a test with several is refused.
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
            accelerometer_mass_kg: None,
            period_s: None,
            has_drive_points: true,
            force_n: None,
        }
    }
}

/// Indices of the lines within the band to evaluate, without 0 Hz, of a transform of `length` samples at the sampling
/// rate `rate`, Hz. Lines of the band above half the sampling rate are included. Without a band, the lines 1 to
/// ⌊`length`/2⌋ − 1.
pub(super) fn band(settings: &MeasurementSettings, rate: f64, length: usize) -> Range<usize> {
    let line = |hertz: f64| hertz * length as f64 / rate;
    match settings.band_hz {
        Some((first, last)) => {
            (line(first).ceil().max(1.0) as usize)..(line(last).floor().max(0.0) as usize + 1)
        }
        None => 1..length / 2,
    }
}
