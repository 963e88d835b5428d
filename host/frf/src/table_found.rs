//! FRF tables in text files of other programs: real and imaginary part, or magnitude and phase, of receptance, mobility
//! or accelerance.
//!
//! The meaning of a column follows from the words and units of its title: `Frequency (Hz)`, `Real`, `Imag`, `Mag (dB)`,
//! `Phase (deg)`, `Hxx Real (m/N)`. If the title does not state it, the user must: the option `--map` or the sidecar
//! names the column (`hxx_re`, `hxx_im`, `hxx_mag`, `hxx_phase`, `hxx_db`, `coherence_xx`, `frequency_hz`) and its
//! unit.

use std::f64::consts::TAU;
use std::path::Path;

use num_complex::Complex64;

use super::frf_unit::FrfUnit;
use super::table_column::{Content, Meaning, Part, PhaseUnit, meaning};
use super::{Frf, FrfError, FrfTable};
use quietcut_model::structure::Direction;
use quietcut_recording::{Import, Sidecar, TextColumn, TextTable};

/// An FRF table read from a file, with a description of how its columns were interpreted.
#[derive(Clone, Debug)]
pub struct ImportedTable {
    /// The table, receptances in m/N.
    pub table: FrfTable,
    /// One line with the columns or functions of each receptance, what they mean, and notes on the reading; `None` for
    /// a CSV table in the format of this program.
    pub understood: Option<String>,
}

/// Reads an FRF table from a text file of another program.
pub(super) fn read(path: &Path, import: &Import) -> Result<ImportedTable, FrfError> {
    let text = TextTable::read(path)?;
    let sidecar = Sidecar::beside(path)?;
    let names: Vec<String> = text.columns.iter().map(|column| column.name.clone()).collect();
    if let Some(stranger) = import.map.iter().find(|map| {
        let is_about = |column: &TextColumn| map.is_about(&column.name, column.number, &names);
        !text.columns.iter().any(is_about)
    }) {
        return Err(FrfError::Content {
            path: path.into(),
            what: format!(
                "--map {}: the file has no such column, but {}",
                stranger.column,
                names.join(", ")
            ),
        });
    }
    let mut columns = Vec::with_capacity(text.columns.len());
    let mut is_named = Vec::with_capacity(text.columns.len());
    for column in &text.columns {
        let map = import
            .map
            .iter()
            .find(|map| map.is_about(&column.name, column.number, &names));
        let said = sidecar.channels.get(&column.name);
        let meaning = meaning(column, map, said).map_err(|what| FrfError::Column {
            path: path.into(),
            column: column.name.clone(),
            what,
        })?;
        columns.push((column, meaning));
        is_named.push(map.is_some() || said.is_some_and(|said| said.name.is_some()));
    }
    let notes = leave_out_unnamed(&mut columns, &is_named, text.notes);
    assemble(path, &columns, notes)
}

/// If the user names a receptance, takes those out that neither the user nor the file names: the user chooses.
fn leave_out_unnamed(
    columns: &mut [(&TextColumn, Meaning)],
    is_named: &[bool],
    mut notes: Vec<String>,
) -> Vec<String> {
    let is_value = |meaning: &Meaning| matches!(meaning.content, Content::Value(_));
    let chooses = columns
        .iter()
        .zip(is_named)
        .any(|((_, meaning), is_named)| *is_named && is_value(meaning));
    if !chooses {
        return notes;
    }
    let mut left_out = Vec::new();
    for ((column, meaning), is_named) in columns.iter_mut().zip(is_named) {
        if !is_named && is_value(meaning) && meaning.directions.is_none() {
            meaning.content = Content::Other;
            left_out.push(column.name.as_str());
        }
    }
    if !left_out.is_empty() {
        notes.push(format!("{} left out", left_out.join(", ")));
    }
    notes
}

/// The two columns of one receptance: real and imaginary part, or magnitude and phase.
struct Pair<'a> {
    label: &'a str,
    first: (&'a TextColumn, &'a Meaning),
    second: (&'a TextColumn, &'a Meaning),
}

fn assemble(
    path: &Path,
    columns: &[(&TextColumn, Meaning)],
    mut notes: Vec<String>,
) -> Result<ImportedTable, FrfError> {
    let wrong = |what: String| FrfError::Content {
        path: path.into(),
        what,
    };
    let (frequency, factor) = columns
        .iter()
        .find_map(|(column, meaning)| match meaning.content {
            Content::Frequency(factor) => Some((column, factor)),
            _ => None,
        })
        .ok_or_else(|| {
            let names: Vec<&str> = columns.iter().map(|(column, _)| column.name.as_str()).collect();
            wrong(format!(
                "there is no column of frequencies, such as frequency_hz or Frequency (Hz), but {}; state the columns with --map {}",
                names.join(", "),
                proposed(&names, &["frequency_hz", "hxx_re:m/N", "hxx_im:m/N"])
            ))
        })?;
    let mut frequency_hz: Vec<f64> = frequency.values.iter().map(|value| value * factor).collect();
    let pairs = pairs(path, columns)?;
    require_statements(path, &pairs)?;
    let mut entries = Vec::new();
    let mut said = Vec::new();
    for pair in &pairs {
        // Directions and unit of the receptance are stated, since `require_statements` has refused the table otherwise.
        let (Some((response, force)), Some(unit)) = (pair.directions(), pair.unit()) else {
            continue;
        };
        let receptance = pair
            .values(path)?
            .into_iter()
            .zip(&frequency_hz)
            .map(|(value, hertz)| {
                value * unit.factor / Complex64::new(0.0, TAU * hertz).powi(unit.derivatives)
            })
            .collect();
        let coherence = coherence(columns, pair.label, (response, force), pairs.len());
        said.push(format!(
            "{} and {} are h{response}{force}, {}",
            pair.first.0.name,
            pair.second.0.name,
            unit.word()
        ));
        entries.push(Frf {
            response,
            force,
            receptance,
            coherence,
            folding: None,
        });
    }
    // Mobility and accelerance cannot be integrated at 0 Hz, and many programs write no number there: then the table has
    // no line there.
    if frequency_hz.first() == Some(&0.0)
        && entries
            .iter()
            .any(|entry| entry.receptance.first().is_some_and(|value| !value.is_finite()))
    {
        frequency_hz.remove(0);
        for entry in &mut entries {
            entry.receptance.remove(0);
            if let Some(coherence) = &mut entry.coherence {
                coherence.remove(0);
            }
        }
        notes.push("the line at 0 Hz is left out".into());
    }
    said.extend(notes);
    let table = FrfTable::new(path, frequency_hz, entries)?;
    Ok(ImportedTable {
        understood: Some(format!("{}: {}", path.display(), said.join("; "))),
        table,
    })
}

/// Text of the option `--map` for the first columns.
fn proposed(names: &[&str], meanings: &[&str]) -> String {
    let map: Vec<String> = names
        .iter()
        .zip(meanings)
        .map(|(name, meaning)| format!("{name}={meaning}"))
        .collect();
    format!("\"{}\"", map.join(","))
}

/// True for a column of a real part, or a magnitude, of which `other` may hold the imaginary part, or the phase.
fn is_partner(first: Part, other: Content) -> bool {
    matches!(
        (first, other),
        (Part::Real, Content::Value(Part::Imaginary))
            | (Part::Magnitude | Part::Decibel, Content::Value(Part::Phase(_)))
    )
}

/// True if the receptance of a magnitude or phase is there as real and imaginary part too.
fn is_given_as_parts(columns: &[(&TextColumn, Meaning)], meaning: &Meaning) -> bool {
    let is_same = |other: &Meaning| other.label == meaning.label && other.directions == meaning.directions;
    let has = |part: Part| {
        columns
            .iter()
            .any(|(_, other)| other.content == Content::Value(part) && is_same(other))
    };
    let is_polar = matches!(
        meaning.content,
        Content::Value(Part::Magnitude | Part::Decibel | Part::Phase(_))
    );
    is_polar && has(Part::Real) && has(Part::Imaginary)
}

/// Pairs the two columns of each receptance: real and imaginary part, or magnitude and phase; a magnitude and a phase of
/// which the real and imaginary part are there too are left out. An error if there is no pair, or if one of these
/// columns stands alone.
fn pairs<'a>(path: &Path, columns: &'a [(&'a TextColumn, Meaning)]) -> Result<Vec<Pair<'a>>, FrfError> {
    let mut pairs: Vec<Pair<'a>> = Vec::new();
    for (column, meaning) in columns {
        let Content::Value(part) = meaning.content else {
            continue;
        };
        // Each pair of columns is formed once, at the column of the real part or magnitude.
        if matches!(part, Part::Imaginary | Part::Phase(_)) || is_given_as_parts(columns, meaning) {
            continue;
        }
        let is_other = |other: &&(&TextColumn, Meaning)| {
            let belongs = other.1.label == meaning.label && other.1.directions == meaning.directions;
            belongs && is_partner(part, other.1.content)
        };
        // A table of one receptance may call its columns by words that have nothing in common: `Level`, `Phase`.
        let only = || {
            let firsts = columns.iter().filter(|(_, first)| match first.content {
                Content::Value(first) => !matches!(first, Part::Imaginary | Part::Phase(_)),
                _ => false,
            });
            let mut others = columns.iter().filter(|other| is_partner(part, other.1.content));
            let other = others.next();
            other.filter(|_| firsts.count() == 1 && others.next().is_none())
        };
        let Some((other, of_other)) = columns
            .iter()
            .find(is_other)
            .or_else(only)
            .map(|(column, meaning)| (*column, meaning))
        else {
            return Err(alone(path, column));
        };
        pairs.push(Pair {
            label: &meaning.label,
            first: (column, meaning),
            second: (other, of_other),
        });
    }
    if pairs.is_empty() {
        return Err(FrfError::Content {
            path: path.into(),
            what: format!(
                "no frequency response function in it; its columns are {}; real and imaginary part, or magnitude and phase, are needed: state them \
                 with --map COLUMN=hxx_re:m/N,COLUMN=hxx_im:m/N or with hxx_mag and hxx_phase",
                columns
                    .iter()
                    .map(|(column, _)| column.name.clone())
                    .collect::<Vec<_>>()
                    .join(", ")
            ),
        });
    }
    let is_paired = |column: &TextColumn| pairs.iter().any(|pair| std::ptr::eq(pair.second.0, column));
    match columns.iter().find(|(column, meaning)| {
        let second = matches!(meaning.content, Content::Value(Part::Imaginary | Part::Phase(_)));
        second && !is_paired(column) && !is_given_as_parts(columns, meaning)
    }) {
        Some((column, _)) => Err(alone(path, column)),
        None => Ok(pairs),
    }
}

/// Error for a column that has no partner.
fn alone(path: &Path, column: &TextColumn) -> FrfError {
    FrfError::Content {
        path: path.into(),
        what: format!(
            "column \"{}\" stands alone; real and imaginary part, or magnitude and phase, are needed",
            column.name
        ),
    }
}

/// Refuses column pairs of which the directions, the unit of response per force or the unit of the phase is not known;
/// the last one may follow from the [values](phase_unit). The message proposes the option and the keys of the sidecar
/// that state them.
fn require_statements(path: &Path, pairs: &[Pair<'_>]) -> Result<(), FrfError> {
    const PROPOSED: [&str; 9] = ["xx", "yx", "zx", "xy", "yy", "zy", "xz", "yz", "zz"];
    let mut taken: Vec<String> = pairs
        .iter()
        .filter_map(|pair| {
            pair.directions()
                .map(|(response, force)| format!("{response}{force}"))
        })
        .collect();
    let (mut lacks, mut map) = (Vec::new(), Vec::new());
    for pair in pairs {
        let mut missing = Vec::new();
        if pair.directions().is_none() {
            missing.push("the directions of response and force");
        }
        if pair.unit().is_none() {
            missing.push("the unit (response per force)");
        }
        if matches!(
            pair.second.1.content,
            Content::Value(Part::Phase(PhaseUnit::Unstated))
        ) && phase_unit(&pair.second.0.values).is_none()
        {
            missing.push("the unit of the phase");
        }
        if missing.is_empty() {
            continue;
        }
        let (first, second) = (pair.first.0, pair.second.0);
        let name = pair.directions().map_or_else(
            || {
                PROPOSED
                    .iter()
                    .find(|name| !taken.iter().any(|other| other == *name))
                    .map_or_else(|| "xx".to_owned(), |name| (*name).to_owned())
            },
            |(response, force)| format!("{response}{force}"),
        );
        taken.push(name.clone());
        lacks.push(format!(
            "\"{}\" and \"{}\": the file does not state {}",
            first.name,
            second.name,
            missing.join(" and ")
        ));
        let unit = if pair.unit().is_none() {
            format!(":{}", pair.first.1.proposed_unit())
        } else {
            String::new()
        };
        let phase = match (pair.second.1.content, phase_unit(&second.values)) {
            (Content::Value(Part::Phase(PhaseUnit::Degrees | PhaseUnit::Radians)), _) => "",
            (_, Some(1.0)) => ":rad",
            _ => ":deg",
        };
        let (one, two) = match pair.first.1.content {
            Content::Value(Part::Real) => (format!("h{name}_re{unit}"), format!("h{name}_im{unit}")),
            Content::Value(Part::Decibel) => (format!("h{name}_db{unit}"), format!("h{name}_phase{phase}")),
            _ => (format!("h{name}_mag{unit}"), format!("h{name}_phase{phase}")),
        };
        map.push(format!("{}={one},{}={two}", first.name, second.name));
    }
    if lacks.is_empty() {
        return Ok(());
    }
    let (file, map) = (Sidecar::path_of(path), map.join(","));
    let lines: Vec<String> = map
        .split(',')
        .filter_map(|entry| entry.split_once('='))
        .map(|(column, name)| match name.split_once(':') {
            Some((name, unit)) => format!("[channels.\"{column}\"] name = \"{name}\", unit = \"{unit}\""),
            None => format!("[channels.\"{column}\"] name = \"{name}\""),
        })
        .collect();
    Err(FrfError::Content {
        path: path.into(),
        what: format!(
            "{}; add --map \"{map}\" with the directions and units that hold, or these keys to {}: {}",
            lacks.join("; "),
            file.display(),
            lines.join("; ")
        ),
    })
}

impl Pair<'_> {
    fn directions(&self) -> Option<(Direction, Direction)> {
        self.first.1.directions
    }

    /// Unit of response per force of the column pair: that of the first column or, if it states none, of a column of
    /// the imaginary part; `None` without either.
    fn unit(&self) -> Option<FrfUnit> {
        self.first.1.unit.or(match self.second.1.content {
            Content::Value(Part::Imaginary) => self.second.1.unit,
            _ => None,
        })
    }

    /// Complex FRF values of the column pair, in the unit of the file. An error if a magnitude is negative.
    fn values(&self, path: &Path) -> Result<Vec<Complex64>, FrfError> {
        let (first, second) = (&self.first.0.values, &self.second.0.values);
        let to_radians = match self.second.1.content {
            Content::Value(Part::Phase(unit)) => match unit {
                PhaseUnit::Degrees => std::f64::consts::PI / 180.0,
                PhaseUnit::Radians => 1.0,
                PhaseUnit::Unstated => phase_unit(second).unwrap_or(1.0),
            },
            _ => 1.0,
        };
        let is_negative = |value: &f64| *value < 0.0;
        if self.first.1.content == Content::Value(Part::Magnitude)
            && let Some(line) = first.iter().position(is_negative)
        {
            return Err(FrfError::Content {
                path: path.into(),
                what: format!(
                    "magnitude \"{}\" is {} at value {}; a magnitude is 0 or more, and decibels have the unit dB: --map \"{}=hxx_db:m/N\" \
                     with the directions and the unit that hold",
                    self.first.0.name,
                    first[line],
                    line + 1,
                    self.first.0.name
                ),
            });
        }
        Ok(first
            .iter()
            .zip(second)
            .map(|(&one, &two)| match self.first.1.content {
                Content::Value(Part::Real) => Complex64::new(one, two),
                Content::Value(Part::Decibel) => {
                    Complex64::from_polar(10f64.powf(one / 20.0), two * to_radians)
                }
                _ => Complex64::from_polar(one, two * to_radians),
            })
            .collect())
    }
}

/// Factor to radians of a column of phases whose unit is not stated; `None` if the values do not decide.
///
/// Values are taken as degrees if the largest magnitude exceeds two revolutions (4π): the phase of a few modes stays
/// below. They are taken as radians if all are within about ±π and span 1.5 or more: a phase that spans few degrees
/// would not show any resonance in the band.
fn phase_unit(values: &[f64]) -> Option<f64> {
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &value| {
            (low.min(value), high.max(value))
        });
    let largest = low.abs().max(high.abs());
    if largest > 2.0 * TAU {
        Some(std::f64::consts::PI / 180.0)
    } else if largest <= std::f64::consts::PI + 0.01 && high - low >= 1.5 {
        Some(1.0)
    } else {
        None
    }
}

/// Coherence of the receptance, from the first coherence column with the given directions or label; if the table has
/// one receptance only, from the first coherence column of all. `None` if there is no such column.
fn coherence(
    columns: &[(&TextColumn, Meaning)],
    label: &str,
    directions: (Direction, Direction),
    pairs: usize,
) -> Option<Vec<f64>> {
    columns
        .iter()
        .find(|(_, meaning)| {
            meaning.content == Content::Coherence
                && (meaning.directions == Some(directions) || meaning.label == label || pairs == 1)
        })
        .map(|(column, _)| column.values.clone())
}

#[cfg(test)]
mod tests;
