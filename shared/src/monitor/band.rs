//! The two frequency bands of the signal chain.

use serde::{Deserialize, Serialize};

/// A frequency band of the signal chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Band {
    /// The structure band, 5 to 400 Hz: modes of a robot or of a machine's frame.
    Structure,
    /// The tool band, up to 5 kHz: modes of tool, holder and spindle.
    Tool,
}
