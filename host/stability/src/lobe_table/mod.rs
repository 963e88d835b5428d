//! The lobe table of the device, built from cases.

mod accuracy;
mod build;
mod derivatives;
mod encoding;
mod entries;
mod error;
mod grid;
mod layers;
mod request;
mod spindle_limit;

pub use build::{BuiltTable, build_table};
pub use error::BuildError;
pub use request::TableRequest;

#[cfg(test)]
mod accuracy_tests;
#[cfg(test)]
mod bistable_tests;
#[cfg(test)]
mod tests;
