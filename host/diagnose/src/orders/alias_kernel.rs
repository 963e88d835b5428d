//! Orders that least squares finds in samples of a periodic signal, including aliasing.
//!
//! With the weights w and a(p) = Σ_i w_i e^{−ipθ_i} / Σ_i w_i, the weighted least-squares fit of y = Σ_{|l|≤K} Y_l
//! e^{ilθ} has the normal equations
//!
//! Σ_l a(k − l) Y_l = b_k, b_k = Σ_i w_i y_i e^{−ikθ_i} / Σ_i w_i, |k| ≤ K.
//!
//! A signal Σ_{|l|≤P} c_l e^{ilθ} with P > K has b_k = Σ_{|l|≤P} a(k − l) c_l, so that Y = G⁻¹ A c exactly. Real signals
//! have Y_{−k} = Y_k*, and only k ≥ 0 is stored. A matrix of entries a(k − l) multiplies the function by the density of
//! the samples over θ, ρ(θ) = Σ_p a(p) e^{ipθ}: two Fourier transforms. The system is solved by conjugate gradients; G
//! is the unit matrix but for the unevenness of the samples over the angle.

use std::sync::Arc;

use num_complex::Complex64;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

use crate::orders::circle::Circle;
use crate::orders::taper::Taper;
use crate::signal::grid::smooth_even;

/// Residual of the normal equations, relative to their right side, at which the iteration ends: rounding accumulated
/// over the terms of a sum.
const SETTLED: f64 = 1e-14;

/// Largest number of iterations. The error falls by a factor of (√κ + 1)/(√κ − 1) per iteration, κ the condition number:
/// below 1e-14 after 100 iterations for κ < 40. Singular systems (aliases that coincide with orders) end here.
const ITERATIONS_MAX: usize = 100;

/// The kernel a(p) of a record and the equations that it gives.
#[derive(Clone)]
pub(crate) struct AliasKernel {
    /// Highest order K of the reduction.
    orders: usize,
    /// Highest order P of a prediction.
    aliases: usize,
    /// a(p) for p = 0 … 2P.
    kernel: Vec<Complex64>,
    /// Products with functions of |l| ≤ P.
    of_aliases: Convolution,
    /// Products with functions of |l| ≤ K.
    of_orders: Convolution,
}

/// Products of functions of |l| ≤ L with the density of the samples over the spindle angle, in their orders |k| ≤ L.
#[derive(Clone)]
struct Convolution {
    /// Density ρ, truncated to |p| ≤ 2L, on an even grid.
    density: Vec<f64>,
    forward: Arc<dyn RealToComplex<f64>>,
    inverse: Arc<dyn ComplexToReal<f64>>,
}

impl AliasKernel {
    /// The kernel of samples at spindle angles in revolutions, for K = `orders` and P = `aliases` ≥ K.
    pub(crate) fn new(orders: usize, aliases: usize, revolutions: &[f64], taper: &Taper) -> Self {
        let circle = Circle::new(2 * aliases);
        let weighted = revolutions
            .iter()
            .enumerate()
            .map(|(sample, revolutions)| (*revolutions, taper.weight(sample)));
        let mut kernel = circle.sums(weighted);
        for entry in &mut kernel {
            *entry /= taper.sum();
        }
        let mut planner = RealFftPlanner::new();
        Self {
            orders,
            aliases,
            of_aliases: Convolution::new(&kernel, aliases, &mut planner),
            of_orders: Convolution::new(&kernel, orders, &mut planner),
            kernel,
        }
    }

    /// Highest order K of the reduction.
    pub(crate) fn orders(&self) -> usize {
        self.orders
    }

    /// Highest order P of a signal that [`Self::seen`] accepts.
    pub(crate) fn aliases(&self) -> usize {
        self.aliases
    }

    /// a(p) for p = 0 … 2P; a(−p) is its conjugate.
    pub(crate) fn kernel(&self) -> &[Complex64] {
        &self.kernel
    }

    /// Orders 0 … K that least squares finds in the samples of the real periodic signal c_0 + 2 Re Σ_{k≥1} c_k
    /// e^{ikθ}, given by its coefficients c_k, k = 0 …; those above P are left out.
    pub(crate) fn seen(&self, c: &[Complex64]) -> Vec<Complex64> {
        let c = &c[..c.len().min(self.aliases + 1)];
        let b = self.of_aliases.product(c, self.orders);
        self.solve(&b)
    }

    /// Solution Y_k of the normal equations for the right side b_k, k = 0 … highest. Aliases of which two coincide make
    /// them singular; the solution is then one of many that fit equally.
    pub(crate) fn solve(&self, right: &[Complex64]) -> Vec<Complex64> {
        self.solve_with_prior(right, &[])
    }

    /// [`Self::solve`] with a prior of the orders: `penalties`, variance of an amplitude by noise over its prior
    /// variance, are added to the diagonal; none for the orders beyond the list.
    pub(crate) fn solve_with_prior(&self, right: &[Complex64], penalties: &[f64]) -> Vec<Complex64> {
        let highest = right.len() - 1;
        let convolution = if highest > self.orders {
            &self.of_aliases
        } else {
            &self.of_orders
        };
        let mut x = vec![Complex64::ZERO; right.len()];
        let mut residual = right.to_vec();
        let mut direction = residual.clone();
        let whole = inner(right, right);
        let mut square = whole;
        for _ in 0..ITERATIONS_MAX {
            if square <= SETTLED * SETTLED * whole {
                break;
            }
            let mut product = convolution.product(&direction, highest);
            for ((product, direction), penalty) in product.iter_mut().zip(&direction).zip(penalties) {
                *product += direction * penalty;
            }
            let curvature = inner(&direction, &product);
            if curvature <= 0.0 {
                break;
            }
            let step = square / curvature;
            for (index, x) in x.iter_mut().enumerate() {
                *x += direction[index] * step;
                residual[index] -= product[index] * step;
            }
            let next = inner(&residual, &residual);
            for (direction, residual) in direction.iter_mut().zip(&residual) {
                *direction = *residual + *direction * (next / square);
            }
            square = next;
        }
        x
    }
}

impl Convolution {
    /// Products in orders up to `highest` with a kernel a(p), p = 0 … 2 × `highest` or more.
    fn new(kernel: &[Complex64], highest: usize, planner: &mut RealFftPlanner<f64>) -> Self {
        // The product of ρ (|p| ≤ 2L) and a function (|l| ≤ L) reaches to 3L; on a grid of more than 4L points its
        // orders |k| ≤ L are free of aliases.
        let points = smooth_even(4 * highest + 2);
        let (forward, inverse) = (planner.plan_fft_forward(points), planner.plan_fft_inverse(points));
        Self {
            density: to_angle(&*inverse, &kernel[..=2 * highest]),
            forward,
            inverse,
        }
    }

    /// Σ_l a(k − l) c_l for k = 0 … `highest`, of a real signal.
    fn product(&self, c: &[Complex64], highest: usize) -> Vec<Complex64> {
        let mut values = to_angle(&*self.inverse, c);
        let scale = 1.0 / values.len() as f64;
        for (value, density) in values.iter_mut().zip(&self.density) {
            *value *= density * scale;
        }
        let mut spectrum = self.forward.make_output_vec();
        // It fails only if lengths differ, and here they are equal.
        let _ = self.forward.process(&mut values, &mut spectrum);
        spectrum.truncate(highest + 1);
        spectrum
    }
}

/// Values c_0 + 2 Re Σ c_k e^{ikθ} on an even grid of angles.
fn to_angle(inverse: &dyn ComplexToReal<f64>, coefficients: &[Complex64]) -> Vec<f64> {
    let mut spectrum = inverse.make_input_vec();
    for (bin, c) in spectrum.iter_mut().zip(coefficients) {
        *bin = *c;
    }
    spectrum[0].im = 0.0;
    let mut values = inverse.make_output_vec();
    let _ = inverse.process(&mut spectrum, &mut values);
    values
}

/// Mean of the product of two real periodic functions over the angle.
fn inner(a: &[Complex64], b: &[Complex64]) -> f64 {
    let all: f64 = a.iter().zip(b).map(|(a, b)| a.re * b.re + a.im * b.im).sum();
    let mean = match (a.first(), b.first()) {
        (Some(a), Some(b)) => a.re * b.re,
        _ => 0.0,
    };
    2.0 * all - mean
}
