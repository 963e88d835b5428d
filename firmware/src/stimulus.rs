//! Simulated signals for the emulated board, in place of sensor and tachometer.
//!
//! The emulated board has no sensor bus. Its third serial port receives [`Stimulus`] messages in postcard, framed by
//! COBS with a closing zero. The board answers each with one byte: [`TAKEN`] after it has processed the message,
//! otherwise [`REFUSED`].
//!
//! Long recordings use the board's memory instead: the host writes stimuli without frames one after the other,
//! beginning at [`STORE_OFFSET`], and sends one [`Stimulus::Stored`].

use quietcut_core::acceleration::Block;
use quietcut_core::tachometer::Edge;
use serde::{Deserialize, Serialize};

/// Upper bound of the length of a framed stimulus in bytes: 64 samples of three axes at 3 bytes each, the head of the
/// block, and the frame.
pub const MAX_FRAME_BYTES: usize = 640;

/// Answer byte of the emulated board to a stimulus that it has processed.
pub const TAKEN: u8 = 0x06;

/// Answer byte of the emulated board to a stimulus that it has not processed, or only in part.
pub const REFUSED: u8 = 0x15;

/// Size in bytes of the emulated flash for lobe tables, at the start of the board's non-volatile memory.
pub const FLASH_BYTES: usize = 256 * 1024;

/// Offset in bytes of stored stimuli from the start of the board's non-volatile memory.
pub const STORE_OFFSET: usize = 1024 * 1024;

/// Size of the board's non-volatile memory in bytes.
pub const MEMORY_BYTES: usize = 16 * 1024 * 1024;

/// A message of simulated signals, which takes the place of sensor and tachometer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
// Boxing the large variant would need an allocator. Most messages are blocks, and few are held at a time.
#[allow(clippy::large_enum_variant)]
pub enum Stimulus {
    /// Samples of the accelerometer.
    Block(Block),
    /// A rising edge of the simulated tachometer.
    Edge(Edge),
    /// Stimuli that the host has stored in the board's memory are to be processed.
    Stored {
        /// Length of the stored stimuli in bytes, from [`STORE_OFFSET`] on.
        bytes: u32,
    },
    /// Requests a log entry with the largest stack depth and the processing times of blocks and of polls of the link.
    AskCost,
}
