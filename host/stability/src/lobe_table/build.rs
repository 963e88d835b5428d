//! Building a lobe table: from cases to bytes.

use quietcut_core::lobes::{InterpolationError, LobeTable};

use super::accuracy::Checks;
use super::derivatives::{self, Derivatives};
use super::encoding::Table;
use super::entries::{self, Entry};
use super::error::BuildError;
use super::request::TableRequest;
use super::spindle_limit::SpindleLimit;
use super::{grid, layers};
use crate::criteria::{LAYER_PROBES, TABLE_TOLERANCE};
use crate::limits::chart::Refinement;
use crate::limits::speeds::{default_speeds, spaced};
use quietcut_model::case::Case;

/// Target size of a table, bytes: a quarter of a slot of the board, so that refinement, which stops only after
/// exceeding it, stays within the slot. A speed takes 4 bytes, plus 2 in each layer, plus 8, and the derivatives, for
/// each unstable interval, of which 1.5 per layer are assumed.
const BYTES: usize = 32 * 1024;

/// Default number of speeds of a lobe table before refinement. A choice.
const SPEEDS: usize = 121;

/// Largest number of corrections of entries to the safe side. The speeds checked in a correction need not be those with
/// the largest disagreement in a gap; corrections after the third change little.
const GUARDED: usize = 3;

/// Lobe table as it is written to a file, with what its user should know.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BuiltTable {
    /// Bytes of the lobe table, header and CRC included.
    pub bytes: Vec<u8>,
    /// Warnings: about limits without derivatives, one for each layer with such limits, about cases whose power or torque
    /// of the spindle cannot be considered, and about cases whose spindle may run at no speed of the table.
    pub warnings: Vec<String>,
}

/// Builds a lobe table with one layer per case, feed and feed direction.
///
/// Speeds are added until every limit half way between two speeds differs from the straight line between them by at
/// most 0.3 % of the largest depth, until they lie too close for more, or until the table has its target size of 32
/// KiB. Feeds and directions are added between the requested ones likewise, up to a number of layers. Then every gap
/// between speeds is checked against the method at two more speeds or more, and at further ones if these disagree with
/// the table, in every layer and half way between layers. If the table is too deep there, on flanks too steep for its
/// speeds, the surrounding entries become as shallow as the gap; see [`InterpolationError`] for the stated error.
/// Depths with two stable orbits, which only nonlinear cases have, count as unstable; depths beyond the power or torque
/// of the spindle, and speeds outside its ranges, as undecided.
///
/// # Errors
/// No case, different numbers of teeth, a request that does not fit a case, two layers for the same cut, or a case
/// whose stability cannot be computed.
pub fn build_table(cases: &[Case], request: &TableRequest) -> Result<BuiltTable, BuildError> {
    let first = cases.first().ok_or(BuildError::NoCase)?;
    let asked = layers::table_layers(cases, request)?;
    let (from_rpm, to_rpm) = match (request.rpm, asked.first()) {
        (Some(rpm), _) => rpm,
        (None, Some(table_layer)) => default_speeds(first, &table_layer.linear.structure, table_layer.teeth),
        (None, None) => return Err(BuildError::NoCase),
    };
    let depth_mm = match request.depth_mm {
        Some(depth_mm) => depth_mm,
        None => grid::default_depth(&asked, from_rpm, to_rpm)?,
    };
    let probes = spaced(from_rpm, to_rpm, LAYER_PROBES);
    let table_layers = layers::refined(cases, request, &probes, depth_mm, TABLE_TOLERANCE * depth_mm)?;
    let modes = if request.derivatives {
        derivatives::mode_count(&table_layers)?
    } else {
        0
    };
    let slopes_bytes = if modes == 0 { 0 } else { 4 * (2 * modes + 1) };
    let bytes_of_speed = 4 + table_layers.len() * (2 + 3 * (8 + slopes_bytes) / 2);
    let refinement = Refinement {
        tolerance: TABLE_TOLERANCE,
        least_step: 2e-4,
        most_speeds: (BYTES / bytes_of_speed).max(SPEEDS),
    };
    let coarse = spaced(from_rpm, to_rpm, request.speeds.unwrap_or(SPEEDS).max(2));
    let (speeds, lines) = grid::lines_of_all(&table_layers, &coarse, depth_mm, refinement)?;
    let derivatives = if modes > 0 {
        let of_layers = table_layers.iter().zip(&lines);
        of_layers
            .map(|(table_layer, lines)| Derivatives::new(table_layer, lines, modes))
            .collect::<Result<_, _>>()?
    } else {
        Vec::new()
    };
    let mut entries: Vec<Vec<Vec<Entry>>> = lines
        .iter()
        .map(|lines| {
            lines
                .iter()
                .map(|line| entries::unstable(line, depth_mm))
                .collect()
        })
        .collect();
    let bytes = |entries: &[Vec<Vec<Entry>>], error: Option<InterpolationError>| {
        let table = Table {
            first,
            table_layers: &table_layers,
            speeds: &speeds,
            entries,
            derivatives: &derivatives,
            depth_mm,
        };
        table.bytes(error)
    };
    let tolerance_mm = TABLE_TOLERANCE * depth_mm;
    let checked_layers = layers::checked_layers(&table_layers)?;
    let mut checks = Checks::new(&checked_layers, &speeds, depth_mm)?;
    let mut written = bytes(&entries, None)?;
    let plain = LobeTable::parse(&written).map_err(BuildError::Format)?;
    checks.resolve(&plain, tolerance_mm)?;
    for _ in 0..GUARDED {
        let table = LobeTable::parse(&written).map_err(BuildError::Format)?;
        let guarded = checks.guard(&table, &mut entries, tolerance_mm);
        if !guarded.iter().flatten().any(|&gap| gap) {
            break;
        }
        written = bytes(&entries, None)?;
        checks.check_again(&guarded)?;
    }
    let table = LobeTable::parse(&written).map_err(BuildError::Format)?;
    Ok(BuiltTable {
        bytes: bytes(&entries, Some(checks.stated(&table, tolerance_mm)))?,
        warnings: derivatives
            .iter()
            .filter_map(|layer| layer.warning.clone())
            .chain(cases.iter().filter_map(|case| SpindleLimit::of_case(case).1))
            .chain(cases.iter().filter_map(|case| no_speed_allowed(case, &speeds)))
            .collect(),
    })
}

/// A warning if the spindle of a case may run at none of the speeds of a table, rev/min.
fn no_speed_allowed(case: &Case, speeds: &[f64]) -> Option<String> {
    let limits = case.limits.as_ref()?;
    if speeds.iter().any(|&rpm| limits.allows(rpm)) {
        return None;
    }
    let [first, last] = [speeds.first()?, speeds.last()?];
    let allowed: Vec<String> = limits
        .allowed_rpm()
        .iter()
        .map(|[from, to]| format!("{from} to {to}"))
        .collect();
    Some(format!(
        "{}: no speed of the table, {first:.1} to {last:.1} rev/min, is allowed by [limits] ({} rev/min): no advice will follow from it; give \
         other speeds with --rpm",
        case.path.display(),
        allowed.join(", ")
    ))
}
