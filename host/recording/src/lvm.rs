//! Reader of LabVIEW measurement files (`.lvm`): a file header, then blocks of channels, with or without their own
//! header.
//!
//! Format: National Instruments, "Specification for the LabVIEW Measurement File (.lvm)". Separator tab or comma,
//! decimal point or comma, one X column, one for each channel, or none; of several X columns the first with values is
//! used. Each block is a record of its own. The column `Comment` is skipped.

use std::path::Path;

use super::RecordingError;
use super::raw::{FoundUnit, Raw, RawColumn};
use super::text_dialect::{Dialect, Separator};
use super::text_head::latin;

/// Line that ends the header of an `.lvm` file and the header of each of its blocks.
const END: &str = "***End_of_Header***";

/// Number of a line in the file, from 1, and its text.
type Line<'a> = (u64, &'a str);

/// Reads the blocks of a LabVIEW measurement file, each as a record of its own.
pub(super) fn read(path: &Path) -> Result<Vec<Raw>, RecordingError> {
    let bytes = crate::file::read(path)?;
    let text = String::from_utf8(bytes).unwrap_or_else(|error| latin(error.as_bytes()));
    let wrong = |line: u64, what: String| RecordingError::Line {
        path: path.into(),
        line,
        what,
    };
    let lines: Vec<Line<'_>> = text
        .lines()
        .enumerate()
        .map(|(index, line)| (index as u64 + 1, line.trim_end_matches('\r')))
        .collect();
    let is_first = |line: &str| {
        line.trim_start_matches('\u{feff}')
            .starts_with("LabVIEW Measurement")
    };
    if !lines.first().is_some_and(|(_, line)| is_first(line)) {
        return Err(wrong(
            1,
            "no LabVIEW measurement file: its first line is not \"LabVIEW Measurement\"; a text table has the extension txt".into(),
        ));
    }
    let dialect = dialect(&lines);
    let end = lines
        .iter()
        .position(|(_, line)| line.trim_start().starts_with(END))
        .ok_or_else(|| {
            wrong(
                lines.len() as u64,
                format!("the header has no end; a line {END} is needed"),
            )
        })?;
    let mut blocks = Vec::new();
    let mut rest = &lines[end + 1..];
    while let Some(start) = rest.iter().position(|(_, line)| !is_blank(line)) {
        let (block, after) = block(&rest[start..], dialect).map_err(|(line, what)| wrong(line, what))?;
        blocks.push(block);
        rest = after;
    }
    if blocks.is_empty() {
        return Err(wrong(
            lines.len() as u64,
            "there is no block of samples after the header".into(),
        ));
    }
    if blocks.len() > 1 {
        for (index, block) in blocks.iter_mut().enumerate() {
            block.label = Some(format!("block {}", index + 1));
        }
    }
    Ok(blocks)
}

/// True for a line with nothing but separators.
fn is_blank(line: &str) -> bool {
    line.chars().all(|letter| letter.is_whitespace() || letter == ',')
}

/// Separator and decimal mark that the header of a LabVIEW measurement file states; tab and point by default.
fn dialect(lines: &[Line<'_>]) -> Dialect {
    let value = |key: &str| {
        lines
            .iter()
            .take_while(|(_, line)| !line.starts_with(END))
            .find_map(|(_, line)| line.strip_prefix(key))
            .map(|rest| rest.to_owned())
    };
    let separator = match value("Separator") {
        Some(text) if text.to_lowercase().contains("comma") => Separator::Comma,
        _ => Separator::Tab,
    };
    // In the header line `Decimal_Separator` the stated decimal mark follows the separator. In a file separated by
    // commas a decimal comma is therefore the second comma of that line; it is ignored, since it could not be told from
    // the separator.
    let decimal_comma = value("Decimal_Separator").is_some_and(|text| {
        let commas = text.matches(',').count();
        commas > usize::from(separator == Separator::Comma)
    });
    Dialect {
        separator,
        decimal_comma: decimal_comma && separator != Separator::Comma,
    }
}

/// Header of a block of a LabVIEW measurement file: rows of a key and values, mostly one for each channel.
#[derive(Default)]
struct BlockHeader<'a> {
    rows: Vec<(&'a str, Vec<&'a str>)>,
}

impl<'a> BlockHeader<'a> {
    /// Value of `key` for channel number `index`, from 0, in the header of a block; the first value if there is none
    /// with that number. `None` if the key is missing or the value empty.
    fn value(&self, key: &str, index: usize) -> Option<&'a str> {
        let (_, values) = self.rows.iter().find(|(name, _)| *name == key)?;
        values
            .get(index)
            .or(values.first())
            .copied()
            .filter(|value| !value.is_empty())
    }
}

/// Reads one block of a LabVIEW measurement file from its first line; returns the block and the lines after it.
fn block<'l, 'a>(lines: &'l [Line<'a>], dialect: Dialect) -> Result<(Raw, &'l [Line<'a>]), (u64, String)> {
    let mut at = 0;
    let mut header = BlockHeader::default();
    // A block that has no header of its own begins with the row of channel names.
    let has_header = lines
        .iter()
        .take_while(|(_, line)| !is_blank(line))
        .any(|(_, line)| line.starts_with(END));
    if has_header {
        for (_, line) in lines {
            at += 1;
            if line.starts_with(END) {
                break;
            }
            let fields = dialect.fields(line);
            if let Some((key, values)) = fields.split_first() {
                header.rows.push((key, values.to_vec()));
            }
        }
    }
    let Some((_, titles)) = lines.get(at) else {
        return Err((
            lines.last().map_or(0, |line| line.0),
            "the block has no row of names".into(),
        ));
    };
    let titles = dialect.fields(titles);
    let rows: Vec<&Line<'_>> = lines[at + 1..]
        .iter()
        .take_while(|(_, line)| !is_blank(line) && !line.starts_with("Channels"))
        .collect();
    let after = &lines[at + 1 + rows.len()..];
    let mut x: Option<Vec<f64>> = None;
    let mut columns: Vec<RawColumn> = Vec::new();
    for (index, title) in titles.iter().enumerate() {
        if title.is_empty() || *title == "Comment" {
            continue;
        }
        let mut samples = Vec::new();
        for (line, row) in &rows {
            let field = dialect.fields(row).get(index).copied().unwrap_or_default();
            if field.is_empty() {
                continue;
            }
            let value = dialect.number(field).filter(|value| value.is_finite());
            samples.push(value.ok_or_else(|| {
                let shown: String = field.chars().take(40).collect();
                (
                    *line,
                    format!("\"{shown}\" in column \"{title}\": a number is needed"),
                )
            })?);
        }
        if *title == "X_Value" {
            if !samples.is_empty() {
                x.get_or_insert(samples);
            }
            continue;
        }
        columns.push(RawColumn {
            name: (*title).into(),
            unit: header
                .value("Y_Unit_Label", index.saturating_sub(1))
                .map_or(FoundUnit::None, |unit| FoundUnit::Text(unit.into())),
            samples,
        });
    }
    let first = lines.first().map_or(0, |line| line.0);
    if let Some(dimension) = header.value("X_Dimension", 0)
        && !dimension.eq_ignore_ascii_case("time")
    {
        return Err((
            first,
            format!("the X values are of \"{dimension}\"; a record over Time is needed"),
        ));
    }
    Ok((record(x, columns, &header, dialect), after))
}

/// Record of a block of samples. X values for all samples become a time column, which takes precedence over a stated
/// interval, unless they agree with the interval that the header of the block states.
fn record(
    x: Option<Vec<f64>>,
    mut columns: Vec<RawColumn>,
    header: &BlockHeader<'_>,
    dialect: Dialect,
) -> Raw {
    let longest = columns
        .iter()
        .map(|column| column.samples.len())
        .max()
        .unwrap_or(0);
    let mut notes = Vec::new();
    columns.retain(|column| {
        let is_whole = column.samples.len() == longest;
        if !is_whole {
            notes.push(format!(
                "{} has {} of {longest} samples and is not used",
                column.name,
                column.samples.len()
            ));
        }
        is_whole
    });
    let number = |key: &str| header.value(key, 0).and_then(|text| dialect.number(text));
    let interval_s = number("Delta_X").filter(|interval| interval.is_finite() && *interval > 0.0);
    let stepped_s = x
        .as_ref()
        .filter(|x| x.len() == longest && longest > 1)
        .map(|x| (x[longest - 1] - x[0]) / (longest - 1) as f64);
    // X values are printed with few digits, the stated interval with all. They agree if the two durations of the block
    // differ by at most one sample interval.
    let agrees = match (interval_s, stepped_s) {
        (Some(interval), Some(stepped)) => (interval - stepped).abs() * longest as f64 <= interval,
        _ => true,
    };
    if let (Some(x), Some(_)) = (x, stepped_s)
        && !(agrees && interval_s.is_some())
    {
        columns.insert(
            0,
            RawColumn {
                name: "t".into(),
                unit: FoundUnit::Text("s".into()),
                samples: x,
            },
        );
    }
    Raw {
        columns,
        sample_rate_hz: interval_s.map(|interval| 1.0 / interval),
        start_s: number("X0").filter(|start| start.is_finite()).unwrap_or(0.0),
        notes,
        ..Raw::default()
    }
}

#[cfg(test)]
mod tests {
    use crate::Recording;

    const FILE: &str = "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\nX_Columns\tOne\n***End_of_Header***\t\n\t\n\
                        Channels\t2\t\t\nSamples\t3\t3\t\nY_Unit_Label\tN\tg\t\nX_Dimension\tTime\tTime\t\nX0\t0.0\t0.0\t\nDelta_X\t0.001\t0.001\t\n\
                        ***End_of_Header***\t\t\t\nX_Value\tHammer\tAcc Y\tComment\n0.000\t1.0\t0.5\tfirst\n0.001\t2.0\t-0.5\t\n0.002\t0.0\t0.25\t\n";

    fn read(text: &str) -> Result<Recording, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.lvm");
        std::fs::write(&path, text).unwrap();
        Recording::read(&path).map_err(|error| error.to_string())
    }

    #[test]
    fn a_block_is_read_with_units_and_interval() {
        let said = read(FILE).unwrap_err();
        assert!(
            said.contains("\"Hammer\"") && said.contains("--map Hammer=fx"),
            "{said}"
        );
        let recording = read(&FILE.replace("Hammer", "Hammer Y")).unwrap();
        assert_eq!(recording.sample_rate_hz, 1000.0);
        assert_eq!(recording.channel("fy").unwrap().samples, [1.0, 2.0, 0.0]);
        assert_eq!(recording.channel("ay").unwrap().samples[2], 0.25 * 9.806_65);
    }

    #[test]
    fn several_blocks_are_several_records() {
        let one = FILE.replace("Hammer", "Hammer Y");
        let (_, block) = one.split_once("\t\nChannels").unwrap();
        let two = format!("{one}\t\nChannels{block}");
        let said = read(&two).unwrap_err();
        assert!(said.contains("2 records") && said.contains("--record"), "{said}");
    }

    #[test]
    fn damaged_files_are_refused_with_their_line() {
        for (from, to, words) in [
            ("LabVIEW Measurement", "LabVIEW", "line 1"),
            ("2.0", "two", "line 17: \"two\""),
            ("Time\tTime", "Frequency\tFrequency", "Frequency"),
        ] {
            let said = read(&FILE.replacen(from, to, 1).replace("Hammer", "Hammer Y")).unwrap_err();
            assert!(said.contains(words), "{said}");
        }
        let said = read("LabVIEW Measurement\n").unwrap_err();
        assert!(said.contains("***End_of_Header***"), "{said}");
    }
}
