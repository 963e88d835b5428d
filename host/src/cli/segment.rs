//! The part of the recordings that a verb uses.

use std::path::PathBuf;

use super::{Error, finite};
use crate::recording::{Recording, Segment};

/// From when to when recordings are used.
#[derive(Clone, Copy, Debug, clap::Args)]
#[command(next_help_heading = "Part of the recordings")]
pub(super) struct RecordedSegment {
    /// Leave out what comes before this time in s, on the time axis of the file.
    #[arg(long, value_name = "T", value_parser = finite, allow_negative_numbers = true)]
    from_s: Option<f64>,
    /// Leave out what comes at this time in s or later, on the time axis of the file.
    #[arg(long, value_name = "T", value_parser = finite, allow_negative_numbers = true)]
    until_s: Option<f64>,
}

impl RecordedSegment {
    /// The segment of each recording, in order.
    ///
    /// # Errors
    /// A recording cannot be read, or does not reach into the segment.
    pub(super) fn read(self, paths: &[PathBuf]) -> Result<Vec<Recording>, Error> {
        let segment = Segment {
            from_s: self.from_s,
            until_s: self.until_s,
        };
        let read = paths.iter().map(|path| Recording::read_segment(path, segment));
        Ok(read.collect::<Result<_, _>>()?)
    }
}
