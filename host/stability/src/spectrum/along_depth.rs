//! Interface of a method to follow Floquet multipliers (characteristic multipliers) along the axial depth.

use num_complex::Complex64;

use super::crossing::Crossing;
use super::root::Root;
use crate::error::{Breakdown, StabilityError};

/// Floquet multipliers of one method at one spindle speed, as functions of the axial depth.
pub(crate) trait Spectrum {
    /// All multipliers at an axial depth (m) above a size that the method sets, and possibly smaller ones, largest
    /// first; complex ones in exact conjugate pairs.
    ///
    /// # Errors
    /// The equations have no finite solution, or the eigenvalues cannot be computed.
    fn multipliers(&mut self, depth_m: f64) -> Result<Vec<Complex64>, Breakdown>;

    /// Floquet multiplier near a guess at an axial depth (m), to the accuracy of the method; a real guess gives a real
    /// multiplier.
    ///
    /// `None` if no multiplier is found within the distance `reach` of the guess.
    fn multiplier_near(&mut self, guess: Complex64, depth_m: f64, reach: f64) -> Option<Complex64>;

    /// Derivative dμ/dw of a Floquet multiplier μ over the axial depth w, 1/m, along its branch through (μ, w); `None`
    /// if it cannot be computed.
    fn sensitivity(&mut self, multiplier: Complex64, depth_m: f64) -> Option<Complex64>;

    /// Floquet multiplier near a guess, with its derivative dμ/dw; a real guess gives a real multiplier.
    ///
    /// The guess must be correct to about 1e-4. The error of the result is about the square of that, plus the error of
    /// the discretized equations. `None` if no multiplier is found near the guess (here within 5 % of |guess|), or if
    /// it has no derivative.
    fn root_near(&mut self, guess: Complex64, depth_m: f64) -> Option<Root> {
        let multiplier = self.multiplier_near(guess, depth_m, 0.05 * guess.norm())?;
        let slope = self.sensitivity(multiplier, depth_m)?;
        Some(Root { multiplier, slope })
    }

    /// Floquet multiplier near a guess, with an error of about the square of that of the guess, or a smaller one; a
    /// real guess gives a real multiplier.
    ///
    /// `None` if no multiplier is found within 5 % of |guess|.
    fn corrected(&mut self, guess: Complex64, depth_m: f64) -> Option<Complex64> {
        self.multiplier_near(guess, depth_m, 0.05 * guess.norm())
    }

    /// Crossing of the unit circle by a multiplier near a guess, at an axial depth between `low_m` and `high_m`.
    fn crossing_near(&mut self, guess: Crossing, low_m: f64, high_m: f64) -> Option<Crossing>;

    /// Chatter frequency at a crossing of the unit circle by a multiplier, Hz; `None` if it cannot be computed.
    fn chatter_hz(&self, crossing: &Crossing) -> Option<f64>;

    /// Error estimate of the multiplier at a crossing, as an absolute value.
    ///
    /// # Errors
    /// The computation on a finer mesh fails, or finds no multiplier near that of the crossing.
    fn error(&mut self, crossing: &Crossing) -> Result<f64, StabilityError>;
}
