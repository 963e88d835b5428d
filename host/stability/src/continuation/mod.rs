//! Forced periodic orbits of the cut and what becomes of them.
//!
//! With the delay equal to the tooth period, u = u_τ holds on an orbit of that period: the regenerative force
//! vanishes, and the orbit is that of an ordinary differential equation under the forces of feed and edges.
//! Its multipliers are those of the delay equation linearized about it.
//!
//! With unequal pitch, or with runout, the orbit has the period of the revolution, the surface cut before acts on it, and it is
//! that of the delay equation itself.

mod anderson;
mod branch;
mod chart;
mod choice;
mod collocated;
mod equivalent;
mod forced;
mod orbit;
mod pairing;
mod restoring;
mod revolution;
mod tooth_period;
mod variation;

pub use branch::{Branch, BranchPoint, Event, Extent, follow_depth};
pub use choice::collocation_of;
pub use equivalent::EquivalentProblem;
pub use forced::ForcedProblem;
pub use orbit::{Orbit, OrbitError};
