//! Options for the segment of the recordings that a verb uses.

use std::path::PathBuf;

use super::{Error, finite};
use crate::recording::{Recording, Segment};

/// Start and end of the segment of the recordings to use.
#[derive(Clone, Copy, Debug, clap::Args)]
#[command(next_help_heading = "Segment of the recordings")]
pub(super) struct RecordedSegment {
    /// Start of the segment in s on the time axis of the file. Default: the first sample.
    #[arg(long, value_name = "T", value_parser = finite, allow_negative_numbers = true)]
    from_s: Option<f64>,
    /// End of the segment in s on the time axis of the file; samples at this time or later are not used. Default: the last
    /// sample.
    #[arg(long, value_name = "T", value_parser = finite, allow_negative_numbers = true)]
    until_s: Option<f64>,
}

impl RecordedSegment {
    /// Reads the segment of each recording, in the order of `paths`.
    ///
    /// # Errors
    /// A recording cannot be read, or has no samples in the segment.
    pub(super) fn read(self, paths: &[PathBuf]) -> Result<Vec<Recording>, Error> {
        let segment = Segment {
            from_s: self.from_s,
            until_s: self.until_s,
        };
        let read = paths.iter().map(|path| Recording::read_segment(path, segment));
        Ok(read.collect::<Result<_, _>>()?)
    }
}
