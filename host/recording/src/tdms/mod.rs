//! Reader of TDMS files of National Instruments: groups of channels with properties, in segments.
//!
//! Format: National Instruments, "TDMS File Format Internal Structure". Each group with numeric samples is a record.
//! `wf_increment` states the sample interval, `unit_string` the unit. Raw data of DAQmx (unscaled, with a format of its
//! own) is refused; one linear scale per channel is applied, any other scale is refused.
//!
//! Every size is checked against the length of the file before memory is taken.

mod bytes;
mod segments;

use std::path::Path;

use super::RecordingError;
use super::raw::{FoundUnit, Raw, RawColumn};
use segments::{Object, Property};

/// Reads the groups of a TDMS file that have numeric samples, each as a record of its own.
pub(super) fn read(path: &Path) -> Result<Vec<Raw>, RecordingError> {
    let data = crate::file::read(path)?;
    let wrong = |what: String| RecordingError::Content {
        path: path.into(),
        what,
    };
    let objects = segments::objects(&data).map_err(wrong)?;
    drop(data);
    let mut records: Vec<(String, Vec<Object>)> = Vec::new();
    for object in objects {
        // An object of a TDMS file whose path is /'group'/'channel' is a channel; root and groups have no samples.
        let names = names(&object.path);
        let [group, _] = names.as_slice() else {
            continue;
        };
        if object.samples.is_empty() {
            continue;
        }
        match records.iter_mut().find(|(name, _)| name == group) {
            Some((_, channels)) => channels.push(object),
            None => records.push((group.clone(), vec![object])),
        }
    }
    if records.is_empty() {
        return Err(wrong("it has no channel of numbers".into()));
    }
    let several = records.len() > 1;
    records
        .into_iter()
        .map(|(group, channels)| record(channels, several.then_some(group)).map_err(wrong))
        .collect()
}

/// Names in a TDMS path: group and channel of `/'group'/'channel'`, the group alone of `/'group'`. A quote in a name is
/// doubled in the path.
fn names(path: &str) -> Vec<String> {
    let mut names = Vec::new();
    let mut rest = path;
    while let Some(inner) = rest.strip_prefix("/'") {
        let mut name = String::new();
        let mut letters = inner.char_indices().peekable();
        let mut end = inner.len();
        while let Some((at, letter)) = letters.next() {
            if letter != '\'' {
                name.push(letter);
            } else if letters.next_if(|(_, next)| *next == '\'').is_some() {
                name.push('\'');
            } else {
                end = at + 1;
                break;
            }
        }
        names.push(name);
        rest = &inner[end..];
    }
    names
}

/// One record from the channels of a TDMS group; a note names each channel with fewer samples than the longest, which
/// is not used.
fn record(channels: Vec<Object>, label: Option<String>) -> Result<Raw, String> {
    let longest = channels
        .iter()
        .map(|channel| channel.samples.len())
        .max()
        .unwrap_or(0);
    let mut raw = Raw {
        label,
        ..Raw::default()
    };
    let mut interval_s: Option<f64> = None;
    for channel in channels {
        let name = names(&channel.path).pop().unwrap_or_default();
        if channel.samples.len() < longest {
            raw.notes.push(format!(
                "{name} has {} of {longest} samples and is not used",
                channel.samples.len()
            ));
            continue;
        }
        let own = channel
            .number("wf_increment")
            .filter(|interval| interval.is_finite() && *interval > 0.0);
        match (interval_s, own) {
            (Some(first), Some(own)) if (own / first - 1.0).abs() > 1e-9 => {
                return Err(format!(
                    "channel \"{name}\" has an interval (wf_increment) of {own} s, and the first one {first} s; all must have been sampled \
                     together"
                ));
            }
            (None, Some(own)) => interval_s = Some(own),
            _ => {}
        }
        raw.start_s = channel
            .number("wf_start_offset")
            .filter(|start| start.is_finite())
            .unwrap_or(raw.start_s);
        let unit = channel
            .text("unit_string")
            .or_else(|| channel.text("NI_UnitDescription"))
            .filter(|unit| !unit.is_empty());
        let unit = unit.map_or(FoundUnit::None, |unit| FoundUnit::Text(unit.into()));
        let samples = channel.scaled(&name)?;
        raw.columns.push(RawColumn { name, unit, samples });
    }
    raw.sample_rate_hz = interval_s.map(|interval| 1.0 / interval);
    Ok(raw)
}

impl Object {
    fn number(&self, name: &str) -> Option<f64> {
        match self.properties.get(name)? {
            Property::Number(number) => Some(*number),
            Property::Text(text) => text.trim().parse().ok(),
        }
    }

    fn text(&self, name: &str) -> Option<&str> {
        match self.properties.get(name)? {
            Property::Text(text) => Some(text.trim()),
            Property::Number(_) => None,
        }
    }

    /// Samples of a TDMS channel after the linear scale that its properties state, value = slope · sample + intercept;
    /// unchanged without a scale or if they are scaled already.
    fn scaled(self, name: &str) -> Result<Vec<f64>, String> {
        let scales = self.number("NI_Number_Of_Scales").unwrap_or(0.0);
        if scales < 1.0 || self.text("NI_Scaling_Status") == Some("scaled") {
            return Ok(self.samples);
        }
        let kind = self.text("NI_Scale[0]_Scale_Type").unwrap_or_default();
        let slope = self.number("NI_Scale[0]_Linear_Slope");
        match (kind, slope) {
            ("Linear", Some(slope)) if scales == 1.0 => {
                let intercept = self.number("NI_Scale[0]_Linear_Y_Intercept").unwrap_or(0.0);
                let mut samples = self.samples;
                samples
                    .iter_mut()
                    .for_each(|sample| *sample = slope * *sample + intercept);
                Ok(samples)
            }
            _ => Err(format!(
                "channel \"{name}\" has {scales} scales, of kind \"{kind}\"; one linear scale is read: export the scaled samples"
            )),
        }
    }
}

#[cfg(test)]
mod tests;
