//! FRF tables in UFF 58: a complex function of type 4 per receptance, a real function of type 6 for its coherence.

mod functions;
mod write;

use std::f64::consts::TAU;
use std::path::Path;

use num_complex::Complex64;

use super::table_found::ImportedTable;
use super::{Frf, FrfError, FrfTable};
use functions::FrfFunction;
use quietcut_recording::uff::{DataSet, Function, Header, Ordinate, data_sets};
use quietcut_recording::{Import, RecordingError, Sidecar};

/// First line of the text of a function that holds the relative error by aliasing of the receptance between the same
/// degrees of freedom, [`Frf::folding`]. UFF has no function type for it, so type 0 (general) is used.
const FOLDING: &str = "folding";

impl From<RecordingError> for FrfError {
    fn from(error: RecordingError) -> Self {
        match error {
            RecordingError::File(cause) => Self::File(cause),
            RecordingError::Line { path, line, what } => Self::Line { path, line, what },
            other => Self::Recording(other),
        }
    }
}

/// True if a UFF file has a frequency response function. A file that cannot be read has none.
pub(super) fn has_frf(path: &Path) -> bool {
    data_sets(path).is_ok_and(|sets| {
        sets.iter()
            .any(|set| set.header.function == Function::FrequencyResponse)
    })
}

/// Reads an FRF table from UFF 58: functions of type 4, each with its coherence (type 6) if the file has one with as
/// many values. Which functions are read, if there are several of one receptance, say [`functions::chosen`].
pub(super) fn read(path: &Path, import: &Import) -> Result<ImportedTable, FrfError> {
    let sets = data_sets(path)?;
    let chosen = functions::chosen(path, &sets, import, &Sidecar::beside(path)?)?;
    let mut entries: Vec<Frf> = Vec::new();
    let mut above_zero: Option<Vec<f64>> = None;
    // Mobility and accelerance cannot be integrated at 0 Hz: then the table has no line there.
    let mut has_zero_hz = true;
    for function in &chosen.functions {
        let set = function.set;
        let wrong = |what: String| FrfError::Line {
            path: path.into(),
            line: set.line,
            what,
        };
        let frequencies = frequencies(set).map_err(wrong)?;
        let mut entry = receptance(function, &frequencies).map_err(wrong)?;
        let begins_at_zero = frequencies.first() == Some(&0.0);
        has_zero_hz &= begins_at_zero && entry.receptance.first().is_some_and(|value| value.is_finite());
        let own = &frequencies[usize::from(begins_at_zero)..];
        if above_zero.get_or_insert_with(|| own.to_vec()) != own {
            return Err(wrong(format!(
                "h{} has {} frequencies, and the first FRF has others; above 0 Hz all must have the same",
                entry.name(),
                frequencies.len()
            )));
        }
        let beside = |is_it: fn(&Header) -> bool| {
            let other = sets
                .iter()
                .find(|other| is_it(&other.header) && has_same_place(other, set))?;
            match &other.ordinate {
                Ordinate::Real(values) if values.len() == frequencies.len() => Some(values.clone()),
                _ => None,
            }
        };
        entry.coherence = beside(|header| header.function == Function::Coherence);
        entry.folding = beside(|header| header.function == Function::General && header.words[0] == FOLDING);
        entries.push(entry);
    }
    let mut frequency_hz = above_zero.unwrap_or_default();
    if has_zero_hz {
        frequency_hz.insert(0, 0.0);
    }
    for entry in &mut entries {
        keep_last(&mut entry.receptance, frequency_hz.len());
        for values in entry.coherence.iter_mut().chain(&mut entry.folding) {
            keep_last(values, frequency_hz.len());
        }
    }
    Ok(ImportedTable {
        table: FrfTable::new(path, frequency_hz, entries)?,
        understood: Some(format!("{}: {}", path.display(), chosen.said)),
    })
}

/// Removes the first values, so that at most `count` are left.
fn keep_last<T>(values: &mut Vec<T>, count: usize) {
    values.drain(..values.len().saturating_sub(count));
}

fn frequencies(set: &DataSet) -> Result<Vec<f64>, String> {
    let hertz = match set.header.abscissa.unit.to_lowercase().as_str() {
        "" | "hz" | "hertz" | "1/s" => 1.0,
        "rad/s" => 1.0 / TAU,
        "rpm" => 1.0 / 60.0,
        other => return Err(format!("frequencies in \"{other}\"; Hz or rad/s is needed")),
    };
    Ok(match (&set.uneven, set.header.even) {
        (Some(values), _) => values.iter().map(|value| value * hertz).collect(),
        (None, Some((first, step))) => (0..set.ordinate.len())
            .map(|index| (first + step * index as f64) * hertz)
            .collect(),
        (None, None) => Vec::new(),
    })
}

fn receptance(function: &FrfFunction<'_>, frequency_hz: &[f64]) -> Result<Frf, String> {
    let Ordinate::Complex(values) = &function.set.ordinate else {
        return Err("an FRF with real values; complex ones are needed".into());
    };
    let unit = function.unit;
    let receptance = values
        .iter()
        .zip(frequency_hz)
        .map(|(value, hertz)| {
            value * (function.sign * unit.factor) / Complex64::new(0.0, TAU * hertz).powi(unit.derivatives)
        })
        .collect();
    Ok(Frf {
        response: function.directions.0,
        force: function.directions.1,
        receptance,
        coherence: None,
        folding: None,
    })
}

/// True if two functions are between the same degrees of freedom, apart from the signs of their directions.
fn has_same_place(one: &DataSet, other: &DataSet) -> bool {
    let place = |set: &DataSet| {
        let Header {
            response, reference, ..
        } = &set.header;
        (
            response.node,
            response.direction.abs(),
            reference.node,
            reference.direction.abs(),
        )
    };
    place(one) == place(other)
}

#[cfg(test)]
mod tests;
