//! Largest Floquet multiplier (characteristic multiplier) from the characteristic function alone: roots by Newton's
//! method, completeness by a winding number.
//!
//! The period map fails in two cases. If motions grow within a period by far more than over the whole of it, the map is
//! so non-normal that rounding moves its eigenvalues. If very many eigenvalues have nearly the same absolute value,
//! Krylov spaces do not converge. With z = 1/μ
//!
//!   G(z) = det(I − z Φ(w (1 − z)))
//!
//! is an entire function of z, computed from n × n matrices. Its zeros are 1/μ of all multipliers μ ≠ 0. The mean of z
//! G'/G over the circle of radius 1/R is the number of multipliers with |μ| > R.

use num_complex::Complex64;
use quietcut_numerics::Stop;
use quietcut_numerics::newton::Newton;

use super::characteristic::{Characteristic, Workspace};
use crate::criteria::{FINE_MARGINS, MARGINS, WINDING_ERRORS, WOUND};

/// Largest estimated number of floating-point operations of all evaluations of the characteristic function in one
/// search: a few seconds. A choice.
const OPERATIONS_MAX: f64 = 3e9;

/// Largest number of equal steps along half of a circle from whose points a winding number is taken: a limit on
/// computing time.
const POINTS_MAX: usize = 8192;

/// Largest number of given candidate multipliers from which Newton's method starts: a limit on computing time.
const CANDIDATES_MAX: usize = 6;

/// Largest number of known multipliers that a search by winding number deflates to find a larger one: a limit on
/// computing time.
const ROOTS_MAX: usize = 12;

/// Largest Floquet multiplier that a search has found, and the radius beyond which the winding number counts none.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LargestMultiplier {
    /// Largest Floquet multiplier found, of a conjugate pair the upper one; `None` if none with |μ| of at least
    /// [`WOUND`] was found.
    pub(crate) multiplier: Option<Complex64>,
    /// Radius about 0 in the plane of the multipliers beyond which the winding number counts no multiplier; infinite if
    /// no count gives zero.
    pub(crate) radius: f64,
}

/// Search for the largest Floquet multiplier with a limited number of evaluations of the characteristic function.
pub(crate) struct Search<'a> {
    characteristic: &'a Characteristic,
    depth_m: f64,
    work: Workspace,
    evaluations_left: usize,
}

impl<'a> Search<'a> {
    /// Search for the largest multiplier at an axial depth, m; the characteristic matrix must be valid for complex
    /// depths with absolute values of up to five times that depth.
    pub(crate) fn new(characteristic: &'a Characteristic, depth_m: f64) -> Self {
        Self {
            characteristic,
            depth_m,
            work: characteristic.workspace(),
            evaluations_left: (OPERATIONS_MAX / characteristic.operations()) as usize,
        }
    }

    /// Logarithmic derivative z G'/G at z of the characteristic function G(z) = det(I − z Φ(w (1 − z))); `None` at a
    /// zero of G, if the result is not finite, or if no evaluations are left.
    fn slope(&mut self, z: Complex64) -> Option<Complex64> {
        self.evaluations_left = self.evaluations_left.checked_sub(1)?;
        let multiplier = z.inv();
        let found = self
            .characteristic
            .logarithmic(multiplier, self.depth_m, &mut self.work)?;
        // G(z) = (−z)ⁿ F(1/z) with F(μ) = det(Φ − μ I), whose logarithmic derivative ∂ ln F/∂μ is `by_multiplier`.
        let slope = self.characteristic.order() as f64 - multiplier * found.by_multiplier;
        slope.is_finite().then_some(slope)
    }

    /// Number of Floquet multipliers with |μ| larger than `radius`; `None` if the winding number does not converge (a
    /// multiplier lies too close to the circle |μ| = `radius`) or is negative, or if [`slope()`](Self::slope) has no
    /// value at one of the points.
    pub(crate) fn count_beyond(&mut self, radius: f64) -> Option<usize> {
        use std::f64::consts::PI;
        let at = |angle: f64| Complex64::from_polar(radius.recip(), angle);
        // The logarithmic derivative is conjugate at conjugate points, so that half of the circle suffices.
        let mut points = 8;
        let mut sum = 0.5 * (self.slope(at(0.0))?.re + self.slope(at(PI))?.re);
        for i in 1..points {
            sum += self.slope(at(PI * i as f64 / points as f64))?.re;
        }
        let (mut last, mut before) = (f64::INFINITY, f64::INFINITY);
        while points <= POINTS_MAX {
            let mean = sum / points as f64;
            let whole = mean.round();
            // Once the points resolve the zero nearest to the circle, each doubling of their number squares the error
            // of the mean. Three successive means close to the same integer are therefore taken as converged.
            let errors = [mean, last, before].map(|mean| (mean - whole).abs());
            if errors
                .iter()
                .zip(WINDING_ERRORS)
                .all(|(error, most)| *error < most)
            {
                return (whole >= 0.0).then_some(whole as usize);
            }
            (before, last) = (last, mean);
            for i in 0..points {
                sum += self.slope(at(PI * (i as f64 + 0.5) / points as f64))?.re;
            }
            points *= 2;
        }
        None
    }

    /// Floquet multiplier with |μ| larger than `radius` that is not among the `known` ones, by Newton's method with the
    /// known ones deflated; `None` if none of the starting values leads to one.
    fn another_beyond(&mut self, radius: f64, known: &[Complex64]) -> Option<Complex64> {
        const ANGLES: usize = 6;
        for share in [0.95, 0.7, 0.3] {
            for i in 0..ANGLES {
                let angle = std::f64::consts::PI * (i as f64 + 0.25) / ANGLES as f64;
                let start = Complex64::from_polar(share / radius, angle);
                if let Some(found) = self.newton(start, known)
                    && found.norm() > radius
                {
                    return Some(found);
                }
            }
        }
        None
    }

    /// Floquet multiplier μ = 1/z to which Newton's method converges from z = `start`, with the `known` multipliers
    /// deflated; of a conjugate pair the upper one. `None` without convergence, or if |μ| is below [`WOUND`].
    fn newton(&mut self, start: Complex64, known: &[Complex64]) -> Option<Complex64> {
        // The polynomials of the elements in the complex depth w (1 − z) are made for |z| up to 1/`WOUND`.
        let is_valid = |z: Complex64| z.is_finite() && z.norm() <= WOUND.recip();
        let found = Newton::new(15, 1e-9).solve(start, |&z: &Complex64| {
            if z != start && !is_valid(z) {
                return Err(Stop::LeftDomain);
            }
            let mut slope = self.slope(z).ok_or(Stop::LeftDomain)?;
            for known in known {
                let zero = known.inv();
                slope -= z / (z - zero);
                if known.im != 0.0 {
                    slope -= z / (z - zero.conj());
                }
            }
            Ok(z / slope)
        });
        let multiplier = found.converged().filter(|z| is_valid(*z))?.inv();
        let is_real = multiplier.im.abs() < 1e-7 * multiplier.norm();
        let im = if is_real { 0.0 } else { multiplier.im.abs() };
        Some(Complex64::new(multiplier.re, im))
    }

    /// Largest Floquet multiplier found, and the radius beyond which the winding number counts none. `candidates` are
    /// approximate multipliers from which Newton's method starts: the first `CANDIDATES_MAX` of those with |μ| above
    /// [`WOUND`] that lie on the real axis or above it.
    pub(crate) fn largest(&mut self, candidates: &[Complex64]) -> LargestMultiplier {
        let mut known: Vec<Complex64> = Vec::new();
        let mut best: Option<Complex64> = None;
        let is_large = |candidate: &&Complex64| candidate.norm() > WOUND && candidate.im >= 0.0;
        for candidate in candidates.iter().filter(is_large).take(CANDIDATES_MAX) {
            if let Some(found) = self.newton(candidate.inv(), &[])
                && best.is_none_or(|best| found.norm() > best.norm())
            {
                best = Some(found);
            }
        }
        let mut radius = f64::INFINITY;
        for margin in MARGINS.into_iter().chain(FINE_MARGINS) {
            // A multiplier outside the unit circle, or a radius below 1 beyond which no multiplier lies, decides the
            // verdict on the cut; the finer margins are then not needed.
            let is_decided = radius < 1.0 || best.is_some_and(|best| best.norm() > 1.0);
            if FINE_MARGINS.contains(&margin) && is_decided {
                break;
            }
            loop {
                let at = best.map_or(WOUND, |best| best.norm()) * (1.0 + margin);
                match self.count_beyond(at) {
                    Some(0) => radius = at,
                    Some(_) if known.len() < ROOTS_MAX => {
                        known.extend(best);
                        if let Some(found) = self.another_beyond(at, &known) {
                            best = Some(found);
                            continue;
                        }
                    }
                    _ => {}
                }
                break;
            }
        }
        LargestMultiplier {
            multiplier: best,
            radius,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::period::{Period, Resolution};
    use crate::spectrum::period_map;
    use crate::tests::problem;

    /// Reference: all multipliers of the collocated map, by QR iteration, against zeros of G.
    #[test]
    fn counts_and_the_largest_multiplier_are_those_of_the_whole_map() {
        let mut numbers = std::collections::BTreeSet::new();
        for (name, rpm) in [("insperger-2dof-ad0.5", 6000.0), ("kuka-kr90-acetal", 900.0)] {
            for depth_mm in [0.1, 1.0, 4.0] {
                let (problem, depth_m) = (problem(name), depth_mm * 1e-3);
                let kappa_m = (1.0 + WOUND.recip()) * depth_m;
                let period = Period::new(&problem, rpm, kappa_m, Resolution::WORKING);
                let all = period_map::multipliers(&period, depth_m).unwrap();
                let characteristic = Characteristic::new(&period, kappa_m);
                let mut search = Search::new(&characteristic, depth_m);
                for radius in [0.3, 0.5, 0.8, 1.1] {
                    // Skips circles so close to a multiplier that the allowed points do not resolve it.
                    if all
                        .iter()
                        .any(|multiplier| (multiplier.norm() / radius - 1.0).abs() < 0.01)
                    {
                        continue;
                    }
                    let count = all.iter().filter(|multiplier| multiplier.norm() > radius).count();
                    assert_eq!(
                        search.count_beyond(radius),
                        Some(count),
                        "{name} {depth_mm} {radius} {all:?}"
                    );
                    numbers.insert(count);
                }
                let beyond = search.largest(&[]);
                let largest = all[0].norm();
                // Tolerances: the map is accurate to 1e-9, the last margin is at most 2e-3.
                match beyond.multiplier {
                    Some(found) => assert!((found.norm() - largest).abs() < 1e-8, "{beyond:?} {largest}"),
                    None => assert!(largest < WOUND * 1.05),
                }
                assert!(
                    largest <= beyond.radius && beyond.radius < 1.003 * largest.max(WOUND),
                    "{beyond:?} {largest}"
                );
            }
        }
        // The test covers different counts: none, and several multipliers.
        assert!(numbers.contains(&0) && numbers.len() >= 3, "{numbers:?}");
    }
}
