//! What the columns of a recording cannot say: the file `NAME.toml` beside `NAME.csv`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::RecordingError;

/// What kind of test was recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// A shaker at constant force.
    Shaker,
    /// A shaker, one frequency after the other.
    StepSine,
    /// A shaker whose frequency glides.
    Sweep,
    /// Blows of a hammer.
    Hammer,
    /// A structure that was let go.
    FreeDecay,
    /// A cut.
    Cutting,
    /// The spindle runs, nothing is cut.
    Idle,
}

/// The file beside a recording.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sidecar {
    /// What kind of test it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<Kind>,
    /// The driven channels; the forces where it is not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub input: Option<Vec<String>>,
    /// Samples per second, where no time column says so.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sample_rate_hz: Option<f64>,
    /// The cut.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cut: Option<RecordedCut>,
    /// Where the robot stood.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub posture: Option<RecordedPosture>,
    /// The channels by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub channels: BTreeMap<String, RecordedChannel>,
}

/// The posture at which it was recorded.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordedPosture {
    /// Joint angles from the base on, degrees.
    pub joints_deg: Vec<f64>,
}

/// The cut that was recorded, as far as it is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordedCut {
    /// Spindle speed, rev/min.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spindle_rpm: Option<f64>,
    /// The speed to which it glides by the end of the record, rev/min; not there where it stays.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub last_rpm: Option<f64>,
    /// Axial depth, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axial_depth_mm: Option<f64>,
    /// Immersion angle of entry, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start_deg: Option<f64>,
    /// Immersion angle of exit, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exit_deg: Option<f64>,
    /// Feed per tooth, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feed_per_tooth_mm: Option<f64>,
    /// Number of teeth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub teeth: Option<u32>,
}

/// What is known of a channel.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordedChannel {
    /// Where the sensor sits, such as spindle-housing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<String>,
    /// The name by the conventions of recordings, where the file calls the channel something else.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The unit, where the file does not say.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// What a volt means, such as "10.2 mV/g".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensitivity: Option<String>,
    /// Of a tachometer: positions on the wheel; one where it is not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pulses_per_rev: Option<u16>,
    /// Of a tachometer: this many positions in a row are missing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missing: Option<u16>,
}

impl Sidecar {
    /// Where the sidecar of a recording is.
    pub fn path_of(recording: &Path) -> PathBuf {
        recording.with_extension("toml")
    }

    /// The sidecar of a recording; an empty one where there is none.
    ///
    /// # Errors
    /// It is there and cannot be read, has a key that does not belong, or a value that cannot be.
    pub fn beside(recording: &Path) -> Result<Self, RecordingError> {
        let path = Self::path_of(recording);
        if !path.exists() {
            return Ok(Self::default());
        }
        let text = crate::file::read_text(&path)?;
        let sidecar: Self = toml::from_str(&text).map_err(|error| {
            let offset = error.span().map_or(0, |span| span.start);
            RecordingError::Line {
                path: path.clone(),
                line: 1 + text.bytes().take(offset).filter(|&byte| byte == b'\n').count() as u64,
                what: error.message().trim().replace('\n', ", "),
            }
        })?;
        sidecar.check(&path)?;
        Ok(sidecar)
    }

    /// Refuses values that no recording can have.
    fn check(&self, path: &Path) -> Result<(), RecordingError> {
        let cut = self.cut.unwrap_or_default();
        let positive = [
            ("sample_rate_hz", self.sample_rate_hz),
            ("cut.spindle_rpm", cut.spindle_rpm),
            ("cut.last_rpm", cut.last_rpm),
            ("cut.teeth", cut.teeth.map(f64::from)),
        ];
        let not_negative = [
            ("cut.axial_depth_mm", cut.axial_depth_mm),
            ("cut.feed_per_tooth_mm", cut.feed_per_tooth_mm),
        ];
        let wrong = |key: &str, value: f64, expected: &str| RecordingError::Content {
            path: path.into(),
            what: format!("{key} = {value}: {expected} is needed"),
        };
        for (key, value) in positive {
            if let Some(value) = value
                && !(value > 0.0 && value.is_finite())
            {
                return Err(wrong(key, value, "a number greater than 0"));
            }
        }
        for (key, value) in not_negative {
            if let Some(value) = value
                && !(value >= 0.0 && value.is_finite())
            {
                return Err(wrong(key, value, "a number of 0 or more"));
            }
        }
        for (key, value) in [("cut.start_deg", cut.start_deg), ("cut.exit_deg", cut.exit_deg)] {
            if let Some(value) = value
                && !value.is_finite()
            {
                return Err(wrong(key, value, "a finite angle"));
            }
        }
        if let (Some(start), Some(exit)) = (cut.start_deg, cut.exit_deg)
            && !(0.0 <= start && start < exit && exit <= 360.0)
        {
            return Err(wrong("cut.exit_deg", exit, "an angle above start_deg, up to 360"));
        }
        let angles = self.posture.iter().flat_map(|posture| &posture.joints_deg);
        if let Some(angle) = angles.into_iter().find(|angle| !angle.is_finite()) {
            return Err(wrong("posture.joints_deg", *angle, "a finite angle"));
        }
        for (name, channel) in &self.channels {
            let positions = channel.pulses_per_rev.unwrap_or(1);
            if positions == 0 {
                return Err(wrong(
                    &format!("channels.{name}.pulses_per_rev"),
                    0.0,
                    "at least one pulse per turn",
                ));
            }
            if channel.missing.unwrap_or(0) >= positions {
                let missing = f64::from(channel.missing.unwrap_or(0));
                return Err(wrong(
                    &format!("channels.{name}.missing"),
                    missing,
                    "fewer than pulses_per_rev",
                ));
            }
        }
        Ok(())
    }

    /// Writes the sidecar of a recording.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_beside(&self, recording: &Path) -> Result<(), RecordingError> {
        let path = Self::path_of(recording);
        let text = toml::to_string(self).map_err(|error| RecordingError::Content {
            path: path.clone(),
            what: error.to_string(),
        })?;
        Ok(crate::file::write(&path, text.as_bytes())?)
    }
}
