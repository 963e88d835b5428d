//! The largest multiplier from the characteristic function alone: roots by Newton, and none missed by a winding number.
//!
//! Where motions grow within a period by far more than over the whole of it, the map of the period is so far from normal that
//! rounding moves its eigenvalues, and where very many of them are of one size Krylov spaces do not settle. With z = 1/μ
//!
//!   G(z) = det(I − z Φ(w (1 − z)))
//!
//! is entire, a matter of n × n matrices, and its zeros are 1/μ of all multipliers. The mean of z G'/G over the circle of radius 1/R
//! is the number of multipliers beyond R.

use num_complex::Complex64;

use super::characteristic::{Characteristic, Workspace};
use crate::criteria::WOUND;

/// How far beyond [`WOUND`], or beyond the largest multiplier, it is shown that there is none, in turn.
const MARGINS: [f64; 5] = [2.8, 0.3, 0.05, 0.01, 2e-3];

/// The same while a verdict is not certain.
const FINE_MARGINS: [f64; 2] = [4e-4, 1e-4];

/// How many operations all evaluations together may take: seconds.
const OPERATIONS_MAX: f64 = 3e9;

/// The most points on half of a circle.
const POINTS_MAX: usize = 8192;

/// From so many candidates Newton begins.
const CANDIDATES_MAX: usize = 6;

/// The most multipliers that are looked for one by one.
const ROOTS_MAX: usize = 12;

/// The largest multiplier found, and a radius beyond which there is none.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beyond {
    /// The largest that was found, if it is larger than [`WOUND`]; of a pair the upper one.
    pub(crate) multiplier: Option<Complex64>,
    /// No multiplier is larger than this; infinite where that could not be shown.
    pub(crate) radius: f64,
}

/// A characteristic function with what may still be spent on it.
pub(crate) struct Search<'a> {
    characteristic: &'a Characteristic,
    depth_m: f64,
    work: Workspace,
    evaluations_left: usize,
}

impl<'a> Search<'a> {
    /// At a depth, m; the characteristic must be one for five times that.
    pub(crate) fn new(characteristic: &'a Characteristic, depth_m: f64) -> Self {
        Self {
            characteristic,
            depth_m,
            work: characteristic.workspace(),
            evaluations_left: (OPERATIONS_MAX / characteristic.operations()) as usize,
        }
    }

    /// z G'/G at z; `None` on a zero, or where nothing finite comes out or nothing may be spent.
    fn slope(&mut self, z: Complex64) -> Option<Complex64> {
        self.evaluations_left = self.evaluations_left.checked_sub(1)?;
        let multiplier = z.inv();
        let found = self
            .characteristic
            .logarithmic(multiplier, self.depth_m, &mut self.work)?;
        // G(z) = (−z)ⁿ F(1/z)
        let slope = self.characteristic.order() as f64 - multiplier * found.by_multiplier;
        slope.is_finite().then_some(slope)
    }

    /// How many multipliers are larger than a radius; `None` where one is so near to it that the points allowed do not tell.
    pub(crate) fn count_beyond(&mut self, radius: f64) -> Option<usize> {
        use std::f64::consts::PI;
        let at = |angle: f64| Complex64::from_polar(radius.recip(), angle);
        // Values at conjugate points are conjugate: half of the circle will do.
        let mut points = 8;
        let mut sum = 0.5 * (self.slope(at(0.0))?.re + self.slope(at(PI))?.re);
        for i in 1..points {
            sum += self.slope(at(PI * i as f64 / points as f64))?.re;
        }
        let (mut last, mut before) = (f64::INFINITY, f64::INFINITY);
        while points <= POINTS_MAX {
            let mean = sum / points as f64;
            let whole = mean.round();
            // Errors fall as a power of the number of points: three rounds near the same whole number have arrived.
            if (mean - whole).abs() < 0.02 && (last - whole).abs() < 0.1 && (before - whole).abs() < 0.4 {
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

    /// A multiplier beyond a radius that is none of those known, by Newton with these divided out.
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

    /// The multiplier to which Newton leads from z = `start`.
    fn newton(&mut self, start: Complex64, known: &[Complex64]) -> Option<Complex64> {
        let mut z = start;
        for _ in 0..15 {
            let mut slope = self.slope(z)?;
            for known in known {
                let zero = known.inv();
                slope -= z / (z - zero);
                if known.im != 0.0 {
                    slope -= z / (z - zero.conj());
                }
            }
            let step = -z / slope;
            z += step;
            // Beyond, the polynomials of the elements are not good.
            if !z.is_finite() || z.norm() > WOUND.recip() {
                return None;
            }
            if step.norm() < 1e-9 * z.norm() {
                let multiplier = z.inv();
                let is_real = multiplier.im.abs() < 1e-7 * multiplier.norm();
                let im = if is_real { 0.0 } else { multiplier.im.abs() };
                return Some(Complex64::new(multiplier.re, im));
            }
        }
        None
    }

    /// The largest multiplier, and a radius beyond which there is none; `candidates` are where Newton may begin.
    pub(crate) fn largest(&mut self, candidates: &[Complex64]) -> Beyond {
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
            // A multiplier outside is enough, and so is a radius inside.
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
        Beyond {
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

    /// All multipliers of the collocated map, by the QR iteration, against zeros of G.
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
                    // Next to a multiplier the points allowed do not tell.
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
                // The map is good to 1e-9, the last margin 2e-3 or better.
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
        // Not always the same: none, and several.
        assert!(numbers.contains(&0) && numbers.len() >= 3, "{numbers:?}");
    }
}
