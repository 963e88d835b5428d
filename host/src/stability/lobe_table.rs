//! From cases to the lobe table that goes to the device.

use std::f64::consts::TAU;

use quietcut_core::lobes::{
    Content, Interval, Kind as TableKind, Layer, TableError, Validity, encode, encoded_length,
    format::{MAX_INTERVALS, NAME_CAPACITY},
};
use quietcut_core::units::{Degrees, Hertz, Millimeters, Rpm};
use quietcut_core::working_point::Limits;

use super::chart::{Chart, Refinement, chart};
use super::collocation::Collocation;
use super::line::SpeedLine;
use super::{CubicTerms, Kind, Problem, StabilityError};
use crate::case::Case;

/// Bytes that a table should have: a quarter of a slot of the board, so that refinement, which stops only after it
/// is exceeded, stays within. A speed takes 4 bytes, and 14 in each layer with one or two unstable intervals.
const BYTES: usize = 32 * 1024;

/// Share of the largest depth by which a limit may differ from the straight line between its neighbours.
const TOLERANCE: f64 = 0.003;

/// Speeds before refinement.
const SPEEDS: usize = 121;

/// Feed per tooth, mm, up to which a layer holds whose limits do not depend on the feed.
const ANY_FEED_MM: f32 = 100.0;

/// What a table is to cover; what is not said is chosen from the first case.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableRequest {
    /// Slowest and fastest spindle speed, rev/min; default the machine's limits, else 1/2 to 5 teeth per
    /// vibration of the most flexible mode.
    pub rpm: Option<(f64, f64)>,
    /// Largest axial depth, mm; default four times the lowest limit.
    pub depth_mm: Option<f64>,
    /// Feeds per tooth, mm, one layer each; default that of each case. Without axial depth modulation limits do not
    /// depend on the feed, and one layer holds for all.
    pub feeds_per_tooth_mm: Vec<f64>,
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
    /// The table format does not take it: two layers for the same cut, for instance.
    #[error("the table cannot be written: {0:?}; each layer must have its own feed, immersion or posture")]
    Format(TableError),
}

struct Family {
    method: Collocation,
    validity: Validity,
}

/// The bytes of a lobe table, header and CRC included: one layer per case and feed.
///
/// Speeds are refined until every limit differs from the straight line between its neighbours by less than 0.3 % of
/// the largest depth, or the table is as long as it should be.
///
/// # Errors
/// No case, cases of different tools, two layers for the same cut, or a case whose stability cannot be computed.
pub fn build_table(cases: &[Case], request: &TableRequest) -> Result<Vec<u8>, BuildError> {
    let first = cases.first().ok_or(BuildError::NoCase)?;
    let families = families(cases, request)?;
    let (from_rpm, to_rpm) = request.rpm.unwrap_or_else(|| default_speeds(first, &families));
    let depth_mm = match request.depth_mm {
        Some(depth_mm) => depth_mm,
        None => default_depth(&families, from_rpm, to_rpm)?,
    };
    let coarse = spaced(from_rpm, to_rpm, SPEEDS);
    let refinement = Refinement {
        tolerance: TOLERANCE,
        least_step: 2e-4,
        most_speeds: (BYTES / (4 + 14 * families.len())).max(SPEEDS),
    };
    let speeds = speeds_of_all(&families, &coarse, depth_mm, refinement)?;
    let mut layers = Vec::with_capacity(families.len());
    for family in &families {
        layers.push(chart(&family.method, &speeds, depth_mm, 0)?);
    }
    written(first, &families, &layers, depth_mm)
}

fn families(cases: &[Case], request: &TableRequest) -> Result<Vec<Family>, BuildError> {
    let mut families = Vec::new();
    let mut teeth = None;
    for case in cases {
        let (tool, cut) = (
            case.tool().map_err(StabilityError::from)?,
            case.cut().map_err(StabilityError::from)?,
        );
        let expected = *teeth.get_or_insert(tool.teeth);
        if tool.teeth != expected {
            return Err(BuildError::Teeth {
                path: case.path.clone(),
                found: tool.teeth,
                expected,
            });
        }
        let problem = Problem::new(case, CubicTerms::Refuse)?;
        let validity = |from: f32, to: f32| Validity {
            feed_from: Millimeters(from),
            feed_to: Millimeters(to),
            start: Degrees(cut.start_deg as f32),
            exit: Degrees(cut.exit_deg as f32),
            posture: case.posture.index,
        };
        if !problem.process.axial_depth_modulation {
            families.push(Family {
                validity: validity(0.0, ANY_FEED_MM),
                method: Collocation { problem },
            });
            continue;
        }
        let own = [cut.feed_per_tooth_mm];
        let feeds = match request.feeds_per_tooth_mm.as_slice() {
            [] => &own[..],
            feeds => feeds,
        };
        for &feed_mm in feeds {
            let mut problem = problem.clone();
            problem.process.feed_per_tooth_m = feed_mm * 1e-3;
            families.push(Family {
                validity: validity(feed_mm as f32, feed_mm as f32),
                method: Collocation { problem },
            });
        }
    }
    Ok(families)
}

fn default_speeds(first: &Case, families: &[Family]) -> (f64, f64) {
    if let Some(limits) = first.limits {
        // A spindle at rest cuts nothing; a hundredth of the fastest speed stands for a slowest speed of 0.
        return (limits.rpm_min.max(0.01 * limits.rpm_max), limits.rpm_max);
    }
    let rpm = families.first().map_or(1.0, |family| {
        let problem = &family.method.problem;
        most_flexible_hz(problem) * 60.0 / problem.teeth as f64
    });
    (0.5 * rpm, 5.0 * rpm)
}

/// The frequency, Hz, of the pole at which the receptance is largest.
fn most_flexible_hz(problem: &Problem) -> f64 {
    let structure = &problem.structure;
    let size = |omega: f64| structure.receptance(omega).map_or(f64::INFINITY, |h| h.norm());
    structure
        .poles()
        .iter()
        .map(|pole| pole.norm())
        .max_by(|a, b| size(*a).total_cmp(&size(*b)))
        .map_or(1.0, |omega| omega / TAU)
}

/// Four times the lowest limit, found by doubling: deep enough for every pocket that is worth while.
fn default_depth(families: &[Family], from_rpm: f64, to_rpm: f64) -> Result<f64, BuildError> {
    const SHALLOWEST_MM: f64 = 0.01;
    const DEEPEST_MM: f64 = 500.0;
    let speeds = spaced(from_rpm, to_rpm, 24);
    let mut depth_mm = SHALLOWEST_MM;
    while depth_mm < DEEPEST_MM {
        let mut lowest_mm = f64::INFINITY;
        for family in families {
            for line in chart(&family.method, &speeds, depth_mm, 0)?.speeds {
                lowest_mm = line
                    .first_limit
                    .map_or(lowest_mm, |limit| lowest_mm.min(limit.depth_mm));
            }
        }
        if lowest_mm.is_finite() {
            return Ok(4.0 * lowest_mm);
        }
        depth_mm *= 2.0;
    }
    Ok(DEEPEST_MM)
}

/// Speeds from first to last with equal ratios: lobes get narrower towards low speeds.
fn spaced(from_rpm: f64, to_rpm: f64, count: usize) -> Vec<f64> {
    let last = count.saturating_sub(1).max(1) as f64;
    (0..count)
        .map(|index| {
            let share = index as f64 / last;
            from_rpm.powf(1.0 - share) * to_rpm.powf(share)
        })
        .collect()
}

/// The speeds that any of the families needs, ascending.
fn speeds_of_all(
    families: &[Family],
    coarse: &[f64],
    depth_mm: f64,
    refinement: Refinement,
) -> Result<Vec<f64>, BuildError> {
    let mut speeds = Vec::new();
    for family in families {
        let refined =
            chart(&family.method, coarse, depth_mm, 0)?.refined(&family.method, depth_mm, refinement)?;
        speeds.extend(refined.speeds.iter().map(|line| line.rpm));
    }
    speeds.sort_by(f64::total_cmp);
    // The table holds single precision: speeds that it cannot tell apart are one.
    speeds.dedup_by_key(|rpm| *rpm as f32);
    Ok(speeds)
}

fn written(
    first: &Case,
    families: &[Family],
    charts: &[Chart],
    depth_mm: f64,
) -> Result<Vec<u8>, BuildError> {
    let intervals: Vec<Vec<Vec<Interval>>> = charts
        .iter()
        .map(|chart| chart.speeds.iter().map(|line| unstable(line, depth_mm)).collect())
        .collect();
    let columns: Vec<Vec<&[Interval]>> = intervals
        .iter()
        .map(|layer| layer.iter().map(Vec::as_slice).collect())
        .collect();
    let layers: Vec<Layer<'_>> = families
        .iter()
        .zip(&columns)
        .map(|(family, columns)| Layer {
            validity: family.validity,
            columns,
        })
        .collect();
    let speeds: Vec<Rpm> = charts.first().map_or_else(Vec::new, |chart| {
        chart.speeds.iter().map(|line| Rpm(line.rpm as f32)).collect()
    });
    let mut end = first.name.len().min(NAME_CAPACITY);
    while !first.name.is_char_boundary(end) {
        end -= 1;
    }
    let content = Content {
        name: &first.name[..end],
        // A tool has at most 64 teeth.
        teeth: families
            .first()
            .map_or(0, |family| family.method.problem.teeth as u8),
        limits: first.limits.map(|limits| Limits {
            rpm_min: Rpm(limits.rpm_min as f32),
            rpm_max: Rpm(limits.rpm_max as f32),
        }),
        depth_from: Millimeters(0.0),
        depth_to: Millimeters(depth_mm as f32),
        speeds: &speeds,
        layers: &layers,
    };
    let mut buffer = vec![0; encoded_length(&content) as usize];
    let bytes = encode(&content, &mut buffer).map_err(BuildError::Format)?;
    Ok(bytes.to_vec())
}

/// The depths that are not stable, as the table wants them.
fn unstable(line: &SpeedLine, depth_mm: f64) -> Vec<Interval> {
    let mut intervals = Vec::new();
    let mut from_mm = 0.0;
    let ends = line.stable_mm.iter().copied().chain([[depth_mm, depth_mm]]);
    for [stable_from, stable_to] in ends {
        if stable_from > from_mm {
            let switch = line.switches.iter().find(|switch| switch.depth_mm == from_mm);
            intervals.push(Interval {
                from: Millimeters(from_mm as f32),
                to: Millimeters(stable_from as f32),
                kind: switch.map_or(TableKind::Undecided, |switch| table_kind(switch.kind)),
                chatter: Hertz(switch.and_then(|switch| switch.chatter_hz).unwrap_or(0.0) as f32),
            });
        }
        from_mm = stable_to;
    }
    // A column holds so many: the narrowest stable gap is given up, which is on the safe side.
    while intervals.len() > MAX_INTERVALS {
        let gap = |i: usize| intervals[i + 1].from.0 - intervals[i].to.0;
        let narrowest = (0..intervals.len() - 1)
            .min_by(|&a, &b| gap(a).total_cmp(&gap(b)))
            .unwrap_or(0);
        intervals[narrowest].to = intervals[narrowest + 1].to;
        intervals.remove(narrowest + 1);
    }
    intervals
}

fn table_kind(kind: Kind) -> TableKind {
    match kind {
        Kind::Hopf => TableKind::Hopf,
        Kind::Flip => TableKind::Flip,
        Kind::Fold => TableKind::Fold,
    }
}
