//! The configured signal chain.

use super::settings::{self, Settings, SettingsError};
use crate::acceleration::SampleClock;
use crate::decimation::{Decimation, FRACTION_BITS};
use crate::tachometer::Tachometer;

/// The configured signal chain. It is constant; everything learned from the blocks is in [`State`](super::State).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Monitor {
    pub(super) settings: Settings,
    pub(super) sample_clock: SampleClock,
    pub(super) tachometer: Option<Tachometer>,
    pub(super) decimation: Decimation,
}

impl Monitor {
    /// Configures the signal chain.
    ///
    /// # Errors
    /// [`SettingsError`] names the invalid setting and its value.
    pub fn new(settings: Settings) -> Result<Self, SettingsError> {
        settings::check(&settings)?;
        let tachometer = match settings.wheel {
            None => None,
            Some(wheel) => Some(Tachometer::new(wheel).ok_or(SettingsError::Wheel(wheel))?),
        };
        let rate = settings.sensor.nominal_rate;
        let decimation = Decimation::new(rate).map_err(|_| SettingsError::SampleRate(rate))?;
        Ok(Self {
            settings,
            sample_clock: settings.sensor.clock(),
            tachometer,
            decimation,
        })
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// One-sided spectral density of one axis of the sensor, from its white noise and its rounding to counts, in
    /// (m/s²)² per Hz.
    pub(super) fn noise_density(&self) -> f32 {
        let sensor = &self.settings.sensor;
        let density = sensor.noise_meters_per_second2_per_root_hertz;
        let step = sensor.meters_per_second2_per_count;
        density * density + step * step / 6.0 / sensor.nominal_rate.0
    }

    /// Acceleration in m/s² that one unit of a decimated sample represents.
    pub(super) fn unit(&self) -> f32 {
        self.settings.sensor.meters_per_second2_per_count / (1 << FRACTION_BITS) as f32
    }
}
