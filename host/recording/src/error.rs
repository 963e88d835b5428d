//! What can be wrong with a recording.

use std::path::PathBuf;

use super::{Quantity, UnknownUnit};
use crate::file::FileError;

/// Why a recording could not be read, or does not have what is asked of it.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file is not there or cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// The ending of the name says a format that is not read.
    #[error("{}: \"{found}\" is no format that can be read; csv, uff, wav and mat are", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// The ending.
        found: String,
    },
    /// The ending of the name says a format that is not written.
    #[error("{}: \"{found}\" is no format that can be written; csv, uff and bunv are", path.display())]
    Written {
        /// The file.
        path: PathBuf,
        /// The ending.
        found: String,
    },
    /// The bytes do not make the format that the name says.
    #[error("{}: {what}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What was found, where, and what would be right.
        what: String,
    },
    /// A line of a text file is wrong.
    #[error("{}, line {line}: {what}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// What was found, and what would be right.
        what: String,
    },
    /// A unit that is not known.
    #[error("{}, column \"{column}\": {cause}", path.display())]
    Unit {
        /// The file.
        path: PathBuf,
        /// The header of the column.
        column: String,
        /// The unit.
        cause: UnknownUnit,
    },
    /// A channel measures something else than its name says.
    #[error("{}, column \"{column}\": {found} ({}), but a channel of this name is {expected}", path.display(), found.unit())]
    Quantity {
        /// The file.
        path: PathBuf,
        /// The header of the column.
        column: String,
        /// What the unit says.
        found: Quantity,
        /// What the name says.
        expected: Quantity,
    },
    /// A sample is NaN or infinite.
    #[error(
        "{}, channel \"{channel}\": sample {sample} at {time_s} s is {value} ({count} such samples, the last at {last_s} s); a number is needed: \
         repair the channel, or use the part before or after by --until-s or --from-s",
        path.display()
    )]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// The channel.
        channel: String,
        /// The first such sample, from 1.
        sample: usize,
        /// Its time, s.
        time_s: f64,
        /// Its value.
        value: f64,
        /// Number of such samples.
        count: usize,
        /// Time of the last one, s.
        last_s: f64,
    },
    /// Nothing says how fast it was sampled.
    #[error("{}: nothing says how fast it was sampled; a column \"t [s]\" or sample_rate_hz in {} is needed", path.display(), sidecar.display())]
    NoSampleRate {
        /// The file.
        path: PathBuf,
        /// The file beside it that would say so.
        sidecar: PathBuf,
    },
    /// A channel that is needed is not there.
    #[error("{}: it has no {needed}; its channels are {}", path.display(), found.join(", "))]
    NoChannel {
        /// The file.
        path: PathBuf,
        /// What is needed.
        needed: String,
        /// What is there.
        found: Vec<String>,
    },
}
