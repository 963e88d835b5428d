//! The library of causes, one file each.

mod linear;
mod missing_mode;
mod process;
mod restoring;
mod sensor;

use super::cause::Cause;

/// All causes.
pub(super) fn all() -> Vec<Box<dyn Cause>> {
    let mut all: Vec<Box<dyn Cause>> = Vec::new();
    all.extend(linear::all());
    all.push(Box::new(missing_mode::MissingMode));
    all.extend(restoring::all());
    all.extend(process::all());
    all.extend(sensor::all());
    all
}
