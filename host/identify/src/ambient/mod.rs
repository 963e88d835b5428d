//! Modes from motion alone, under a force that nobody measured.

mod recording;
pub mod subspace;

pub use recording::Ambient;
