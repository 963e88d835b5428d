//! The structure of the workspace: crates and rooms in layers, no import circle, files of one noun.
//!
//! The import graph is read from the code itself: `use` declarations and paths of every file, without what is compiled for tests
//! only. A name that a parent module re-exports leads to the file that defines it, so that a page that hands names on is no arrow.

#![allow(clippy::unwrap_used, clippy::panic, clippy::expect_used)]

mod circles;
mod crates;
mod graph;
mod module;
mod rooms;
mod size;
mod tokens;
