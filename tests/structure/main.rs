//! The structure of the workspace: crates and rooms form layers, no import circle exists, each file holds one noun, and the name of each
//! effect stands in one place.
//!
//! The import graph is read from the code: `use` declarations and paths of every file, without code that is compiled for tests
//! only. A name that a parent module re-exports is attributed to the file that defines it.

#![allow(clippy::unwrap_used, clippy::panic, clippy::expect_used)]

mod circles;
mod crates;
mod effect_names;
mod graph;
mod module;
mod rooms;
mod size;
mod tokens;
