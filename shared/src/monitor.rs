//! Block in, report out: the pipeline that all callers use.

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
