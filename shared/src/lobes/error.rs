//! Why bytes are no table, or content cannot become one.

use serde::{Deserialize, Serialize};

use crate::units::{Hertz, Millimeters, Rpm};

/// Why bytes are no table, or content cannot become one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TableError {
    /// Fewer bytes than the header and the description need.
    TooShort {
        /// Bytes needed at least.
        needed: u32,
        /// Bytes found.
        found: u32,
    },
    /// The bytes do not begin as a table does.
    Magic {
        /// What they begin with; a table begins with [`MAGIC`](super::format::MAGIC).
        found: [u8; 4],
    },
    /// The table has a schema that this code does not know.
    Schema {
        /// The schema of the table.
        found: u16,
        /// The schema that this code knows.
        known: u16,
    },
    /// The header says another length than there are bytes.
    Length {
        /// What the header says.
        header: u32,
        /// Bytes found.
        found: u32,
    },
    /// Bytes have changed since the CRC was taken.
    Crc {
        /// What the header says.
        header: u32,
        /// The CRC of the bytes found.
        computed: u32,
    },
    /// The arrays that the description announces do not fill the length.
    Arrays {
        /// The length that the description needs.
        needed: u64,
        /// The length of the table.
        found: u32,
    },
    /// The name is too long or not UTF-8.
    Name {
        /// Its length in bytes; at most [`NAME_CAPACITY`](super::format::NAME_CAPACITY).
        length: u32,
    },
    /// A tool without teeth.
    Teeth,
    /// Limits of the machine that are no range of positive speeds.
    Limits {
        /// Slowest.
        from: Rpm,
        /// Fastest.
        to: Rpm,
    },
    /// Depths that are no range beginning at 0 or above.
    Depths {
        /// Smallest.
        from: Millimeters,
        /// Largest.
        to: Millimeters,
    },
    /// A chatter frequency that is negative or not finite.
    Chatter {
        /// The value.
        found: Hertz,
    },
    /// No speeds or too many, no layers or too many.
    Count {
        /// Speeds; 1 to 65 535.
        speeds: u32,
        /// Layers; 1 to 65 535.
        layers: u32,
    },
    /// Speeds must be positive and strictly ascending.
    SpeedOrder {
        /// Index of the speed that is wrong.
        index: u32,
        /// Its value.
        found: Rpm,
    },
    /// A layer that holds for nothing, for feeds that another layer of the same immersion and posture has too, or for
    /// an immersion that is not another layer's but closer than twice the tolerance.
    Layer {
        /// Index of the layer.
        layer: u32,
    },
    /// A layer has not one column per speed.
    Columns {
        /// Index of the layer.
        layer: u32,
        /// Columns found.
        found: u32,
        /// Speeds of the table.
        speeds: u32,
    },
    /// A column with more intervals than [`MAX_INTERVALS`](super::format::MAX_INTERVALS), or a layer with more than 65 535.
    TooManyIntervals {
        /// Index of the layer.
        layer: u32,
        /// Index of the speed.
        speed: u32,
        /// Intervals found: in the column, or up to it in the layer.
        found: u32,
    },
    /// The intervals of a column do not begin where those of the column before end.
    ColumnOrder {
        /// Index of the layer.
        layer: u32,
        /// Index of the speed.
        speed: u32,
    },
    /// An interval that is empty, outside the depths of the table, not behind the one before it, or of unknown kind.
    IntervalOrder {
        /// Index of the layer.
        layer: u32,
        /// Index of the speed.
        speed: u32,
        /// Index of the interval in its column.
        interval: u32,
    },
    /// The buffer is too small for the table.
    Buffer {
        /// Bytes needed.
        needed: u64,
        /// Bytes there are.
        found: u64,
    },
}
