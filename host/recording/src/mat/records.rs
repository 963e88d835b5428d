//! Records in the variables of a MAT-file.
//!
//! Of the vectors and matrices of the file, those with the most samples are one record. If none has more than one
//! sample, each element of each structure is read in the same way, as a record of its own: an array of impacts gives as
//! many records. Two or more structures side by side that hold one signal each count as vectors: their signals are
//! channels of one record.

use super::value::{Item, Value, Variable};
use crate::raw::{FoundUnit, Raw, RawColumn};

/// Names of a variable that holds the sample rate in samples per second, in lower case.
const RATES: &[&str] = &[
    "fs",
    "f_s",
    "fsample",
    "srate",
    "samplerate",
    "sample_rate",
    "sample_rate_hz",
    "samplingrate",
    "sampling_rate",
    "samplingfrequency",
    "sampling_frequency",
    "abtastrate",
];

/// Names of a variable that holds the sample interval in s, in lower case.
const INTERVALS: &[&str] = &[
    "dt",
    "ts",
    "deltat",
    "delta_t",
    "tsample",
    "sampletime",
    "sample_time",
    "x_increment",
    "wf_increment",
    "tinterval",
];

/// Names of the time vector in a MAT structure that holds one channel, in lower case.
const TIMES: &[&str] = &["t", "time", "zeit", "x"];

/// The records in the variables of a MAT-file; an error if there is none.
pub(super) fn records(items: Vec<Item>) -> Result<Vec<Raw>, String> {
    let rate = rate(&items);
    let mut found = Vec::new();
    collect(items, None, rate, &mut found);
    if found.is_empty() {
        return Err(
            "it has no numeric vector that could be a channel (objects and sparse arrays are skipped, and complex ones in level 7.3)".into(),
        );
    }
    Ok(found)
}

/// Adds the records in `items`, the variables of the file or the fields of structure `label`; `outer_hz` is the sample
/// rate that the enclosing structure or the file states.
fn collect(items: Vec<Item>, label: Option<String>, outer_hz: Option<f64>, found: &mut Vec<Raw>) {
    let rate_hz = rate(&items).or(outer_hz);
    let units = units(&items);
    let mut variables: Vec<(Variable, Option<String>)> = Vec::new();
    let mut structures = Vec::new();
    for item in items {
        match item.value {
            Value::Numbers(variable) => {
                let unit = units
                    .iter()
                    .find(|(name, _)| *name == item.name.to_lowercase())
                    .map(|(_, unit)| unit.clone());
                variables.push((variable, unit));
            }
            Value::Text(_) => {}
            Value::Elements(elements) => structures.push((item.name, elements)),
        }
    }
    let channels_of_structures = channels(&mut structures);
    variables.extend(channels_of_structures);
    let longest = variables
        .iter()
        .map(|(variable, _)| variable.samples())
        .max()
        .unwrap_or(0);
    if longest > 1 {
        found.push(record(variables, longest, label, rate_hz));
        return;
    }
    for (name, elements) in structures {
        let several = elements.len() > 1;
        for (index, fields) in elements.into_iter().enumerate() {
            let own = if several {
                format!("{name}({})", index + 1)
            } else {
                name.clone()
            };
            let label = match &label {
                Some(outer) if own.is_empty() => outer.clone(),
                Some(outer) => format!("{outer}.{own}"),
                None => own,
            };
            collect(fields, Some(label), rate_hz, found);
        }
    }
}

/// One record from the variables of `longest` samples; a note names each shorter vector or matrix, which is not used.
fn record(
    variables: Vec<(Variable, Option<String>)>,
    longest: usize,
    label: Option<String>,
    worded_rate_hz: Option<f64>,
) -> Raw {
    let mut notes = Vec::new();
    let mut columns: Vec<RawColumn> = Vec::new();
    let mut sources = 0;
    for (variable, unit) in variables {
        let samples = variable.samples();
        if samples < longest {
            if samples > 1 {
                notes.push(format!(
                    "{} has {samples} of {longest} samples and is not used",
                    variable.name
                ));
            }
            continue;
        }
        sources += 1;
        columns.extend(variable.into_columns().into_iter().map(|column| RawColumn {
            unit: unit.clone().map_or(FoundUnit::None, FoundUnit::Text),
            ..column
        }));
    }
    Raw {
        asks_names: sources == 1 && columns.len() > 1,
        columns,
        worded_rate_hz,
        label,
        notes,
        ..Raw::default()
    }
}

/// Sample rate, samples per second, from a scalar variable whose name says that it is a sample rate or a sample
/// interval; `None` without such a variable with a positive finite value.
fn rate(items: &[Item]) -> Option<f64> {
    let scalar = |names: &[&str]| {
        items.iter().find_map(|item| match &item.value {
            Value::Numbers(variable) if names.contains(&item.name.to_lowercase().as_str()) => {
                match variable.values.as_slice() {
                    [values] if values.len() == 1 && values[0].is_finite() && values[0] > 0.0 => {
                        Some(values[0])
                    }
                    _ => None,
                }
            }
            _ => None,
        })
    };
    scalar(RATES).or_else(|| scalar(INTERVALS).map(|interval| 1.0 / interval))
}

/// Units of variables by the name of the variable in lower case, as text variables (`force_unit = 'N'`) or as a
/// structure `unit` or `units` with a text field for each variable.
fn units(items: &[Item]) -> Vec<(String, String)> {
    let mut units = Vec::new();
    for item in items {
        let name = item.name.to_lowercase();
        match &item.value {
            Value::Text(text) => {
                for end in ["_unit", "_units"] {
                    if let Some(of) = name.strip_suffix(end) {
                        units.push((of.to_owned(), text.clone()));
                    }
                }
            }
            Value::Elements(elements) if matches!(name.as_str(), "unit" | "units") => {
                for field in elements.iter().flatten() {
                    if let Value::Text(text) = &field.value {
                        units.push((field.name.to_lowercase(), text.clone()));
                    }
                }
            }
            _ => {}
        }
    }
    units
}

/// If at least two of `structures` hold one channel each, removes these and returns their channels: one vector, and the
/// text of its unit if there is one. Otherwise returns nothing.
fn channels(structures: &mut Vec<(String, Vec<Vec<Item>>)>) -> Vec<(Variable, Option<String>)> {
    // If only one structure holds a single channel, it is left as a record of its own, with the names of its fields.
    let is_channel = |(_, elements): &(String, Vec<Vec<Item>>)| match elements.as_slice() {
        [fields] => fields.iter().filter(|field| is_signal(field)).count() == 1,
        _ => false,
    };
    if structures
        .iter()
        .filter(|structure| is_channel(structure))
        .count()
        < 2
    {
        return Vec::new();
    }
    let mut taken = Vec::new();
    for (name, elements) in std::mem::take(structures) {
        let structure = (name, elements);
        if !is_channel(&structure) {
            structures.push(structure);
            continue;
        }
        let (name, elements) = structure;
        let mut unit = None;
        let mut signal = None;
        for field in elements.into_iter().flatten() {
            let is_unit = matches!(field.name.to_lowercase().as_str(), "unit" | "units" | "einheit");
            let is_the_signal = is_signal(&field);
            match field.value {
                Value::Text(text) if is_unit => unit = Some(text),
                Value::Numbers(variable) if is_the_signal => signal = Some(variable),
                _ => {}
            }
        }
        taken.extend(signal.map(|variable| (Variable { name, ..variable }, unit)));
    }
    taken
}

/// True for a field of a MAT structure with one vector of samples whose name is not that of time.
fn is_signal(field: &Item) -> bool {
    matches!(&field.value, Value::Numbers(variable) if variable.values.len() == 1 && variable.samples() > 1)
        && !TIMES.contains(&field.name.to_lowercase().as_str())
}
