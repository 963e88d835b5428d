//! Floquet multipliers (characteristic multipliers) of methods with an explicit period map, along the axial depth.

use num_complex::Complex64;
use quietcut_numerics::Stop;
use quietcut_numerics::newton::Newton;

use super::along_depth::Spectrum;
use super::crossing::Crossing;
use super::krylov::{Dominant, LinearMap};
use super::stability_loss::StabilityLoss;
use crate::criteria::MAPPED;
use crate::error::{Breakdown, StabilityError};

/// Step in axial depth w of the difference quotient dμ/dw of a Floquet multiplier μ, as a share of the largest depth to
/// be computed, taken as at least 1e-9 m.
const DIFFERENCE: f64 = 1e-6;

/// Map over one period at one axial depth; its eigenvalues are the Floquet multipliers.
pub(crate) trait PeriodMap: LinearMap {
    /// Vibration frequency of a Floquet multiplier, Hz, from its eigenvector `vector` of the map; `None` if it cannot
    /// be computed.
    fn chatter_hz(&self, multiplier: Complex64, vector: &nalgebra::DVector<Complex64>) -> Option<f64>;
}

/// All Floquet multipliers μ of the period map at one axial depth with |μ| > `MAPPED`.
struct MultipliersAtDepth {
    depth_m: f64,
    dominant: Dominant,
    /// Floquet multipliers at the depth `depth_m` plus `MapSpectrum::step_m`, for the difference quotient dμ/dw; `None`
    /// until they have been computed.
    deeper: Option<Vec<Complex64>>,
}

/// Floquet multipliers of period maps at any axial depth: `map` returns the period map at a depth (m), `error` the
/// error estimate of a multiplier at a depth (m).
pub(crate) struct MapSpectrum<F, E> {
    map: F,
    error: E,
    /// Depth step of the difference quotient dμ/dw, m.
    step_m: f64,
    known: Option<MultipliersAtDepth>,
}

impl<M: PeriodMap, F: Fn(f64) -> Option<M>, E: Fn(Complex64, f64) -> Result<f64, StabilityError>>
    MapSpectrum<F, E>
{
    /// Floquet multipliers of period maps for axial depths up to `deepest_m`.
    pub(crate) fn new(deepest_m: f64, map: F, error: E) -> Self {
        Self {
            map,
            error,
            step_m: DIFFERENCE * deepest_m.max(1e-9),
            known: None,
        }
    }

    fn at(&mut self, depth_m: f64) -> Result<&mut MultipliersAtDepth, Breakdown> {
        if self.known.as_ref().is_none_or(|known| known.depth_m != depth_m) {
            self.known = Some(MultipliersAtDepth {
                depth_m,
                dominant: Dominant::of(&(self.map)(depth_m).ok_or(Breakdown::NoSolution)?, MAPPED)?,
                deeper: None,
            });
        }
        self.known.as_mut().ok_or(Breakdown::NoSolution)
    }

    /// Of the Floquet multipliers at an axial depth with |μ| > `MAPPED`, the one [`nearest`] to a guess; `None` if
    /// there is none of its kind, or if they cannot be computed.
    fn nearest(&mut self, guess: Complex64, depth_m: f64) -> Option<Complex64> {
        nearest(&self.at(depth_m).ok()?.dominant.eigenvalues, guess)
    }
}

/// Floquet multiplier of a list nearest to a guess: a real one for a real guess, a complex one for a complex guess;
/// `None` if the list has none of that kind.
pub(crate) fn nearest(multipliers: &[Complex64], guess: Complex64) -> Option<Complex64> {
    multipliers
        .iter()
        .copied()
        .filter(|multiplier| (multiplier.im == 0.0) == (guess.im == 0.0))
        .min_by(|p, q| (p - guess).norm().total_cmp(&(q - guess).norm()))
}

impl<M: PeriodMap, F: Fn(f64) -> Option<M>, E: Fn(Complex64, f64) -> Result<f64, StabilityError>> Spectrum
    for MapSpectrum<F, E>
{
    fn multipliers(&mut self, depth_m: f64) -> Result<Vec<Complex64>, Breakdown> {
        Ok(self.at(depth_m)?.dominant.eigenvalues.clone())
    }

    fn multiplier_near(&mut self, guess: Complex64, depth_m: f64, reach: f64) -> Option<Complex64> {
        self.nearest(guess, depth_m)
            .filter(|found| (found - guess).norm() < reach)
    }

    fn sensitivity(&mut self, multiplier: Complex64, depth_m: f64) -> Option<Complex64> {
        let step_m = self.step_m;
        let own = self.nearest(multiplier, depth_m)?;
        if self.at(depth_m).ok()?.deeper.is_none() {
            let deeper = Dominant::of(&(self.map)(depth_m + step_m)?, MAPPED)
                .ok()?
                .eigenvalues;
            self.at(depth_m).ok()?.deeper = Some(deeper);
        }
        let deeper = self.at(depth_m).ok()?.deeper.as_deref()?;
        // Two real multipliers may meet between the depths w and w + step and become a complex pair. If there is then
        // no real one at w + step, there is no derivative.
        Some((nearest(deeper, own)? - own) / step_m)
    }

    /// Newton's method in the axial depth for |μ| = 1 of one Floquet multiplier μ. The last step is not applied,
    /// because dμ/dw is a difference quotient: the crossing lies at the depth at which the multiplier was last
    /// computed.
    fn crossing_near(&mut self, guess: Crossing, low_m: f64, high_m: f64) -> Option<Crossing> {
        let margin_m = 0.5 * (high_m - low_m);
        let allowed_m = (low_m - margin_m).max(0.0)..=high_m + margin_m;
        let (mut expected, mut last) = (guess.multiplier, guess);
        // The unknown of Newton's method is the axial depth as a share of `high_m`.
        Newton::new(20, 1e-9)
            .with_least_size(1.0)
            .solve(guess.depth_m / high_m, |share: &f64| {
                let depth_m = share * high_m;
                if !allowed_m.contains(&depth_m) {
                    return Err(Stop::LeftDomain);
                }
                let multiplier = self.nearest(expected, depth_m).ok_or(Stop::GivenUp)?;
                let slope = self.sensitivity(multiplier, depth_m).ok_or(Stop::GivenUp)?;
                let outward = (multiplier.conj() * slope).re / multiplier.norm();
                let step_m = (1.0 - multiplier.norm()) / outward;
                last = Crossing { depth_m, multiplier };
                expected = multiplier + slope * step_m;
                Ok(-step_m / high_m)
            })
            .converged()?;
        let Crossing { depth_m, multiplier } = last;
        let on_circle = multiplier / multiplier.norm();
        (low_m..=high_m).contains(&depth_m).then_some(Crossing {
            depth_m,
            multiplier: match StabilityLoss::of(multiplier) {
                StabilityLoss::Hopf => Complex64::new(on_circle.re, on_circle.im.abs()),
                StabilityLoss::Flip | StabilityLoss::Fold => Complex64::from(on_circle.re.signum()),
            },
        })
    }

    fn chatter_hz(&self, crossing: &Crossing) -> Option<f64> {
        let map = (self.map)(crossing.depth_m)?;
        let dominant = Dominant::of(&map, MAPPED).ok()?;
        let multiplier = nearest(&dominant.eigenvalues, crossing.multiplier)?;
        map.chatter_hz(multiplier, &dominant.vector(multiplier)?)
    }

    fn error(&mut self, crossing: &Crossing) -> Result<f64, StabilityError> {
        (self.error)(crossing.multiplier, crossing.depth_m)
    }
}
