//! The library of causes, one file each.

pub(crate) mod cause;
pub(crate) mod closed_loop;
pub(crate) mod extension_tables;
mod linear;
mod missing_mode;
mod process;
mod restoring;
mod sensor;

use self::cause::Cause;

/// All causes.
pub(crate) fn all() -> Vec<Box<dyn Cause>> {
    let mut all: Vec<Box<dyn Cause>> = Vec::new();
    all.extend(linear::all());
    all.push(Box::new(missing_mode::MissingMode));
    all.extend(restoring::all());
    all.extend(process::all());
    all.extend(sensor::all());
    all
}
