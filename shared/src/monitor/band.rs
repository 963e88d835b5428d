//! The two frequency bands of the signal chain.

use serde::{Deserialize, Serialize};

/// A frequency band of the signal chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Band {
    /// Modes of a robot or a machine's frame: 5 to 400 Hz.
    Structure,
    /// Modes of tool, holder and spindle: up to 5 kHz.
    Tool,
}
