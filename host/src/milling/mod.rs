//! The cut: tool, material, engagement, and the forces that a chip makes.

mod cut;
mod material;
mod tool;

pub use cut::Cut;
pub use material::Material;
pub use tool::{Runout, Tool};
