//! The bytes of a table, schemas 1 to 3. All numbers are little-endian and unaligned.
//!
//! | offset | bytes | header |
//! |---|---|---|
//! | 0 | 4 | magic `QCLT` |
//! | 4 | 2 | schema: [`SCHEMA_PLAIN`], [`SCHEMA_ADDITIONS`] or [`SCHEMA`] |
//! | 6 | 2 | zero |
//! | 8 | 4 | length of the whole table in bytes, header included |
//! | 12 | 4 | generation: 0 in a file; the device increments it to find the newer of its two slots |
//! | 16 | 12 | zero |
//! | 28 | 4 | CRC-32 of bytes 0..28 and 32..length |
//!
//! | offset | bytes | description |
//! |---|---|---|
//! | 32 | 1 | teeth |
//! | 33 | 1 | length of the name in bytes |
//! | 34 | 2 | L, number of layers |
//! | 36 | 2 | S, number of speeds |
//! | 38 | 2 | flags: bit 0 machine's limits given; schema 2 on: bit 1 interpolation error given, bits 8–15 M |
//! | 40 | 4+4 | slowest and fastest speed of the machine, f32, rev/min |
//! | 48 | 4+4 | smallest and largest depth of the table, f32, mm |
//! | 56 | 4 | largest chatter frequency, f32, Hz: the scale of all chatter frequencies |
//! | 60 | 4 | I, number of intervals |
//! | 64 | 32 | name of the case, UTF-8, padded with zeros |
//! | 96 | 24·L | layers, each of 24 bytes as described below |
//! | … | 4·S | speeds, f32, rev/min, strictly ascending, steps of any size |
//! | … | 2·L·(S+1) | per layer: index of each speed's first interval, counted in the layer, u16; one more for the end |
//! | … | 8·I | intervals: from, to, chatter (u16 each), kind (1 byte: 0 Hopf, 1 flip, 2 fold, 3 undecided; schema 3: 4 bistable), 1 zero |
//! | … | 4+4 | schema 2 on, where flagged: interpolation error in depth (f32, mm) and in speed (f32, relative) |
//! | … | 8·L·M | schema 2 on: per layer its modes: natural frequency (f32, Hz), damping ratio (f32) |
//! | … | 4·(2M+1)·I | schema 2 on, where M > 0: per interval the derivatives of `from`, then those of `to` |
//!
//! A layer has feed from and feed to (f32, mm), start and exit (f32, degrees), posture (1 byte), 3 further bytes, and
//! the index of its first interval (u32). The 3 bytes are zeros in schema 1. From schema 2 on they are 1 if a feed
//! direction is given, else 0 (1 byte), and the feed direction (u16, 1/100 degree).
//!
//! M is the number of modes of each layer. The derivatives of an interval end are those by the natural frequency of
//! each mode, then by the damping ratio of each mode, then by the cutting force (IEEE binary16, mm per relative
//! change).
//!
//! A depth is smallest + q·(largest − smallest)/65535, a chatter frequency q·largest/65535 with 0 for "not known".
//! `from` is rounded down and `to` up, so that an entry errs by less than one step and to the unstable side only
//! (a depth within 1/50 of a step is taken as that step: a table that is read and encoded again keeps its bytes). The
//! chatter frequency is rounded to the nearest, but never to 0. With 10 mm and 5 000 Hz a step is 0.15 µm and 0.08
//! Hz. 600 speeds, 6 layers and 2 intervals per column are 67 KB; 3 are 96 KB.
//!
//! # Schemas
//!
//! The header never changes. Schema 1 is a table without additions. Tables without additions are always written in
//! schema 1, so that devices with older firmware accept them. Schema 2 has the additions marked above. Schema 3 is schema
//! 2 with bistable intervals; a table is written in it only if it has one. A reader
//! refuses every other schema with [`TableError::Schema`](super::TableError::Schema) before it reads beyond the
//! header, and refuses unknown flags of schemas 2 and 3.
//!
//! A further addition needs a higher [`SCHEMA`], goes to the end of the table, and has its bytes frozen in the tests.

pub use super::header::Header;

/// The first four bytes of a lobe table.
pub const MAGIC: [u8; 4] = *b"QCLT";
/// The latest schema of lobe tables that this code reads and writes.
pub const SCHEMA: u16 = 3;
/// The schema of lobe tables with optional parts and without bistable intervals.
pub const SCHEMA_ADDITIONS: u16 = 2;
/// The schema of lobe tables without optional parts.
pub const SCHEMA_PLAIN: u16 = 1;
/// Length of the header of a lobe table, in bytes.
pub const HEADER_LENGTH: usize = 32;
/// Largest length of the name of a case in a lobe table, in bytes.
pub const NAME_CAPACITY: usize = 32;
/// Largest number of unstable depth intervals in one stored column of a lobe table.
pub const MAX_INTERVALS: usize = 12;

pub(super) const CRC_OFFSET: usize = 28;
pub(super) const NAME_OFFSET: usize = 64;
pub(super) const FLAGS_OFFSET: usize = 38;
pub(super) const LAYERS_OFFSET: usize = 96;
pub(super) const LAYER_LENGTH: usize = 24;
pub(super) const INTERVAL_LENGTH: usize = 8;
pub(super) const STEPS: f32 = 65_535.0;

/// Flag bit of a lobe table: the table states its interpolation error.
pub(super) const ERROR_GIVEN: u16 = 2;
/// Bit position of the number of modes in the flags of a lobe table.
pub(super) const MODES_SHIFT: u16 = 8;
/// All flag bits of a lobe table of schemas 2 and 3, without the bits of the number of modes.
pub(super) const KNOWN_FLAGS: u16 = 1 | ERROR_GIVEN;

/// Number of codes for the feed direction in 360°: one per 1/100 degree.
pub(super) const TURN: u16 = 36_000;

pub(super) const ERROR_LENGTH: usize = 8;
pub(super) const MODE_LENGTH: usize = 8;
