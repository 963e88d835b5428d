//! Reads and writes recordings; [`Format`] finds the format of a file that is read, the file extension selects that of
//! one that is written.

use std::path::Path;

use super::assemble::{self, Imported};
use super::error::RecordingError;
use super::format::Format;
use super::import::Import;
use super::recording::Recording;
use super::segment::Segment;
use super::sidecar::Sidecar;
use super::uff::UffForm;
use super::{csv, csv_writer, lvm, mat, tdms, uff, wav};
use crate::file::Prepared;

/// File extensions of the formats that can be written: CSV, UFF 58 as text (uff, unv), UFF 58 binary (bunv).
pub const WRITTEN: [&str; 4] = ["csv", "uff", "unv", "bunv"];

impl Recording {
    /// Reads the only recording of a file (text table, WAV, MAT, LabVIEW measurement file, TDMS or UFF 58) and its
    /// sidecar.
    ///
    /// # Errors
    /// For example: the file has several records; it is missing or malformed; a unit is unknown or contradicts the
    /// channel name; time is not evenly spaced; there is no sample rate; a sample is NaN or infinite.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, RecordingError> {
        Self::read_segment(path, Segment::default())
    }

    /// Reads a segment of the only recording of a file, and its sidecar. Samples of channels outside the segment may be
    /// NaN or infinite, except in a LabVIEW measurement file; time stamps may not.
    ///
    /// # Errors
    /// An error of [`Recording::read`], or a segment that lies outside the recording.
    pub fn read_segment(path: impl AsRef<Path>, segment: Segment) -> Result<Self, RecordingError> {
        let import = Import {
            segment,
            ..Import::default()
        };
        Self::import(path, &import).map(|imported| imported.recording)
    }

    /// Reads the only record of a file, or the one that `import` chooses, with its sidecar and the facts that the user
    /// states about the file; also returns a report of how it was understood.
    ///
    /// # Errors
    /// An error of [`Recording::import_all`], or a file with several records of which `import` does not choose one.
    pub fn import(path: impl AsRef<Path>, import: &Import) -> Result<Imported, RecordingError> {
        let path = path.as_ref();
        let mut records = Self::import_all(path, import)?;
        match (records.len(), records.pop()) {
            (1, Some(record)) => Ok(record),
            (count, _) => Err(RecordingError::Content {
                path: path.into(),
                what: format!(
                    "the file has {count} records, and one is needed; choose it with --record 1 to --record {count}"
                ),
            }),
        }
    }

    /// Reads all records of a file, or the one that `import` chooses, each as a recording of its own.
    ///
    /// # Errors
    /// An error of [`Recording::read`] other than that of several records, or a record or column that `import` names
    /// and the file does not have.
    pub fn import_all(path: impl AsRef<Path>, import: &Import) -> Result<Vec<Imported>, RecordingError> {
        let path = path.as_ref();
        let finite = import.segment.is_whole();
        let records = match Format::of(path)? {
            Format::Text => vec![csv::read(path, finite)?],
            Format::Wav => vec![wav::read(path)?],
            Format::Mat => mat::read(path)?,
            Format::Lvm => lvm::read(path)?,
            Format::Tdms => tdms::read(path)?,
            Format::Uff => vec![uff::read(path, finite)?],
        };
        let count = records.len();
        let first = match import.record {
            None => 0,
            Some(number) if (1..=count).contains(&number) => number - 1,
            Some(number) => {
                return Err(RecordingError::Content {
                    path: path.into(),
                    what: format!("--record {number}: the file has {count} records"),
                });
            }
        };
        let mut known: Vec<String> = Vec::new();
        for column in records.iter().flat_map(|raw| &raw.columns) {
            if !known.contains(&column.name) {
                known.push(column.name.clone());
            }
        }
        let chosen = if import.record.is_some() { 1 } else { count };
        let sidecar = Sidecar::beside(path)?;
        records
            .into_iter()
            .skip(first)
            .take(chosen)
            .map(|raw| {
                let imported = assemble::recording(path, raw, sidecar.clone(), import, &known)?;
                Ok(Imported {
                    recording: import.segment.of(imported.recording)?,
                    ..imported
                })
            })
            .collect()
    }

    /// Writes the recording and its sidecar to `path` in the format of the file extension.
    ///
    /// Both files are complete under temporary names before they are renamed, the sidecar first. On an error the
    /// previous recording stays. If the second rename fails, or the computer between the two, the new sidecar stands
    /// beside the previous recording, or beside none if there was none.
    ///
    /// # Errors
    /// The extension is not one of [`WRITTEN`], or a file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), RecordingError> {
        match crate::file::ending(path).as_str() {
            "csv" => self.publish(path, csv_writer::prepared(path, self)?),
            "uff" | "unv" => self.write_uff(path, UffForm::Text),
            "bunv" => self.write_uff(path, UffForm::Binary),
            ending => Err(RecordingError::Written {
                path: path.into(),
                found: ending.into(),
            }),
        }
    }

    /// Writes the recording to `path` as UFF 58, with its sidecar. Both files are replaced one after the other, as by
    /// [`Recording::write`].
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write_uff(&self, path: &Path, form: UffForm) -> Result<(), RecordingError> {
        self.publish(path, uff::prepared(path, self, form)?)
    }

    /// Renames the prepared sidecar of `path` and then the prepared recording to their final names.
    fn publish(&self, path: &Path, recording: Prepared) -> Result<(), RecordingError> {
        let sidecar = self.sidecar.prepared_beside(path)?;
        Ok(crate::file::publish([sidecar, recording])?)
    }
}
