//! Understanding of columns: which column is which channel, from the option `--map`, the sidecar, or the words and unit
//! of its head.
//!
//! A column that the option or the sidecar names is the channel of that name. A column with the name of a channel (`t`,
//! `fx`, `x`, `vx`, `ax`, `tacho`) is that channel; an axis alone, such as `X [g]`, is the channel of its unit. Words
//! may name time and tachometer. A column whose words or unit say that it is a force or a motion must also state its
//! direction and its unit; otherwise it is a doubt, and the file is refused with the option that answers it. All other
//! columns are auxiliary channels.

use std::path::Path;

use super::import::{ColumnMap, Import, Scale};
use super::meaning::Meaning;
use super::open_doubts::{Doubts, Open, prefix};
use super::raw::{FoundUnit, Raw, RawColumn};
use super::sidecar::RecordedChannel;
use super::understood::Basis;
use super::words::NameMeaning;
use super::{Quantity, RecordingError, Sensitivity, Sidecar, Unit};

/// All that file, sidecar and the option `--map` state about one column.
#[derive(Default)]
struct Stated {
    name: Option<String>,
    is_negative: bool,
    unit: Option<Unit>,
    unit_text: Option<String>,
    sensitivity: Option<Sensitivity>,
    from: Option<Basis>,
    /// True for one of several columns whose names are letters without a meaning.
    is_letter: bool,
}

/// Meaning of every column of a file, that is the channel that it becomes, in the order of the columns of `raw`.
///
/// # Errors
/// A unit is unknown (unless the file states it for an auxiliary channel) or contradicts the name or the words of its
/// channel; a sensitivity is unknown or given for a column that is no voltage; the sidecar or the map names a column
/// that does not exist; the map states a unit of frequency response functions; a meaning is in doubt.
pub(super) fn understand(
    path: &Path,
    raw: &Raw,
    sidecar: &Sidecar,
    import: &Import,
    known: &[String],
) -> Result<Vec<Meaning>, RecordingError> {
    let columns = raw.columns.as_slice();
    let names: Vec<String> = columns.iter().map(|column| column.name.clone()).collect();
    if let Some(stranger) = sidecar.channels.keys().find(|name| !known.contains(name)) {
        return Err(RecordingError::Content {
            path: Sidecar::path_of(path),
            what: format!(
                "channels.{stranger}: the recording has no such channel, but {}",
                known.join(", ")
            ),
        });
    }
    let is_about = |map: &ColumnMap, index: usize| map.is_about(&names[index], raw.number(index), &names);
    if let Some(stranger) = import.map.iter().find(|map| {
        let is_known = (0..known.len()).any(|index| map.is_about(&known[index], index + 1, known));
        !is_known && !(0..columns.len()).any(|index| is_about(map, index))
    }) {
        return Err(RecordingError::Content {
            path: path.into(),
            what: format!(
                "--map {}: the file has no such column, but {}",
                stranger.column,
                known.join(", ")
            ),
        });
    }
    // Oscilloscopes call their channels A, B, C …: beside a B the letter A is no acceleration.
    let has = |letter: &str| names.iter().any(|name| name.eq_ignore_ascii_case(letter));
    let are_letters = has("a") && has("b");
    let mut doubts = Doubts::default();
    let mut meanings = Vec::with_capacity(columns.len());
    for (index, column) in columns.iter().enumerate() {
        let map = import.map.iter().find(|map| is_about(map, index));
        let said = sidecar.channels.get(&column.name);
        let mut stated = stated(path, column, said, map)?;
        let is_letter = matches!(names[index].to_lowercase().as_str(), "a" | "b" | "c" | "d");
        stated.is_letter = are_letters && is_letter;
        meanings.push(meaning(path, column, stated, &mut doubts)?);
    }
    prefer_exact_time(&mut meanings);
    doubts.twice(columns, &meanings);
    let found = doubts.suggested(&meanings);
    if found.is_empty() {
        Ok(meanings)
    } else {
        Err(RecordingError::Doubt {
            path: path.into(),
            sidecar: Sidecar::path_of(path),
            doubts: found,
            lacks_rate: import.rate_hz.or(sidecar.sample_rate_hz).is_none()
                && !meanings.iter().any(|meaning| meaning.name == "t"),
        })
    }
}

/// Combines the facts that file, sidecar and the option `--map` state about a column; the option takes precedence over
/// the sidecar, the sidecar over the file.
fn stated(
    path: &Path,
    column: &RawColumn,
    said: Option<&RecordedChannel>,
    map: Option<&ColumnMap>,
) -> Result<Stated, RecordingError> {
    let in_sidecar = |what: String| RecordingError::Content {
        path: Sidecar::path_of(path),
        what: format!("channels.{}.{what}", column.name),
    };
    let mut stated = Stated::default();
    match &column.unit {
        FoundUnit::None => {}
        FoundUnit::Text(text) => {
            stated.unit = text.parse().ok();
            stated.unit_text = Some(text.clone());
        }
        FoundUnit::Known(unit) => {
            stated.unit = Some(*unit);
            stated.unit_text = Some(unit_text(*unit));
        }
    }
    if let Some(said) = said {
        if let Some(text) = &said.unit {
            let unit: Unit = text
                .parse()
                .map_err(|error| in_sidecar(format!("unit: {error}")))?;
            stated.unit = Some(unit);
            stated.unit_text = Some(text.clone());
        }
        if let Some(text) = &said.sensitivity {
            let sensitivity: Sensitivity = text
                .parse()
                .map_err(|error| in_sidecar(format!("sensitivity: {error}")))?;
            let quantity = stated.unit.map_or(Quantity::Unknown, |unit| unit.quantity);
            if quantity != Quantity::Voltage {
                return Err(in_sidecar(format!(
                    "sensitivity: only a voltage has one, and the channel is {quantity} ({})",
                    quantity.unit()
                )));
            }
            stated.sensitivity = Some(sensitivity);
        }
        if let Some(name) = &said.name {
            stated.is_negative = name.starts_with('-');
            stated.name = Some(name.trim_start_matches('-').into());
            stated.from = Some(Basis::Sidecar);
        }
    }
    if let Some(map) = map {
        stated.name = Some(map.name.clone());
        stated.is_negative = map.is_negative;
        stated.from = Some(Basis::Option);
        match map.scale.clone() {
            Some(Scale::Ratio(unit)) => {
                return Err(RecordingError::Content {
                    path: path.into(),
                    what: format!(
                        "--map {}={}:{unit}: a unit of frequency response functions, and this is a recording over time",
                        map.column, map.name
                    ),
                });
            }
            Some(Scale::Unit(unit)) => {
                stated.sensitivity = None;
                stated.unit = Some(unit);
                stated.unit_text = Some(unit_text(unit));
            }
            Some(Scale::Sensitivity(sensitivity)) => {
                // A column with a sensitivity, voltage per measured unit, is in volts if no unit is stated.
                let volts = stated.unit.unwrap_or(Unit {
                    quantity: Quantity::Voltage,
                    factor: 1.0,
                });
                if volts.quantity != Quantity::Voltage {
                    return Err(RecordingError::Content {
                        path: path.into(),
                        what: format!(
                            "--map {}={}: only a voltage has a sensitivity, and the column is {} ({})",
                            map.column,
                            map.name,
                            volts.quantity,
                            volts.quantity.unit()
                        ),
                    });
                }
                stated.unit = Some(volts);
                stated.unit_text.get_or_insert_with(|| "V".into());
                stated.sensitivity = Some(sensitivity);
            }
            None => {}
        }
    }
    // The unit at the end of a title, as in `force_N`, holds whatever the column is called.
    if let (Some(name), None) = (&stated.name, &stated.unit_text) {
        let of_title = NameMeaning::of(&column.name).unit;
        stated.unit = of_title.filter(|unit| Quantity::of_name(name) == Some(unit.quantity));
        stated.unit_text = stated.unit.map(unit_text);
    }
    Ok(stated)
}

/// Text of a unit for the report of an import: the SI unit, with the factor if it is not 1.
fn unit_text(unit: Unit) -> String {
    if unit.factor == 1.0 {
        unit.quantity.unit().into()
    } else {
        format!("{} {}", unit.factor, unit.quantity.unit())
    }
}

/// Meaning of one column, that is the channel that it becomes. A column without a standard name, which its words or its
/// unit show to be a force or a motion, is added to `doubts` if its direction, sign, unit or sensitivity is uncertain.
fn meaning(
    path: &Path,
    column: &RawColumn,
    stated: Stated,
    doubts: &mut Doubts,
) -> Result<Meaning, RecordingError> {
    let (mut quantity, mut factor) = stated
        .unit
        .map_or((Quantity::Unknown, 1.0), |unit| (unit.quantity, unit.factor));
    if let Some(sensitivity) = stated.sensitivity {
        quantity = sensitivity.quantity;
        factor /= sensitivity.volts_per_unit;
    }
    if stated.is_negative {
        factor = -factor;
    }
    let of = |name: String, from: Basis| Meaning {
        name,
        quantity,
        factor,
        is_negative: stated.is_negative,
        from,
        unit: stated.unit_text.clone(),
        sensitivity: stated.sensitivity.map(|sensitivity| {
            format!(
                "{} V/({})",
                sensitivity.volts_per_unit,
                sensitivity.quantity.unit()
            )
        }),
    };
    let lower = column.name.to_lowercase();
    let is_speed =
        NameMeaning::of(&column.name).is_tacho && stated.unit_text.as_deref().is_some_and(is_spindle_speed);
    let is_measured = matches!(
        quantity,
        Quantity::Time
            | Quantity::Force
            | Quantity::Displacement
            | Quantity::Velocity
            | Quantity::Acceleration
    );
    let is_letter = stated.is_letter && !is_measured;
    let found = match stated.name {
        None if is_letter => return Ok(of(lower, Basis::Auxiliary)),
        None if is_speed => return Ok(of("rpm".into(), Basis::Auxiliary)),
        Some(name) => of(name, stated.from.unwrap_or(Basis::Sidecar)),
        None if is_channel_name(&lower) => match motion_of_axis(&lower, quantity) {
            Some(name) => of(name, Basis::Words),
            None => of(lower, Basis::Head),
        },
        None if lower == "time" => of("t".into(), Basis::Head),
        None => return by_words(path, column, of(lower, Basis::Auxiliary), doubts),
    };
    checked(path, column, found)
}

/// True for a unit of the spindle speed: such a column of a tachometer has values, not pulses.
fn is_spindle_speed(unit: &str) -> bool {
    let unit = unit.trim().to_lowercase().replace(' ', "");
    ["rpm", "1/min", "min-1", "min^-1", "u/min", "r/min", "rev/min"].contains(&unit.as_str())
}

/// True if the name is a standard channel name: `t`, `fx`, `x`, `vx`, `ax` …, `tacho`, or one of these with a number as
/// suffix (`ax_2`).
fn is_channel_name(name: &str) -> bool {
    let stem = name.split_once('_').map_or(name, |(stem, suffix)| {
        // Only a number may follow: `ax_2` and `ax_7_2` are further sensors of direction x. `a_x` and `x_value` are no
        // standard names and are read as words.
        if suffix
            .chars()
            .all(|letter| letter.is_ascii_digit() || letter == '_')
        {
            stem
        } else {
            name
        }
    });
    Quantity::of_name(stem).is_some() || stem == "tacho"
}

/// Channel name of a column of force, velocity or acceleration that is called by its axis alone, such as `X [g]`: the
/// unit states the quantity; `X [s]`, the abscissa, is time. `None` for other columns.
fn motion_of_axis(name: &str, quantity: Quantity) -> Option<String> {
    let is_axis = matches!(name, "x" | "y" | "z");
    if name == "x" && quantity == Quantity::Time {
        return Some("t".into());
    }
    let prefix = match quantity {
        Quantity::Force => "f",
        Quantity::Velocity => "v",
        Quantity::Acceleration => "a",
        _ => return None,
    };
    is_axis.then(|| format!("{prefix}{name}"))
}

/// Refuses a column with a standard channel name if the text of its unit is unknown, or if the unit, unless of voltage,
/// measures another quantity than the name requires. A name with a number, such as `ax_2`, is checked for an unknown
/// unit only.
fn checked(path: &Path, column: &RawColumn, found: Meaning) -> Result<Meaning, RecordingError> {
    let stem = found.name.split('_').next().unwrap_or_default();
    let expected = Quantity::of_name(&found.name).or_else(|| Quantity::of_name(stem));
    if let (FoundUnit::Text(text), Quantity::Unknown) = (&column.unit, found.quantity)
        && (expected.is_some() || found.name == "tacho")
    {
        return Err(unknown_unit(path, column, text));
    }
    // A voltage without sensitivity may represent any quantity, so its unit contradicts no channel name.
    if let Some(expected) = Quantity::of_name(&found.name)
        && ![expected, Quantity::Voltage, Quantity::Unknown].contains(&found.quantity)
    {
        return Err(RecordingError::Quantity {
            path: path.into(),
            column: found.name,
            found: found.quantity,
            expected,
        });
    }
    Ok(found)
}

fn unknown_unit(path: &Path, column: &RawColumn, text: &str) -> RecordingError {
    RecordingError::Unit {
        path: path.into(),
        column: format!("{} [{text}]", column.name),
        cause: super::UnknownUnit { found: text.into() },
    }
}

/// Meaning of a column from the words of its head and from its unit; `plain` is its meaning as an auxiliary channel.
fn by_words(
    path: &Path,
    column: &RawColumn,
    plain: Meaning,
    doubts: &mut Doubts,
) -> Result<Meaning, RecordingError> {
    let words = NameMeaning::of(&column.name);
    if words.is_tacho {
        return Ok(Meaning {
            name: "tacho".into(),
            from: Basis::Words,
            ..plain
        });
    }
    // The unit alone makes a column of force or acceleration a motion or force channel, whose direction must be known.
    // A column in m or m/s counts as one only if its head names a direction, because it may be a position or a feed.
    let by_unit = match plain.quantity {
        Quantity::Time | Quantity::Force | Quantity::Acceleration => Some(plain.quantity),
        Quantity::Displacement | Quantity::Velocity if words.axis.is_some() => Some(plain.quantity),
        _ => None,
    };
    let Some(quantity) = words.quantity.or(by_unit) else {
        return Ok(plain);
    };
    let mut found = Meaning {
        from: Basis::Words,
        ..plain
    };
    if found.quantity == Quantity::Unknown {
        if let FoundUnit::Text(text) = &column.unit {
            return Err(unknown_unit(path, column, text));
        }
        if let Some(unit) = words.unit {
            found.quantity = unit.quantity;
            found.factor *= unit.factor;
            found.unit = Some(unit_text(unit));
        }
    }
    if quantity == Quantity::Time {
        let is_time = matches!(found.quantity, Quantity::Time | Quantity::Unknown);
        return Ok(if is_time {
            Meaning {
                name: "t".into(),
                ..found
            }
        } else {
            Meaning {
                from: Basis::Auxiliary,
                ..found
            }
        });
    }
    let has_unit = found.quantity == quantity;
    if !has_unit && ![Quantity::Voltage, Quantity::Level, Quantity::Unknown].contains(&found.quantity) {
        return Err(RecordingError::Quantity {
            path: path.into(),
            column: column.name.clone(),
            found: found.quantity,
            expected: quantity,
        });
    }
    if has_unit
        && !words.is_negative
        && let Some(axis) = words.axis
    {
        found.name = format!("{}{axis}", prefix(quantity));
        return Ok(found);
    }
    doubts.open.push(Open {
        column: column.name.clone(),
        quantity,
        axis: words.axis,
        is_negative: words.is_negative,
        stated: found.quantity,
        is_twice: false,
    });
    Ok(found)
}

/// Makes surplus time columns auxiliary channels: of those that are known only from words, the first stays time, and
/// none if a head, the sidecar or an option names another column `t`.
fn prefer_exact_time(meanings: &mut [Meaning]) {
    let is_exact = |meaning: &Meaning| meaning.name == "t" && meaning.from != Basis::Words;
    let has_exact = meanings.iter().any(is_exact);
    let mut has_time = has_exact;
    for meaning in meanings.iter_mut() {
        if meaning.name == "t" && meaning.from == Basis::Words {
            if has_time {
                meaning.name = "time".into();
                meaning.from = Basis::Auxiliary;
            }
            has_time = true;
        }
    }
}

#[cfg(test)]
mod tests;
