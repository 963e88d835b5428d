//! What quietcut does with measured data: the library behind the `quietcut` command.

pub mod case;
pub mod cli;
mod complex_eigenvalues;
pub mod continuation;
pub mod demo;
pub mod device;
pub mod diagnose;
mod eigenvalues;
pub mod file;
pub mod frf;
pub mod identify;
pub mod lobe_table;
pub mod milling;
pub mod plan;
pub mod recording;
pub mod report;
pub mod simulate;
pub mod stability;
pub mod structure;
pub mod test_cuts;
