//! The signal chain as one step: a block of samples in, a report out.
//!
//! Firmware, emulator and host all call [`Monitor::step`]. The files stand in the order of the data: samples and angles,
//! spectra, verdict and advice. [`Monitor`] is constant; everything learned is in [`State`].

mod angles;
mod band;
mod band_state;
mod passings;
mod pipeline;
mod report;
mod settings;
mod spectra;
mod state;
mod step;
mod strobe;
mod verdict;

pub use band::Band;
pub use pipeline::Monitor;
pub use report::Report;
pub use settings::{MAX_TEETH, Settings, SettingsError};
pub use state::State;
pub use strobe::{MAX_BLOCK_STROBES, Strobe};
