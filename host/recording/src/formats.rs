//! Reads and writes recordings; the file extension selects the format.

use std::path::Path;

use super::error::RecordingError;
use super::recording::Recording;
use super::segment::Segment;
use super::sidecar::Sidecar;
use super::uff::UffForm;
use super::{assemble, csv, mat, uff, wav};
use crate::file::Prepared;

/// File extensions of the formats that can be written: CSV, UFF 58 as text (uff, unv), UFF 58 binary (bunv).
pub const WRITTEN: [&str; 4] = ["csv", "uff", "unv", "bunv"];

impl Recording {
    /// Reads a recording (CSV, WAV, MAT or UFF 58) and its sidecar.
    ///
    /// # Errors
    /// The file is missing or malformed; a unit is unknown or contradicts the channel name; time is not evenly spaced; there is no sample
    /// rate; a sample is NaN or infinite.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, RecordingError> {
        Self::read_segment(path, Segment::default())
    }

    /// Reads a segment of a recording and its sidecar. Samples outside the segment may be NaN or infinite.
    ///
    /// # Errors
    /// As [`Recording::read`]; also if the segment lies outside the recording.
    pub fn read_segment(path: impl AsRef<Path>, segment: Segment) -> Result<Self, RecordingError> {
        let path = path.as_ref();
        let ending = crate::file::ending(path);
        let raw = match ending.as_str() {
            "csv" => csv::read(path, segment.is_whole())?,
            "wav" => wav::read(path)?,
            "mat" => mat::read(path)?,
            "uff" | "unv" | "bunv" => uff::read(path, segment.is_whole())?,
            _ => {
                // A missing file is reported before an unknown extension.
                crate::file::read(path)?;
                return Err(RecordingError::Format {
                    path: path.into(),
                    found: ending,
                });
            }
        };
        segment.of(assemble::recording(path, raw, Sidecar::beside(path)?)?)
    }

    /// Writes the recording and its sidecar to `path` in the format of the file extension.
    ///
    /// Both files are complete on the disk before the first of them gets its name, the sidecar first. On an error the previous recording
    /// stays. Only a machine that fails between the two renames leaves a sidecar whose recording is missing or older.
    ///
    /// # Errors
    /// The extension is not one of [`WRITTEN`], or a file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), RecordingError> {
        match crate::file::ending(path).as_str() {
            "csv" => self.publish(path, csv::prepared(path, self)?),
            "uff" | "unv" => self.write_uff(path, UffForm::Text),
            "bunv" => self.write_uff(path, UffForm::Binary),
            ending => Err(RecordingError::Written {
                path: path.into(),
                found: ending.into(),
            }),
        }
    }

    /// Writes the recording to `path` as UFF 58, with its sidecar; both files as in [`Recording::write`].
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write_uff(&self, path: &Path, form: UffForm) -> Result<(), RecordingError> {
        self.publish(path, uff::prepared(path, self, form)?)
    }

    /// Gives the sidecar of `path` and then the recording their names.
    fn publish(&self, path: &Path, recording: Prepared) -> Result<(), RecordingError> {
        let sidecar = self.sidecar.prepared_beside(path)?;
        Ok(crate::file::publish([sidecar, recording])?)
    }
}
