//! What schema 2 adds behind the intervals, and in bytes of the layers that were zero: see [`format`](super::format).

use super::TableError;
use super::bytes::saturate;
use super::format::TURN;
use super::slopes::{IntervalSlopes, LayerMode, MODES_MAX};
use crate::units::{Degrees, Millimeters};

/// How far what the table says between its entries may be from what the method says there.
///
/// On the unsafe side `depth` bounds it alone: a depth that the table calls stable is stable for the method, or lies within `depth`
/// of one that is. On the safe side, what a layer calls unstable may be stable within `depth` of a limit of the method, or within
/// the share `speed` of the speed of one at the same depth: on steep flanks, and where islands begin and kinds change, entries are
/// not interpolated but what is unstable in either holds. Between layers that may give up more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InterpolationError {
    /// In depth.
    pub depth: Millimeters,
    /// In speed, relative to it, on the safe side.
    pub speed: f32,
}

/// What a table may hold beyond schema 1.
#[derive(Clone, Copy, Debug, Default)]
pub struct Additions<'a> {
    /// The error of lookups between entries, where known.
    pub interpolation_error: Option<InterpolationError>,
    /// For each layer the feed direction it holds for, from the machine's x towards its y; `None` for any. Empty: any for all.
    pub feed_directions: &'a [Option<Degrees>],
    /// For each layer the modes whose derivatives are given: as many for all, at most [`MODES_MAX`]. Empty: no derivatives.
    pub modes: &'a [&'a [LayerMode]],
    /// The derivatives of every interval, in the order of layers, speeds and intervals.
    pub slopes: &'a [IntervalSlopes],
}

impl Additions<'_> {
    /// Number of modes of each layer.
    pub(super) fn mode_count(&self) -> usize {
        self.modes.first().map_or(0, |modes| modes.len())
    }

    /// True where schema 1 can say all of it.
    pub(super) fn is_empty(&self) -> bool {
        self.interpolation_error.is_none()
            && self.modes.is_empty()
            && self.feed_directions.iter().all(Option::is_none)
    }

    /// Refuses what does not fit the layers and intervals of a table, and numbers that cannot be.
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

/// Hundredths of a degree from 0 to below a full turn; `None` for what is no angle.
pub(super) fn direction_code(direction: Degrees) -> Option<u16> {
    let turns = direction.0 / 360.0;
    if !(-1.0e3..=1.0e3).contains(&turns) {
        return None;
    }
    // The cast truncates towards zero; one more turn for negative angles.
    let whole = turns as i32 - i32::from(turns < 0.0);
    let hundredths = (turns - whole as f32) * f32::from(TURN) + 0.5;
    Some(hundredths as u16 % TURN)
}
