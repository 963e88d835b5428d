//! The machine model: case, structure, tool, material and cut.

pub mod case;
pub mod cutter;
mod dynamics;
pub mod effects;
mod error;
mod force_law;
pub mod milling;
pub mod path;
pub mod spindle;
pub mod structure;
pub mod term;

pub use cutter::{Cutter, Immersion, Tooth};
pub use dynamics::Dynamics;
pub use effects::{Effect, EffectError, Effects};
pub use error::ModelError;
pub use force_law::{ChipLaw, ForceLaw, ProcessDamping};
pub use spindle::{Fluctuation, Spindle};
pub use term::{At, Branch, Slopes, Term};
