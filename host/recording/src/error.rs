//! Errors of recordings.

use std::path::PathBuf;

use super::doubt::{Doubt, doubts_text};
use super::{Quantity, UnknownUnit};
use crate::file::FileError;

/// Error of reading, writing or using a recording; every message names the file.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// A file cannot be read or written, or is not UTF-8 text.
    #[error(transparent)]
    File(#[from] FileError),
    /// The file extension belongs to no format that can be read.
    #[error("{}: \"{found}\" is no format that can be read; csv, uff, wav and mat are, lvm, tdms, and txt, dat, tsv and asc as text tables", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// The ending.
        found: String,
    },
    /// The file extension belongs to no format that can be written.
    #[error("{}: \"{found}\" is no format that can be written; csv, uff and bunv are", path.display())]
    Written {
        /// The file.
        path: PathBuf,
        /// The ending.
        found: String,
    },
    /// A fault of the recorded file, of its sidecar or of the options about it that no other variant names.
    #[error("{}: {what}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// Fault, and in most cases the expected content.
        what: String,
    },
    /// A fault of the file or its sidecar that belongs to one line.
    #[error("{}, line {line}: {what}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// Number of this line, from 1.
        line: u64,
        /// Fault and the expected content.
        what: String,
    },
    /// The text of the unit of a column is no known unit.
    #[error("{}, column \"{column}\": {cause}", path.display())]
    Unit {
        /// The file.
        path: PathBuf,
        /// The header of the column.
        column: String,
        /// The unknown unit.
        cause: UnknownUnit,
    },
    /// The unit of a channel measures another quantity than the name of the channel, or the words in the head of its
    /// column, require.
    #[error(
        "{}, column \"{column}\": {found} ({}), but a channel of this name is {expected}; correct the head, or --map \"{column}=NAME:UNIT\" \
         with the name and unit that hold",
        path.display(),
        found.unit()
    )]
    Quantity {
        /// The file.
        path: PathBuf,
        /// Name of the channel or of its column.
        column: String,
        /// Quantity of the stated unit.
        found: Quantity,
        /// Quantity that the name or the words require.
        expected: Quantity,
    },
    /// A sample of a channel is NaN or infinite.
    #[error(
        "{}, channel \"{channel}\": sample {sample} at {time_s} s is {value} ({count} such samples, the last at {last_s} s); a number is needed: \
         repair the channel, or use the segment before or after it with --until-s or --from-s",
        path.display()
    )]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// Name of the channel.
        channel: String,
        /// Number of the first NaN or infinite sample of the channel, from 1.
        sample: usize,
        /// Time of the first NaN or infinite sample of the channel, s.
        time_s: f64,
        /// Value of the first NaN or infinite sample of the channel: NaN, ∞ or −∞.
        value: f64,
        /// Number of samples of the channel that are NaN or infinite.
        count: usize,
        /// Time of the last NaN or infinite sample of the channel, s.
        last_s: f64,
    },
    /// The meaning of columns is in doubt: their direction, sign, unit or sensitivity is not stated, or several are the
    /// same channel.
    #[error("{}: {}", path.display(), doubts_text(doubts, *lacks_rate, sidecar))]
    Doubt {
        /// The file.
        path: PathBuf,
        /// Sidecar file in which the user could state the meaning of the columns.
        sidecar: PathBuf,
        /// The columns in doubt, each with a proposal of what the user could state about it.
        doubts: Vec<Doubt>,
        /// True if the sample rate is not stated either.
        lacks_rate: bool,
    },
    /// Neither the recorded file nor its sidecar nor the option `--rate` states the sample rate.
    #[error("{}: {}", path.display(), no_rate(without_unit, sidecar))]
    NoSampleRate {
        /// The file.
        path: PathBuf,
        /// Sidecar file in which the user could state the sample rate.
        sidecar: PathBuf,
        /// Names of the channels with a standard name, such as `fx`, whose unit is not stated either.
        without_unit: Vec<String>,
    },
    /// The recording lacks a channel or a setting that the command requires.
    #[error("{}: {}", path.display(), no_channel(needed, found))]
    NoChannel {
        /// The file.
        path: PathBuf,
        /// Description of the channel or setting that the recording lacks.
        needed: String,
        /// Names and units of the channels that the recording has.
        found: Vec<String>,
    },
}

/// Message for a channel or setting that a recording lacks, with the channels that it has; if the unit of one with a
/// standard name is unknown, as in `fx [unknown]`, also the option `--map` that would state it.
fn no_channel(needed: &str, found: &[String]) -> String {
    let names: Vec<&str> = found
        .iter()
        .filter_map(|channel| channel.strip_suffix(" [unknown]"))
        .collect();
    let channels = found.join(", ");
    match map_of_units(&names) {
        None => format!("it has no {needed}; its channels are {channels}"),
        Some(map) => format!(
            "it has no {needed} with a unit; its channels are {channels}: the file states no unit for some of them; add {map} with the units \
             that hold"
        ),
    }
}

/// Message for a sample rate that is not stated, with the options or keys that would state it and the missing units.
fn no_rate(without_unit: &[String], sidecar: &std::path::Path) -> String {
    let names: Vec<&str> = without_unit.iter().map(String::as_str).collect();
    match map_of_units(&names) {
        None => format!(
            "the sample rate is not given; --rate 25600 with the rate that holds, sample_rate_hz = 25600 in {}, or a column \"t [s]\" is needed",
            sidecar.display()
        ),
        Some(map) => format!(
            "neither the sample rate nor the units of {} are given; add {map} --rate 25600 with the units and the rate that hold, or \
             sample_rate_hz = 25600 and [channels.{}] with unit to {}",
            names.join(", "),
            names[0],
            sidecar.display()
        ),
    }
}

/// The option `--map` that states a unit for each of the channels whose name stands for a quantity; `None` if there is
/// none.
fn map_of_units(names: &[&str]) -> Option<String> {
    let map: Vec<String> = names
        .iter()
        .filter_map(|name| Some(format!("{name}={name}:{}", Quantity::of_name(name)?.unit())))
        .collect();
    (!map.is_empty()).then(|| format!("--map {}", map.join(",")))
}
