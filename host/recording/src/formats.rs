//! Reads and writes a recording in the form that the ending of its name says.

use std::path::Path;

use super::error::RecordingError;
use super::recording::Recording;
use super::segment::Segment;
use super::sidecar::Sidecar;
use super::uff::UffForm;
use super::{assemble, csv, mat, uff, wav};

/// Endings of the names of recordings that can be written: CSV, UFF 58 as text, and in binary.
pub const WRITTEN: [&str; 4] = ["csv", "uff", "unv", "bunv"];

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
}
