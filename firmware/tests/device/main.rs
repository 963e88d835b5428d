//! The device at a line: requests, repeated requests, uploads, fed blocks, slow and noisy lines.
#![allow(clippy::unwrap_used, clippy::panic)]

mod bench;
mod feeding;
mod frames;
mod outputs;
mod requests;
mod slow_line;
#[path = "../support/mod.rs"]
mod support;
mod uploads;
