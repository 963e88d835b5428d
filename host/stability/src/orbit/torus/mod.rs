//! Tori beyond a torus bifurcation: the vibration of developed chatter as an invariant closed curve of the stroboscopic
//! map, with loss of contact.
//!
//! Beyond the loss the motion has two angles: that of the tooth period and θ, which advances by ρ over each tooth period.
//! The delay is the tooth period, so that the motion of earlier passings is that of other angles at the same time t:
//!
//!   u(t − pT) = u(t, θ − pρ).
//!
//! A torus solves an ordinary differential equation over one tooth period, in which all angles are coupled:
//!
//!   ẋ(t, θ) = A x − N(x) + B w Σ_teeth cutting·max(0, h),   x(T, θ) = x(0, θ + ρ),
//!   h(t, θ) = min_p [n·(u(t, θ) − u(t, θ − pρ)) + p n_x f],   p = 1, 2, …,
//!
//! in the symbols of [`ForcedProblem`](super::ForcedProblem). The minimum over the passings p is the surface that they all
//! left: a tooth that missed the workpiece left the surface of the passing before it (thesis eqs 6.20 to 6.24 with exact
//! contact). The motion is a Fourier polynomial in θ, collocated at equidistant angles.
//!
//! The branch is followed from the bifurcation by pseudo-arclength in depth, through folds. Where the vibration locks to a
//! rational rotation, no smooth torus need exist; the branch then ends, or passes a narrow tongue without a trace.
//!
//! Source of the method: Schilder, Osinga, Vogt, *Continuation of quasi-periodic invariant tori*, SIAM J. Appl. Dyn. Syst. 4
//! (2005), for ordinary differential equations; the delay equal to the period brings the delay equation to that form. Chip
//! thickness over earlier passings: Tlusty, Ismail, *Basic non-linearity in machining chatter*, CIRP Annals 30 (1981).

mod branch;
mod circle;
mod corrector;
mod motion;
mod period;
mod start;

#[cfg(test)]
mod tests;

pub use branch::{TorusBranch, TorusEnd, TorusPoint, follow_torus};
