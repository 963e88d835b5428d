//! Errors of reading and encoding a lobe table.

use serde::{Deserialize, Serialize};

use super::format::{MAGIC, MAX_INTERVALS, NAME_CAPACITY};
use crate::units::{Hertz, Millimeters, Rpm};

/// The reason why bytes are not a valid lobe table, or why content cannot be encoded as one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TableError {
    /// The bytes, or the table length that the header states, are fewer than a lobe table needs.
    TooShort {
        /// Bytes needed at least.
        needed: u32,
        /// Bytes found.
        found: u32,
    },
    /// The bytes do not begin with the magic number of a lobe table.
    Magic {
        /// The first four bytes of the given data; a lobe table begins with [`MAGIC`](super::format::MAGIC).
        found: [u8; 4],
    },
    /// The lobe table has a schema that this code does not know.
    Schema {
        /// The schema of the table.
        found: u16,
        /// The latest schema of lobe tables that this code knows.
        known: u16,
    },
    /// The table length that the header states does not fit the number of bytes.
    Length {
        /// Length of the lobe table that its header states, in bytes.
        header: u32,
        /// Bytes found.
        found: u32,
    },
    /// The CRC-32 does not match: bytes of the table have changed since the CRC was computed.
    Crc {
        /// CRC-32 in the header.
        header: u32,
        /// CRC-32 computed from the bytes.
        computed: u32,
    },
    /// The counts in the description of the table (layers, speeds, intervals) do not match its length or its columns.
    Arrays {
        /// The length in bytes that the counts in the description of the table imply.
        needed: u64,
        /// The actual length in bytes of the lobe table.
        found: u32,
    },
    /// The name of the case in the table is too long or not UTF-8.
    Name {
        /// Length of the name in bytes; at most [`NAME_CAPACITY`](super::format::NAME_CAPACITY).
        length: u32,
    },
    /// A tool without teeth.
    Teeth,
    /// The speed limits of the machine are not an ascending, finite range of speeds of at least 0.
    Limits {
        /// Slowest.
        from: Rpm,
        /// Fastest.
        to: Rpm,
    },
    /// The depth range of the table is not an ascending, finite range of depths of at least 0.
    Depths {
        /// Smallest.
        from: Millimeters,
        /// Largest.
        to: Millimeters,
    },
    /// A chatter frequency in the table is negative or not finite.
    Chatter {
        /// The value.
        found: Hertz,
    },
    /// The table has no spindle speeds or too many, or no layers or too many.
    Count {
        /// Speeds; 1 to 65 535.
        speeds: u32,
        /// Layers; 1 to 65 535.
        layers: u32,
    },
    /// A spindle speed of the table is not positive and finite, or not above the preceding one.
    SpeedOrder {
        /// Index of the wrong speed.
        index: u32,
        /// Its value.
        found: Rpm,
    },
    /// The feed range or the immersion of a layer of the table is empty or not finite, or its feed range begins below
    /// 0; or the feed range overlaps that of a layer of equal immersion and posture whose feed direction is not
    /// another one; or the immersion differs by at most twice the tolerance from that of a layer of the same posture,
    /// without being equal.
    Layer {
        /// Index of the layer.
        layer: u32,
    },
    /// A layer of the table whose number of columns (one per speed) differs from the number of spindle speeds.
    Columns {
        /// Index of the layer.
        layer: u32,
        /// Columns found.
        found: u32,
        /// Speeds of the table.
        speeds: u32,
    },
    /// A column of the table with more unstable depth intervals than [`MAX_INTERVALS`](super::format::MAX_INTERVALS),
    /// or a layer with more than 65 535.
    TooManyIntervals {
        /// Index of the layer.
        layer: u32,
        /// Index of the speed.
        speed: u32,
        /// Number of unstable depth intervals: in the column, or from the first column of the layer up to this one.
        found: u32,
    },
    /// A column of the table that cannot be read, or whose unstable depth intervals are not stored directly after
    /// those of the preceding column.
    ColumnOrder {
        /// Index of the layer.
        layer: u32,
        /// Index of the speed.
        speed: u32,
    },
    /// An unstable depth interval that is empty, outside the depths of the table, not above the preceding one, or of
    /// unknown kind.
    IntervalOrder {
        /// Index of the layer.
        layer: u32,
        /// Index of the speed.
        speed: u32,
        /// Index of the unstable depth interval in its column.
        interval: u32,
    },
    /// The buffer is too small for the bytes of the lobe table, or the table is longer than 2³² − 1 bytes.
    Buffer {
        /// Bytes needed.
        needed: u64,
        /// Bytes available.
        found: u64,
    },
    /// The table has unknown flags, or more modes than possible.
    Flags {
        /// The flags of the description.
        found: u16,
    },
    /// A feed direction of a table layer is not finite, beyond ±1000 revolutions, or stored as an invalid code; or the
    /// number of directions differs from the number of layers.
    FeedDirection {
        /// Index of the table layer with an invalid feed direction, or the number of feed directions.
        layer: u32,
    },
    /// A mode of a table layer has a frequency that is not positive and finite, or a damping ratio that is not in
    /// [0, 1).
    Mode {
        /// Index of the layer.
        layer: u32,
        /// Index of the mode in its table layer.
        mode: u32,
    },
    /// The interpolation error that the table states is negative or not finite in depth, or not in [0, 1) in relative
    /// speed.
    InterpolationError {
        /// Stated error in depth.
        depth: Millimeters,
        /// Stated interpolation error in spindle speed, relative to the speed; it must be in [0, 1).
        speed: f32,
    },
    /// A derivative of a limit is not finite; the number of sets of derivatives differs from the number of unstable
    /// intervals; or not all layers have the same number of modes, at most [`MODES_MAX`](super::MODES_MAX).
    Slopes {
        /// Index in the table of the unstable interval with the faulty derivative, or the number of sets of
        /// derivatives.
        index: u32,
    },
}

impl core::fmt::Display for TableError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TooShort { needed, found } => {
                write!(f, "{found} bytes: a lobe table has at least {needed}")
            }
            Self::Magic { found } => write!(
                f,
                "no lobe table: it begins with {}, a table with {}",
                found.escape_ascii(),
                MAGIC.escape_ascii()
            ),
            Self::Schema { found, known } => {
                write!(f, "schema {found} of lobe tables: known are 1 to {known}")
            }
            Self::Length { header, found } => {
                write!(f, "{found} bytes where the header of the table says {header}")
            }
            Self::Crc { header, computed } => write!(
                f,
                "the bytes have changed: their CRC-32 is {computed:08x}, the header says {header:08x}"
            ),
            Self::Arrays { needed, found } => {
                write!(f, "the table announces {needed} bytes of entries and has {found}")
            }
            Self::Name { length } => write!(
                f,
                "a name of {length} bytes that is too long or no UTF-8: at most {NAME_CAPACITY} are possible"
            ),
            Self::Teeth => f.write_str("a tool without teeth"),
            Self::Limits { from, to } => {
                write!(
                    f,
                    "a spindle from {from} to {to}: the slowest speed must be below the fastest"
                )
            }
            Self::Depths { from, to } => {
                write!(
                    f,
                    "depths from {from} to {to}: they must begin at 0 or above and ascend"
                )
            }
            Self::Chatter { found } => {
                write!(
                    f,
                    "a chatter frequency of {found}: it must be a number of at least 0"
                )
            }
            Self::Count { speeds, layers } => {
                write!(
                    f,
                    "{speeds} speeds and {layers} layers: 1 to 65535 of each are possible"
                )
            }
            Self::SpeedOrder { index, found } => {
                write!(
                    f,
                    "speed number {index} is {found}: speeds must be positive and ascend"
                )
            }
            Self::Layer { layer } => write!(
                f,
                "layer number {layer} holds for no cut, or for one that another layer has too"
            ),
            Self::Columns { layer, found, speeds } => {
                write!(f, "layer number {layer} has {found} columns for {speeds} speeds")
            }
            Self::TooManyIntervals { layer, speed, found } => write!(
                f,
                "{found} intervals at speed number {speed} of layer number {layer}: a column holds {MAX_INTERVALS}, a \
                 layer 65535"
            ),
            Self::ColumnOrder { layer, speed } => write!(
                f,
                "the intervals of speed number {speed} of layer number {layer} are not behind those before"
            ),
            Self::IntervalOrder {
                layer,
                speed,
                interval,
            } => write!(
                f,
                "interval number {interval} of speed number {speed} of layer number {layer} is empty, outside of the \
                 depths of the table, not behind the one before, or of unknown kind"
            ),
            Self::Buffer { needed, found } => write!(f, "{found} bytes of memory: the table needs {needed}"),
            Self::Flags { found } => write!(f, "flags {found:#06x}: not all of them are known"),
            Self::FeedDirection { layer } => {
                write!(
                    f,
                    "layer number {layer} has no feed direction, or one that is no angle"
                )
            }
            Self::Mode { layer, mode } => write!(
                f,
                "mode number {mode} of layer number {layer}: its frequency must be positive, its damping ratio from 0 to \
                 below 1"
            ),
            Self::InterpolationError { depth, speed } => write!(
                f,
                "an interpolation error of {depth} and {speed} of the speed: both must be at least 0, the second below 1"
            ),
            Self::Slopes { index } => write!(
                f,
                "the derivatives of interval number {index} are no numbers, or not as many as there are intervals"
            ),
        }
    }
}

impl core::error::Error for TableError {}
