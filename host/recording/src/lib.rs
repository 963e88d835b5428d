//! Recordings: channels with name, unit and rate, and what the file beside them says.
//!
//! Forces act on the structure. A rising edge of `tacho` is immersion angle 0 of tooth 1. Samples are in SI units.

mod assemble;
mod blocks;
mod csv;
mod error;
pub mod file;
mod mat;
mod segment;
mod sidecar;
mod spindle_angle;
pub mod uff;
mod unit;
mod wav;

use std::ops::Range;
use std::path::{Path, PathBuf};

pub use blocks::{Sensed, Speed};
pub use error::RecordingError;
pub use segment::Segment;
pub use sidecar::{Kind, RecordedChannel, RecordedCut, RecordedPosture, Sidecar};
pub use spindle_angle::SpindleAngle;
pub use uff::UffForm;
pub use unit::{Quantity, Sensitivity, Unit, UnknownUnit};

/// Endings of the names of recordings that can be written: CSV, UFF 58 as text, and in binary.
pub const WRITTEN: [&str; 4] = ["csv", "uff", "unv", "bunv"];

/// Channels that were sampled together, evenly.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Where it was read from, or will be written to.
    pub path: PathBuf,
    /// Samples per second.
    pub sample_rate_hz: f64,
    /// Time of the first sample, s.
    pub start_s: f64,
    /// How long after the beginning of the recording of which it is a part it begins, s: what grows or swings with time counts from
    /// there. 0 where it is whole.
    pub since_s: f64,
    /// The channels, all of one length. Time is not among them.
    pub channels: Vec<Channel>,
    /// What the file beside it says.
    pub sidecar: Sidecar,
}

/// One channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Its name: `fx`, `x`, `vx`, `ax`, `tacho` …
    pub name: String,
    /// What it measures; samples are in the SI unit of it.
    pub quantity: Quantity,
    /// The samples.
    pub samples: Vec<f64>,
}

/// What a file says before the sidecar is consulted.
struct Raw {
    columns: Vec<RawColumn>,
    /// Samples per second, where the format carries it.
    sample_rate_hz: Option<f64>,
    /// Time of the first sample, s, where no column says so.
    start_s: f64,
}

/// A column of a file.
struct RawColumn {
    name: String,
    /// `None` where the file does not say.
    unit: Option<Unit>,
    samples: Vec<f64>,
}

impl Recording {
    /// Reads a recording, with the sidecar beside it.
    ///
    /// # Errors
    /// Missing or malformed file, unknown or contradicting units, uneven time, no sample rate, a sample that is no finite number.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, RecordingError> {
        Self::read_segment(path, Segment::default())
    }

    /// Reads a segment of a recording. Samples outside of it may be NaN or infinite.
    ///
    /// # Errors
    /// As [`Recording::read`]; a segment that lies outside of the recording.
    pub fn read_segment(path: impl AsRef<Path>, segment: Segment) -> Result<Self, RecordingError> {
        let path = path.as_ref();
        let ending = crate::file::ending(path);
        let raw = match ending.as_str() {
            "csv" => csv::read(path, segment.is_whole())?,
            "wav" => wav::read(path)?,
            "mat" => mat::read(path)?,
            "uff" | "unv" | "bunv" => uff::read(path, segment.is_whole())?,
            _ => {
                // A file that is not there is the first thing to mend.
                crate::file::read(path)?;
                return Err(RecordingError::Format {
                    path: path.into(),
                    found: ending,
                });
            }
        };
        segment.of(assemble::recording(path, raw, Sidecar::beside(path)?)?)
    }

    /// Writes it to `path`, with its sidecar, in the form that the ending says: both whole, or as they were before.
    ///
    /// # Errors
    /// Another ending than those of [`WRITTEN`], or a file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), RecordingError> {
        match crate::file::ending(path).as_str() {
            "csv" => {
                csv::write(path, self)?;
                self.sidecar.write_beside(path)
            }
            "uff" | "unv" => self.write_uff(path, UffForm::Text),
            "bunv" => self.write_uff(path, UffForm::Binary),
            ending => Err(RecordingError::Written {
                path: path.into(),
                found: ending.into(),
            }),
        }
    }

    /// Writes it to `path` as UFF 58, with its sidecar: both whole, or as they were before.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write_uff(&self, path: &Path, form: UffForm) -> Result<(), RecordingError> {
        uff::write(path, self, form)?;
        self.sidecar.write_beside(path)
    }

    /// The channel of a name.
    pub fn channel(&self, name: &str) -> Option<&Channel> {
        self.channels.iter().find(|channel| channel.name == name)
    }

    /// Number of samples of each channel.
    pub fn len(&self) -> usize {
        self.channels.first().map_or(0, |channel| channel.samples.len())
    }

    /// True where there are no samples.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Time of a sample, s.
    pub fn time_s(&self, sample: usize) -> f64 {
        self.start_s + sample as f64 / self.sample_rate_hz
    }

    /// A part of it, of these samples.
    ///
    /// # Panics
    /// Where it has fewer samples.
    #[must_use]
    pub fn part(&self, range: Range<usize>) -> Self {
        let channels = self.channels.iter().map(|channel| Channel {
            samples: channel.samples[range.clone()].to_vec(),
            ..channel.clone()
        });
        Self {
            channels: channels.collect(),
            path: self.path.clone(),
            sidecar: self.sidecar.clone(),
            start_s: self.time_s(range.start),
            since_s: self.since_s + range.start as f64 / self.sample_rate_hz,
            ..*self
        }
    }

    /// The error that it has no channel that is needed.
    pub fn lacks(&self, needed: impl Into<String>) -> RecordingError {
        RecordingError::NoChannel {
            path: self.path.clone(),
            needed: needed.into(),
            found: self
                .channels
                .iter()
                .map(|channel| format!("{} [{}]", channel.name, channel.quantity.unit()))
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests;
