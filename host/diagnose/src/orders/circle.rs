//! Fourier sums over samples at arbitrary spindle angles, and Fourier series at such angles, at a cost that does not
//! grow with the number of orders.
//!
//! The circle is divided into M sectors of half width δ = π/M. With θ = θ_m + sδ, |s| ≤ 1, in sector m,
//!
//! Σ_i v_i e^{−ikθ_i} = Σ_j (−ikδ)^j/j! Σ_m e^{−ikθ_m} μ_{j,m}, μ_{j,m} = Σ over the samples of sector m of v s^j,
//!
//! where the sum over m is a fast Fourier transform. A Fourier series is evaluated by the transposed steps. M is at
//! least eight times the highest order, hence kδ ≤ π/8, and the first neglected term is (π/8)^12/12! = 3e-14 of Σ|v|.

use std::f64::consts::PI;
use std::sync::Arc;

use num_complex::Complex64;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

use crate::signal::grid::smooth_even;

/// Number of terms of Taylor's series in a sector.
const TERMS: usize = 12;

/// Sectors of the spindle angle for orders up to a highest one.
#[derive(Clone)]
pub(crate) struct Circle {
    highest: usize,
    sectors: usize,
    forward: Arc<dyn RealToComplex<f64>>,
    inverse: Arc<dyn ComplexToReal<f64>>,
}

impl Circle {
    /// Sectors for the orders 0 … `highest`.
    pub(crate) fn new(highest: usize) -> Self {
        let sectors = smooth_even(8 * highest.max(1));
        let mut planner = RealFftPlanner::new();
        Self {
            highest,
            sectors,
            forward: planner.plan_fft_forward(sectors),
            inverse: planner.plan_fft_inverse(sectors),
        }
    }

    /// Sector and place in it, from −1 to 1, of an angle in revolutions.
    fn place(&self, revolutions: f64) -> (usize, f64) {
        let position = (revolutions - revolutions.floor()) * self.sectors as f64;
        let nearest = (position + 0.5) as usize;
        let place = 2.0 * (position - nearest as f64);
        (if nearest >= self.sectors { 0 } else { nearest }, place)
    }

    /// Σ_i v_i e^{−ikθ_i} for the orders k = 0 … highest, of values at spindle angles in revolutions.
    pub(crate) fn sums(&self, samples: impl Iterator<Item = (f64, f64)>) -> Vec<Complex64> {
        let mut moments = vec![[0.0; TERMS]; self.sectors];
        for (revolutions, value) in samples {
            let (sector, place) = self.place(revolutions);
            let mut power = value;
            for moment in &mut moments[sector] {
                *moment += power;
                power *= place;
            }
        }
        let mut sums = vec![Complex64::ZERO; self.highest + 1];
        let mut spectrum = self.forward.make_output_vec();
        for term in 0..TERMS {
            let mut column: Vec<f64> = moments.iter().map(|moments| moments[term]).collect();
            // It fails only if lengths differ, and here they are equal.
            let _ = self.forward.process(&mut column, &mut spectrum);
            for (order, (sum, value)) in sums.iter_mut().zip(&spectrum).enumerate() {
                *sum += value * self.taylor(order, term).conj();
            }
        }
        sums
    }

    /// (ikδ)^j/j! for order k and term j.
    fn taylor(&self, order: usize, term: usize) -> Complex64 {
        let step = Complex64::new(0.0, order as f64 * PI / self.sectors as f64);
        (1..=term).fold(Complex64::ONE, |product, factor| product * step / factor as f64)
    }

    /// The real function c_0 + 2 Re Σ_{k≥1} c_k e^{ikθ}; coefficients of orders above the highest are left out.
    pub(crate) fn series(&self, coefficients: &[Complex64]) -> Series<'_> {
        let mut table = vec![[0.0; TERMS]; self.sectors];
        for term in 0..TERMS {
            let mut spectrum = self.inverse.make_input_vec();
            for (order, (bin, c)) in spectrum
                .iter_mut()
                .zip(coefficients)
                .take(self.highest + 1)
                .enumerate()
            {
                *bin = c * self.taylor(order, term);
            }
            spectrum[0].im = 0.0;
            let mut values = self.inverse.make_output_vec();
            let _ = self.inverse.process(&mut spectrum, &mut values);
            for (entry, value) in table.iter_mut().zip(&values) {
                entry[term] = *value;
            }
        }
        Series { circle: self, table }
    }
}

/// A real periodic function of the spindle angle.
pub(crate) struct Series<'a> {
    circle: &'a Circle,
    table: Vec<[f64; TERMS]>,
}

impl Series<'_> {
    /// Value at an angle in revolutions.
    pub(crate) fn at(&self, revolutions: f64) -> f64 {
        let (sector, place) = self.circle.place(revolutions);
        self.table[sector]
            .iter()
            .rev()
            .fold(0.0, |sum, term| sum * place + term)
    }
}
