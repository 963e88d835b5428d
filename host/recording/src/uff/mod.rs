//! Universal file format (UFF), data set 58: functions at nodal degrees of freedom, as text and binary (58b).
//!
//! Format: Structural Dynamics Research Laboratory, University of Cincinnati. Each data set begins and ends with a
//! delimiter line `-1`. The reader accepts empty lines between data sets, `D` exponents, both byte orders, data that
//! look like the delimiter, several data sets per file, units from data set 164, and a missing last delimiter. It skips
//! other data sets.

mod data;
mod fault;
mod header;
mod number;
mod source;
mod units;
mod write;

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

pub use data::Ordinate;
pub use header::{Axis, DegreeOfFreedom, Function, Header, OrdinateType};
pub use units::unit;
pub use write::UffForm;
pub use write::{Values, axis_of, write_set, write_units};

use fault::{Fault, fault};
use header::{Binary, RECORDS};
use source::{Line, Source};
use units::FileUnits;
use write::{exponential, header_of};

use super::raw::{Raw, RawColumn};
use super::{Quantity, Recording, RecordingError};
use crate::file::{FileError, Prepared};

/// One UFF data set 58: a function with its header and values.
#[derive(Clone, Debug, PartialEq)]
pub struct DataSet {
    /// Number of the line in the file, from 1, that holds the data set number 58.
    pub line: u64,
    /// Header of the data set: the eleven records before the data.
    pub header: Header,
    /// Abscissa values of a function with uneven spacing; `None` if the spacing is even.
    pub uneven: Option<Vec<f64>>,
    /// Ordinate values.
    pub ordinate: Ordinate,
    /// Units of the UFF file (data set 164), SI by default.
    pub units: FileUnits,
}

/// Reads all data sets 58 of a UFF file, in order; there is at least one.
///
/// # Errors
/// The file cannot be read, has no data set 58, or a data set is damaged; the message names the line and the expected
/// content.
pub fn data_sets(path: &Path) -> Result<Vec<DataSet>, RecordingError> {
    let file = File::open(path).map_err(|cause| FileError::Read {
        path: path.into(),
        cause,
    })?;
    parse(BufReader::with_capacity(1 << 16, file)).map_err(|fault| fault.of_file(path))
}

fn parse(reader: impl BufRead) -> Result<Vec<DataSet>, Fault> {
    let mut source = Source::new(reader);
    let mut sets = Vec::new();
    let mut units: Option<FileUnits> = None;
    let mut others: Vec<u32> = Vec::new();
    while let Some(line) = next_delimiter(&mut source)? {
        let Some(mut first) = next_filled(&mut source)? else {
            break;
        };
        // An extra delimiter is skipped.
        while first.is_delimiter() {
            match next_filled(&mut source)? {
                Some(next) => first = next,
                None => break,
            }
        }
        if first.is_delimiter() {
            break;
        }
        match first.number_of_set() {
            Some((58, rest)) => sets.push(data_set(&mut source, first.number, &rest)?),
            Some((164, _)) => {
                let found = file_units(&mut source)?;
                // The first data set 164 (units) also applies to the data sets before it in the file.
                sets.iter_mut()
                    .filter(|_| units.is_none())
                    .for_each(|set: &mut DataSet| set.units = found);
                units = Some(found);
            }
            Some((other, _)) => {
                others.push(other);
                skip(&mut source)?;
            }
            None => {
                let shown: String = first.text().trim().chars().take(40).collect();
                return Err(fault(
                    first.number,
                    format!(
                        "\"{}\" after the -1 of line {line}; the number of a data set is needed",
                        shown.escape_debug()
                    ),
                ));
            }
        }
        if let (Some(set), Some(units)) = (sets.last_mut(), units)
            && set.line == first.number
        {
            set.units = units;
        }
    }
    if sets.is_empty() {
        let found = match others.as_slice() {
            [] => "no line -1 with the number of a data set after it".into(),
            _ => format!("only data sets {others:?}"),
        };
        return Err(fault(
            source.line().max(1),
            format!("{found}; a data set 58 is needed"),
        ));
    }
    Ok(sets)
}

/// Skips lines of a UFF file up to and including the next delimiter line `-1`. Returns its line number, or `None` at
/// the end of the file.
fn next_delimiter<R: BufRead>(source: &mut Source<R>) -> Result<Option<u64>, Fault> {
    while let Some(line) = source.next()? {
        if line.is_delimiter() {
            return Ok(Some(line.number));
        }
    }
    Ok(None)
}

/// Reads the next line of the UFF file that is not blank; `None` at the end of the file.
fn next_filled<R: BufRead>(source: &mut Source<R>) -> Result<Option<Line>, Fault> {
    while let Some(line) = source.next()? {
        if !line.is_blank() {
            return Ok(Some(line));
        }
    }
    Ok(None)
}

/// Skips the rest of a UFF data set, including its final delimiter.
fn skip<R: BufRead>(source: &mut Source<R>) -> Result<(), Fault> {
    while let Some(line) = source.next()? {
        if line.is_delimiter() {
            break;
        }
    }
    Ok(())
}

/// Reads the units that data set 164 states for the whole UFF file.
fn file_units<R: BufRead>(source: &mut Source<R>) -> Result<FileUnits, Fault> {
    let mut lines = Vec::new();
    let mut first = source.line() + 1;
    while let Some(line) = source.next()? {
        if line.is_delimiter() {
            break;
        }
        if lines.is_empty() {
            first = line.number;
        }
        lines.push(line.text());
    }
    FileUnits::parse(&lines).map_err(|(index, what)| fault(first + index as u64, what))
}

/// Reads a UFF data set 58 after its first line; `rest` is the text after `58` in that line.
fn data_set<R: BufRead>(source: &mut Source<R>, line: u64, rest: &str) -> Result<DataSet, Fault> {
    let binary = match rest.strip_prefix(['b', 'B']) {
        Some(rest) => Some(Binary::parse(rest).map_err(|what| fault(line, what))?),
        None => None,
    };
    let count = binary.map_or(RECORDS, |binary| binary.lines);
    let mut records: [String; RECORDS] = Default::default();
    let mut numbers = [line; RECORDS];
    for index in 0..count {
        let Some(record) = source.next()? else {
            return Err(fault(
                source.line(),
                format!("the file ends within the {RECORDS} lines before the data"),
            ));
        };
        // The five lines of free text may contain −1; in the later records, which hold numbers, `-1` alone is the
        // delimiter.
        if record.is_delimiter() && index >= 5 {
            return Err(fault(
                record.number,
                format!("-1 in line {} of the {RECORDS} lines before the data", index + 1),
            ));
        }
        if let (Some(text), Some(number)) = (records.get_mut(index), numbers.get_mut(index)) {
            *text = record.text();
            *number = record.number;
        }
    }
    let header = Header::parse(&records).map_err(|(index, what)| fault(numbers[index], what))?;
    let data = match binary {
        Some(binary) => data::read_binary(source, &header, binary)?,
        None => data::read_text(source, &header)?,
    };
    Ok(DataSet {
        line,
        header,
        uneven: data.uneven,
        ordinate: data.ordinate,
        units: FileUnits::SI,
    })
}

/// Reads the time histories of a UFF file as columns. With `finite`, a NaN or infinite sample is an error that names
/// the line of its data set.
pub(super) fn read(path: &Path, finite: bool) -> Result<Raw, RecordingError> {
    let mut sets = data_sets(path)?;
    let functions: Vec<i64> = sets.iter().map(|set| set.header.function.code()).collect();
    sets.retain(DataSet::is_over_time);
    let Some(first) = sets.first() else {
        return Err(RecordingError::Content {
            path: path.into(),
            what: format!(
                "its functions are of type {functions:?}; a record over time is of type 1 (an FRF, type 4, is no recording)"
            ),
        });
    };
    let mut columns = Vec::with_capacity(sets.len() + 1);
    let (even, uneven, count) = (first.header.even, first.uneven.clone(), first.ordinate.len());
    if let Some(times) = &uneven {
        columns.push(RawColumn {
            name: "t".into(),
            unit: "s".parse().ok().into(),
            samples: times.clone(),
        });
    }
    let names = names(&sets);
    for (set, name) in sets.into_iter().zip(names) {
        let wrong = |what: String| RecordingError::Line {
            path: path.into(),
            line: set.line,
            what: format!("channel \"{name}\": {what}"),
        };
        if set.ordinate.len() != count || set.header.even != even || set.uneven != uneven {
            return Err(wrong(format!(
                "{} samples, but the first channel has {count}, or other times; all channels must have been sampled together",
                set.ordinate.len()
            )));
        }
        let unit = unit(&set.header.ordinate, set.units).map_err(wrong)?;
        let Ordinate::Real(mut samples) = set.ordinate else {
            return Err(wrong(
                "complex samples; those of a record over time are real".into(),
            ));
        };
        let wrong_sample = samples.iter().position(|sample| finite && !sample.is_finite());
        if let Some(at) = wrong_sample {
            let time_s = match (even, &uneven) {
                (Some((first, step)), _) => first + step * at as f64,
                (None, times) => times.as_ref().map_or(f64::NAN, |times| times[at]),
            };
            return Err(wrong(format!(
                "sample {} is {} at {time_s} s; a number is needed: repair the channel, or use the segment before or after it with \
                 --until-s or --from-s",
                at + 1,
                samples[at]
            )));
        }
        // A direction of −1 to −3 in a UFF header means that the sensor measures against the axis x, y or z, so the
        // samples change their sign.
        if (-3..0).contains(&set.header.response.direction) {
            samples.iter_mut().for_each(|sample| *sample = -*sample);
        }
        columns.push(RawColumn {
            name,
            unit: unit.into(),
            samples,
        });
    }
    Ok(Raw {
        columns,
        sample_rate_hz: even.map(|(_, step)| rate_hz(step)),
        start_s: even.map_or(0.0, |(first, _)| first),
        ..Raw::default()
    })
}

/// Channel names of the records over time of a UFF file, as `read` gives them, each with the number of its node.
///
/// # Errors
/// The file cannot be read, or a data set has a fault.
pub fn nodes(path: &Path) -> Result<Vec<(String, i64)>, RecordingError> {
    let mut sets = data_sets(path)?;
    sets.retain(DataSet::is_over_time);
    let of_sets = sets.iter().map(|set| set.header.response.node);
    Ok(names(&sets).into_iter().zip(of_sets).collect())
}

/// Sample rate, Hz, from a time step that UFF rounds to six digits: the integer rate with the same rounded step, if
/// there is one, else 1/step.
fn rate_hz(step_s: f64) -> f64 {
    let whole = (1.0 / step_s).round();
    let six_digits = |step: f64| exponential(step, 5, 0);
    if whole >= 1.0 && six_digits(1.0 / whole) == six_digits(step_s) {
        whole
    } else {
        1.0 / step_s
    }
}

impl DataSet {
    /// True if the data set is a time history: function type 1, or type 0 (general) with time as abscissa.
    fn is_over_time(&self) -> bool {
        match self.header.function {
            Function::Time => true,
            Function::General => self.header.abscissa.kind == 17,
            _ => false,
        }
    }

    /// Name of the channel from the header of its data set: a standard name, such as `az` for an acceleration along ±z;
    /// else the entity name; the first line of text if there is no entity name or it may be truncated; `channel` if
    /// that line is empty.
    fn name(&self) -> String {
        let header = &self.header;
        let axis = match header.response.direction.abs() {
            1 => "x",
            2 => "y",
            3 => "z",
            _ => "",
        };
        let prefix = match unit(&header.ordinate, self.units) {
            Ok(Some(unit)) => match unit.quantity {
                Quantity::Force => Some("f"),
                Quantity::Displacement => Some(""),
                Quantity::Velocity => Some("v"),
                Quantity::Acceleration => Some("a"),
                _ => None,
            },
            _ => None,
        };
        if let (false, Some(prefix)) = (axis.is_empty(), prefix) {
            return format!("{prefix}{axis}");
        }
        let entity = &header.response.entity;
        let words = &header.words[0];
        // UFF limits entity names to ten characters, so one of ten may be truncated; the first line of text then holds
        // the full name.
        if entity.is_empty() || (entity.len() == 10 && words.starts_with(entity.as_str())) {
            if words.is_empty() {
                "channel".into()
            } else {
                words.clone()
            }
        } else {
            entity.clone()
        }
    }
}

/// Channel names for UFF data sets: equal names get the node number as suffix, and names that are still equal their
/// position in `sets`.
fn names(sets: &[DataSet]) -> Vec<String> {
    let plain: Vec<String> = sets.iter().map(DataSet::name).collect();
    let is_twice = |names: &[String], name: &String| names.iter().filter(|other| *other == name).count() > 1;
    let with_node: Vec<String> = plain
        .iter()
        .zip(sets)
        .map(|(name, set)| {
            if is_twice(&plain, name) {
                format!("{name}_{}", set.header.response.node)
            } else {
                name.clone()
            }
        })
        .collect();
    with_node
        .iter()
        .enumerate()
        .map(|(index, name)| {
            if is_twice(&with_node, name) {
                format!("{name}_{}", index + 1)
            } else {
                name.clone()
            }
        })
        .collect()
}

/// Writes a recording to a temporary UFF file, not yet under its final name: data set 164 with SI units, then one data
/// set 58 per channel.
pub(super) fn prepared(
    path: &Path,
    recording: &Recording,
    form: UffForm,
) -> Result<Prepared, RecordingError> {
    Ok(crate::file::prepare(path, |out| {
        write_units(out)?;
        for channel in &recording.channels {
            let header = header_of(recording, channel);
            write_set(out, &header, None, Values::Real(&channel.samples), form)?;
        }
        Ok(())
    })?)
}

#[cfg(test)]
mod tests;
