//! The sidecar of a recording: `NAME.toml` beside `NAME.csv` holds the kind of test, the cut, the posture and the
//! channel descriptions.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::RecordingError;
use crate::file::Prepared;

/// Kind of the recorded test, which sets how the recording is evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TestKind {
    /// Shaker test with steady excitation: random, or one or several tones.
    Shaker,
    /// Step-sine test: a shaker dwells at one frequency after the other.
    StepSine,
    /// Swept-sine test: the shaker frequency changes continuously.
    Sweep,
    /// Impact test with a hammer.
    Hammer,
    /// Free decay after a static force on the structure is released.
    FreeDecay,
    /// Milling cut.
    Cutting,
    /// Spindle running without a cut (air cut).
    Idle,
}

/// The sidecar file of a recording; a part that is not given is `None` or empty.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sidecar {
    /// Kind of the recorded test.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<TestKind>,
    /// Names of the channels that hold the excitation, a force or an imposed motion; if `None`, the force channels
    /// count as excitation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub input: Option<Vec<String>>,
    /// Sample rate, samples per second; required if neither the file nor an option states it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sample_rate_hz: Option<f64>,
    /// Parameters of the recorded cut.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cut: Option<RecordedCut>,
    /// Posture of the robot during the recording.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub posture: Option<RecordedPosture>,
    /// Descriptions of channels; the keys are the names of the channels in the recorded file.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub channels: BTreeMap<String, RecordedChannel>,
}

/// Posture of the robot during a recording, as joint angles.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordedPosture {
    /// Angles of the robot's joints, degrees, starting at the base.
    pub joints_deg: Vec<f64>,
}

/// Parameters of a recorded cut; a parameter that is not given is `None`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordedCut {
    /// Spindle speed, rev/min.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spindle_rpm: Option<f64>,
    /// Spindle speed at the end of a recording with a speed ramp, rev/min; `None` for constant speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub last_rpm: Option<f64>,
    /// Axial depth of cut, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axial_depth_mm: Option<f64>,
    /// Entry angle (immersion angle at which a tooth enters the workpiece), degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start_deg: Option<f64>,
    /// Exit angle (immersion angle at which a tooth leaves the workpiece), degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exit_deg: Option<f64>,
    /// Feed per tooth, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub feed_per_tooth_mm: Option<f64>,
    /// Number of teeth of the tool.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub teeth: Option<u32>,
}

/// Description of one channel in the sidecar; a fact that is not given is `None`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordedChannel {
    /// Mounting position of the sensor, such as `spindle-housing`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<String>,
    /// Standard name of the channel (`fx`, `ax`, `tacho` …) if the file uses another name; `-ax` for a sensor against
    /// the axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Unit of the channel, such as `m/s^2`; it overrides the unit in the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Sensitivity of the sensor, voltage per measured unit, such as "10.2 mV/g"; only for a channel in volts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensitivity: Option<String>,
    /// Number of mark positions on the tachometer wheel, missing marks included; default 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pulses_per_rev: Option<u16>,
    /// Number of adjacent missing marks on the tachometer wheel (the gap that marks angle 0); default 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missing: Option<u16>,
    /// True if an anti-aliasing filter stands between the sensor and the samples, so that nothing above half the sample
    /// rate folds into the record; default false.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub anti_aliasing: Option<bool>,
}

/// True for the text of a case file: it has a section (`structure`, `tool` or `material`) that no sidecar has.
fn is_case(text: &str) -> bool {
    text.parse::<toml::Table>().is_ok_and(|table| {
        ["structure", "tool", "material"]
            .iter()
            .any(|section| table.get(*section).is_some_and(toml::Value::is_table))
    })
}

impl Sidecar {
    /// Description of the channel with a standard name such as `ax`, also if the file calls it by another name, or if
    /// the description states the name with a sign (`-ax`); `None` if the sidecar has no description of it.
    pub fn channel(&self, name: &str) -> Option<&RecordedChannel> {
        self.channels.get(self.section_of(name).unwrap_or(name))
    }

    /// Name in the file of the channel that the sidecar gives the standard name `name`, also with a sign; `None` if the
    /// sidecar gives it to no channel.
    pub fn section_of(&self, name: &str) -> Option<&str> {
        let is_named = |stated: &str| stated.strip_prefix('-').unwrap_or(stated) == name;
        self.channels
            .iter()
            .find(|(_, channel)| channel.name.as_deref().is_some_and(is_named))
            .map(|(section, _)| section.as_str())
    }

    /// Path of the sidecar of `recording`: the same name with the extension `.toml`.
    pub fn path_of(recording: &Path) -> PathBuf {
        recording.with_extension("toml")
    }

    /// Reads the sidecar of `recording`; the default (empty) sidecar if the file does not exist.
    ///
    /// # Errors
    /// The file exists but cannot be read, is a case, is no valid TOML, has an unknown key, or has a value of a wrong
    /// type or out of bounds.
    pub fn beside(recording: &Path) -> Result<Self, RecordingError> {
        let path = Self::path_of(recording);
        if !path.exists() {
            return Ok(Self::default());
        }
        let text = crate::file::read_text(&path)?;
        if is_case(&text) {
            return Err(RecordingError::Content {
                path: path.clone(),
                what: format!(
                    "this is a case, not the sidecar of {}, although it has the sidecar's name; rename one of the two",
                    recording.display()
                ),
            });
        }
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

    /// Checks the bounds of the numbers in a sidecar: positive rate, speed and teeth, non-negative depth and feed,
    /// ascending entry and exit angle within a revolution, finite joint angles, possible tachometer wheels.
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
        if let Some(start) = cut.start_deg
            && !(0.0..360.0).contains(&start)
        {
            return Err(wrong("cut.start_deg", start, "an angle from 0 to below 360"));
        }
        if let Some(exit) = cut.exit_deg
            && !(exit > 0.0 && exit <= 360.0)
        {
            return Err(wrong("cut.exit_deg", exit, "an angle above 0, up to 360"));
        }
        if let (Some(start), Some(exit)) = (cut.start_deg, cut.exit_deg)
            && start >= exit
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
                    "at least one pulse per revolution",
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

    /// Text of the sidecar file that belongs to `recording`, with the values of this sidecar.
    ///
    /// # Errors
    /// A value cannot be written as TOML.
    pub fn text(&self, recording: &Path) -> Result<String, RecordingError> {
        toml::to_string(self).map_err(|error| RecordingError::Content {
            path: Self::path_of(recording),
            what: error.to_string(),
        })
    }

    /// Writes these values as the sidecar file beside `recording`.
    ///
    /// # Errors
    /// The values cannot be written as TOML, or the file cannot be written.
    pub fn write_beside(&self, recording: &Path) -> Result<(), RecordingError> {
        let text = self.text(recording)?;
        Ok(crate::file::write(&Self::path_of(recording), text.as_bytes())?)
    }

    /// Writes the sidecar of `recording` to a temporary file, not yet under its final name.
    ///
    /// # Errors
    /// The values cannot be written as TOML, or the file cannot be written.
    pub(super) fn prepared_beside(&self, recording: &Path) -> Result<Prepared, RecordingError> {
        let path = Self::path_of(recording);
        let text = self.text(recording)?;
        Ok(crate::file::prepare(&path, |writer| {
            writer.write_all(text.as_bytes())
        })?)
    }
}
