//! The settings of the signal chain and their check.

use serde::{Deserialize, Serialize};

use crate::acceleration::Sensor;
use crate::decimation::{MAX_RATE, MIN_RATE};
use crate::tachometer::Wheel;
use crate::units::{Hertz, Rpm};
use crate::working_point::{Limits, Tool};

/// The settings of the signal chain. The host may change them over the link.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The accelerometer.
    pub sensor: Sensor,
    /// The tool.
    pub tool: Tool,
    /// The tachometer wheel; `None` without a tachometer.
    pub wheel: Option<Wheel>,
    /// Spindle speed that is assumed if no tachometer measures it; `None` if unknown.
    pub assumed_speed: Option<Rpm>,
    /// Speed limits of the spindle; `None` without limits.
    pub limits: Option<Limits>,
}

/// Largest number of teeth of a tool that the signal chain supports.
pub const MAX_TEETH: u8 = 12;

/// The reason why the settings of the signal chain are invalid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum SettingsError {
    /// The tool has no teeth, or more than [`MAX_TEETH`].
    Teeth(u8),
    /// The tachometer wheel has no positions; or it has a gap and fewer than four teeth outside of it, or a gap of
    /// 100 positions or more.
    Wheel(Wheel),
    /// The sample rate of the sensor is outside the range of the decimation filters.
    SampleRate(Hertz),
    /// The acceleration of one sensor count is not a positive finite number.
    CountScale(f32),
    /// The noise density of the sensor is not a finite number of at least 0.
    Noise(f32),
    /// The assumed spindle speed is not a positive finite number.
    AssumedSpeed(Rpm),
    /// The slowest and the fastest spindle speed are not an ascending range of positive finite numbers.
    Limits(Limits),
}

impl core::fmt::Display for SettingsError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Teeth(n) => write!(f, "a tool with {n} teeth: 1 to {MAX_TEETH} are possible"),
            Self::Wheel(wheel) => write!(
                f,
                "a wheel with {} positions of which {} are missing: at least 1 position, and 4 teeth beside a gap, are needed",
                wheel.positions, wheel.missing
            ),
            Self::SampleRate(rate) => write!(
                f,
                "a sample rate of {rate}: {MIN_RATE} to {MAX_RATE} are possible"
            ),
            Self::CountScale(scale) => write!(f, "a count of {scale} m/s²: it must be a number above 0"),
            Self::Noise(noise) => write!(
                f,
                "a sensor noise of {noise} m/s² per √Hz: it must be a number of at least 0"
            ),
            Self::AssumedSpeed(speed) => {
                write!(f, "an assumed speed of {speed}: it must be a number above 0")
            }
            Self::Limits(limits) => write!(
                f,
                "a spindle from {} to {}: the slowest speed must be above 0 and below the fastest",
                limits.rpm_min, limits.rpm_max
            ),
        }
    }
}

impl core::error::Error for SettingsError {}

/// Checks the settings of the signal chain, except wheel and sample rate. Each condition states what must hold, because
/// NaN fails every comparison.
pub(super) fn check(settings: &Settings) -> Result<(), SettingsError> {
    let Settings {
        sensor,
        tool,
        assumed_speed,
        limits,
        ..
    } = settings;
    if !(1..=MAX_TEETH).contains(&tool.teeth) {
        return Err(SettingsError::Teeth(tool.teeth));
    }
    let scale = sensor.meters_per_second2_per_count;
    if !(scale > 0.0 && scale.is_finite()) {
        return Err(SettingsError::CountScale(scale));
    }
    let noise = sensor.noise_meters_per_second2_per_root_hertz;
    if !(noise >= 0.0 && noise.is_finite()) {
        return Err(SettingsError::Noise(noise));
    }
    if let Some(speed) = assumed_speed
        && !(speed.0 > 0.0 && speed.0.is_finite())
    {
        return Err(SettingsError::AssumedSpeed(*speed));
    }
    if let Some(limits) = limits
        && !(limits.rpm_min.0 > 0.0 && limits.rpm_min.0 < limits.rpm_max.0 && limits.rpm_max.0.is_finite())
    {
        return Err(SettingsError::Limits(*limits));
    }
    Ok(())
}
