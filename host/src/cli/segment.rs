//! Options for the segment of the recordings that a verb uses, and for what their files do not state.

use std::path::PathBuf;

use super::{Error, finite, positive, progress};
use crate::recording::{ColumnMap, ColumnMaps, Import, Recording, Segment, Understood};

/// Start and end of the segment of the recordings to use; names, units and rate that their files do not state.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Segment of the recordings")]
pub(super) struct RecordedSegment {
    /// Start of the segment in s on the time axis of the file. Default: the first sample.
    #[arg(long, value_name = "T", value_parser = finite, allow_negative_numbers = true)]
    from_s: Option<f64>,
    /// End of the segment in s on the time axis of the file; samples at this time or later are not used. Default: the
    /// last sample.
    #[arg(long, value_name = "T", value_parser = finite, allow_negative_numbers = true)]
    until_s: Option<f64>,
    #[command(flatten)]
    stated: StatedColumns,
}

/// Facts that the user states about the files of recordings: channels, units, sample rate.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Import of the recordings")]
pub(super) struct StatedColumns {
    /// Channel and unit of a column, such as acc=ax:g, 2=fx:N (by number), "ch1=ax:10.2 mV/g" (sensitivity), acc=-az
    /// (against the axis) or acc=ax@3:g (sensor at the point 3). Several with commas between; may be repeated.
    #[arg(long, value_name = "COLUMN=NAME[:UNIT],…", value_parser = ColumnMap::parse_list)]
    map: Vec<ColumnMaps>,
    /// Sample rate in samples per second; it replaces the time column of the file.
    #[arg(long, value_name = "HZ", value_parser = positive, allow_negative_numbers = true)]
    rate: Option<f64>,
    /// Number of the record to use, from 1, in a file with several. Default: all of them.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    record: Option<u32>,
}

/// Recordings that a verb has read, and how each record that had to be interpreted was understood.
#[derive(Default)]
pub(super) struct Recorded {
    pub(super) recordings: Vec<Recording>,
    pub(super) understood: Vec<Understood>,
}

impl StatedColumns {
    /// The options `--map`, `--rate` and `--record` with `segment`, as the instructions for reading a file.
    pub(super) fn import(&self, segment: Segment) -> Import {
        Import {
            segment,
            map: self.map.iter().flat_map(|maps| maps.0.clone()).collect(),
            rate_hz: self.rate,
            record: self.record.map(|record| record as usize),
        }
    }
}

impl RecordedSegment {
    /// The options `--from-s`, `--until-s`, `--map`, `--rate` and `--record` as the instructions for reading a file.
    pub(super) fn import(&self) -> Import {
        self.stated.import(Segment {
            from_s: self.from_s,
            until_s: self.until_s,
        })
    }

    /// Reads the segment of every recording in the files `paths`, in their order; prints one line on stderr for each
    /// file whose first record had to be interpreted.
    ///
    /// # Errors
    /// For example: a recording cannot be read, or has no samples in the segment.
    pub(super) fn read(&self, paths: &[PathBuf]) -> Result<Recorded, Error> {
        let import = self.import();
        let mut read = Recorded::default();
        for path in paths {
            let records = Recording::import_all(path, &import)?;
            let count = records.len();
            for (index, imported) in records.into_iter().enumerate() {
                if imported.understood.is_interpreted() {
                    // The records of one file usually have the same columns, so the message describes only the first
                    // record.
                    if index == 0 {
                        progress::clear();
                        let others = if count > 1 {
                            format!(" (the first of {count} records)")
                        } else {
                            String::new()
                        };
                        eprintln!("understood: {}{others}", imported.understood);
                    }
                    read.understood.push(imported.understood);
                }
                read.recordings.push(imported.recording);
            }
        }
        Ok(read)
    }
}
