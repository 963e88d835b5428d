//! Meaning of a column of an FRF table in a text file: frequency, part of an FRF, or coherence. It follows from the
//! words of the title, the unit, the option `--map` or the sidecar.

use quietcut_model::structure::Direction;
use quietcut_recording::{ColumnMap, RecordedChannel, Scale, TextColumn};

use super::frf_unit::{FrfUnit, frf_unit, is_force_per_motion, pair_of};

/// Content of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Content {
    /// Column of frequencies; the factor converts its values to Hz.
    Frequency(f64),
    /// Column with one part of complex FRF values, such as the real part or the phase.
    Value(Part),
    /// Coherence.
    Coherence,
    /// Anything else.
    Other,
}

/// Part of a complex value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Real,
    Imaginary,
    Magnitude,
    /// Magnitude in decibels: 20·log₁₀ of the magnitude in [`Meaning::unit`].
    Decibel,
    Phase(PhaseUnit),
}

/// Unit of a phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PhaseUnit {
    Degrees,
    Radians,
    Unstated,
}

/// Meaning of a column.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Meaning {
    pub(super) content: Content,
    /// Directions of response and force; `None` for frequencies, and if neither title nor user states them.
    pub(super) directions: Option<(Direction, Direction)>,
    /// Unit of the FRF values in the column, response per force; `None` if neither file nor user states it, for a
    /// phase, and for other content than [`Content::Value`].
    pub(super) unit: Option<FrfUnit>,
    /// Text that is equal for the two columns of one receptance: for a column with a stated name the directions in this
    /// name; otherwise the words of the title in lower case, without those for part, coherence and kind of FRF and
    /// those in [`EMPTY`].
    pub(super) label: String,
    /// Order of the time derivative of displacement that a word of the column title names: 1 for mobility, 2 for
    /// accelerance, otherwise 0.
    word_derivatives: i32,
}

impl Meaning {
    /// Unit that the column title suggests, proposed to the user in messages: that of a receptance, mobility or
    /// accelerance.
    pub(super) fn proposed_unit(&self) -> &'static str {
        match self.word_derivatives {
            1 => "(m/s)/N",
            2 => "(m/s^2)/N",
            _ => "m/N",
        }
    }
}

/// Words in lower case, one of which in the title of a column without a unit marks it as one of frequencies.
const FREQUENCY: &[&str] = &["frequency", "freq", "frequenz", "frequencies", "hz"];

/// For each part of a complex FRF value, the words that mark it in a column title, in lower case.
const PARTS: &[(Part, &[&str])] = &[
    (Part::Real, &["real", "re", "realteil", "realpart"]),
    (
        Part::Imaginary,
        &["imag", "im", "imaginary", "imaginär", "imaginärteil", "imaginaer"],
    ),
    (Part::Decibel, &["db"]),
    (
        Part::Phase(PhaseUnit::Unstated),
        &["phase", "phi", "arg", "angle", "phasenwinkel"],
    ),
    (
        Part::Magnitude,
        &["mag", "magnitude", "abs", "amplitude", "amp", "betrag", "modulus"],
    ),
];

/// Words of a column title that do not distinguish one receptance from another, in lower case.
const EMPTY: &[&str] = &["frf", "h", "part", "of", "the", "in", "response", "function"];

/// Meaning of a column of a text table: from the name that the option `--map` or the sidecar states, otherwise from its
/// title. The unit is that of `--map`, otherwise of the sidecar, otherwise of the file.
///
/// # Errors
/// The unit of a real part, imaginary part or magnitude is no displacement, velocity or acceleration per force.
pub(super) fn meaning(
    column: &TextColumn,
    map: Option<&ColumnMap>,
    said: Option<&RecordedChannel>,
) -> Result<Meaning, String> {
    let stated = map
        .map(|map| map.name.clone())
        .or_else(|| said.and_then(|said| said.name.clone()));
    let unit = map
        .and_then(|map| match &map.scale {
            Some(Scale::Ratio(unit)) => Some(unit.clone()),
            Some(Scale::Unit(unit)) => Some(unit.quantity.unit().to_owned()),
            _ => None,
        })
        .or_else(|| said.and_then(|said| said.unit.clone()))
        .or_else(|| column.unit.clone());
    let in_degrees = map.is_some_and(|map| {
        matches!(&map.scale, Some(Scale::Unit(unit)) if (unit.factor - std::f64::consts::PI / 180.0).abs() < 1e-6)
    });
    match stated {
        Some(name) if name == "frequency_hz" => stated_frequency(column, unit),
        Some(name) => {
            let unit = unit.or_else(|| name_and_ratio(&column.name).1);
            by_name(&name, unit.as_deref(), in_degrees)
        }
        None => by_words(&column.name, unit.as_deref()),
    }
}

/// Meaning of a column for which option or sidecar state the name `frequency_hz`: frequencies in its unit, which is that
/// of its title if none is stated, or else Hz.
///
/// # Errors
/// The unit is none of a frequency.
fn stated_frequency(column: &TextColumn, unit: Option<String>) -> Result<Meaning, String> {
    let unit = unit
        .or_else(|| name_and_ratio(&column.name).1)
        .unwrap_or_default();
    let factor = match unit.trim() {
        "" => 1.0,
        unit => hertz(unit)
            .ok_or_else(|| format!("frequency_hz in \"{unit}\"; frequencies are in Hz, kHz or rad/s"))?,
    };
    Ok(Meaning {
        content: Content::Frequency(factor),
        directions: None,
        unit: None,
        label: "frequency_hz".into(),
        word_derivatives: 0,
    })
}

/// Factor that converts a frequency in this unit to Hz; `None` if it is no unit of a frequency.
fn hertz(unit: &str) -> Option<f64> {
    match unit.to_lowercase().as_str() {
        "hz" | "hertz" | "1/s" => Some(1.0),
        "khz" => Some(1e3),
        "rad/s" => Some(1.0 / std::f64::consts::TAU),
        _ => None,
    }
}

/// Meaning of a column from the name that option or sidecar state for it, such as `hxx_re`, `hxy_phase` or
/// `coherence_xx`.
fn by_name(name: &str, unit: Option<&str>, in_degrees: bool) -> Result<Meaning, String> {
    let of = |content, directions, unit| Meaning {
        content,
        directions,
        unit,
        label: name.to_owned(),
        word_derivatives: 0,
    };
    if let Some(pair) = name.strip_prefix("coherence_").and_then(pair_of) {
        return Ok(of(Content::Coherence, Some(pair), None));
    }
    let part = name.strip_prefix('h').and_then(|rest| rest.split_once('_'));
    let found = part.and_then(|(pair, part)| {
        let part = match part {
            "re" => Part::Real,
            "im" => Part::Imaginary,
            "mag" => Part::Magnitude,
            "db" => Part::Decibel,
            "phase" if in_degrees => Part::Phase(PhaseUnit::Degrees),
            "phase" => Part::Phase(phase(unit)),
            _ => return None,
        };
        Some((pair_of(pair)?, part))
    });
    let Some((pair, part)) = found else {
        // If the name that the user states for a column is none of an FRF table, the column is not used.
        return Ok(of(Content::Other, None, None));
    };
    let unit = match part {
        Part::Phase(_) => None,
        _ => unit.map(|unit| frf_unit(unit_of_level(unit))).transpose()?,
    };
    let label = format!("{}{}", pair.0, pair.1);
    Ok(Meaning {
        label,
        ..of(Content::Value(part), Some(pair), unit)
    })
}

/// Unit without a level prefix, as `m/N` in `dB re 1 m/N` and `dB m/N`; empty for `dB` alone.
fn unit_of_level(unit: &str) -> &str {
    let lower = unit.to_lowercase();
    let rest = lower
        .strip_prefix("db")
        .map_or(unit, |rest| &unit[unit.len() - rest.len()..]);
    let rest = rest.trim();
    let rest = rest.strip_prefix("re").map_or(rest, str::trim);
    // The 1 of `1 m/N` is a factor, that of `1/kg` the numerator.
    let rest = match rest.strip_prefix('1') {
        Some(unit) if !unit.trim_start().starts_with('/') => unit.trim(),
        _ => rest,
    };
    rest.trim_start_matches('(')
}

fn phase(unit: Option<&str>) -> PhaseUnit {
    match unit.map(|unit| unit.trim().to_lowercase()).as_deref() {
        Some("deg" | "°" | "degree" | "degrees" | "grad") => PhaseUnit::Degrees,
        Some("rad" | "radian" | "radians") => PhaseUnit::Radians,
        _ => PhaseUnit::Unstated,
    }
}

/// Meaning of a column of a text table from the words of its title and from its unit.
fn by_words(name: &str, unit: Option<&str>) -> Result<Meaning, String> {
    let (name, unit) = match unit {
        Some(unit) => (name.to_owned(), Some(unit.to_owned())),
        None => name_and_ratio(name),
    };
    let lower = name.to_lowercase();
    let words: Vec<&str> = lower
        .split(|letter: char| !letter.is_alphanumeric())
        .filter(|word| !word.is_empty())
        .collect();
    let plain_unit = unit.as_deref().map(str::trim).unwrap_or_default();
    let mut found = Meaning {
        content: Content::Other,
        directions: None,
        unit: None,
        label: String::new(),
        word_derivatives: 0,
    };
    let hertz = hertz(plain_unit);
    let is_frequency = words.iter().any(|word| FREQUENCY.contains(word)) || words == ["f"];
    if hertz.is_some() || is_frequency && plain_unit.is_empty() {
        found.content = Content::Frequency(hertz.unwrap_or(1.0));
        return Ok(found);
    }
    let is_modulus = name.trim().starts_with('|') && name.trim().ends_with('|');
    let is_level = plain_unit.to_lowercase().starts_with("db") || words.contains(&"db");
    let mut part = None;
    let mut label = Vec::new();
    for word in words {
        if word.starts_with("coh") || word.starts_with("kohärenz") {
            found.content = Content::Coherence;
        } else if let Some((named, _)) = PARTS.iter().find(|(_, known)| known.contains(&word)) {
            part.get_or_insert(*named);
        } else if let Some(derivatives) = derivatives(word) {
            found.word_derivatives = derivatives;
        } else if !EMPTY.contains(&word) {
            label.push(word);
        }
    }
    found.directions = directions(&label);
    found.label = label.join(" ");
    if found.content == Content::Coherence {
        return Ok(found);
    }
    let part = part.or(is_modulus.then_some(Part::Magnitude));
    let part = match part {
        Some(Part::Phase(_)) => Part::Phase(phase(unit.as_deref())),
        Some(Part::Magnitude) | None if is_level => Part::Decibel,
        Some(part) => part,
        None => return Ok(found),
    };
    found.content = Content::Value(part);
    if !matches!(part, Part::Phase(_)) {
        let unit = unit_of_level(plain_unit);
        if !unit.is_empty() && unit != "-" {
            found.unit = Some(frf_unit(unit)?);
        }
    }
    Ok(found)
}

/// Splits titles such as `Hxx Real (m/N)` and `Hxx (dB re 1 m/N)` into name and unit; other titles stay whole, without
/// unit. The reader of recordings leaves such units in the title, since they are no units of a channel.
fn name_and_ratio(title: &str) -> (String, Option<String>) {
    let inner = title.trim().strip_suffix(')');
    if let Some(inner) = inner {
        for (at, _) in inner.match_indices('(') {
            let unit = &inner[at + 1..];
            let is_phase = phase(Some(unit)) != PhaseUnit::Unstated;
            let lower = unit.trim().to_lowercase();
            let is_frequency = ["hz", "khz", "hertz", "rad/s"].contains(&lower.as_str());
            let is_ratio = frf_unit(unit).is_ok() || is_force_per_motion(unit);
            if is_phase || is_frequency || lower.starts_with("db") || is_ratio {
                return (title[..at].trim().into(), Some(unit.trim().into()));
            }
        }
    }
    (title.into(), None)
}

/// Order of the time derivative of displacement that a word of a column title names: 0 receptance, 1 mobility, 2
/// accelerance; `None` for other words.
fn derivatives(word: &str) -> Option<i32> {
    match word {
        "receptance" | "compliance" | "flexibility" | "nachgiebigkeit" => Some(0),
        "mobility" | "admittance" => Some(1),
        "accelerance" | "inertance" => Some(2),
        _ => None,
    }
}

/// Directions of response and force in the words of a label: `hxx`, `xy`, `x y`, `ax fx`. `None` if no word is a pair
/// and not exactly two words are axes.
fn directions(label: &[&str]) -> Option<(Direction, Direction)> {
    let whole = label
        .iter()
        .find_map(|word| pair_of(word).or_else(|| pair_of(word.strip_prefix('h')?)));
    if whole.is_some() {
        return whole;
    }
    let axis = |word: &str| -> Option<Direction> {
        let last = word.strip_prefix(['a', 'f', 'v', 'd']).unwrap_or(word);
        let direction: Direction = last.parse().ok()?;
        direction.axis().map(|_| direction)
    };
    let axes: Vec<Direction> = label.iter().filter_map(|word| axis(word)).collect();
    match axes.as_slice() {
        &[response, force] => Some((response, force)),
        _ => None,
    }
}

/// True if the column titles are those of an FRF table: one begins with `frequency_hz`, or one column has frequencies
/// and another a part of an FRF or a wrong unit.
pub(super) fn is_head(titles: &[String]) -> bool {
    let of = |title: &String| {
        let (name, unit) = match title.strip_suffix(']').and_then(|inner| inner.rsplit_once('[')) {
            Some((name, unit)) => (name.trim(), Some(unit)),
            None => (title.as_str(), None),
        };
        by_words(name, unit).map(|meaning| meaning.content)
    };
    let contents: Vec<_> = titles.iter().map(of).collect();
    let has_frequency = contents
        .iter()
        .any(|content| matches!(content, Ok(Content::Frequency(_))));
    let is_own = titles.iter().any(|title| title.starts_with("frequency_hz"));
    // A column with a wrong unit (error) still shows that the file is an FRF table and not a recording.
    let has_value = contents
        .iter()
        .any(|content| matches!(content, Ok(Content::Value(_)) | Err(_)));
    is_own || has_frequency && has_value
}
