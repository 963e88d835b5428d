//! A multiplier, how it leaves the unit circle, and what that says of the cut.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector, Vector3};
use num_complex::Complex64;
use serde::Serialize;

use super::Problem;
use super::period::Period;

/// How a multiplier leaves the unit circle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// As a complex pair: chatter with a frequency of its own (secondary Hopf, torus).
    Hopf,
    /// Through −1: period doubling.
    Flip,
    /// Through +1.
    Fold,
}

impl Kind {
    /// The kind of a multiplier. Real multipliers must be real to the last bit.
    pub fn of(multiplier: Complex64) -> Self {
        if multiplier.im != 0.0 {
            Self::Hopf
        } else if multiplier.re < 0.0 {
            Self::Flip
        } else {
            Self::Fold
        }
    }

    /// The word in answers.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hopf => "hopf",
            Self::Flip => "flip",
            Self::Fold => "fold",
        }
    }

    /// How many multipliers cross together.
    pub(crate) fn count(self) -> i32 {
        match self {
            Self::Hopf => 2,
            Self::Flip | Self::Fold => 1,
        }
    }
}

/// What a multiplier and its error say.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// |μ| + error < 1.
    Stable,
    /// |μ| − error > 1.
    Unstable,
    /// The error bar straddles 1.
    Undecided,
}

impl Verdict {
    /// The verdict on a multiplier of this size.
    pub fn of(multiplier_abs: f64, error: f64) -> Self {
        if multiplier_abs + error < 1.0 {
            Self::Stable
        } else if multiplier_abs - error > 1.0 {
            Self::Unstable
        } else {
            Self::Undecided
        }
    }

    /// The word in answers.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stable => "stable",
            Self::Unstable => "unstable",
            Self::Undecided => "undecided",
        }
    }
}

/// The vibration frequency, Hz, of the motion u(t) = e^{st} v(t) with v of tooth period τ and e^{sτ} = μ.
///
/// The motion has the frequencies |Im ln μ + 2πk|/(2πτ); the one with the largest displacement is given. With
/// F̂_k the k-th harmonic of the regenerative force along the eigenfunction, displacement is H(s_k) F̂_k.
pub(crate) fn chatter_hz(
    problem: &Problem,
    rpm: f64,
    period: &Period,
    multiplier: Complex64,
    depth_m: f64,
) -> Option<f64> {
    let forces = eigenfunction_forces(period, multiplier, depth_m)?;
    loudest_hz(problem, problem.tooth_period_s(rpm), multiplier, |s| {
        let mut harmonic = Vector3::<Complex64>::zeros();
        for (time_s, force) in &forces {
            harmonic += force * (-s * *time_s).exp();
        }
        Some((problem.structure.transfer(s)? * harmonic).norm())
    })
}

/// The frequency, Hz, among |Im ln μ + 2πk|/(2πT) at which the motion is largest; `size` gives its size at an exponent
/// s with e^{sT} = μ.
pub(super) fn loudest_hz(
    problem: &Problem,
    period_s: f64,
    multiplier: Complex64,
    size: impl Fn(Complex64) -> Option<f64>,
) -> Option<f64> {
    let growth = multiplier.ln();
    let fastest = problem
        .structure
        .poles()
        .iter()
        .map(|pole| pole.im)
        .fold(0.0, f64::max);
    // Above the fastest pole the receptance only falls; one harmonic beyond is enough.
    let highest = (fastest * period_s / TAU).ceil() as i32 + 1;
    (-highest..=highest)
        .filter_map(|k| {
            let s = (growth + Complex64::new(0.0, TAU * f64::from(k))) / period_s;
            Some((size(s)?, s.im.abs() / TAU))
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, frequency_hz)| frequency_hz)
}

/// Force times quadrature weight of every port along the eigenfunction, with its time.
fn eigenfunction_forces(
    period: &Period,
    multiplier: Complex64,
    depth_m: f64,
) -> Option<Vec<(f64, Vector3<Complex64>)>> {
    let kappa = (Complex64::ONE - multiplier.inv()) * depth_m;
    let order = period.order();
    let complex = |matrix: &DMatrix<f64>| matrix.map(Complex64::from);
    let mut transition = DMatrix::<Complex64>::identity(order, order);
    let mut observed = Vec::with_capacity(period.elements.len());
    for element in &period.elements {
        let ports = element.kernel.nrows();
        let implicit = DMatrix::identity(ports, ports) - complex(&element.kernel) * kappa;
        let seen = implicit.lu().solve(&(complex(&element.observe) * &transition))?;
        transition = complex(&element.flow) * &transition + complex(&element.drive) * &seen * kappa;
        observed.push(seen);
    }
    let transition = complex(&period.flight) * transition;
    let start = eigenvector(&transition, multiplier)?;
    let mut forces = Vec::new();
    for (element, seen) in period.elements.iter().zip(&observed) {
        let seen = seen * &start;
        for (port, seen) in element.ports.iter().zip(seen.iter()) {
            let force = port.force.map(Complex64::from) * (seen * kappa * port.weight_s);
            forces.push((port.time_s, force));
        }
    }
    Some(forces)
}

/// A vector that the matrix multiplies by about `eigenvalue`, by inverse iteration.
pub(super) fn eigenvector(matrix: &DMatrix<Complex64>, eigenvalue: Complex64) -> Option<DVector<Complex64>> {
    let order = matrix.nrows();
    // A shift a little off the eigenvalue keeps the matrix regular and separates the vector by 1e8 at each step.
    let shift = eigenvalue * (1.0 + 1e-8);
    let lu = (matrix - DMatrix::identity(order, order) * shift).lu();
    let mut vector = DVector::from_fn(order, |i, _| Complex64::new(1.0, 0.3 * i as f64));
    for _ in 0..3 {
        vector = lu.solve(&vector)?;
        let norm = vector.norm();
        if !(norm.is_finite() && norm > 0.0) {
            return None;
        }
        vector.unscale_mut(norm);
    }
    Some(vector)
}
