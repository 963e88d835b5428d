//! Curves of stability losses over two parameters: torus, flip and fold of forced orbits.
//!
//! A stability loss of a branch, followed in a second parameter, is a curve in the plane of both. The unknowns are the
//! orbit and its critical Floquet mode together (extended system; for delay equations Engelborghs, Luzyanina, Roose:
//! ACM Trans. Math. Softw. 28 (2002) 1, for its regularity Kuznetsov: *Elements of Applied Bifurcation Theory*,
//! section 10.3). Since the delay equals the tooth period, the mode solves an ordinary differential equation.
//!
//! The period is that of the teeth, not of the revolution. A flip is a multiplier of −1 here; over the revolution of a
//! tool with an even number of teeth it would be +1.

mod criteria;
mod doubles;
mod error;
mod extended;
mod follow;
mod mode;
mod newton;
mod points;
mod start;

#[cfg(test)]
mod brute_force_tests;
#[cfg(test)]
mod cost_tests;
#[cfg(test)]
pub(super) mod tests;

pub use error::CurveError;
pub use follow::follow_curve;
pub use points::{
    Curve, CurveEnd, CurveJournal, CurvePoint, CurveRecord, CurveSeed, DoubleLoss, NoJournal, Plane,
    Resonance,
};
