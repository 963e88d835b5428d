//! The description of a lobe table: its numbers of entries, their byte offsets, and the scales of stored numbers.

use core::ops::Range;

use super::additions::InterpolationError;
use super::bytes::{f32_at, saturate, u16_at, u32_at};
use super::format::{
    ERROR_GIVEN, ERROR_LENGTH, FLAGS_OFFSET, INTERVAL_LENGTH, KNOWN_FLAGS, LAYER_LENGTH, LAYERS_OFFSET,
    MODE_LENGTH, MODES_SHIFT, NAME_CAPACITY, NAME_OFFSET, SCHEMA, SCHEMA_ADDITIONS, STEPS, TURN,
};
use super::half;
use super::slopes::{IntervalSlopes, LayerMode, MODES_MAX, Slopes};
use super::{Interval, IntervalKind, TableError, Validity};
use crate::units::{Degrees, Hertz, Millimeters, Rpm};
use crate::working_point::Limits;

/// Numbers of entries of a lobe table, from which all byte offsets follow, and the scales of stored numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub(super) teeth: u8,
    pub(super) limits: Option<Limits>,
    pub(super) depth_from_mm: f32,
    pub(super) depth_to_mm: f32,
    pub(super) chatter_max_hz: f32,
    pub(super) layers: usize,
    pub(super) speeds: usize,
    pub(super) intervals: usize,
    pub(super) name_length: usize,
    /// True for schema 2 and above.
    pub(super) is_extended: bool,
    /// True for schema 3: intervals may be bistable.
    pub(super) has_bistable: bool,
    /// True if the lobe table states its interpolation error.
    pub(super) error_given: bool,
    /// Number of modes per table layer by whose parameters the table contains derivatives; 0 without derivatives.
    pub(super) modes: usize,
}

impl Shape {
    /// Reads the description of a lobe table (numbers of entries and scales) and checks it.
    pub(super) fn read(bytes: &[u8]) -> Result<Self, TableError> {
        let found = saturate(bytes.len());
        let shape = Self::read_fields(bytes).ok_or(TableError::TooShort {
            needed: LAYERS_OFFSET as u32,
            found,
        })?;
        check_flags(u16_at(bytes, FLAGS_OFFSET).unwrap_or(0), shape.is_extended)?;
        let needed = shape.length();
        if needed != u64::from(found) {
            return Err(TableError::Arrays { needed, found });
        }
        let name = bytes.get(NAME_OFFSET..NAME_OFFSET + shape.name_length);
        if shape.name_length > NAME_CAPACITY || name.is_none_or(|name| core::str::from_utf8(name).is_err()) {
            return Err(TableError::Name {
                length: saturate(shape.name_length),
            });
        }
        shape.check()?;
        Ok(shape)
    }

    fn read_fields(bytes: &[u8]) -> Option<Self> {
        let limits = Limits {
            rpm_min: Rpm(f32_at(bytes, 40)?),
            rpm_max: Rpm(f32_at(bytes, 44)?),
        };
        let flags = u16_at(bytes, FLAGS_OFFSET)?;
        let schema = u16_at(bytes, 4)?;
        let is_extended = schema >= SCHEMA_ADDITIONS;
        Some(Self {
            teeth: *bytes.get(32)?,
            limits: (flags & 1 != 0).then_some(limits),
            depth_from_mm: f32_at(bytes, 48)?,
            depth_to_mm: f32_at(bytes, 52)?,
            chatter_max_hz: f32_at(bytes, 56)?,
            layers: usize::from(u16_at(bytes, 34)?),
            speeds: usize::from(u16_at(bytes, 36)?),
            intervals: u32_at(bytes, 60)? as usize,
            name_length: usize::from(*bytes.get(33)?),
            is_extended,
            has_bistable: schema == SCHEMA,
            error_given: is_extended && flags & ERROR_GIVEN != 0,
            modes: if is_extended {
                usize::from(flags >> MODES_SHIFT)
            } else {
                0
            },
        })
    }

    /// Checks that the values in the description of a lobe table (teeth, speed limits, depths, largest chatter
    /// frequency, numbers of speeds and layers) are possible.
    pub(super) fn check(&self) -> Result<(), TableError> {
        if self.teeth == 0 {
            return Err(TableError::Teeth);
        }
        if let Some(Limits { rpm_min, rpm_max }) = self.limits
            && !(rpm_min.0 >= 0.0 && rpm_min < rpm_max && rpm_max.0.is_finite())
        {
            return Err(TableError::Limits {
                from: rpm_min,
                to: rpm_max,
            });
        }
        let (from_mm, to_mm) = (self.depth_from_mm, self.depth_to_mm);
        if !(from_mm >= 0.0 && from_mm < to_mm && to_mm.is_finite()) {
            return Err(TableError::Depths {
                from: Millimeters(from_mm),
                to: Millimeters(to_mm),
            });
        }
        if !(self.chatter_max_hz >= 0.0 && self.chatter_max_hz.is_finite()) {
            return Err(TableError::Chatter {
                found: Hertz(self.chatter_max_hz),
            });
        }
        let is_countable = |count: usize| (1..=usize::from(u16::MAX)).contains(&count);
        if !(is_countable(self.speeds) && is_countable(self.layers)) {
            return Err(TableError::Count {
                speeds: saturate(self.speeds),
                layers: saturate(self.layers),
            });
        }
        Ok(())
    }

    /// Length of the whole lobe table in bytes.
    pub(super) fn length(&self) -> u64 {
        let intervals = (INTERVAL_LENGTH as u64) * (self.intervals as u64);
        self.intervals_offset() as u64 + intervals + self.additions_length()
    }

    pub(super) fn depth_step_mm(&self) -> f32 {
        (self.depth_to_mm - self.depth_from_mm) / STEPS
    }

    pub(super) fn chatter_step_hz(&self) -> f32 {
        self.chatter_max_hz / STEPS
    }

    pub(super) fn name<'a>(&self, bytes: &'a [u8]) -> &'a str {
        bytes
            .get(NAME_OFFSET..NAME_OFFSET + self.name_length)
            .and_then(|name| core::str::from_utf8(name).ok())
            .unwrap_or_default()
    }

    // With 16-bit counts of speeds and layers the byte offsets of speeds and columns fit into 32 bits. The offset of
    // the intervals may reach 24·65535 + 4·65535 + 2·65535·65536, which exceeds 32 bits. It then saturates; such a
    // table exceeds the memory of a 32-bit device anyway.
    fn speeds_offset(&self) -> usize {
        LAYERS_OFFSET + LAYER_LENGTH * self.layers
    }

    fn columns_offset(&self) -> usize {
        self.speeds_offset() + 4 * self.speeds
    }

    pub(super) fn intervals_offset(&self) -> usize {
        self.columns_offset()
            .saturating_add((2 * self.layers).saturating_mul(self.speeds + 1))
    }

    pub(super) fn validity(&self, bytes: &[u8], layer: usize) -> Option<Validity> {
        let offset = LAYERS_OFFSET + LAYER_LENGTH * layer;
        Some(Validity {
            feed_from: Millimeters(f32_at(bytes, offset)?),
            feed_to: Millimeters(f32_at(bytes, offset + 4)?),
            start: Degrees(f32_at(bytes, offset + 8)?),
            exit: Degrees(f32_at(bytes, offset + 12)?),
            posture: *bytes.get(offset + 16)?,
        })
    }

    fn first_interval(&self, bytes: &[u8], layer: usize) -> Option<usize> {
        Some(u32_at(bytes, LAYERS_OFFSET + LAYER_LENGTH * layer + 20)? as usize)
    }

    pub(super) fn speed_rpm(&self, bytes: &[u8], index: usize) -> Option<f32> {
        f32_at(bytes, self.speeds_offset() + 4 * index)
    }

    /// Range of the indices, in the whole table, of the unstable depth intervals of one column; `None` if there is no
    /// such column.
    pub(super) fn column_range(&self, bytes: &[u8], layer: usize, speed: usize) -> Option<Range<usize>> {
        if layer >= self.layers || speed >= self.speeds {
            return None;
        }
        let offset = self.columns_offset() + 2 * (layer * (self.speeds + 1) + speed);
        let first = self.first_interval(bytes, layer)?;
        let from = first.checked_add(usize::from(u16_at(bytes, offset)?))?;
        let to = first.checked_add(usize::from(u16_at(bytes, offset + 2)?))?;
        Some(from..to)
    }

    /// The unstable depth intervals of a layer at one speed; `None` if there is no such column or it exceeds the bytes.
    /// An item is `None` if its kind is unknown.
    pub(super) fn column<'a>(
        &self,
        bytes: &'a [u8],
        layer: usize,
        speed: usize,
    ) -> Option<impl ExactSizeIterator<Item = Option<Interval>> + use<'a>> {
        let range = self.column_range(bytes, layer, speed)?;
        let offset = |index: usize| {
            self.intervals_offset()
                .checked_add(index.checked_mul(INTERVAL_LENGTH)?)
        };
        let entries = bytes.get(offset(range.start)?..offset(range.end)?)?;
        let (depth_from_mm, depth_to_mm) = (self.depth_from_mm, self.depth_to_mm);
        let (depth_step_mm, chatter_step_hz) = (self.depth_step_mm(), self.chatter_step_hz());
        // The largest 16-bit depth code gives the largest depth of the table without rounding. An interval that ends
        // there reaches the end of the table.
        let depth = move |code: u16| match code {
            u16::MAX => Millimeters(depth_to_mm),
            _ => Millimeters(depth_from_mm + f32::from(code) * depth_step_mm),
        };
        let (entries, _) = entries.as_chunks::<INTERVAL_LENGTH>();
        Some(entries.iter().map(move |&[a, b, c, d, e, f, kind, _]| {
            Some(Interval {
                from: depth(u16::from_le_bytes([a, b])),
                to: depth(u16::from_le_bytes([c, d])),
                kind: kind_of(kind)?,
                chatter: Hertz(f32::from(u16::from_le_bytes([e, f])) * chatter_step_hz),
            })
        }))
    }
}

impl Shape {
    /// Length in bytes of the optional parts that follow the unstable intervals in the table.
    pub(super) fn additions_length(&self) -> u64 {
        let error = if self.error_given { ERROR_LENGTH as u64 } else { 0 };
        let modes = (MODE_LENGTH * self.modes) as u64 * self.layers as u64;
        error + modes + self.slopes_length() as u64 * self.intervals as u64
    }

    /// Length in bytes of the derivatives of one unstable interval: for each of its two ends, 16 bits per derivative by
    /// the frequency and the damping ratio of each mode and by the cutting force.
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

    /// Derivatives of the unstable interval with this index, counted over the whole table; `None` if the table has none
    /// for it.
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

    /// The feed direction for which a table layer is valid; `None` for any. An impossible code is an error.
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

/// Refuses unknown flags of a lobe table of schema 2 or 3, and more than [`MODES_MAX`] modes. In schema 1 all flags except
/// the first are ignored.
fn check_flags(flags: u16, is_extended: bool) -> Result<(), TableError> {
    let modes = usize::from(flags >> MODES_SHIFT);
    if is_extended && (flags & 0xFF & !KNOWN_FLAGS != 0 || modes > MODES_MAX) {
        return Err(TableError::Flags { found: flags });
    }
    Ok(())
}

pub(super) fn kind_code(kind: IntervalKind) -> u8 {
    match kind {
        IntervalKind::Hopf => 0,
        IntervalKind::Flip => 1,
        IntervalKind::Fold => 2,
        IntervalKind::Undecided => 3,
        IntervalKind::Bistable => 4,
    }
}

fn kind_of(code: u8) -> Option<IntervalKind> {
    Some(match code {
        0 => IntervalKind::Hopf,
        1 => IntervalKind::Flip,
        2 => IntervalKind::Fold,
        3 => IntervalKind::Undecided,
        4 => IntervalKind::Bistable,
        _ => return None,
    })
}
