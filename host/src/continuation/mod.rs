//! Forced periodic orbits of the cut and what becomes of them.
//!
//! With the delay equal to the tooth period, u = u_τ holds on an orbit of that period: the regenerative force
//! vanishes, and the orbit is that of an ordinary differential equation under the forces of feed and edges.
//! Its multipliers are those of the delay equation linearized about it.

mod branch;
mod chart;
mod forced;
mod orbit;
mod variation;

pub use branch::{Branch, BranchPoint, Event, Extent, follow_depth};
pub use forced::ForcedProblem;
pub use orbit::{Orbit, OrbitError};
