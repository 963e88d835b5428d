//! The files to which `simulate` writes a recording.

use std::path::PathBuf;

use super::Error;
use crate::recording::Recording;

/// Files to which one simulated recording is written, each in the format of its ending.
#[derive(Debug)]
pub(super) struct OutputRecordings {
    /// The file that the answer of `simulate` names first.
    pub(super) first: PathBuf,
    /// Further files with the same recording.
    pub(super) copies: Vec<PathBuf>,
}

impl OutputRecordings {
    /// The files of the option `--out`, of which the parser of the command line requires one or more.
    pub(super) fn new(out: &[PathBuf]) -> Self {
        let (first, copies) = out
            .split_first()
            .map_or_else(Default::default, |(first, copies)| {
                (first.clone(), copies.to_vec())
            });
        Self { first, copies }
    }

    /// Writes the recording to every file, each with a sidecar beside it.
    ///
    /// # Errors
    /// As [`Recording::write`], for the first file that fails.
    pub(super) fn write(&self, recording: &Recording) -> Result<(), Error> {
        for path in std::iter::once(&self.first).chain(&self.copies) {
            recording.write(path)?;
        }
        Ok(())
    }
}
