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
mod branch_record;
mod branches;
mod choice;
mod coefficients;
mod collocated;
mod collocation_matrix;
mod criticality;
mod crossing;
pub mod curve;
mod equivalent;
mod explicit;
mod follower;
mod forced;
mod forced_at;
mod forced_method;
mod pairing;
mod parameter;
mod periodic_orbit;
mod ports;
mod restoring;
mod resumed_branch;
mod revolution_period;
mod subharmonic;
mod tooth_period;
mod tooth_period_map;
mod torus;
mod variation;
mod varied_period;

#[cfg(test)]
mod coefficients_tests;
#[cfg(test)]
mod follower_tests;
#[cfg(test)]
mod revolution_period_tests;

pub use branch::{Branch, BranchPoint, BrokenBranch, Event, Extent};
pub use branch_record::{BranchJournal, BranchRecord, Unrecorded};
pub use branches::{follow, follow_depth, follow_recorded};
pub use choice::collocation_of;
pub use coefficients::{Coefficients, Smoothing};
pub use criticality::{Criticality, criticality};
pub use equivalent::EquivalentProblem;
pub use forced::ForcedProblem;
pub use parameter::{Parameter, Place, Setting};
pub use periodic_orbit::{Orbit, OrbitError};
pub use subharmonic::{BrokenDoubledBranch, DoubledBranch, DoubledPoint, follow_doubled};
pub use torus::{TorusBranch, TorusEnd, TorusPoint, follow_torus};
