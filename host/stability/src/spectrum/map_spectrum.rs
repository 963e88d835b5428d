//! Multipliers of methods that have a map over one period, along the depth.

use num_complex::Complex64;

use super::along_depth::Spectrum;
use super::crossing::Crossing;
use super::krylov::{Dominant, LinearMap};
use super::stability_loss::StabilityLoss;
use crate::criteria::MAPPED;

/// Share of the largest depth over which a difference stands for the derivative: its error, and that of multipliers
/// divided by it, are then both near 1e-6, and slopes are used as predictions only.
const DIFFERENCE: f64 = 1e-6;

/// The map over one period at one depth: its eigenvalues are the multipliers.
pub(crate) trait PeriodMap: LinearMap {
    /// The frequency, Hz, of the vibration of a multiplier, from its eigenvector.
    fn chatter_hz(&self, multiplier: Complex64, vector: &nalgebra::DVector<Complex64>) -> Option<f64>;
}

/// All multipliers of the map at one depth.
struct Known {
    depth_m: f64,
    dominant: Dominant,
    /// The multipliers a little deeper.
    beside: Option<Vec<Complex64>>,
}

/// The multipliers of maps at any depth; `map` makes that of a depth, m, and `error` says how far a multiplier at a depth, m,
/// may be off.
pub(crate) struct MapSpectrum<F, E> {
    map: F,
    error: E,
    /// The step for differences, m.
    step_m: f64,
    known: Option<Known>,
}

impl<M: PeriodMap, F: Fn(f64) -> Option<M>, E: Fn(Complex64, f64) -> Option<f64>> MapSpectrum<F, E> {
    /// For depths up to `deepest_m`.
    pub(crate) fn new(deepest_m: f64, map: F, error: E) -> Self {
        Self {
            map,
            error,
            step_m: DIFFERENCE * deepest_m.max(1e-9),
            known: None,
        }
    }

    fn at(&mut self, depth_m: f64) -> Option<&mut Known> {
        if self.known.as_ref().is_none_or(|known| known.depth_m != depth_m) {
            self.known = Some(Known {
                depth_m,
                dominant: Dominant::of(&(self.map)(depth_m)?, MAPPED)?,
                beside: None,
            });
        }
        self.known.as_mut()
    }

    /// The multiplier nearest to a guess, real ones for real guesses.
    fn nearest(&mut self, guess: Complex64, depth_m: f64) -> Option<Complex64> {
        nearest(&self.at(depth_m)?.dominant.eigenvalues, guess)
    }
}

/// The nearest to a guess, real ones for real guesses.
pub(crate) fn nearest(multipliers: &[Complex64], guess: Complex64) -> Option<Complex64> {
    multipliers
        .iter()
        .copied()
        .filter(|multiplier| (multiplier.im == 0.0) == (guess.im == 0.0))
        .min_by(|p, q| (p - guess).norm().total_cmp(&(q - guess).norm()))
}

impl<M: PeriodMap, F: Fn(f64) -> Option<M>, E: Fn(Complex64, f64) -> Option<f64>> Spectrum
    for MapSpectrum<F, E>
{
    fn multipliers(&mut self, depth_m: f64) -> Option<Vec<Complex64>> {
        Some(self.at(depth_m)?.dominant.eigenvalues.clone())
    }

    fn multiplier_near(&mut self, guess: Complex64, depth_m: f64, reach: f64) -> Option<Complex64> {
        self.nearest(guess, depth_m)
            .filter(|found| (found - guess).norm() < reach)
    }

    fn sensitivity(&mut self, multiplier: Complex64, depth_m: f64) -> Option<Complex64> {
        let step_m = self.step_m;
        let own = self.nearest(multiplier, depth_m)?;
        if self.at(depth_m)?.beside.is_none() {
            let beside = Dominant::of(&(self.map)(depth_m + step_m)?, MAPPED)?.eigenvalues;
            self.at(depth_m)?.beside = Some(beside);
        }
        let beside = self.at(depth_m)?.beside.as_deref()?;
        // Where two real ones meet between both depths there is no derivative.
        Some((nearest(beside, own)? - own) / step_m)
    }

    fn crossing_near(&mut self, guess: Crossing, low_m: f64, high_m: f64) -> Option<Crossing> {
        let (mut depth_m, mut expected) = (guess.depth_m, guess.multiplier);
        // Newton on |μ| = 1 along the branch.
        for _ in 0..20 {
            let multiplier = self.nearest(expected, depth_m)?;
            let slope = self.sensitivity(multiplier, depth_m)?;
            let outward = (multiplier.conj() * slope).re / multiplier.norm();
            let step_m = (1.0 - multiplier.norm()) / outward;
            if !step_m.is_finite() {
                return None;
            }
            if step_m.abs() < 1e-9 * high_m {
                let kind = StabilityLoss::of(multiplier);
                let on_circle = multiplier / multiplier.norm();
                return (low_m..=high_m).contains(&depth_m).then_some(Crossing {
                    depth_m,
                    multiplier: match kind {
                        StabilityLoss::Hopf => Complex64::new(on_circle.re, on_circle.im.abs()),
                        StabilityLoss::Flip | StabilityLoss::Fold => Complex64::from(on_circle.re.signum()),
                    },
                });
            }
            expected = multiplier + slope * step_m;
            depth_m += step_m;
            let margin_m = 0.5 * (high_m - low_m);
            if !(low_m - margin_m..=high_m + margin_m).contains(&depth_m) || depth_m < 0.0 {
                return None;
            }
        }
        None
    }

    fn chatter_hz(&self, crossing: &Crossing) -> Option<f64> {
        let map = (self.map)(crossing.depth_m)?;
        let dominant = Dominant::of(&map, MAPPED)?;
        let multiplier = nearest(&dominant.eigenvalues, crossing.multiplier)?;
        map.chatter_hz(multiplier, &dominant.vector(multiplier)?)
    }

    fn error(&mut self, crossing: &Crossing) -> Option<f64> {
        (self.error)(crossing.multiplier, crossing.depth_m)
    }
}
