//! Layers of a lobe table: cases, feeds per tooth and feed directions.

use std::collections::BTreeSet;
use std::path::Path;

use quietcut_core::lobes::{FEED_DIRECTION_SPAN, Validity};
use quietcut_core::units::{Degrees, Millimeters};
use rayon::prelude::*;

use super::error::BuildError;
use super::request::TableRequest;
use super::spindle_limit::SpindleLimit;
use crate::criteria::LAYERS_MAX;
use crate::error::StabilityError;
use crate::limits::chart::chart;
use crate::limits::method::Method;
use crate::limits::speed_line::{Limit, SpeedLine};
use crate::limits::spread::Percentile;
use crate::limits::uncertainty::Uncertainty;
use crate::orbit::collocation_of;
use crate::problem::linear::{CubicTerms, Problem};
use crate::problem::pitched::Pitched;
use crate::process::speed_dependence::depends_on_speed;
use crate::process::treatment::needs_orbit;
use quietcut_model::case::Case;

/// Largest feed per tooth, mm, that the table states for a layer whose limits do not depend on the feed; larger than
/// any feed.
const ANY_FEED_MM: f32 = 100.0;

/// Seed of the random draws for percentiles of a table; fixed, so that a table can be reproduced.
const SEED: u64 = 1;

/// One layer of a lobe table: its case, the method that computes its limits, and the cuts for which it is valid.
pub(super) struct TableLayer {
    pub(super) method: Box<dyn Method>,
    /// Linear delay problem of the layer's case with the mean pitch. It is the problem of the method itself if that
    /// needs no forced orbit and the pitch is equal.
    pub(super) linear: Problem,
    pub(super) validity: Validity,
    /// Feed direction of the layer, degrees; `None` if the table does not state it.
    pub(super) direction_deg: Option<f64>,
    pub(super) teeth: usize,
    /// Limits of the spindle beyond its lowest and highest speed.
    pub(super) spindle: Option<SpindleLimit>,
    case: Case,
    percentile: Option<f64>,
}

impl TableLayer {
    fn new(case: Case, percentile: Option<f64>, direction_deg: Option<f64>) -> Result<Self, BuildError> {
        let cut = *case.cut().map_err(StabilityError::from)?;
        let (feed_from, feed_to) = if depends_on_feed(&case) {
            (cut.feed_per_tooth_mm as f32, cut.feed_per_tooth_mm as f32)
        } else {
            (0.0, ANY_FEED_MM)
        };
        if percentile.is_some() && !case.is_uncertain() {
            return Err(BuildError::NotPossible {
                path: case.path,
                what: "--percentile needs deviations: keys that end in _std, such as ktc_mpa_std = 5.0 beside ktc_mpa, or a section [uncertainty]",
            });
        }
        // Of a structure that depends on the spindle speed, its first one: it sets the default range of speeds.
        let first = case.at_speed(case.structure_rpm.unwrap_or_default());
        let pitched = Pitched::new(&first, CubicTerms::Kept)?;
        let linear = pitched.with_mean_pitch().clone();
        Ok(Self {
            method: collocation_of(&case)?,
            validity: Validity {
                feed_from: Millimeters(feed_from),
                feed_to: Millimeters(feed_to),
                start: Degrees(cut.start_deg as f32),
                exit: Degrees(cut.exit_deg as f32),
                posture: case.posture.index,
            },
            direction_deg,
            teeth: linear.teeth,
            linear,
            spindle: SpindleLimit::of_case(&case).0,
            case,
            percentile,
        })
    }

    /// Path of the case file.
    pub(super) fn path(&self) -> &Path {
        &self.case.path
    }

    fn feed_mm(&self) -> f64 {
        self.case.cut.map_or(0.0, |cut| cut.feed_per_tooth_mm)
    }

    /// Layer of the same case at another feed per tooth and feed direction.
    fn at(&self, feed_mm: f64, direction_deg: Option<f64>) -> Result<Self, BuildError> {
        Self::new(
            at(&self.case, feed_mm, direction_deg),
            self.percentile,
            direction_deg,
        )
    }

    fn is_of_cut(&self, other: &Self) -> bool {
        let (a, b) = (self.validity, other.validity);
        (a.posture, a.start, a.exit) == (b.posture, b.start, b.exit)
    }

    /// Difference of the feeds per tooth, mm, if this layer has the larger feed, its limits depend on the feed, and
    /// both are for the same immersion, posture and feed direction; otherwise `None`.
    fn feeds_beyond(&self, other: &Self) -> Option<f64> {
        let more_mm = self.feed_mm() - other.feed_mm();
        let is_same = self.is_of_cut(other) && self.direction_deg == other.direction_deg;
        (is_same && depends_on_feed(&self.case) && more_mm > 0.0).then_some(more_mm)
    }

    /// Angle from the feed direction of the other layer to that of this one, degrees, if immersion, posture and feed
    /// are equal; otherwise `None`, as for an angle over which lookups of the device do not interpolate, or a direction
    /// that is not stated.
    fn turned_from(&self, other: &Self) -> Option<f64> {
        let turn = (self.direction_deg? - other.direction_deg?).rem_euclid(360.0);
        let is_same = self.is_of_cut(other) && self.feed_mm() == other.feed_mm();
        (is_same && turn > 0.0 && turn <= f64::from(FEED_DIRECTION_SPAN.0)).then_some(turn)
    }

    /// Stability of the layer's case at these spindle speeds; with a percentile, that percentile of the drawn machines.
    pub(super) fn lines(&self, speeds_rpm: &[f64], depth_mm: f64) -> Result<Vec<SpeedLine>, StabilityError> {
        self.lines_with_known(Vec::new(), speeds_rpm, depth_mm)
    }

    /// Stability at these spindle speeds like [`lines`](Self::lines). `known` contains the limits by the method at some
    /// of them, which are not computed again.
    pub(super) fn lines_with_known(
        &self,
        known: Vec<SpeedLine>,
        speeds_rpm: &[f64],
        depth_mm: f64,
    ) -> Result<Vec<SpeedLine>, StabilityError> {
        let is_known = |rpm: &&f64| known.iter().any(|line| line.rpm == **rpm);
        let (own, missing): (Vec<f64>, Vec<f64>) = speeds_rpm.iter().partition(is_known);
        let mut lines = chart(self.method.as_ref(), &missing, depth_mm, 0)?.speeds;
        lines.extend(known.into_iter().filter(|line| own.contains(&line.rpm)));
        let place = |line: &SpeedLine| speeds_rpm.iter().position(|rpm| *rpm == line.rpm);
        lines.sort_by_key(place);
        let lines = self.at_percentile(lines, depth_mm)?;
        match &self.spindle {
            Some(spindle) => lines.into_iter().map(|line| spindle.limited(line)).collect(),
            None => Ok(lines),
        }
    }

    /// Lines with the percentile of the layer in place of the nominal limits; unchanged without a percentile.
    fn at_percentile(&self, lines: Vec<SpeedLine>, depth_mm: f64) -> Result<Vec<SpeedLine>, StabilityError> {
        let Some(percent) = self.percentile else {
            return Ok(lines);
        };
        let method_of = |case: &Case| collocation_of(case).map_err(|error| error.to_string());
        let Some(uncertainty) = Uncertainty::new(&self.case, &method_of, SEED) else {
            return Ok(lines);
        };
        let limited: Vec<Result<SpeedLine, StabilityError>> = lines
            .into_par_iter()
            .map(|line| {
                let percentile = uncertainty.percentile(&line, depth_mm, 0.01 * percent)?;
                Ok(up_to(line, &percentile, depth_mm))
            })
            .collect();
        limited.into_iter().collect()
    }
}

/// Stability of a layer at one speed, stable only up to a percentile of the first limit over drawn machines; the kind
/// of stability loss is that of the nominal first limit.
fn up_to(line: SpeedLine, percentile: &Percentile, depth_mm: f64) -> SpeedLine {
    let error_mm = percentile.error_mm(depth_mm);
    let limit = percentile.depth_mm.and_then(|depth_mm| {
        Some(Limit {
            depth_mm,
            error_mm,
            ..line.first_limit?
        })
    });
    let stable_to = percentile.depth_mm.unwrap_or(depth_mm);
    SpeedLine {
        stable_mm: if stable_to > 0.0 {
            vec![[0.0, stable_to]]
        } else {
            Vec::new()
        },
        undecided_mm: percentile
            .depth_mm
            .zip(error_mm)
            .map(|(limit_mm, error_mm)| {
                [
                    (limit_mm - error_mm).max(0.0),
                    (limit_mm + error_mm).min(depth_mm),
                ]
            })
            .into_iter()
            .collect(),
        bistable_mm: Vec::new(),
        switches: limit
            .map(|limit| crate::Switch {
                depth_mm: limit.depth_mm,
                error_mm: limit.error_mm,
                kind: limit.kind,
                gain: false,
                chatter_hz: limit.chatter_hz,
            })
            .into_iter()
            .collect(),
        first_limit: limit,
        ..line
    }
}

fn has_variable_pitch(case: &Case) -> bool {
    case.tool
        .as_ref()
        .is_some_and(quietcut_model::milling::Tool::has_variable_pitch)
}

fn depends_on_feed(case: &Case) -> bool {
    case.axial_depth_modulation() || needs_orbit(case)
}

/// Layers of a table that are checked together against the method: a single layer, or two neighbours, half way between
/// which lookups interpolate.
pub(super) struct CheckedLayers {
    pub(super) table_layer: TableLayer,
    /// Index of the single layer of the table, or indices of the two layers.
    pub(super) layers: Vec<usize>,
}

/// All layers of a table, and the middles of all neighbours in feed or in feed direction, for the check against the
/// method.
pub(super) fn checked_layers(table_layers: &[TableLayer]) -> Result<Vec<CheckedLayers>, BuildError> {
    let mut checked_layers = Vec::new();
    for (index, table_layer) in table_layers.iter().enumerate() {
        checked_layers.push(CheckedLayers {
            table_layer: table_layer.at(table_layer.feed_mm(), table_layer.direction_deg)?,
            layers: vec![index],
        });
        if let Some(next) = nearest(table_layers, index, |other| other.feeds_beyond(table_layer)) {
            let feed_mm = 0.5 * (table_layer.feed_mm() + table_layers[next].feed_mm());
            checked_layers.push(CheckedLayers {
                table_layer: table_layer.at(feed_mm, table_layer.direction_deg)?,
                layers: vec![index, next],
            });
        }
        if let Some(next) = nearest(table_layers, index, |other| other.turned_from(table_layer)) {
            let turn = table_layers[next].turned_from(table_layer).unwrap_or(0.0);
            let degrees = table_layer.direction_deg.map(|degrees| degrees + 0.5 * turn);
            checked_layers.push(CheckedLayers {
                table_layer: table_layer.at(table_layer.feed_mm(), degrees)?,
                layers: vec![index, next],
            });
        }
    }
    Ok(checked_layers)
}

/// Index of the layer, other than `index`, for which the function `distance` gives the least value; `None` if it gives
/// none.
fn nearest(
    table_layers: &[TableLayer],
    index: usize,
    distance: impl Fn(&TableLayer) -> Option<f64>,
) -> Option<usize> {
    let others = table_layers
        .iter()
        .enumerate()
        .filter(|(other, _)| *other != index);
    others
        .filter_map(|(other, table_layer)| Some((other, distance(table_layer)?)))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(other, _)| other)
}

/// Feeds per tooth and feed directions of the layers that one case gives to a table.
#[derive(Clone)]
struct Division {
    feeds_mm: Vec<f64>,
    /// Feed directions of the layers, degrees; `None` for the direction of the case, which the table does not state.
    directions_deg: Vec<Option<f64>>,
}

fn division(case: &Case, request: &TableRequest) -> Result<Division, BuildError> {
    let cut = case.cut().map_err(StabilityError::from)?;
    let mut feeds_mm = if depends_on_feed(case) && !request.feeds_per_tooth_mm.is_empty() {
        request.feeds_per_tooth_mm.clone()
    } else {
        vec![cut.feed_per_tooth_mm]
    };
    feeds_mm.sort_by(f64::total_cmp);
    feeds_mm.dedup();
    let directions = distinct(&request.feed_directions_deg);
    let directions_deg = if directions.is_empty() {
        vec![None]
    } else {
        directions.into_iter().map(Some).collect()
    };
    Ok(Division {
        feeds_mm,
        directions_deg,
    })
}

/// Feed directions, degrees, by ascending size; of those that are one direction to a hundredth of a degree, such as 0 and
/// 360 degrees, the first.
fn distinct(directions_deg: &[f64]) -> Vec<f64> {
    let mut directions = directions_deg.to_vec();
    directions.sort_by(f64::total_cmp);
    let mut hundredths = BTreeSet::new();
    directions.retain(|degrees| hundredths.insert((degrees * 100.0).round().rem_euclid(36_000.0) as u32));
    directions
}

fn at(case: &Case, feed_mm: f64, direction_deg: Option<f64>) -> Case {
    let mut case = case.clone();
    if let Some(cut) = &mut case.cut {
        cut.feed_per_tooth_mm = feed_mm;
        cut.feed_direction_deg = direction_deg.unwrap_or(cut.feed_direction_deg);
    }
    case
}

fn divided(
    cases: &[Case],
    divisions: &[Division],
    request: &TableRequest,
) -> Result<Vec<TableLayer>, BuildError> {
    let mut table_layers = Vec::new();
    for (case, division) in cases.iter().zip(divisions) {
        for &direction_deg in &division.directions_deg {
            for &feed_mm in &division.feeds_mm {
                let case = at(case, feed_mm, direction_deg);
                table_layers.push(TableLayer::new(case, request.percentile, direction_deg)?);
            }
        }
    }
    Ok(table_layers)
}

/// Layers as requested, before refinement.
pub(super) fn table_layers(cases: &[Case], request: &TableRequest) -> Result<Vec<TableLayer>, BuildError> {
    let mut teeth = None;
    for case in cases {
        let found = case.tool().map_err(StabilityError::from)?.teeth;
        let expected = *teeth.get_or_insert(found);
        if found != expected {
            return Err(BuildError::Teeth {
                path: case.path.clone(),
                found,
                expected,
            });
        }
        let is_followed = !needs_orbit(case)
            && !depends_on_speed(case)
            && !has_variable_pitch(case)
            && request.percentile.is_none();
        if request.derivatives && !is_followed {
            return Err(BuildError::NotPossible {
                path: case.path.clone(),
                what: "--derivatives are those of the limits of a linear structure: without cubic terms, with equal pitch, the same at all speeds, without --percentile",
            });
        }
    }
    let divisions = divisions(cases, request)?;
    divided(cases, &divisions, request)
}

fn divisions(cases: &[Case], request: &TableRequest) -> Result<Vec<Division>, BuildError> {
    cases.iter().map(|case| division(case, request)).collect()
}

/// Adds feeds and feed directions between the requested ones. It stops when the first limits half way between two
/// layers differ from the mean of both by no more than `tolerance_mm` at the probe speeds, or when the number of layers
/// is exhausted. Feeds are tested in the first direction, directions at the smallest feed. Directions too far apart for
/// interpolation are divided in any case.
pub(super) fn refined(
    cases: &[Case],
    request: &TableRequest,
    probes_rpm: &[f64],
    depth_mm: f64,
    tolerance_mm: f64,
) -> Result<Vec<TableLayer>, BuildError> {
    let mut divisions = divisions(cases, request)?;
    for (case, division) in cases.iter().zip(&mut divisions) {
        let limits = |feed_mm: f64, direction_deg: Option<f64>| -> Result<Vec<f64>, BuildError> {
            let table_layer = TableLayer::new(at(case, feed_mm, direction_deg), None, direction_deg)?;
            let lines = table_layer.lines(probes_rpm, depth_mm)?;
            let limit = |line: &SpeedLine| line.first_limit.map_or(depth_mm, |limit| limit.depth_mm);
            Ok(lines.iter().map(limit).collect())
        };
        let direction_deg = division.directions_deg.first().copied().flatten();
        let axis = Axis {
            tolerance: tolerance_mm,
            most: LAYERS_MAX / division.directions_deg.len().max(1),
            widest: f64::INFINITY,
        };
        division.feeds_mm = axis.filled(&division.feeds_mm, |feed_mm| limits(feed_mm, direction_deg))?;
        let stated: Vec<f64> = division.directions_deg.iter().copied().flatten().collect();
        if stated.len() > 1 {
            let axis = Axis {
                tolerance: tolerance_mm,
                most: (LAYERS_MAX / division.feeds_mm.len().max(1)).max(stated.len()),
                widest: f64::from(FEED_DIRECTION_SPAN.0),
            };
            let feed_mm = division.feeds_mm[0];
            let directions = axis.filled(&stated, |degrees| limits(feed_mm, Some(degrees)))?;
            division.directions_deg = directions.into_iter().map(Some).collect();
        }
    }
    divided(cases, &divisions, request)
}

/// Refinement of the layers of a table along one axis: feed per tooth (mm) or feed direction (degrees).
struct Axis {
    tolerance: f64,
    most: usize,
    /// Largest distance between two layers over which lookups of the device interpolate; layers further apart always
    /// get one between them.
    widest: f64,
}

impl Axis {
    /// Feeds or directions of the layers, ascending: the given ones, and others between them until the limits half way
    /// between two neighbours agree with the mean of the limits at both, or the number of layers is exhausted.
    /// Neighbours further apart than `widest` always get one between them.
    fn filled(
        &self,
        values: &[f64],
        limits: impl Fn(f64) -> Result<Vec<f64>, BuildError>,
    ) -> Result<Vec<f64>, BuildError> {
        let mut filled: Vec<(f64, Vec<f64>)> = Vec::new();
        if let [lone] = values {
            return Ok(vec![*lone]);
        }
        for &value in values {
            filled.push((value, limits(value)?));
        }
        let mut index = 0;
        while index + 1 < filled.len() {
            let (low, high) = (&filled[index], &filled[index + 1]);
            let middle = 0.5 * (low.0 + high.0);
            let there = limits(middle)?;
            let miss = low.1.iter().zip(&high.1).zip(&there);
            let miss = miss
                .map(|((low, high), there)| (0.5 * (low + high) - there).abs())
                .fold(0.0, f64::max);
            let is_wide = high.0 - low.0 > self.widest;
            if is_wide || (miss > self.tolerance && filled.len() < self.most) {
                filled.insert(index + 1, (middle, there));
            } else {
                index += 1;
            }
        }
        Ok(filled.into_iter().map(|(value, _)| value).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_whole_turn_is_the_same_direction() {
        assert_eq!(distinct(&[360.0, 90.0, 0.0, 90.001]), [0.0, 90.0]);
        assert_eq!(distinct(&[359.999, 180.0, 0.0, -180.0]), [-180.0, 0.0]);
    }
}
