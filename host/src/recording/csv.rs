//! CSV: a header row with `name [unit]` per column, then numbers.

use std::path::Path;

use super::{Quantity, Raw, RawColumn, Recording, RecordingError};

/// Significant digits of written numbers: what a 32-bit float holds, and more than any 16-bit sensor.
const DIGITS: usize = 9;

pub(super) fn read(path: &Path) -> Result<Raw, RecordingError> {
    let text = crate::file::read_text(path)?;
    let mut reader = csv::ReaderBuilder::new()
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    let header = reader.headers().map_err(|error| malformed(path, &error))?.clone();
    let mut columns = Vec::with_capacity(header.len());
    for title in &header {
        columns.push(column(path, title)?);
    }
    let mut record = csv::StringRecord::new();
    while reader
        .read_record(&mut record)
        .map_err(|error| malformed(path, &error))?
    {
        let line = record.position().map_or(0, csv::Position::line);
        let wrong = |what: String| RecordingError::Line {
            path: path.into(),
            line,
            what,
        };
        if record.len() != columns.len() {
            return Err(wrong(format!(
                "{} values, but the header has {} columns",
                record.len(),
                columns.len()
            )));
        }
        for (column, field) in columns.iter_mut().zip(&record) {
            match field.parse::<f64>() {
                Ok(value) if value.is_finite() => column.samples.push(value),
                _ => {
                    return Err(wrong(format!(
                        "\"{field}\" in column \"{}\": a number is needed",
                        column.name
                    )));
                }
            }
        }
    }
    if columns.iter().all(|column| column.samples.is_empty()) {
        return Err(RecordingError::Content {
            path: path.into(),
            what: "there are no samples; a header row and then numbers are needed".into(),
        });
    }
    Ok(Raw {
        columns,
        sample_rate_hz: None,
    })
}

/// A column by its header, `name [unit]` or `name`.
fn column(path: &Path, title: &str) -> Result<RawColumn, RecordingError> {
    let (name, unit) = match title.strip_suffix(']').and_then(|inner| inner.rsplit_once('[')) {
        Some((name, unit)) => {
            let unit = unit.parse().map_err(|cause| RecordingError::Unit {
                path: path.into(),
                column: title.into(),
                cause,
            })?;
            (name.trim(), Some(unit))
        }
        None => (title, None),
    };
    let is_number = name.parse::<f64>().is_ok();
    if name.is_empty() || is_number {
        let what = if is_number {
            format!("the header has the number {name}; a row of names is needed before the numbers")
        } else {
            "a column has no name; every column needs one, as in \"ax [m/s^2]\"".into()
        };
        return Err(RecordingError::Line {
            path: path.into(),
            line: 1,
            what,
        });
    }
    Ok(RawColumn {
        name: name.into(),
        unit,
        samples: Vec::new(),
    })
}

fn malformed(path: &Path, error: &csv::Error) -> RecordingError {
    RecordingError::Line {
        path: path.into(),
        line: error.position().map_or(1, csv::Position::line),
        what: error.to_string(),
    }
}

pub(super) fn write(path: &Path, recording: &Recording) -> Result<(), RecordingError> {
    crate::file::write_with(path, |writer| {
        let mut writer = csv::Writer::from_writer(writer);
        let titles = recording.channels.iter().map(|channel| match channel.quantity {
            Quantity::Unknown => channel.name.clone(),
            quantity => format!("{} [{}]", channel.name, quantity.unit()),
        });
        writer.write_record(std::iter::once("t [s]".into()).chain(titles))?;
        let mut row: Vec<String> = Vec::with_capacity(recording.channels.len() + 1);
        for sample in 0..recording.len() {
            row.clear();
            // Time needs all its digits: after an hour nine are not a microsecond.
            row.push(recording.time_s(sample).to_string());
            row.extend(
                recording
                    .channels
                    .iter()
                    .map(|channel| number(channel.samples[sample])),
            );
            writer.write_record(&row)?;
        }
        writer.flush()
    })?;
    Ok(())
}

/// A number in the fewest characters that keep [`DIGITS`] digits.
fn number(value: f64) -> String {
    let rounded: f64 = format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value);
    let plain = rounded.to_string();
    let exponent = format!("{rounded:e}");
    if exponent.len() < plain.len() {
        exponent
    } else {
        plain
    }
}
