//! Forced periodic orbits of the cut, their Floquet multipliers (characteristic multipliers), and branches of orbits.
//!
//! On an orbit of the tooth period u = u_τ: the regenerative force vanishes, and the orbit solves an ordinary
//! differential equation under feed and edge forces. Its multipliers are those of the delay equation linearized about
//! it.
//!
//! With unequal pitch, or with runout, the orbit of a nonlinear structure has the period of the revolution. The
//! previously cut surface acts on it, and it solves the delay equation itself.

mod anderson;
mod branch;
mod choice;
mod collocated;
mod collocation_matrix;
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
