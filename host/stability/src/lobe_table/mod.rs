//! From cases to the lobe table that goes to the device.

mod accuracy;
mod derivatives;
mod entries;
mod grid;
mod layers;

use quietcut_core::lobes::{
    Additions, Content, InterpolationError, IntervalSlopes, Layer, LayerMode, LobeTable, TableError,
    encode_with, encoded_length_with, format::NAME_CAPACITY,
};
use quietcut_core::units::{Degrees, Millimeters, Rpm};
use quietcut_core::working_point::Limits;

use crate::{Refinement, StabilityError, default_speeds, spaced};
use accuracy::Checks;
use derivatives::Derivatives;
use entries::Entry;
use layers::Family;
use quietcut_model::case::Case;

/// Bytes that a table should have: a quarter of a slot of the board, so that refinement, which stops only after it
/// is exceeded, stays within. A speed takes 4 bytes, and in each layer 2 and 8 for each of one or two unstable intervals.
const BYTES: usize = 32 * 1024;

/// Share of the largest depth by which a limit may differ from the straight line between its neighbours.
const TOLERANCE: f64 = 0.003;

/// Speeds before refinement.
const SPEEDS: usize = 121;

/// What a table is to cover; what is not said is chosen from the first case.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableRequest {
    /// Slowest and fastest spindle speed, rev/min; default the machine's limits, else 1/2 to 5 teeth per
    /// vibration of the most flexible mode.
    pub rpm: Option<(f64, f64)>,
    /// Largest axial depth, mm; default four times the lowest limit.
    pub depth_mm: Option<f64>,
    /// Feeds per tooth, mm, one layer each, and more between them where limits bend; default that of each case. Without axial
    /// depth modulation and cubic terms limits do not depend on the feed, and one layer holds for all.
    pub feeds_per_tooth_mm: Vec<f64>,
    /// Feed directions, degrees from the machine's x towards its y, one layer each, and more between them where limits bend;
    /// none: that of each case, which the table then does not state.
    pub feed_directions_deg: Vec<f64>,
    /// Speeds before refinement, at least 2; default 121.
    pub speeds: Option<usize>,
    /// True for the derivatives of every entry beside the entries.
    pub derivatives: bool,
    /// The first limit of all but this share of the machines that the deviations describe, in percent, instead of the
    /// limits of the case itself; what is stable again above the limit is left out.
    pub percentile: Option<f64>,
}

/// Why no table can be made.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// There is no case.
    #[error("a table needs at least one case")]
    NoCase,
    /// Stability cannot be computed.
    #[error(transparent)]
    Stability(#[from] StabilityError),
    /// The cases belong to different tools.
    #[error("{}: {found} teeth; a table is for one tool, and the first case has {expected}", path.display())]
    Teeth {
        /// The case file.
        path: std::path::PathBuf,
        /// Its number of teeth.
        found: usize,
        /// That of the first case.
        expected: usize,
    },
    /// What was asked for does not fit a case.
    #[error("{}: {what}", path.display())]
    NotPossible {
        /// The case file.
        path: std::path::PathBuf,
        /// What does not fit, and what would.
        what: &'static str,
    },
    /// The table format does not take it: two layers for the same cut, for instance.
    #[error(
        "the table cannot be written: {0}; each layer must have its own feed, feed direction, immersion or posture"
    )]
    Format(TableError),
}

/// The bytes of a lobe table, header and CRC included: one layer per case, feed and feed direction.
///
/// Speeds are refined until every limit differs from the straight line between its neighbours by less than 0.3 % of
/// the largest depth, or the table is as long as it should be; feeds and directions likewise. Then every gap between speeds is
/// checked against the method itself at one more speed, in every layer and half way between layers. Where the table is too deep there,
/// on flanks too steep for its speeds, the entries around are made as shallow as the gap: see [`InterpolationError`] for what it
/// states. Depths with two stable orbits, which only cubic terms make, count as unstable.
///
/// # Errors
/// No case, cases of different tools, two layers for the same cut, or a case whose stability cannot be computed.
pub fn build_table(cases: &[Case], request: &TableRequest) -> Result<Vec<u8>, BuildError> {
    let first = cases.first().ok_or(BuildError::NoCase)?;
    let asked = layers::families(cases, request)?;
    let (from_rpm, to_rpm) = match (request.rpm, asked.first()) {
        (Some(rpm), _) => rpm,
        (None, Some(family)) => default_speeds(first, &family.linear.structure, family.teeth),
        (None, None) => return Err(BuildError::NoCase),
    };
    let depth_mm = match request.depth_mm {
        Some(depth_mm) => depth_mm,
        None => grid::default_depth(&asked, from_rpm, to_rpm)?,
    };
    let probes = spaced(from_rpm, to_rpm, layers::PROBES);
    let families = layers::refined(cases, request, &probes, depth_mm, TOLERANCE * depth_mm)?;
    let modes = if request.derivatives {
        derivatives::mode_count(&families)?
    } else {
        0
    };
    let slopes_bytes = if modes == 0 { 0 } else { 4 * (2 * modes + 1) };
    let bytes_of_speed = 4 + families.len() * (2 + 3 * (8 + slopes_bytes) / 2);
    let refinement = Refinement {
        tolerance: TOLERANCE,
        least_step: 2e-4,
        most_speeds: (BYTES / bytes_of_speed).max(SPEEDS),
    };
    let coarse = spaced(from_rpm, to_rpm, request.speeds.unwrap_or(SPEEDS).max(2));
    let speeds = grid::speeds_of_all(&families, &coarse, depth_mm, refinement)?;
    let mut lines = Vec::with_capacity(families.len());
    for family in &families {
        lines.push(family.lines(&speeds, depth_mm)?);
    }
    let derivatives = if modes > 0 {
        let of_layers = families.iter().zip(&lines);
        of_layers
            .map(|(family, lines)| Derivatives::new(family, lines, modes))
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
            families: &families,
            speeds: &speeds,
            entries,
            derivatives: &derivatives,
            depth_mm,
        };
        table.bytes(error)
    };
    let tolerance_mm = TOLERANCE * depth_mm;
    let spans = layers::spans(&families)?;
    let checks = Checks::new(&spans, &speeds, depth_mm)?;
    let plain = bytes(&entries, None)?;
    let plain = LobeTable::parse(&plain).map_err(BuildError::Format)?;
    checks.guard(&plain, &mut entries, tolerance_mm);
    let guarded = bytes(&entries, None)?;
    let guarded = LobeTable::parse(&guarded).map_err(BuildError::Format)?;
    bytes(&entries, Some(checks.stated(&guarded, tolerance_mm)))
}

/// The table for cuts with a feed direction, where that is known.
fn towards<'a>(table: &LobeTable<'a>, direction_deg: Option<f64>) -> LobeTable<'a> {
    match direction_deg {
        Some(degrees) => table.towards(Degrees(degrees as f32)),
        None => *table,
    }
}

/// All that is written.
struct Table<'a> {
    first: &'a Case,
    families: &'a [Family],
    speeds: &'a [f64],
    /// By layer and speed.
    entries: &'a [Vec<Vec<Entry>>],
    /// By layer; empty for none.
    derivatives: &'a [Derivatives],
    depth_mm: f64,
}

impl Table<'_> {
    fn bytes(&self, error: Option<InterpolationError>) -> Result<Vec<u8>, BuildError> {
        let intervals: Vec<Vec<Vec<_>>> = self
            .entries
            .iter()
            .map(|layer| {
                let columns = layer.iter();
                columns
                    .map(|column| column.iter().map(|entry| entry.interval).collect())
                    .collect()
            })
            .collect();
        let columns: Vec<Vec<&[_]>> = intervals
            .iter()
            .map(|layer| layer.iter().map(Vec::as_slice).collect())
            .collect();
        let layers: Vec<Layer<'_>> = self
            .families
            .iter()
            .zip(&columns)
            .map(|(family, columns)| Layer {
                validity: family.validity,
                columns,
            })
            .collect();
        let speeds: Vec<Rpm> = self.speeds.iter().map(|&rpm| Rpm(rpm as f32)).collect();
        let mut end = self.first.name.len().min(NAME_CAPACITY);
        while !self.first.name.is_char_boundary(end) {
            end -= 1;
        }
        let content = Content {
            name: &self.first.name[..end],
            // A tool has at most 64 teeth.
            teeth: self.families.first().map_or(0, |family| family.teeth as u8),
            limits: self.first.limits.map(|limits| Limits {
                rpm_min: Rpm(limits.rpm_min as f32),
                rpm_max: Rpm(limits.rpm_max as f32),
            }),
            depth_from: Millimeters(0.0),
            depth_to: Millimeters(self.depth_mm as f32),
            speeds: &speeds,
            layers: &layers,
        };
        let directions: Vec<Option<Degrees>> = self
            .families
            .iter()
            .map(|family| family.direction_deg.map(|degrees| Degrees(degrees as f32)))
            .collect();
        let modes: Vec<&[LayerMode]> = self
            .derivatives
            .iter()
            .map(|layer| layer.modes.as_slice())
            .collect();
        let slopes: Vec<IntervalSlopes> = self
            .entries
            .iter()
            .zip(self.derivatives)
            .flat_map(|(columns, derivatives)| {
                columns
                    .iter()
                    .zip(&derivatives.by_speed)
                    .flat_map(|(column, slopes)| column.iter().map(|entry| slopes.of(entry)))
            })
            .collect();
        let additions = Additions {
            interpolation_error: error,
            feed_directions: &directions,
            modes: &modes,
            slopes: &slopes,
        };
        let mut buffer = vec![0; encoded_length_with(&content, &additions) as usize];
        let bytes = encode_with(&content, &additions, &mut buffer).map_err(BuildError::Format)?;
        Ok(bytes.to_vec())
    }
}

#[cfg(test)]
mod tests;
