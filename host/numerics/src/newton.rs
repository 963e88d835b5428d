//! Newton's method x ← x − J⁻¹ r(x) for r(x) = 0, with an optional bound on the growth of its steps and the reason to
//! stop.
//!
//! The caller computes the step J⁻¹ r by a method of its choice: a quotient, an LU decomposition or an iterative
//! solver. [`Newton`] limits the step and tests it for convergence, in the same way for numbers and vectors.

use nalgebra::DVector;
use num_complex::Complex64;

use crate::stop::Stop;

/// An unknown of Newton's method: a real or complex number, or a vector.
pub trait Unknown {
    /// Absolute value of a number, or Euclidean norm of a vector.
    fn size(&self) -> f64;

    /// Subtracts the fraction `share` of `step` from this unknown x: x ← x − `share` · `step`.
    fn subtract(&mut self, share: f64, step: &Self);
}

impl Unknown for f64 {
    fn size(&self) -> f64 {
        self.abs()
    }

    fn subtract(&mut self, share: f64, step: &Self) {
        *self -= share * step;
    }
}

impl Unknown for Complex64 {
    fn size(&self) -> f64 {
        self.norm()
    }

    fn subtract(&mut self, share: f64, step: &Self) {
        *self -= step * share;
    }
}

impl Unknown for DVector<f64> {
    fn size(&self) -> f64 {
        self.norm()
    }

    fn subtract(&mut self, share: f64, step: &Self) {
        self.axpy(-share, step, 1.0);
    }
}

impl Unknown for Vec<f64> {
    fn size(&self) -> f64 {
        self.iter().map(|x| x * x).sum::<f64>().sqrt()
    }

    fn subtract(&mut self, share: f64, step: &Self) {
        for (x, step) in self.iter_mut().zip(step) {
            *x -= share * step;
        }
    }
}

/// Newton's method with a bound on the number of its steps and an optional one on their growth.
///
/// ```
/// use quietcut_numerics::Stop;
/// use quietcut_numerics::newton::Newton;
///
/// // x² = 2.
/// let root = Newton::new(20, 1e-9).solve(1.0, |x: &f64| Ok((x * x - 2.0) / (2.0 * x)));
/// assert_eq!(root.stop, Stop::Converged);
/// assert!((root.x - 2.0_f64.sqrt()).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Newton {
    iterations_max: usize,
    tolerance: f64,
    growth: f64,
    least_size: f64,
}

/// The unknown x at which Newton's method stopped, and the reason for the stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Root<X> {
    /// Unknown x after the last step.
    pub x: X,
    /// Reason for which the iteration stopped.
    pub stop: Stop,
    /// Number of Newton steps that were computed.
    pub iterations: usize,
}

impl<X> Root<X> {
    /// The unknown x if the iteration has converged, otherwise `None`.
    pub fn converged(self) -> Option<X> {
        (self.stop == Stop::Converged).then_some(self.x)
    }
}

impl Newton {
    /// Newton's method with full steps, until ‖step‖ ≤ `tolerance` · ‖x‖ or after `iterations_max` steps.
    ///
    /// Near a simple root convergence is quadratic: the step after one of 1e-9 · ‖x‖ is usually below rounding.
    pub fn new(iterations_max: usize, tolerance: f64) -> Self {
        Self {
            iterations_max,
            tolerance,
            growth: f64::INFINITY,
            least_size: f64::MIN_POSITIVE,
        }
    }

    /// Sets the smallest ‖x‖ that the tolerance refers to, for unknowns whose root may lie at or near zero: the search
    /// converges at ‖step‖ ≤ tolerance · max(‖x‖, `size`).
    #[must_use]
    pub fn with_least_size(self, size: f64) -> Self {
        Self {
            least_size: size,
            ..self
        }
    }

    /// Limits each step but the first and that which meets the tolerance to `factor` times the length of the preceding
    /// step, as it was applied. This keeps Newton's method from jumping to a distant solution.
    #[must_use]
    pub fn with_growth(self, factor: f64) -> Self {
        Self {
            growth: factor,
            ..self
        }
    }

    /// Searches the root of r(x) = 0 near `start`; `step` returns the Newton step J⁻¹ r at a given x, or the reason for
    /// which it cannot be computed.
    ///
    /// The search always ends; [`Root::stop`] states the reason. The step that meets the tolerance is applied in full.
    pub fn solve<X: Unknown>(&self, start: X, mut step: impl FnMut(&X) -> Result<X, Stop>) -> Root<X> {
        let mut root = Root {
            x: start,
            stop: Stop::Iterations,
            iterations: 0,
        };
        let mut longest = f64::INFINITY;
        while root.iterations < self.iterations_max {
            let size_before = root.x.size();
            let found = match step(&root.x) {
                Ok(found) => found,
                Err(stop) => return Root { stop, ..root },
            };
            root.iterations += 1;
            let length = found.size();
            if !length.is_finite() {
                return Root {
                    stop: Stop::LeftDomain,
                    ..root
                };
            }
            if length <= self.tolerance * size_before.max(self.least_size) {
                root.x.subtract(1.0, &found);
                return Root {
                    stop: Stop::Converged,
                    ..root
                };
            }
            let share = if longest.is_finite() {
                (longest / length).min(1.0)
            } else {
                1.0
            };
            root.x.subtract(share, &found);
            longest = self.growth * length * share;
        }
        root
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use rand::{RngExt, SeedableRng};

    use super::*;

    #[test]
    fn roots_of_unity_are_found_in_the_plane() {
        let newton = Newton::new(50, 1e-9);
        for k in 0..5 {
            let exact = Complex64::cis(std::f64::consts::TAU * f64::from(k) / 5.0);
            let found = newton.solve(exact * 1.1, |z: &Complex64| {
                Ok((z.powi(5) - 1.0) / (5.0 * z.powi(4)))
            });
            assert_eq!(found.stop, Stop::Converged);
            assert!((found.x - exact).norm() < 1e-15);
            // From an error of 0.1: 0.02, 8e-4, 1e-6, 3e-12, and the step that confirms it.
            assert!(found.iterations <= 5, "{}", found.iterations);
        }
    }

    #[test]
    fn a_random_system_meets_its_constructed_root() {
        let seed = 11;
        println!("seed {seed}");
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        for size in 1..8 {
            // r(x) = A (x − s) + c ∘ (x − s)² has the root s.
            let a = DMatrix::from_fn(size, size, |i, j| {
                rng.random_range(-1.0..1.0) + if i == j { size as f64 } else { 0.0 }
            });
            let exact = DVector::from_fn(size, |_, _| rng.random_range(1.0..2.0));
            let curvature = DVector::from_fn(size, |_, _| rng.random_range(-0.2..0.2));
            let step = |x: &DVector<f64>| {
                let off = x - &exact;
                let residual = &a * &off + curvature.component_mul(&off).component_mul(&off);
                let jacobian = &a + DMatrix::from_diagonal(&(2.0 * curvature.component_mul(&off)));
                jacobian.lu().solve(&residual).ok_or(Stop::Singular)
            };
            let found = Newton::new(30, 1e-9)
                .with_growth(2.0)
                .solve(exact.add_scalar(0.3), step);
            assert!((found.converged().unwrap() - &exact).norm() < 1e-13 * size as f64);
            // A vector of another type takes the same way.
            let as_list = |x: &Vec<f64>| {
                step(&DVector::from_column_slice(x)).map(|step| step.iter().copied().collect::<Vec<f64>>())
            };
            let start: Vec<f64> = exact.iter().map(|x| x + 0.3).collect();
            let again = Newton::new(30, 1e-9).solve(start, as_list);
            assert_eq!(again.stop, Stop::Converged);
        }
    }

    #[test]
    fn the_growth_of_steps_is_bounded() {
        // arctan diverges from 2 with full steps, which alternate with growing length.
        let step = |x: &f64| Ok(x.atan() * (1.0 + x * x));
        assert_ne!(Newton::new(50, 1e-9).solve(2.0, step).stop, Stop::Converged);
        // A step of 1e-2 followed by one of 1: bounded to 2e-2.
        let mut steps = [-1e-2, -1.0].into_iter();
        let found = Newton::new(2, 1e-9)
            .with_growth(2.0)
            .solve(1.0, |_: &f64| steps.next().ok_or(Stop::Singular));
        assert!((found.x - 1.03).abs() < 1e-15);
    }

    #[test]
    fn every_reason_to_stop_is_met() {
        let newton = Newton::new(10, 1e-9);
        assert_eq!(
            newton.solve(1.0, |_: &f64| Err(Stop::Singular)).stop,
            Stop::Singular
        );
        assert_eq!(newton.solve(1.0, |_: &f64| Ok(f64::NAN)).stop, Stop::LeftDomain);
        let slow = newton.solve(1.0, |x: &f64| Ok(0.5 * x));
        assert_eq!((slow.stop, slow.iterations), (Stop::Iterations, 10));
        assert_eq!(slow.converged(), None);
        // A root at zero: relative to its size no step is short, but a step of zero is.
        assert_eq!(newton.solve(0.0, |x: &f64| Ok(*x)).stop, Stop::Converged);
        let halved = Newton::new(40, 1e-9).with_least_size(1.0);
        let found = halved.solve(1.0, |x: &f64| Ok(0.5 * x));
        // The step of iteration k is 2⁻ᵏ, which is below 1e-9 from k = 30 on.
        assert_eq!((found.stop, found.iterations), (Stop::Converged, 30));
    }
}
