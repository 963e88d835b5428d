//! The library behind the `quietcut` command: command line, device client, demonstration and report pages.
//!
//! It re-exports the library crates of the workspace (recording, model, frf, simulate, stability, identify, diagnose).

pub use quietcut_diagnose as diagnose;
pub use quietcut_frf as frf;
pub use quietcut_identify as identify;
pub use quietcut_identify::plan;
pub use quietcut_model::{case, milling, structure};
pub use quietcut_recording as recording;
pub use quietcut_recording::file;
pub use quietcut_simulate as simulate;
pub use quietcut_stability as stability;
pub use quietcut_stability::{lobe_table, orbit, trial_cuts};

pub mod cli;
mod criteria;
pub mod demo;
pub mod device;
pub mod machine;
pub mod report;
