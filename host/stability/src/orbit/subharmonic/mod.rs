//! Subharmonic orbits: vibrations of q tooth periods, such as the period-doubled one (q = 2) that begins at a flip.
//!
//! The delay is the tooth period T. With x_k the motion over the k-th tooth period, x_k(t) = x(t + kT) for 0 ≤ t ≤ T and
//! k = 0…q−1, the delayed motion of x_k is x_{k−1}, and that of x_0 is x_{q−1}. A subharmonic orbit therefore solves an
//! ordinary differential equation of q times as many states over one tooth period,
//!
//!   ẋ_k = f(t, x_k) + w R(t) (x_k − x_{k−1}),   x_k(T) = x_{k+1}(0),
//!
//! with indices modulo q, f the equation of the forced orbit, w the axial depth and R = B Σ_teeth cutting·nᵀ C per depth.
//! Where all x_k are equal it is that of the forced orbit. Its Floquet multipliers (characteristic multipliers) over q
//! tooth periods are those of the product of the maps over each tooth period, linearized about x_k.
//!
//! All teeth are taken to stay in contact, as in stability limits; the smallest chip thickness on an orbit says whether
//! they do.

mod branch;
mod period;
mod start;

#[cfg(test)]
mod tests;

pub use branch::{BrokenDoubledBranch, DoubledBranch, DoubledPoint, follow_doubled};
