//! The characteristic matrix: single Floquet multipliers and limits by Newton's method.
//!
//! On a motion that one period multiplies by μ, u_τ = u/μ. The delay equation becomes ẋ = (A + B[κ K α(t) − β(t)] C) x
//! with the complex depth κ = w (1 − 1/μ). Its transition matrix Φ over the period depends on κ alone and is an entire
//! function of κ. Then
//!
//!   det(Φ(w (1 − 1/μ)) − μ I) = 0
//!
//! holds for μ ≠ 0 if and only if μ is a Floquet multiplier. Φ is a product over elements of polynomials in κ with real
//! coefficients, and of the transition of the free flight.

use num_complex::Complex64;
use quietcut_numerics::Stop;
use quietcut_numerics::newton::Newton;

use super::crossing::Crossing;
use super::root::Root;
use crate::problem::period::{Element, Period};

/// Size of a term of an element's polynomial in κ, as a share of the largest coefficient, below which all higher terms
/// are dropped: below rounding.
const TERM: f64 = 1e-17;

/// Largest |κ|, in units of the depth by which the polynomials are scaled, at which `root_near` evaluates them. The
/// 20th power of 1.5 is 3300, so that 20 terms lose three digits to rounding.
const RADIUS: f64 = 1.5;

/// Largest number of terms of an element's polynomial in κ: a limit on computing time. Elements are so short that far
/// fewer are needed.
const TERMS_MAX: usize = 60;

/// Transition matrix Φ(κ) over a tooth period at one spindle speed.
#[derive(Clone, Debug)]
pub(crate) struct Characteristic {
    order: usize,
    /// Axial depth, m, by which the complex depth κ is divided before its powers are taken.
    scale: f64,
    /// For each element the coefficients of its polynomial in κ/scale, by ascending power, each n × n row by row.
    elements: Vec<Vec<f64>>,
    /// Transition matrix of the structure over the free flight, in which no tooth cuts, n × n row by row.
    flight: Vec<f64>,
}

/// Buffers for evaluating the transition matrix Φ and its derivative, reused between evaluations.
#[derive(Clone, Debug)]
pub(crate) struct Workspace {
    value: Vec<Complex64>,
    slope: Vec<Complex64>,
    factor: Vec<Complex64>,
    factor_slope: Vec<Complex64>,
    product: Vec<Complex64>,
}

/// Logarithmic derivatives of the characteristic function F = det(Φ − μI) at a point (μ, w).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Logarithmic {
    /// ∂ ln F/∂μ.
    pub(crate) by_multiplier: Complex64,
    /// ∂ ln F/∂w, 1/m.
    pub(crate) by_depth: Complex64,
}

impl Characteristic {
    /// Transition matrix Φ of a tooth period, valid for |κ| up to about `depth_m`.
    pub(crate) fn new(period: &Period, depth_m: f64) -> Self {
        // This floor is below every real depth; with a scale of 0 the polynomials in κ/scale would be constant.
        let depth_m = depth_m.max(1e-12);
        Self {
            order: period.order(),
            scale: depth_m,
            elements: period
                .elements
                .iter()
                .map(|element| polynomial(element, depth_m))
                .collect(),
            flight: by_rows(&period.flight),
        }
    }

    /// Number of states, n.
    pub(crate) fn order(&self) -> usize {
        self.order
    }

    /// Approximate number of floating-point operations of one evaluation of Φ and dΦ/dκ.
    pub(crate) fn operations(&self) -> f64 {
        let n = self.order as f64;
        let entries: usize = self.elements.iter().map(Vec::len).sum();
        16.0 * entries as f64 + 32.0 * n.powi(3) * (self.elements.len() as f64 + 3.0)
    }

    /// Allocates the buffers for evaluations.
    pub(crate) fn workspace(&self) -> Workspace {
        let zero = vec![Complex64::ZERO; self.order * self.order];
        Workspace {
            value: zero.clone(),
            slope: zero.clone(),
            factor: zero.clone(),
            factor_slope: zero.clone(),
            product: zero,
        }
    }

    /// Writes the transition matrix Φ(κ) and its derivative dΦ/dκ to `work.value` and `work.slope`.
    fn evaluate(&self, kappa: Complex64, work: &mut Workspace) {
        let n = self.order;
        let xi = kappa / self.scale;
        let Some((first, rest)) = self.elements.split_first() else {
            for (value, entry) in work.value.iter_mut().zip(&self.flight) {
                *value = Complex64::from(*entry);
            }
            work.slope.fill(Complex64::ZERO);
            return;
        };
        polynomial_at(first, n, xi, &mut work.value, &mut work.slope);
        for element in rest {
            polynomial_at(element, n, xi, &mut work.factor, &mut work.factor_slope);
            // Product rule (P T)' = P' T + P T' for the transition P of this element after the transition T of the
            // elements before.
            multiply(&work.factor, &work.slope, n, &mut work.product);
            multiply_add(&work.factor_slope, &work.value, n, &mut work.product);
            std::mem::swap(&mut work.slope, &mut work.product);
            multiply(&work.factor, &work.value, n, &mut work.product);
            std::mem::swap(&mut work.value, &mut work.product);
        }
        multiply_real(&self.flight, &work.value, n, &mut work.product);
        std::mem::swap(&mut work.value, &mut work.product);
        multiply_real(&self.flight, &work.slope, n, &mut work.product);
        std::mem::swap(&mut work.slope, &mut work.product);
        for entry in &mut work.slope {
            *entry /= self.scale;
        }
    }

    /// Logarithmic derivatives of the characteristic function F = det(Φ − μI) at (μ, w); `None` if Φ − μI is singular
    /// or a result is not finite.
    pub(crate) fn logarithmic(
        &self,
        multiplier: Complex64,
        depth_m: f64,
        work: &mut Workspace,
    ) -> Option<Logarithmic> {
        let n = self.order;
        let inverse = inverse(multiplier);
        self.evaluate((Complex64::ONE - inverse) * depth_m, work);
        // The matrix Φ − μI is divided by about |μ|, since squares of large multipliers would overflow.
        let unit = multiplier.l1_norm().max(1.0);
        for i in 0..n {
            work.value[i * n + i] -= multiplier;
        }
        for entry in work.value.iter_mut().chain(&mut work.slope) {
            *entry /= unit;
        }
        let (trace, trace_slope) = traces(&mut work.value, &mut work.slope, &mut work.factor, n)?;
        let trace = trace / unit;
        let logarithmic = Logarithmic {
            by_multiplier: trace_slope * depth_m * inverse * inverse - trace,
            by_depth: trace_slope * (Complex64::ONE - inverse),
        };
        (logarithmic.by_multiplier.is_finite() && logarithmic.by_depth.is_finite()).then_some(logarithmic)
    }

    /// Floquet multiplier at a depth near a guess, by Newton's method on the characteristic function; a real guess
    /// gives a real multiplier.
    ///
    /// `None` if the iteration moves from the guess by more than `reach` or does not converge.
    pub(crate) fn multiplier_near(
        &self,
        guess: Complex64,
        depth_m: f64,
        reach: f64,
        work: &mut Workspace,
    ) -> Option<Complex64> {
        let is_near = |multiplier: Complex64| (multiplier - guess).norm() <= reach;
        let found = Newton::new(20, 1e-9).solve(guess, |&multiplier: &Complex64| {
            if !is_near(multiplier) {
                return Err(Stop::LeftDomain);
            }
            // Without a logarithmic derivative F is exactly zero, so that this is the multiplier, or the numbers are
            // out of range.
            let logarithmic = self.logarithmic(multiplier, depth_m, work);
            Ok(logarithmic.map_or(Complex64::ZERO, |logarithmic| inverse(logarithmic.by_multiplier)))
        });
        found
            .converged()
            .filter(|multiplier| multiplier.is_finite() && is_near(*multiplier))
    }

    /// Floquet multiplier near a guess, with its derivative dμ/dw, by one Newton step; a real guess gives a real
    /// multiplier.
    ///
    /// Its error is about the square of that of the guess. `None` if the relative step is 0.01 or more, if κ is too
    /// large for the polynomials, if Φ − μI is singular, or if a result is not finite.
    pub(crate) fn root_near(&self, guess: Complex64, depth_m: f64, work: &mut Workspace) -> Option<Root> {
        // Both logarithmic derivatives of the characteristic function F are infinite at a root of F. Close to it their
        // ratio is smooth, so that they are evaluated at a relative distance of 1e-7.
        let nearby = guess + Complex64::new(1e-7, 1e-7) * guess.norm();
        if (Complex64::ONE - nearby.inv()).norm() * depth_m > RADIUS * self.scale {
            return None;
        }
        let logarithmic = self.logarithmic(nearby, depth_m, work)?;
        let mut multiplier = nearby - inverse(logarithmic.by_multiplier);
        let mut slope = -logarithmic.by_depth / logarithmic.by_multiplier;
        if guess.im == 0.0 {
            (multiplier.im, slope.im) = (0.0, 0.0);
        }
        // One Newton step is not enough if the guess is more than 1 % off. A second root nearby, whose term is also in
        // the logarithmic derivative, makes the step too short, which is not detected here.
        let step = (multiplier - guess).norm();
        (step < 0.01 * guess.norm() && slope.is_finite()).then_some(Root { multiplier, slope })
    }

    /// Derivative dμ/dw of a Floquet multiplier μ over the axial depth w, 1/m, along its branch through (μ, w); `None`
    /// if a result is not finite.
    pub(crate) fn sensitivity(
        &self,
        multiplier: Complex64,
        depth_m: f64,
        work: &mut Workspace,
    ) -> Option<Complex64> {
        // Both logarithmic derivatives of the characteristic function F are infinite at a root of F. Close to it their
        // ratio is smooth, so that they are evaluated at a relative distance of 1e-7.
        let nearby = multiplier + Complex64::new(1e-7, 1e-7) * multiplier.norm();
        let logarithmic = self.logarithmic(nearby, depth_m, work)?;
        let ratio = -logarithmic.by_depth / logarithmic.by_multiplier;
        ratio.is_finite().then_some(ratio)
    }

    /// Crossing of the unit circle near a guess, at a depth between `low_m` and `high_m`, by Newton's method in depth
    /// and angle of the multiplier. `None` if it does not converge, or converges to a depth outside this range.
    pub(crate) fn crossing_near(
        &self,
        guess: Crossing,
        low_m: f64,
        high_m: f64,
        work: &mut Workspace,
    ) -> Option<Crossing> {
        let real = guess.multiplier.im == 0.0;
        let unit = guess.multiplier / guess.multiplier.norm();
        let multiplier_at = |angle: f64| if real { unit } else { Complex64::cis(angle) };
        let margin_m = 0.5 * (high_m - low_m);
        let allowed_m = low_m - margin_m..=high_m + margin_m;
        // Both unknowns in one complex number: the depth as a share of the larger depth, and the angle θ in rad.
        let start = Complex64::new(guess.depth_m / high_m, unit.arg());
        let found = Newton::new(30, 1e-9)
            .with_least_size(1.0)
            .solve(start, |at: &Complex64| {
                let (depth_m, multiplier) = (at.re * high_m, multiplier_at(at.im));
                if !allowed_m.contains(&depth_m) {
                    return Err(Stop::LeftDomain);
                }
                let Some(logarithmic) = self.logarithmic(multiplier, depth_m, work) else {
                    // F vanishes to rounding, so that this is the crossing, or the numbers are out of range.
                    return if self.is_finite_at(multiplier, depth_m, work) {
                        Ok(Complex64::ZERO)
                    } else {
                        Err(Stop::LeftDomain)
                    };
                };
                let by_angle = logarithmic.by_multiplier * multiplier * Complex64::I;
                let by_depth = logarithmic.by_depth;
                let (step_m, turn) = if real {
                    (by_depth.re.recip(), 0.0)
                } else {
                    // Newton step from F(w, θ) = 0: (∂ ln F/∂w) dw + (∂ ln F/∂θ) dθ = 1, real and imaginary part.
                    let determinant = by_depth.re * by_angle.im - by_depth.im * by_angle.re;
                    (by_angle.im / determinant, -by_depth.im / determinant)
                };
                Ok(Complex64::new(step_m / high_m, turn))
            })
            .converged()?;
        let (depth_m, multiplier) = (found.re * high_m, multiplier_at(found.im));
        (low_m..=high_m).contains(&depth_m).then_some(Crossing {
            depth_m,
            multiplier: Complex64::new(multiplier.re, multiplier.im.abs()),
        })
    }

    /// True if the transition matrix Φ(κ) and its derivative are finite at the multiplier μ and the axial depth w.
    fn is_finite_at(&self, multiplier: Complex64, depth_m: f64, work: &mut Workspace) -> bool {
        self.evaluate((Complex64::ONE - inverse(multiplier)) * depth_m, work);
        work.value
            .iter()
            .chain(&work.slope)
            .all(|entry| entry.is_finite())
    }

    /// Transition matrix Φ(κ), n × n row by row.
    #[cfg(test)]
    pub(crate) fn transition(&self, kappa: Complex64) -> Vec<Complex64> {
        let mut work = self.workspace();
        self.evaluate(kappa, &mut work);
        work.value
    }
}

/// Reciprocal 1/z, also if |z|² overflows or underflows.
fn inverse(z: Complex64) -> Complex64 {
    let size = z.re.abs().max(z.im.abs());
    (z / size).inv() / size
}

/// Transition matrix of an element as the polynomial G + κ T E + κ² T Q E + …, given by its coefficients in κ/scale.
fn polynomial(element: &Element, scale: f64) -> Vec<f64> {
    let mut coefficients = by_rows(&element.flow);
    let mut largest = element.flow.amax();
    let mut seen = element.observe.clone();
    let drive = &element.drive * scale;
    let kernel = &element.kernel * scale;
    let mut next = seen.clone();
    let mut term = element.flow.clone();
    for _ in 1..TERMS_MAX {
        drive.mul_to(&seen, &mut term);
        for row in 0..term.nrows() {
            coefficients.extend(term.row(row).iter());
        }
        let size = term.amax();
        largest = largest.max(size);
        if size < TERM * largest {
            break;
        }
        kernel.mul_to(&seen, &mut next);
        std::mem::swap(&mut seen, &mut next);
    }
    coefficients
}

fn by_rows(matrix: &nalgebra::DMatrix<f64>) -> Vec<f64> {
    matrix.transpose().as_slice().to_vec()
}

/// Value and derivative, at ξ = κ/scale, of the matrix polynomial of an element's transition matrix.
fn polynomial_at(
    coefficients: &[f64],
    n: usize,
    xi: Complex64,
    value: &mut [Complex64],
    slope: &mut [Complex64],
) {
    value.fill(Complex64::ZERO);
    slope.fill(Complex64::ZERO);
    // Powers of ξ are summed, not nested products: the coefficients are real, so that each entry needs products with a
    // real number only.
    let (mut power, mut power_slope) = (Complex64::ONE, Complex64::ZERO);
    for (j, term) in coefficients.chunks_exact(n * n).enumerate() {
        for ((value, slope), coefficient) in value.iter_mut().zip(slope.iter_mut()).zip(term) {
            value.re += coefficient * power.re;
            value.im += coefficient * power.im;
            slope.re += coefficient * power_slope.re;
            slope.im += coefficient * power_slope.im;
        }
        power_slope = power * (j + 1) as f64;
        power *= xi;
    }
}

fn multiply(a: &[Complex64], b: &[Complex64], n: usize, out: &mut [Complex64]) {
    out.fill(Complex64::ZERO);
    multiply_add(a, b, n, out);
}

fn multiply_add(a: &[Complex64], b: &[Complex64], n: usize, out: &mut [Complex64]) {
    for (row, out) in a.chunks_exact(n).zip(out.chunks_exact_mut(n)) {
        for (factor, b) in row.iter().zip(b.chunks_exact(n)) {
            for (out, entry) in out.iter_mut().zip(b) {
                *out += factor * entry;
            }
        }
    }
}

fn multiply_real(a: &[f64], b: &[Complex64], n: usize, out: &mut [Complex64]) {
    out.fill(Complex64::ZERO);
    for (row, out) in a.chunks_exact(n).zip(out.chunks_exact_mut(n)) {
        for (factor, b) in row.iter().zip(b.chunks_exact(n)) {
            for (out, entry) in out.iter_mut().zip(b) {
                *out += entry * *factor;
            }
        }
    }
}

/// Traces tr(M⁻¹) and tr(M⁻¹ S) by elimination with row exchange; overwrites M and S. `None` if M is singular.
fn traces(
    m: &mut [Complex64],
    s: &mut [Complex64],
    identity: &mut [Complex64],
    n: usize,
) -> Option<(Complex64, Complex64)> {
    identity.fill(Complex64::ZERO);
    for i in 0..n {
        identity[i * n + i] = Complex64::ONE;
    }
    for column in 0..n {
        let pivot = (column..n).max_by(|&a, &b| {
            m[a * n + column]
                .norm_sqr()
                .total_cmp(&m[b * n + column].norm_sqr())
        })?;
        if pivot != column {
            for j in 0..n {
                m.swap(pivot * n + j, column * n + j);
                s.swap(pivot * n + j, column * n + j);
                identity.swap(pivot * n + j, column * n + j);
            }
        }
        let inverse = m[column * n + column].inv();
        if !inverse.is_finite() {
            return None;
        }
        for j in 0..n {
            m[column * n + j] *= inverse;
            s[column * n + j] *= inverse;
            identity[column * n + j] *= inverse;
        }
        for i in 0..n {
            if i == column {
                continue;
            }
            let factor = m[i * n + column];
            for j in 0..n {
                let (a, b, c) = (m[column * n + j], s[column * n + j], identity[column * n + j]);
                m[i * n + j] -= factor * a;
                s[i * n + j] -= factor * b;
                identity[i * n + j] -= factor * c;
            }
        }
    }
    let trace = (0..n).map(|i| identity[i * n + i]).sum();
    let trace_s = (0..n).map(|i| s[i * n + i]).sum();
    Some((trace, trace_s))
}
