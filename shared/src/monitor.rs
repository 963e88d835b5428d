//! The signal chain as one step: takes a block of samples, returns a report.
//!
//! Firmware, emulator and host all call [`Monitor::step`]. The data pass through angles and samples, spectra, verdict
//! and advice, in this order. [`Monitor`] is constant. Everything learned from the blocks is in [`State`].

mod angles;
mod band;
mod band_state;
mod loudness;
mod pipeline;
mod report;
mod settings;
mod spectra;
mod state;
mod step;
mod strobe;
mod tooth_passings;
mod verdict;

pub use band::Band;
pub use pipeline::Monitor;
pub use report::Report;
pub use settings::{MAX_TEETH, Settings, SettingsError};
pub use state::State;
pub use strobe::{MAX_BLOCK_STROBES, Strobe};
