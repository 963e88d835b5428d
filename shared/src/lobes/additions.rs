//! The optional parts of a lobe table that schema 2 adds; [`format`](super::format) specifies their bytes.

use super::TableError;
use super::bytes::saturate;
use super::format::TURN;
use super::slopes::{IntervalSlopes, LayerMode, MODES_MAX};
use crate::units::{Degrees, Millimeters};

/// Bound of the difference between the stability that the interpolated lobe table gives and that of the stability
/// method that computed its entries.
///
/// *Unsafe side*: a depth that is stable in the table is stable for the method, or lies within `depth` of a depth that
/// is.
///
/// *Safe side*: a depth that is unstable in the table but stable for the method lies within `depth` of a limit of the
/// method, or within the relative speed `speed` of a limit at the same depth. The second case occurs on steep flanks of
/// the limit, and where the union of two columns replaces interpolation. Between layers the difference may be larger,
/// because their limits may not be interpolated but combined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InterpolationError {
    /// Bound in depth.
    pub depth: Millimeters,
    /// Bound of the interpolation error in spindle speed, relative to the speed; on the safe side only.
    pub speed: f32,
}

/// The optional parts of a lobe table: interpolation error, feed directions of layers, modes and derivatives of limits.
/// Schema 2 adds them.
#[derive(Clone, Copy, Debug, Default)]
pub struct Additions<'a> {
    /// Bound of the interpolation error of the lobe table, if known.
    pub interpolation_error: Option<InterpolationError>,
    /// For each layer the feed direction for which it is valid, from the machine's x axis towards its y axis; `None`
    /// for any. An empty slice means any direction for all layers.
    pub feed_directions: &'a [Option<Degrees>],
    /// For each layer the modes by whose parameters the limits are differentiated; the same number for all layers, at
    /// most [`MODES_MAX`]. An empty slice means no derivatives.
    pub modes: &'a [&'a [LayerMode]],
    /// Derivatives of the limits of every unstable depth interval, in the order of layers, speeds and intervals of the
    /// table; empty without modes.
    pub slopes: &'a [IntervalSlopes],
}

impl Additions<'_> {
    /// Number of modes by whose parameters the limits of each table layer are differentiated.
    pub(super) fn mode_count(&self) -> usize {
        self.modes.first().map_or(0, |modes| modes.len())
    }

    /// True if the table has no optional part of schema 2, so that schema 1 suffices.
    pub(super) fn is_empty(&self) -> bool {
        self.interpolation_error.is_none()
            && self.modes.is_empty()
            && self.feed_directions.iter().all(Option::is_none)
    }

    /// Checks the lengths of the optional parts of a lobe table against its numbers of layers and of unstable depth
    /// intervals, and the values of feed directions and derivatives.
    pub(super) fn check(&self, layers: usize, intervals: usize) -> Result<(), TableError> {
        let count = self.mode_count();
        let wrong = TableError::Slopes {
            index: saturate(self.slopes.len()),
        };
        if count > MODES_MAX || self.modes.iter().any(|modes| modes.len() != count) {
            return Err(wrong);
        }
        let expected = if count > 0 { (layers, intervals) } else { (0, 0) };
        if (self.modes.len(), self.slopes.len()) != expected {
            return Err(wrong);
        }
        if !self.feed_directions.is_empty() && self.feed_directions.len() != layers {
            return Err(TableError::FeedDirection {
                layer: saturate(self.feed_directions.len()),
            });
        }
        for (layer, direction) in self.feed_directions.iter().enumerate() {
            if direction.is_some_and(|direction| direction_code(direction).is_none()) {
                return Err(TableError::FeedDirection {
                    layer: saturate(layer),
                });
            }
        }
        for (index, slopes) in self.slopes.iter().enumerate() {
            let numbers = slopes.from.numbers(count).chain(slopes.to.numbers(count));
            if numbers.into_iter().any(|number| !number.is_finite()) {
                return Err(TableError::Slopes {
                    index: saturate(index),
                });
            }
        }
        Ok(())
    }
}

/// The code of a feed direction in 1/100 degree, from 0 to below 360°; `None` for an angle that is not finite or beyond
/// ±1000 revolutions.
pub(super) fn direction_code(direction: Degrees) -> Option<u16> {
    let turns = direction.0 / 360.0;
    if !(-1.0e3..=1.0e3).contains(&turns) {
        return None;
    }
    // The cast truncates towards zero. For a negative angle `whole` is one less, so that the remaining fraction of a
    // revolution lies between 0 and 1.
    let whole = turns as i32 - i32::from(turns < 0.0);
    let hundredths = (turns - whole as f32) * f32::from(TURN) + 0.5;
    Some(hundredths as u16 % TURN)
}
