//! Which frequency response functions of a UFF file make a table, their directions and their units.

use std::collections::BTreeSet;
use std::path::Path;

use crate::FrfError;
use crate::frf_unit::{DirectionPair, FrfUnit, frf_unit, pair_of};
use quietcut_model::structure::Direction;
use quietcut_recording::uff::{Axis, DataSet, DegreeOfFreedom, Function, Header, unit};
use quietcut_recording::{Import, Quantity, Scale, Sidecar, Unit, channel_section};

/// Most functions that a message lists; a choice, about what fits on a screen.
const LISTED: usize = 12;

/// A frequency response function of the table.
pub(super) struct FrfFunction<'a> {
    /// Number of the function among the FRFs of the file, from 1.
    number: usize,
    pub(super) set: &'a DataSet,
    /// Directions of response and force.
    pub(super) directions: DirectionPair,
    /// −1 if one of the two directions, but not both, is negative; else 1.
    pub(super) sign: f64,
    pub(super) unit: FrfUnit,
}

/// The functions that make a table.
pub(super) struct Chosen<'a> {
    pub(super) functions: Vec<FrfFunction<'a>>,
    /// What was taken for what, and what was left out.
    pub(super) said: String,
}

/// What the user states about a function: name `hxx`, sign and unit.
struct Statement {
    directions: DirectionPair,
    sign: f64,
    unit: Option<FrfUnit>,
}

/// Chooses the functions of type 4 of which a table is made.
///
/// If the user names functions by their number (`--map 2=hxx`, or the section `[channels.2]` of the sidecar), these.
/// Otherwise all, if no receptance is given twice; if there is one twice, those whose response and reference are both at
/// one node, if there is one such node only: the receptances of a drive point.
///
/// # Errors
/// There is no FRF; a direction or unit is neither in the file nor stated by the user; an option names a function that
/// is not there; receptances are given twice, and no node decides.
pub(super) fn chosen<'a>(
    path: &Path,
    sets: &'a [DataSet],
    import: &Import,
    sidecar: &Sidecar,
) -> Result<Chosen<'a>, FrfError> {
    let wrong = |what: String| FrfError::Content {
        path: path.into(),
        what,
    };
    let all: Vec<&DataSet> = sets
        .iter()
        .filter(|set| set.header.function == Function::FrequencyResponse)
        .collect();
    if all.is_empty() {
        let found: Vec<i64> = sets.iter().map(|set| set.header.function.code()).collect();
        return Err(wrong(format!(
            "its functions are of type {found:?}; frequency response functions, type 4, are needed"
        )));
    }
    let stated = statements(path, all.len(), import, sidecar)?;
    let is_stated = !stated.is_empty();
    let mut functions = Vec::new();
    for (index, set) in all.iter().enumerate() {
        let statement = stated.iter().find(|(number, _)| *number == index + 1);
        if is_stated && statement.is_none() {
            continue;
        }
        let function = function(index + 1, set, statement.map(|(_, statement)| statement));
        functions.push(function.map_err(|what| FrfError::Line {
            path: path.into(),
            line: set.line,
            what,
        })?);
    }
    if !is_stated && is_ambiguous(&functions) {
        let nodes: BTreeSet<i64> = functions.iter().filter_map(FrfFunction::drive_node).collect();
        let mut nodes = nodes.into_iter();
        if let (Some(node), None) = (nodes.next(), nodes.next()) {
            functions.retain(|function| function.drive_node() == Some(node));
        }
    }
    if is_ambiguous(&functions) {
        return Err(wrong(twice(&functions)));
    }
    let said = said(&functions, all.len());
    Ok(Chosen { functions, said })
}

/// What `--map` and the sidecar state about functions, each with its number; `--map` comes first.
fn statements(
    path: &Path,
    count: usize,
    import: &Import,
    sidecar: &Sidecar,
) -> Result<Vec<(usize, Statement)>, FrfError> {
    let mut stated = Vec::new();
    for map in &import.map {
        let wrong = |what: String| FrfError::Content {
            path: path.into(),
            what: format!("--map {}: {what}", map.column),
        };
        let number = number_of(&map.column, count).ok_or_else(|| {
            wrong(format!(
                "the columns of a UFF file with FRFs are their numbers, from 1 to {count}, as in --map 1=hxx"
            ))
        })?;
        let unit = match &map.scale {
            Some(Scale::Ratio(unit)) => Some(frf_unit(unit).map_err(wrong)?),
            Some(_) => {
                return Err(wrong(
                    "a unit of an FRF, such as (m/s^2)/N or um/N, is needed".into(),
                ));
            }
            None => None,
        };
        stated.push((
            number,
            statement(&map.name, map.is_negative, unit).map_err(wrong)?,
        ));
    }
    for (section, channel) in &sidecar.channels {
        let wrong = |what: String| FrfError::Content {
            path: Sidecar::path_of(path),
            what: format!("{}: {what}", channel_section(section)),
        };
        let (Some(number), Some(name)) = (number_of(section, count), &channel.name) else {
            continue;
        };
        let unit = channel.unit.as_deref().map(frf_unit).transpose().map_err(wrong)?;
        let (is_negative, name) = match name.strip_prefix('-') {
            Some(name) => (true, name),
            None => (false, name.as_str()),
        };
        if !stated.iter().any(|(other, _)| *other == number) {
            stated.push((number, statement(name, is_negative, unit).map_err(wrong)?));
        }
    }
    Ok(stated)
}

fn number_of(column: &str, count: usize) -> Option<usize> {
    let number = column.parse().ok()?;
    (1..=count).contains(&number).then_some(number)
}

fn statement(name: &str, is_negative: bool, unit: Option<FrfUnit>) -> Result<Statement, String> {
    let directions = name.strip_prefix('h').and_then(pair_of).ok_or_else(|| {
        format!("\"{name}\"; hxx, hyx … are needed: directions of response and force after the letter h")
    })?;
    Ok(Statement {
        directions,
        sign: if is_negative { -1.0 } else { 1.0 },
        unit,
    })
}

fn function<'a>(
    number: usize,
    set: &'a DataSet,
    stated: Option<&Statement>,
) -> Result<FrfFunction<'a>, String> {
    let (directions, sign) = match stated {
        Some(stated) => (stated.directions, stated.sign),
        None => {
            let (response, a) = direction(&set.header.response, "response", number)?;
            let (force, b) = direction(&set.header.reference, "reference", number)?;
            ((response, force), a * b)
        }
    };
    let unit = match stated.and_then(|stated| stated.unit) {
        Some(unit) => unit,
        None => compliance(set, number)?,
    };
    Ok(FrfFunction {
        number,
        set,
        directions,
        sign,
        unit,
    })
}

impl FrfFunction<'_> {
    fn name(&self) -> String {
        format!("h{}{}", self.directions.0, self.directions.1)
    }

    /// Node of a function whose response and reference are both there.
    fn drive_node(&self) -> Option<i64> {
        let Header {
            response, reference, ..
        } = &self.set.header;
        (response.node == reference.node).then_some(response.node)
    }

    /// Number, name and nodes: `2 is hxx (response at node 5, force at node 1), accelerance`.
    fn described(&self) -> String {
        let Header {
            response, reference, ..
        } = &self.set.header;
        format!(
            "{} is {} (response at node {}, force at node {}), {}",
            self.number,
            self.name(),
            response.node,
            reference.node,
            self.unit.word()
        )
    }
}

/// True if a receptance is given twice.
fn is_ambiguous(functions: &[FrfFunction<'_>]) -> bool {
    let names: BTreeSet<String> = functions.iter().map(FrfFunction::name).collect();
    names.len() < functions.len()
}

/// Message for receptances that are given twice.
fn twice(functions: &[FrfFunction<'_>]) -> String {
    let shown: Vec<String> = functions
        .iter()
        .take(LISTED)
        .map(FrfFunction::described)
        .collect();
    let rest = match functions.len().saturating_sub(LISTED) {
        0 => String::new(),
        rest => format!("; and {rest} more"),
    };
    let first = functions.first();
    format!(
        "its FRFs have a receptance twice: FRF {}{rest}; say which of them are at the tool tip, with --map {}={} for each",
        shown.join("; "),
        first.map_or(1, |function| function.number),
        first.map_or_else(|| "hxx".into(), FrfFunction::name),
    )
}

/// What was read and what was left out.
fn said(functions: &[FrfFunction<'_>], count: usize) -> String {
    let mut said: Vec<String> = functions
        .iter()
        .map(|function| format!("FRF {}", function.described()))
        .collect();
    if functions.iter().any(|function| function.drive_node().is_none()) {
        said.push("response and force at different nodes are no drive point: right for the tool tip only if both nodes are there".into());
    }
    if functions.len() < count {
        said.push(format!(
            "{} of {count} FRFs are left out, which are at other nodes or not named; --map NUMBER=hxx names others",
            count - functions.len()
        ));
    }
    said.join("; ")
}

fn direction(dof: &DegreeOfFreedom, what: &str, number: usize) -> Result<(Direction, f64), String> {
    let axis = match dof.direction.abs() {
        1 => Direction::X,
        2 => Direction::Y,
        3 => Direction::Z,
        _ => {
            return Err(format!(
                "{what} direction {} of FRF {number}; 1, 2 or 3 (x, y, z), with sign, is needed: state the directions with \
                 --map {number}=hxx, or with name = \"hxx\" under [channels.{number}] in the sidecar",
                dof.direction
            ));
        }
    };
    Ok((axis, dof.direction.signum() as f64))
}

/// Unit of an FRF: receptance, mobility or accelerance. An error for a unit of none of them.
fn compliance(set: &DataSet, number: usize) -> Result<FrfUnit, String> {
    let needed = format!(
        "receptance (m/N), mobility (m/s/N) or accelerance (m/s^2/N) is needed; state the unit with --map {number}=hxx:(m/s^2)/N"
    );
    let (ordinate, denominator) = ratio(set, number)?;
    let derivatives = match ordinate.quantity {
        Quantity::Displacement => 0,
        Quantity::Velocity => 1,
        Quantity::Acceleration => 2,
        other => return Err(format!("an FRF of {other}; {needed}")),
    };
    if denominator.quantity != Quantity::Force {
        return Err(format!("an FRF per {}; {needed}", denominator.quantity));
    }
    Ok(FrfUnit {
        factor: ordinate.factor / denominator.factor,
        derivatives,
    })
}

/// Units of numerator (response) and denominator (force) of an FRF. Some programs write both into the unit label of the
/// ordinate, such as `(m/s^2)/N`.
fn ratio(set: &DataSet, number: usize) -> Result<(Unit, Unit), String> {
    let Header {
        ordinate,
        denominator,
        ..
    } = &set.header;
    let lacks = |what: &str| {
        format!(
            "the unit of the {what} of FRF {number} is not said; receptance, mobility and accelerance need it: state it with --map \
             \"{number}=hxx:(m/s^2)/N\" and the directions and unit that hold"
        )
    };
    if let Some((above, below)) = ordinate.unit.rsplit_once('/')
        && let Ok(below) = below.trim().parse::<Unit>()
        && below.quantity == Quantity::Force
    {
        let above = Axis {
            unit: above.trim().trim_start_matches('(').trim_end_matches(')').into(),
            ..ordinate.clone()
        };
        return Ok((unit(&above, set.units)?.ok_or_else(|| lacks("response"))?, below));
    }
    Ok((
        unit(ordinate, set.units)?.ok_or_else(|| lacks("response"))?,
        unit(denominator, set.units)?.ok_or_else(|| lacks("reference"))?,
    ))
}
