//! Simulated signals for the emulated board: what a virtual spindle sends in place of sensor and tachometer.
//!
//! The emulated board has no sensor bus. Its third serial port takes [`Stimulus`] messages, each in
//! postcard, framed by COBS with a closing zero, and answers each with one byte: [`TAKEN`] once the
//! message has gone through the whole pipeline, [`REFUSED`] where it cannot be read.
//!
//! Long recordings go through the board's memory instead: the host writes stimuli back to back,
//! without frames, from [`STORE_OFFSET`] on, and sends one [`Stimulus::Stored`].

use quietcut_core::acceleration::Block;
use quietcut_core::tachometer::Edge;
use serde::{Deserialize, Serialize};

/// The most bytes of one framed stimulus: 64 samples of three axes at 3 bytes each, the head of the
/// block, and what the frame adds.
pub const MAX_FRAME_BYTES: usize = 640;

/// Answer to a stimulus that was taken.
pub const TAKEN: u8 = 0x06;

/// Answer to a stimulus that could not be read, or does not fit the memory.
pub const REFUSED: u8 = 0x15;

/// Bytes of the emulated flash for lobe tables, at the start of the board's lasting memory.
pub const FLASH_BYTES: usize = 256 * 1024;

/// Where stored stimuli begin in the board's lasting memory.
pub const STORE_OFFSET: usize = 1024 * 1024;

/// Bytes of the board's lasting memory.
pub const MEMORY_BYTES: usize = 16 * 1024 * 1024;

/// What a virtual spindle says.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
// Blocks are by far the most common: a box would need an allocator, and nothing holds many of these.
#[allow(clippy::large_enum_variant)]
pub enum Stimulus {
    /// Samples of the accelerometer.
    Block(Block),
    /// A rising edge of the tachometer.
    Edge(Edge),
    /// This many bytes of stimuli stand in the board's memory.
    Stored {
        /// Bytes from [`STORE_OFFSET`] on.
        bytes: u32,
    },
    /// Asks the board to log how deep its stack went, and how long its blocks took.
    AskCost,
}
