//! The cut: tool, material, engagement, and the forces on the teeth.

mod cut;
mod engagement;
mod force;
mod harmonics;
mod material;
mod process;
mod tool;
mod tooth;

pub use cut::Cut;
pub use engagement::{Engagement, Subinterval};
pub use force::{Averaged, RotatingVector, ToothForce};
pub use harmonics::Harmonic;
pub use material::Material;
pub use process::Process;
pub use tool::{Runout, Tool};
pub use tooth::{EdgeAngle, EdgeForce, Immersion};
