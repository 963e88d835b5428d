//! The interface through which multipliers are followed along the depth.

use num_complex::Complex64;

use super::crossing::Crossing;
use super::root::Root;

/// The multipliers of one method at one speed, as functions of depth.
pub(crate) trait Spectrum {
    /// All multipliers at a depth, m, that may come near the unit circle, largest first; complex ones in exact pairs.
    ///
    /// `None` where the equations have no finite solution.
    fn multipliers(&mut self, depth_m: f64) -> Option<Vec<Complex64>>;

    /// The multiplier near a guess to rounding; real guesses stay real.
    ///
    /// `None` where there is none within `reach` of it.
    fn multiplier_near(&mut self, guess: Complex64, depth_m: f64, reach: f64) -> Option<Complex64>;

    /// dμ/dw, 1/m, along the branch of multipliers through (μ, w).
    fn sensitivity(&mut self, multiplier: Complex64, depth_m: f64) -> Option<Complex64>;

    /// A multiplier near a guess that is good to about 1e-4, with its derivative; real guesses stay real.
    ///
    /// What is left of the error is its square, and that of the equations. `None` where there is none.
    fn root_near(&mut self, guess: Complex64, depth_m: f64) -> Option<Root> {
        let multiplier = self.multiplier_near(guess, depth_m, 0.05 * guess.norm())?;
        let slope = self.sensitivity(multiplier, depth_m)?;
        Some(Root { multiplier, slope })
    }

    /// The depth between `low_m` and `high_m` where the multiplier of the guess crosses the unit circle.
    fn crossing_near(&mut self, guess: Crossing, low_m: f64, high_m: f64) -> Option<Crossing>;

    /// The frequency of the vibration that is born or dies at a crossing, Hz.
    fn chatter_hz(&self, crossing: &Crossing) -> Option<f64>;

    /// An estimate of |error| of the multiplier of a crossing; `None` where a finer computation does not know it.
    fn error(&mut self, crossing: &Crossing) -> Option<f64>;
}
