//! Writer of CSV recordings: time in seconds, then one column per channel.

use std::path::Path;

use super::{Quantity, Recording, RecordingError};
use crate::file::Prepared;

/// Number of significant digits of written samples: nine suffice to get every 32-bit float back by rounding to 32 bits.
const DIGITS: usize = 9;

/// Writes a recording to a temporary CSV file, not yet under its final name: time in seconds, then one column per
/// channel.
pub(super) fn prepared(path: &Path, recording: &Recording) -> Result<Prepared, RecordingError> {
    Ok(crate::file::prepare(path, |writer| {
        let mut writer = csv::Writer::from_writer(writer);
        let titles = recording.channels.iter().map(|channel| match channel.quantity {
            Quantity::Unknown => channel.name.clone(),
            quantity => format!("{} [{}]", channel.name, quantity.unit()),
        });
        writer.write_record(std::iter::once("t [s]".into()).chain(titles))?;
        let mut row: Vec<String> = Vec::with_capacity(recording.channels.len() + 1);
        for sample in 0..recording.len() {
            row.clear();
            // Time is written with all digits: nine digits would resolve only 10 µs after an hour.
            row.push(recording.time_s(sample).to_string());
            row.extend(
                recording
                    .channels
                    .iter()
                    .map(|channel| number_text(channel.samples[sample])),
            );
            writer.write_record(&row)?;
        }
        writer.flush()
    })?)
}

/// Shorter text, plain or with exponent, of a sample value rounded to [`DIGITS`] significant digits.
fn number_text(value: f64) -> String {
    let rounded: f64 = format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value);
    let plain = rounded.to_string();
    let exponent = format!("{rounded:e}");
    if exponent.len() < plain.len() {
        exponent
    } else {
        plain
    }
}
