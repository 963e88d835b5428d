//! What schema 2 adds behind the intervals, and in bytes of the layers that were zero: see [`format`](super::format).

use super::format::{
    HEADER_LENGTH, INTERVAL_LENGTH, LAYER_LENGTH, LAYERS_OFFSET, Shape, f32_at, saturate, u16_at,
};
use super::slopes::{IntervalSlopes, LayerMode, MODES_MAX, Slopes};
use super::{LobeTable, TableError, half};
use crate::units::{Degrees, Hertz, Millimeters};

/// Bit of the flags: the interpolation error is given.
pub(super) const ERROR_GIVEN: u16 = 2;
/// Where the number of modes stands in the flags.
pub(super) const MODES_SHIFT: u16 = 8;
/// All bits of the flags that schema 2 knows, but for the number of modes.
const KNOWN_FLAGS: u16 = 1 | ERROR_GIVEN;
/// Codes of a full turn of the feed direction.
pub(super) const TURN: u16 = 36_000;

const ERROR_LENGTH: usize = 8;
const MODE_LENGTH: usize = 8;

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

impl Shape {
    /// Bytes behind the intervals.
    pub(super) fn additions_length(&self) -> u64 {
        let error = if self.error_given { ERROR_LENGTH as u64 } else { 0 };
        let modes = (MODE_LENGTH * self.modes) as u64 * self.layers as u64;
        error + modes + self.slopes_length() as u64 * self.intervals as u64
    }

    /// Bytes of the derivatives of one interval: two ends, 16 bits each by frequency and damping of every mode and by force.
    fn slopes_length(&self) -> usize {
        if self.modes == 0 {
            0
        } else {
            4 * (2 * self.modes + 1)
        }
    }

    fn error_offset(&self) -> usize {
        self.intervals_offset()
            .saturating_add(self.intervals.saturating_mul(INTERVAL_LENGTH))
    }

    fn modes_offset(&self) -> usize {
        self.error_offset()
            .saturating_add(if self.error_given { ERROR_LENGTH } else { 0 })
    }

    pub(super) fn interpolation_error(&self, bytes: &[u8]) -> Option<InterpolationError> {
        if !self.error_given {
            return None;
        }
        let offset = self.error_offset();
        Some(InterpolationError {
            depth: Millimeters(f32_at(bytes, offset)?),
            speed: f32_at(bytes, offset.checked_add(4)?)?,
        })
    }

    pub(super) fn layer_mode(&self, bytes: &[u8], layer: usize, mode: usize) -> Option<LayerMode> {
        if layer >= self.layers || mode >= self.modes {
            return None;
        }
        let offset = self
            .modes_offset()
            .checked_add(MODE_LENGTH.checked_mul(layer.checked_mul(self.modes)?.checked_add(mode)?)?)?;
        Some(LayerMode {
            frequency: Hertz(f32_at(bytes, offset)?),
            damping_ratio: f32_at(bytes, offset.checked_add(4)?)?,
        })
    }

    /// Derivatives of the interval with this index in the whole table.
    pub(super) fn interval_slopes(&self, bytes: &[u8], index: usize) -> Option<IntervalSlopes> {
        if self.modes == 0 || index >= self.intervals {
            return None;
        }
        let modes_length = MODE_LENGTH.checked_mul(self.modes)?.checked_mul(self.layers)?;
        let first = self.modes_offset().checked_add(modes_length)?;
        let offset = first.checked_add(index.checked_mul(self.slopes_length())?)?;
        let end = offset.checked_add(self.slopes_length())?;
        let (codes, _) = bytes.get(offset..end)?.as_chunks::<2>();
        let mut numbers = codes.iter().map(|code| half::decode(u16::from_le_bytes(*code)));
        Some(IntervalSlopes {
            from: Slopes::of_numbers(&mut numbers, self.modes)?,
            to: Slopes::of_numbers(&mut numbers, self.modes)?,
        })
    }

    /// The feed direction a layer holds for; `None` for any. The error is a code that no direction has.
    pub(super) fn feed_direction(&self, bytes: &[u8], layer: usize) -> Result<Option<Degrees>, TableError> {
        let wrong = TableError::FeedDirection {
            layer: saturate(layer),
        };
        if !self.is_extended {
            return Ok(None);
        }
        let offset = LAYERS_OFFSET + LAYER_LENGTH * layer + 17;
        let code = u16_at(bytes, offset + 1).ok_or(wrong)?;
        match bytes.get(offset) {
            Some(0) if code == 0 => Ok(None),
            Some(1) if code < TURN => Ok(Some(Degrees(f32::from(code) * 0.01))),
            _ => Err(wrong),
        }
    }
}

/// The flags of a table: refuses those that this code does not know. Schema 1 has but one, the others were not looked at.
pub(super) fn check_flags(flags: u16, is_extended: bool) -> Result<(), TableError> {
    let modes = usize::from(flags >> MODES_SHIFT);
    if is_extended && (flags & 0xFF & !KNOWN_FLAGS != 0 || modes > MODES_MAX) {
        return Err(TableError::Flags { found: flags });
    }
    Ok(())
}

/// Checks all that schema 2 adds: every number finite, errors and modes in their range.
pub(super) fn check_additions(table: &LobeTable<'_>) -> Result<(), TableError> {
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

impl LobeTable<'_> {
    /// How far lookups between the entries may be off; `None` where the table does not say.
    pub fn interpolation_error(&self) -> Option<InterpolationError> {
        self.shape.interpolation_error(self.bytes)
    }

    /// The feed direction that a layer holds for, from the machine's x towards its y; `None` for any.
    pub fn feed_direction(&self, layer: usize) -> Option<Degrees> {
        self.shape.feed_direction(self.bytes, layer).ok().flatten()
    }
}
