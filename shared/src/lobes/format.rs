//! The bytes of a table, schemas 1 and 2. All numbers little-endian, no alignment needed.
//!
//! | offset | bytes | header |
//! |---|---|---|
//! | 0 | 4 | magic `QCLT` |
//! | 4 | 2 | schema: [`SCHEMA_PLAIN`] or [`SCHEMA`] |
//! | 6 | 2 | zero |
//! | 8 | 4 | length of the whole table in bytes, header included |
//! | 12 | 4 | generation: 0 in a file; the device counts it up to know the newer of its two slots |
//! | 16 | 12 | zero |
//! | 28 | 4 | CRC-32 of bytes 0..28 and 32..length |
//!
//! | offset | bytes | description |
//! |---|---|---|
//! | 32 | 1 | teeth |
//! | 33 | 1 | length of the name in bytes |
//! | 34 | 2 | L, number of layers |
//! | 36 | 2 | S, number of speeds |
//! | 38 | 2 | flags: bit 0, the machine's limits are given; schema 2: bit 1, the interpolation error is given; bits 8–15 M, number of modes |
//! | 40 | 4+4 | slowest and fastest speed of the machine, f32, rev/min |
//! | 48 | 4+4 | smallest and largest depth of the table, f32, mm |
//! | 56 | 4 | largest chatter frequency, f32, Hz: the scale of all of them |
//! | 60 | 4 | I, number of intervals |
//! | 64 | 32 | name of the case, UTF-8, padded with zeros |
//! | 96 | 24·L | layers: feed from, feed to (f32, mm), start, exit (f32, degrees), posture (1 byte), 3 zeros, index of its first interval (u32); schema 2 instead of the zeros: 1 where a feed direction is given, and it (u16, 1/100 degree) |
//! | … | 4·S | speeds, f32, rev/min, strictly ascending, steps of any size |
//! | … | 2·L·(S+1) | per layer: where the intervals of each speed begin, relative to the layer's first, u16; one more for the end |
//! | … | 8·I | intervals: from, to, chatter (u16 each), kind (1 byte: 0 Hopf, 1 flip, 2 fold, 3 undecided), 1 zero |
//! | … | 4+4 | schema 2, where flagged: interpolation error in depth (f32, mm) and in speed (f32, relative) |
//! | … | 8·L·M | schema 2: per layer its modes: natural frequency (f32, Hz), damping ratio (f32) |
//! | … | 4·(2M+1)·I | schema 2, where M > 0: per interval for `from`, then for `to`: derivatives by frequency and by damping ratio of each mode, by cutting force (IEEE binary16, mm per relative change) |
//!
//! A depth is smallest + q·(largest − smallest)/65535, a chatter frequency q·largest/65535 with 0 for "not known".
//! `from` is rounded down and `to` up, so that an entry errs by less than one step and to the unstable side only
//! (steps are snapped at 1/50: a table that is read and encoded again keeps its bytes). The chatter frequency is rounded to
//! the nearest, but never to 0. With 10 mm and 5 000 Hz a step is 0.15 µm and 0.08 Hz. 600 speeds, 6 layers and
//! 2 intervals per column are 67 KB; 3 are 96 KB.
//!
//! # Schemas
//!
//! The header never changes. Schema 1 is a table without additions; its bytes stay readable, and what needs no addition is
//! written in it, so that devices with older firmware take it. Schema 2 has the additions marked above. A reader refuses every
//! other schema with [`TableError::Schema`], before it looks at anything behind the header, and within schema 2 every flag that it
//! does not know. Whoever adds something raises [`SCHEMA`], puts it behind what is there, and freezes its bytes in the tests.

use core::ops::Range;

use serde::{Deserialize, Serialize};

use super::additions::{ERROR_GIVEN, MODES_SHIFT, check_flags};
use super::{Interval, Kind, TableError, Validity};
use crate::checksum::{Crc32, crc32};
use crate::units::{Degrees, Hertz, Millimeters, Rpm};
use crate::working_point::Limits;

/// The first four bytes of a table.
pub const MAGIC: [u8; 4] = *b"QCLT";
/// The latest schema that this code reads and writes.
pub const SCHEMA: u16 = 2;
/// The schema of tables without additions.
pub const SCHEMA_PLAIN: u16 = 1;
/// Length of the header in bytes.
pub const HEADER_LENGTH: usize = 32;
/// The most bytes in the name of a case.
pub const NAME_CAPACITY: usize = 32;
/// The most intervals of one column.
pub const MAX_INTERVALS: usize = 12;

const CRC_OFFSET: usize = 28;
const NAME_OFFSET: usize = 64;
const FLAGS_OFFSET: usize = 38;
pub(super) const LAYERS_OFFSET: usize = 96;
pub(super) const LAYER_LENGTH: usize = 24;
pub(super) const INTERVAL_LENGTH: usize = 8;
pub(super) const STEPS: f32 = 65_535.0;

/// The first [`HEADER_LENGTH`] bytes of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Header {
    /// Schema; after [`read`](Self::read) one that this code [`knows`](Self::knows).
    pub schema: u16,
    /// Length of the table in bytes, header included.
    pub length: u32,
    /// Counted up by the device; 0 in a file.
    pub generation: u32,
    /// CRC-32 of everything but itself.
    pub crc: u32,
}

impl Header {
    /// True for the schemas that this code reads.
    pub const fn knows(schema: u16) -> bool {
        schema == SCHEMA_PLAIN || schema == SCHEMA
    }

    /// The header at the beginning of `bytes`; refuses a wrong magic, an unknown schema and a length that cannot be.
    ///
    /// More may follow in `bytes` than the length says; whether the CRC is right is for [`check`](Self::check) to say.
    pub fn read(bytes: &[u8]) -> Result<Self, TableError> {
        let too_short = TableError::TooShort {
            needed: LAYERS_OFFSET as u32,
            found: saturate(bytes.len()),
        };
        let magic = array_at(bytes, 0).ok_or(too_short)?;
        if magic != MAGIC {
            return Err(TableError::Magic { found: magic });
        }
        let schema = u16_at(bytes, 4).ok_or(too_short)?;
        if !Self::knows(schema) {
            return Err(TableError::Schema {
                found: schema,
                known: SCHEMA,
            });
        }
        let length = u32_at(bytes, 8).ok_or(too_short)?;
        if (length as usize) < LAYERS_OFFSET {
            return Err(TableError::TooShort {
                needed: LAYERS_OFFSET as u32,
                found: length,
            });
        }
        Ok(Self {
            schema,
            length,
            generation: u32_at(bytes, 12).ok_or(too_short)?,
            crc: u32_at(bytes, CRC_OFFSET).ok_or(too_short)?,
        })
    }

    /// Refuses bytes that are not exactly the table of this header.
    pub fn check(&self, bytes: &[u8]) -> Result<(), TableError> {
        if bytes.len() as u64 != u64::from(self.length) {
            return Err(TableError::Length {
                header: self.length,
                found: saturate(bytes.len()),
            });
        }
        let payload = bytes.get(HEADER_LENGTH..).unwrap_or_default();
        self.check_payload(payload)?;
        // The CRC was taken with zeros where the header has them: they must be there.
        if bytes.get(..HEADER_LENGTH) == Some(&self.to_bytes()) {
            return Ok(());
        }
        let header = bytes.get(..CRC_OFFSET).unwrap_or_default();
        Err(TableError::Crc {
            header: self.crc,
            computed: crc32([header, payload]),
        })
    }

    /// Refuses a payload, the bytes behind the header, that does not have the CRC of this header.
    pub fn check_payload(&self, payload: &[u8]) -> Result<(), TableError> {
        let computed = self.crc_with(payload);
        if computed == self.crc {
            Ok(())
        } else {
            Err(TableError::Crc {
                header: self.crc,
                computed,
            })
        }
    }

    /// This header with another generation, and with the CRC that then is right for `payload`: the bytes behind the header.
    pub fn with_generation(self, generation: u32, payload: &[u8]) -> Self {
        let renewed = Self { generation, ..self };
        Self {
            crc: renewed.crc_with(payload),
            ..renewed
        }
    }

    /// The bytes of the header.
    pub fn to_bytes(&self) -> [u8; HEADER_LENGTH] {
        let mut bytes = self.without_crc();
        if let Some(slot) = bytes.get_mut(CRC_OFFSET..) {
            slot.copy_from_slice(&self.crc.to_le_bytes());
        }
        bytes
    }

    fn without_crc(&self) -> [u8; HEADER_LENGTH] {
        let mut bytes = [0; HEADER_LENGTH];
        let fields = MAGIC
            .into_iter()
            .chain(self.schema.to_le_bytes())
            .chain([0, 0])
            .chain(self.length.to_le_bytes())
            .chain(self.generation.to_le_bytes());
        for (slot, byte) in bytes.iter_mut().zip(fields) {
            *slot = byte;
        }
        bytes
    }

    /// The CRC-32 of a table with this header, as far as the header: the payload is to follow.
    pub fn begin_crc(&self) -> Crc32 {
        let mut crc = Crc32::new();
        crc.update(self.without_crc().get(..CRC_OFFSET).unwrap_or_default());
        crc
    }

    fn crc_with(&self, payload: &[u8]) -> u32 {
        let mut crc = self.begin_crc();
        crc.update(payload);
        crc.value()
    }
}

/// Where the arrays of a table are, and the scales of its numbers.
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
    /// True for schema 2.
    pub(super) is_extended: bool,
    /// True where the interpolation error is given.
    pub(super) error_given: bool,
    /// Number of modes of each layer whose derivatives are given; 0 for none.
    pub(super) modes: usize,
}

impl Shape {
    /// Reads the description and checks that all of it can be.
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
        let is_extended = u16_at(bytes, 4)? == SCHEMA;
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
            error_given: is_extended && flags & ERROR_GIVEN != 0,
            modes: if is_extended {
                usize::from(flags >> MODES_SHIFT)
            } else {
                0
            },
        })
    }

    /// Refuses numbers that cannot be.
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

    /// Length of the whole table in bytes.
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

    // The counts are 16 bits wide, so these offsets fit 32 bits: 24·65535 + 4·65535 + 2·65535·65536 would not, but such a
    // table cannot be held by a target with 32-bit addresses; saturating keeps the sum from wrapping there.
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

    /// Indices of the intervals of a column.
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

    /// The intervals of a column; `None` for one of a kind that does not exist.
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
        // The ends must come out exactly: they say that an interval reaches the end of the table.
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

pub(super) fn kind_code(kind: Kind) -> u8 {
    match kind {
        Kind::Hopf => 0,
        Kind::Flip => 1,
        Kind::Fold => 2,
        Kind::Undecided => 3,
    }
}

fn kind_of(code: u8) -> Option<Kind> {
    Some(match code {
        0 => Kind::Hopf,
        1 => Kind::Flip,
        2 => Kind::Fold,
        3 => Kind::Undecided,
        _ => return None,
    })
}

/// A count for a message: what does not fit is shown as the largest.
pub(super) fn saturate(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}

fn array_at<const N: usize>(bytes: &[u8], offset: usize) -> Option<[u8; N]> {
    bytes.get(offset..offset.checked_add(N)?)?.try_into().ok()
}

pub(super) fn u16_at(bytes: &[u8], offset: usize) -> Option<u16> {
    array_at(bytes, offset).map(u16::from_le_bytes)
}

fn u32_at(bytes: &[u8], offset: usize) -> Option<u32> {
    array_at(bytes, offset).map(u32::from_le_bytes)
}

pub(super) fn f32_at(bytes: &[u8], offset: usize) -> Option<f32> {
    array_at(bytes, offset).map(f32::from_le_bytes)
}
