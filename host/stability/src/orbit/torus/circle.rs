//! Fourier polynomials on the circle, by their values at equidistant angles.

use std::f64::consts::TAU;

use nalgebra::DMatrix;

/// Odd number of equidistant angles θ_k = 2πk/K, between which values are interpolated by a Fourier polynomial with the
/// harmonics up to (K − 1)/2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Circle {
    pub(super) angles: usize,
}

impl Circle {
    /// Circle with the harmonics up to `harmonics`.
    pub(super) fn new(harmonics: usize) -> Self {
        Self {
            angles: 2 * harmonics + 1,
        }
    }

    /// Highest harmonic.
    pub(super) fn harmonics(self) -> usize {
        self.angles / 2
    }

    /// Angle number `k`, rad.
    pub(super) fn angle(self, k: usize) -> f64 {
        TAU * k as f64 / self.angles as f64
    }

    /// Dirichlet kernel (1 + 2 Σ cos mφ)/K, and its derivative with respect to φ.
    fn kernel(self, phi: f64) -> [f64; 2] {
        let count = self.angles as f64;
        (1..=self.harmonics()).fold([1.0 / count, 0.0], |[value, slope], m| {
            let m = m as f64;
            let (sin, cos) = (m * phi).sin_cos();
            [value + 2.0 * cos / count, slope - 2.0 * m * sin / count]
        })
    }

    /// Matrix that takes the values at the angles θ_k to those at θ_k + `by`, and its derivative with respect to `by`.
    pub(super) fn shift(self, by: f64) -> [DMatrix<f64>; 2] {
        [0, 1].map(|order| {
            // Entries depend on the difference of the angles only.
            let of_difference: Vec<f64> = (0..self.angles)
                .map(|k| self.kernel(self.angle(k) + by)[order])
                .collect();
            DMatrix::from_fn(self.angles, self.angles, |row, column| {
                of_difference[(row + self.angles - column) % self.angles]
            })
        })
    }

    /// Matrix that takes the values at these angles to those at the angles of another circle.
    pub(super) fn onto(self, other: Self) -> DMatrix<f64> {
        DMatrix::from_fn(other.angles, self.angles, |row, column| {
            self.kernel(other.angle(row) - self.angle(column))[0]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    #[test]
    fn shifts_and_other_circles_are_exact_for_the_harmonics_of_the_circle() {
        let (circle, finer) = (Circle::new(5), Circle::new(9));
        let value = |angle: f64| 0.3 + (2.0 * angle).cos() - 0.4 * (5.0 * angle + 0.2).sin();
        let slope = |angle: f64| -2.0 * (2.0 * angle).sin() - 2.0 * (5.0 * angle + 0.2).cos();
        let at = |circle: Circle, of: &dyn Fn(f64) -> f64| {
            DVector::from_fn(circle.angles, |k, _| of(circle.angle(k)))
        };
        let values = at(circle, &value);
        let [shift, by] = circle.shift(0.7);
        assert!((shift * &values - at(circle, &|angle| value(angle + 0.7))).amax() < 1e-13);
        assert!((by * &values - at(circle, &|angle| slope(angle + 0.7))).amax() < 1e-12);
        assert!((circle.onto(finer) * &values - at(finer, &value)).amax() < 1e-13);
    }
}
