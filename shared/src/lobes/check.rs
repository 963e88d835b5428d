//! Checks of the entries of a lobe table: order, range and consistency.

use super::bytes::saturate;
use super::format::{HEADER_LENGTH, Header, MAX_INTERVALS};
use super::shape::Shape;
use super::{IMMERSION_TOLERANCE, IntervalKind, LobeTable, TableError, Validity};
use crate::units::{Degrees, Rpm};

impl<'a> LobeTable<'a> {
    /// Parses `bytes`, which must be exactly one lobe table, and checks header, CRC-32 and every entry.
    ///
    /// Cost: one pass over the bytes for the CRC and one over the entries.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, TableError> {
        let header = Header::read(bytes)?;
        header.check(bytes)?;
        let shape = Shape::read(bytes)?;
        let table = Self {
            bytes,
            shape,
            feed_direction: None,
        };
        table.check_entries()?;
        Ok(table)
    }

    /// Checks the entries of the lobe table as [`parse`](Self::parse) does, without the CRC-32, which the caller has
    /// verified.
    pub fn check_entries(&self) -> Result<(), TableError> {
        check_entries(self)
    }
}

/// Checks every spindle speed, layer, column and unstable depth interval of a lobe table, and its optional parts.
fn check_entries(table: &LobeTable<'_>) -> Result<(), TableError> {
    check_speeds(table.speeds())?;
    check_layers(
        table
            .layers()
            .enumerate()
            .map(|(layer, validity)| (validity, table.feed_direction(layer))),
    )?;
    let LobeTable { bytes, shape, .. } = table;
    let mut expected = 0;
    for layer in 0..shape.layers {
        for speed in 0..shape.speeds {
            expected = check_column(table, layer, speed, expected)?;
        }
    }
    if expected != shape.intervals {
        return Err(TableError::Arrays {
            needed: shape.length(),
            found: saturate(bytes.len()),
        });
    }
    check_additions(table)
}

/// Checks a column of a lobe table: the unstable depth intervals of one layer at one speed. Its first interval must
/// have the index `expected` in the table. Returns the index after its last interval.
fn check_column(
    LobeTable { bytes, shape, .. }: &LobeTable<'_>,
    layer: usize,
    speed: usize,
    expected: usize,
) -> Result<usize, TableError> {
    let (layer_index, speed_index) = (saturate(layer), saturate(speed));
    let misplaced = TableError::ColumnOrder {
        layer: layer_index,
        speed: speed_index,
    };
    let range = shape.column_range(bytes, layer, speed).ok_or(misplaced)?;
    if range.start != expected || range.end < range.start {
        return Err(misplaced);
    }
    if range.len() > MAX_INTERVALS {
        return Err(TableError::TooManyIntervals {
            layer: layer_index,
            speed: speed_index,
            found: saturate(range.len()),
        });
    }
    let mut end_mm = shape.depth_from_mm;
    for (position, interval) in shape.column(bytes, layer, speed).ok_or(misplaced)?.enumerate() {
        let interval = interval
            .filter(|i| i.from.0 >= end_mm && i.from < i.to && i.to.0 <= shape.depth_to_mm)
            .filter(|i| shape.has_bistable || i.kind != IntervalKind::Bistable)
            .ok_or(interval_order(layer, speed, position))?;
        end_mm = interval.to.0;
    }
    Ok(range.end)
}

/// Checks that the spindle speeds of a lobe table are positive, finite and strictly ascending.
pub(super) fn check_speeds(speeds: impl Iterator<Item = Rpm>) -> Result<(), TableError> {
    let mut previous = Rpm(0.0);
    for (index, found) in speeds.enumerate() {
        if !(found > previous && found.0.is_finite()) {
            return Err(TableError::SpeedOrder {
                index: saturate(index),
                found,
            });
        }
        previous = found;
    }
    Ok(())
}

/// Checks the layers of a lobe table; [`TableError::Layer`] states what is refused. Each layer comes with its feed
/// direction, `None` for any.
pub(super) fn check_layers(
    layers: impl Iterator<Item = (Validity, Option<Degrees>)> + Clone,
) -> Result<(), TableError> {
    for (index, (layer, direction)) in layers.clone().enumerate() {
        let error = TableError::Layer {
            layer: saturate(index),
        };
        let is_range = layer.feed_from.0 >= 0.0
            && layer.feed_from <= layer.feed_to
            && layer.feed_to.0.is_finite()
            && layer.start.0.is_finite()
            && layer.start < layer.exit
            && layer.exit.0.is_finite();
        let clashes = |(other, other_direction): (Validity, Option<Degrees>)| match other.is_family_of(&layer)
        {
            // Two table layers of equal immersion and posture that are valid for different feed directions do not
            // clash. A layer for any feed direction clashes with a layer for one if their feed ranges overlap.
            true if direction.zip(other_direction).is_some_and(|(a, b)| a != b) => false,
            true => other.feed_from <= layer.feed_to && layer.feed_from <= other.feed_to,
            // Table layers of equal immersion and posture form a family. The immersion ranges of two families,
            // tolerance included, must not overlap.
            false => other.posture == layer.posture && is_near(&other, &layer),
        };
        if !is_range || layers.clone().take(index).any(clashes) {
            return Err(error);
        }
    }
    Ok(())
}

pub(super) fn interval_order(layer: usize, speed: usize, interval: usize) -> TableError {
    TableError::IntervalOrder {
        layer: saturate(layer),
        speed: saturate(speed),
        interval: saturate(interval),
    }
}

/// True if the immersion of a cut could lie within the tolerance of both table layers.
fn is_near(a: &Validity, b: &Validity) -> bool {
    let tolerance = 2.0 * IMMERSION_TOLERANCE.0;
    (a.start.0 - b.start.0).abs() <= tolerance && (a.exit.0 - b.exit.0).abs() <= tolerance
}

/// Checks the optional parts of schema 2 in a lobe table: codes of feed directions valid, all numbers finite,
/// interpolation error and modes within their ranges.
fn check_additions(table: &LobeTable<'_>) -> Result<(), TableError> {
    let LobeTable { bytes, shape, .. } = table;
    for layer in 0..shape.layers {
        shape.feed_direction(bytes, layer)?;
        for mode in 0..shape.modes {
            let is_mode = shape.layer_mode(bytes, layer, mode).is_some_and(|mode| {
                mode.frequency.0 > 0.0
                    && mode.frequency.0.is_finite()
                    && (0.0..1.0).contains(&mode.damping_ratio)
            });
            if !is_mode {
                return Err(TableError::Mode {
                    layer: saturate(layer),
                    mode: saturate(mode),
                });
            }
        }
    }
    if shape.error_given {
        let error = shape.interpolation_error(bytes).ok_or(TableError::TooShort {
            needed: HEADER_LENGTH as u32,
            found: saturate(bytes.len()),
        })?;
        let is_error = error.depth.0 >= 0.0 && error.depth.0.is_finite() && (0.0..1.0).contains(&error.speed);
        if !is_error {
            return Err(TableError::InterpolationError {
                depth: error.depth,
                speed: error.speed,
            });
        }
    }
    if shape.modes > 0 {
        for index in 0..shape.intervals {
            let is_finite = shape.interval_slopes(bytes, index).is_some_and(|slopes| {
                let ends = [slopes.from, slopes.to];
                ends.iter()
                    .all(|end| end.numbers(shape.modes).all(f32::is_finite))
            });
            if !is_finite {
                return Err(TableError::Slopes {
                    index: saturate(index),
                });
            }
        }
    }
    Ok(())
}
