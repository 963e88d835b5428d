//! Roots of real polynomials up to degree 4.

use crate::math::sqrt;

/// A complex number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Complex {
    pub(crate) re: f32,
    pub(crate) im: f32,
}

impl Complex {
    pub(crate) const fn new(re: f32, im: f32) -> Self {
        Self { re, im }
    }

    pub(crate) fn minus(self, b: Self) -> Self {
        Self::new(self.re - b.re, self.im - b.im)
    }

    pub(crate) fn times(self, b: Self) -> Self {
        Self::new(self.re * b.re - self.im * b.im, self.re * b.im + self.im * b.re)
    }

    /// Quotient; infinite or not a number for a divisor of 0.
    pub(crate) fn over(self, b: Self) -> Self {
        let square = b.square();
        Self::new(
            (self.re * b.re + self.im * b.im) / square,
            (self.im * b.re - self.re * b.im) / square,
        )
    }

    /// Square of the absolute value.
    pub(crate) fn square(self) -> f32 {
        self.re * self.re + self.im * self.im
    }
}

/// The most iterations for degree 3 and 4. Simple roots converge quadratically: from the start values all but
/// clusters are there after ten.
const ITERATIONS: usize = 24;

/// Root of largest absolute value of z^P − c\[0\]·z^(P−1) − … − c\[P−1\]; of a complex pair the one with im > 0.
///
/// Degree 2 in closed form; 3 and 4 by Durand and Kerner's iteration, which finds all roots at once. In single precision
/// a simple root is good to about 1e-6 over its distance to the next. Returns `None` where an iteration left the finite numbers.
pub(crate) fn largest<const P: usize>(coefficients: &[f32; P]) -> Option<Complex> {
    let mut best: Option<Complex> = None;
    for root in all(coefficients)? {
        if best.is_none_or(|best| root.square() > best.square()) {
            best = Some(root);
        }
    }
    let best = best?;
    // What rounding leaves of an imaginary part is none.
    let im = if best.im * best.im < 1e-8 * best.square() {
        0.0
    } else {
        best.im.abs()
    };
    (best.square().is_finite()).then_some(Complex::new(best.re, im))
}

fn all<const P: usize>(coefficients: &[f32; P]) -> Option<[Complex; P]> {
    let mut roots = [Complex::default(); P];
    match coefficients.as_slice() {
        [c] => roots[0] = Complex::new(*c, 0.0),
        [c, d] => {
            let (first, second) = quadratic(*c, *d);
            roots[0] = first;
            roots[P - 1] = second;
        }
        _ => {
            // Start values on no line of symmetry, about where multipliers are.
            let mut start = Complex::new(1.0, 0.0);
            for root in &mut roots {
                *root = start;
                start = start.times(Complex::new(0.4, 0.9));
            }
            for _ in 0..ITERATIONS {
                let mut moved = 0.0;
                for index in 0..P {
                    let root = roots[index];
                    let mut value = Complex::new(1.0, 0.0);
                    for &c in coefficients {
                        value = value.times(root).minus(Complex::new(c, 0.0));
                    }
                    let mut others = Complex::new(1.0, 0.0);
                    for (other, &r) in roots.iter().enumerate() {
                        if other != index {
                            others = others.times(root.minus(r));
                        }
                    }
                    let step = value.over(others);
                    if !step.square().is_finite() {
                        return None;
                    }
                    roots[index] = root.minus(step);
                    moved += step.square();
                }
                if moved < 1e-12 {
                    break;
                }
            }
        }
    }
    Some(roots)
}

/// Roots of z² − c·z − d.
fn quadratic(c: f32, d: f32) -> (Complex, Complex) {
    let half = 0.5 * c;
    let square = half * half + d;
    if square < 0.0 {
        let im = sqrt(-square);
        return (Complex::new(half, im), Complex::new(half, -im));
    }
    let root = sqrt(square);
    // The larger first, the other from the product: no cancellation.
    let large = if half >= 0.0 { half + root } else { half - root };
    let small = if large == 0.0 { 0.0 } else { -d / large };
    (Complex::new(large, 0.0), Complex::new(small, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polynomial<const P: usize>(roots: [Complex; P]) -> [f32; P] {
        // Π (z − r), highest power first, without the leading 1.
        let mut poly = vec![Complex::new(1.0, 0.0)];
        for root in roots {
            let mut next = vec![Complex::default(); poly.len() + 1];
            for (k, &c) in poly.iter().enumerate() {
                next[k] = next[k].minus(Complex::new(-c.re, -c.im));
                next[k + 1] = next[k + 1].minus(c.times(root));
            }
            poly = next;
        }
        core::array::from_fn(|k| -poly[k + 1].re)
    }

    fn pair(abs: f32, degrees: f32) -> [Complex; 2] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        [
            Complex::new(abs * cos, abs * sin),
            Complex::new(abs * cos, -abs * sin),
        ]
    }

    #[test]
    fn two_pairs_are_found() {
        for (large, small) in [(1.02, 0.6), (0.98, 0.9), (2.5, 1.1), (1.4, 0.05)] {
            for (first, second) in [(151.0, 40.0), (173.0, 60.0), (12.0, 120.0)] {
                let ([a, b], [c, d]) = (pair(large, first), pair(small, second));
                let found = largest(&polynomial([c, a, d, b])).unwrap();
                let error = found.minus(a).square().sqrt();
                assert!(error < 2e-4, "{large} {small} {first} {second}: {error}");
            }
        }
    }

    #[test]
    fn real_roots_are_real() {
        let real = |re| Complex::new(re, 0.0);
        let found = largest(&polynomial([real(-1.018), real(0.3), real(-0.5), real(0.9)])).unwrap();
        assert_eq!(found.im, 0.0);
        assert!((found.re + 1.018).abs() < 1e-5);
        assert_eq!(largest(&[-1.05]), Some(real(-1.05)));
        let found = largest(&polynomial([real(0.4), real(-1.1)])).unwrap();
        assert!((found.re + 1.1).abs() < 1e-6 && found.im == 0.0);
        assert_eq!(largest(&[0.0, 0.0]), Some(real(0.0)));
    }
}
