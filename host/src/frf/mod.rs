//! Frequency response functions: what they are, their table in a file, and what lies between its lines.

mod error;
mod interpolation;
mod table;
mod table_file;

pub use error::FrfError;
pub use interpolation::Interpolation;
pub use table::{Frf, FrfTable};
