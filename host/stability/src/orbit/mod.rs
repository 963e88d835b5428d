//! Forced periodic orbits of the cut, their Floquet multipliers (characteristic multipliers), and branches of orbits.
//!
//! With the delay equal to the tooth period, u = u_τ holds on an orbit of that period: the regenerative force
//! vanishes, and the orbit is that of an ordinary differential equation under the forces of feed and edges.
//! Its multipliers are those of the delay equation linearized about it.
//!
//! With unequal pitch, or with runout, the orbit has the period of the revolution, the surface cut before acts on it, and it is
//! that of the delay equation itself.

mod anderson;
mod branch;
mod choice;
mod collocated;
mod equivalent;
mod follower;
mod forced;
mod forced_method;
mod pairing;
mod periodic_orbit;
mod restoring;
mod revolution_period;
mod tooth_period;
mod tooth_period_map;
mod variation;

#[cfg(test)]
mod follower_tests;
#[cfg(test)]
mod revolution_period_tests;

pub use branch::{Branch, BranchPoint, Event, Extent};
pub use choice::collocation_of;
pub use equivalent::EquivalentProblem;
pub use follower::follow_depth;
pub use forced::ForcedProblem;
pub use periodic_orbit::{Orbit, OrbitError};
