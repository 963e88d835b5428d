//! The device behind a line: requests, retries, uploads, feeding, slow and noisy lines.
#![allow(clippy::unwrap_used, clippy::panic)]

mod bench;
mod feeding;
mod frames;
mod heard;
mod requests;
mod slow_line;
#[path = "../support/mod.rs"]
mod support;
mod uploads;
