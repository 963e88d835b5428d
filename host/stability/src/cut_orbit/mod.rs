//! Forced periodic orbits of a cut over one revolution, exact for teeth that enter, leave and lose contact, with
//! derivatives with respect to parameters.
//!
//! | file | content |
//! |---|---|
//! | `model` | structure, restoring forces and tool at one speed |
//! | `mesh` | subintervals of a revolution |
//! | `propagator`, `response` | motion of the linear structure under given forces |
//! | `motion` | outputs over a revolution |
//! | `law` | forces at one instant |
//! | `events` | loss of contact, surfaces, stick |
//! | `period` | forces along the motion |
//! | `newton`, `jumps` | the equations, with the instants at which forces jump |
//! | `states` | internal states along a known motion |
//! | `orbit` | the orbit |
//! | `sensitivity` | derivatives with respect to parameters |
//! | `harmonics` | Fourier coefficients of the forces |

mod events;
mod harmonics;
mod jumps;
mod law;
mod mesh;
mod model;
mod motion;
mod newton;
mod orbit;
mod period;
mod propagator;
mod response;
mod sensitivity;
mod states;
#[cfg(test)]
mod tests;

pub use harmonics::{ForceOrders, OrderWeights};
pub use model::CutModel;
pub use orbit::{CutOrbit, CutOrbitError};
pub use sensitivity::Sensitivity;
