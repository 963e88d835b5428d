//! The cut: tool, material, engagement, and the forces that a chip makes.

mod cut;
mod engagement;
mod force;
mod harmonics;
mod material;
mod process;
mod tool;

pub use cut::Cut;
pub use engagement::{Engagement, Interval};
pub use force::{Averaged, ToothForce, TurningVector};
pub use harmonics::Harmonic;
pub use material::Material;
pub use process::Process;
pub use tool::{Runout, Tool};
