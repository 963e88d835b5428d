//! Virtual cuts: the delay equations of milling integrated in time, and the sensors that hear them.
//!
//! The equations are those of thesis chapters 3 and 6 without any smoothing: teeth enter and leave exactly at their
//! angles, a chip is as thick as the surface left by *all* earlier passes leaves it (eqs 6.20 to 6.27), and a tooth
//! off the surface feels no force.

mod anti_aliasing;
mod contact;
mod cutting;
mod drive;
mod error;
mod integrator;
mod model;
mod passage;
mod pores;
mod reading;
mod record;
pub mod rig;
mod run;
mod segment;
mod sensor;
mod settings;
mod surface;
mod virtual_cut;

#[cfg(test)]
pub(crate) mod tests;

pub use quietcut_model::effects::{self as effect, Effect, EffectError, Effects};
pub use quietcut_model::{
    At, Branch, ChipLaw, Cutter, Dynamics, Fluctuation, ForceLaw, Immersion, ModelError, ProcessDamping,
    Slopes, Spindle, Term, Tooth, path,
};

pub use cutting::{Cutting, Regeneration};
pub use drive::Drive;
pub use error::SimulateError;
pub use integrator::Statistics;
pub use model::Model;
pub use passage::Passage;
pub use pores::Pores;
pub use reading::Reading;
pub use record::Recorder;
pub use segment::{Motion, Room, Segment};
pub use sensor::{Accelerometer, STANDARD_GRAVITY, Sampler, TachometerModel};
pub use settings::Settings;
pub use virtual_cut::{Entry, Heard, VirtualCut, VirtualCutError};
