//! What quietcut does with measured data: the library behind the `quietcut` command.

pub mod cli;
pub mod file;
pub mod report;
