//! Nonlinear complex mode analysis: natural frequency and loss factor of a mode as functions of force and receptance
//! (thesis eqs 4.5 to 4.9).

use nalgebra::{DMatrix, DVector, Matrix4, Vector4};
use num_complex::Complex64;
use quietcut_numerics::least_squares::LinearProblem;
use quietcut_numerics::roots::bisection;

use crate::criteria::LARGEST_PAIRED_RECEPTANCE;

/// A measured receptance at constant force amplitude over frequency.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Amplitude of the force, N.
    pub force_n: f64,
    /// Points (ω in rad/s, H in m/N) of the receptance H, sorted by ω.
    pub points: Vec<(f64, Complex64)>,
}

/// Mode linearized at one vibration amplitude, from two points of a receptance with equal magnitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linearized {
    /// Amplitude of the force, N.
    pub force_n: f64,
    /// Receptance magnitude |H|, m/N, which the two points of the mode have in common.
    pub receptance: f64,
    /// Natural frequency ω_r, rad/s.
    pub omega: f64,
    /// Loss factor η_r.
    pub loss_factor: f64,
    /// Complex modal constant A_r + iB_r of the mode, 1/kg, numerator of its receptance.
    pub modal_constant: Complex64,
}

/// Empirical map of a modal parameter over the force amplitude F and the receptance X/F: value = a(F)·(X/F)² +
/// b(F)·(X/F) + c(F). The polynomials a, b, c in F have degree 1 as in thesis eqs 4.8 and 4.9, or degree 2, which a
/// cubic mode requires (its a is proportional to F²).
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Coefficients of the polynomial a from the highest power of F down, then those of b, then those of c.
    pub coefficients: Vec<f64>,
    /// Standard deviations of the coefficients.
    pub deviations: Vec<f64>,
    /// NRMSE of the map: RMS of the residual over RMS of the mapped values.
    pub relative_error: f64,
    /// Smallest and largest force, N, and smallest and largest receptance, m/N, of the fitted points.
    pub range: [[f64; 2]; 2],
}

/// Coefficients of the map of thesis eq. 4.8 as printed: natural frequency ω_r of the first mode in y, in Hz as in Fig.
/// 4.10.
pub const THESIS_FREQUENCY_HZ: [f64; 6] = [-3.7e8, 1.3e9, 5.6e3, -6.3, -0.036, 8.7];
/// Coefficients of the map of thesis eq. 4.9 as printed: loss factor η_r of the first mode in y.
pub const THESIS_LOSS_FACTOR: [f64; 6] = [6.1e7, -2.4e8, -1.1e3, 2.1e3, 0.005, 0.039];

/// Value of a [`Map`] with the given coefficients, three polynomials of equal degree in the force F, at a force and a
/// receptance.
pub fn evaluate(coefficients: &[f64], force_n: f64, receptance: f64) -> f64 {
    let size = (coefficients.len() / 3).max(1);
    coefficients.chunks(size).fold(0.0, |value, polynomial| {
        let of_force = polynomial.iter().fold(0.0, |sum, c| sum * force_n + c);
        value * receptance + of_force
    })
}

impl Map {
    /// Value of the mapped modal parameter at force F, N, and receptance X/F, m/N.
    pub fn at(&self, force_n: f64, receptance: f64) -> f64 {
        evaluate(&self.coefficients, force_n, receptance)
    }

    /// Fits the map of thesis eq. 4.7 to the points of all forces together by least squares. `None` if there are fewer
    /// points than coefficients, or if they do not determine the coefficients, for example with no more distinct forces
    /// than the degree in F.
    pub fn fit(points: &[Linearized], degree: usize, value: impl Fn(&Linearized) -> f64) -> Option<Self> {
        let size = degree + 1;
        let matrix = DMatrix::from_fn(points.len(), 3 * size, |row, column| {
            let Linearized {
                force_n, receptance, ..
            } = points[row];
            receptance.powi(2 - (column / size) as i32) * force_n.powi((degree - column % size) as i32)
        });
        let right = DVector::from_iterator(points.len(), points.iter().map(&value));
        if points.len() < 3 * size {
            return None;
        }
        let fit = LinearProblem::new(&matrix, &right).solve().ok()?;
        let variance = fit.sum_of_squares / fit.degrees_of_freedom.max(1) as f64;
        let ends = |of: fn(&Linearized) -> f64| {
            let values = points.iter().map(of);
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| {
                [a.min(x), b.max(x)]
            })
        };
        Some(Self {
            coefficients: fit.parameters.iter().copied().collect(),
            deviations: (0..3 * size)
                .map(|i| (variance * fit.covariance[(i, i)]).sqrt())
                .collect(),
            relative_error: fit.sum_of_squares.sqrt() / right.norm(),
            range: [ends(|point| point.force_n), ends(|point| point.receptance)],
        })
    }
}

impl Curve {
    /// Linearized modes from pairs of points with equal receptance magnitude |H| on both sides of the resonance peak,
    /// with |H| from the fraction `share` to 98 % of the peak.
    ///
    /// Each measured point on one side is paired with an interpolated point on the other. Between points, real and
    /// imaginary part of H are cubics through four of them. Empty if the peak is at an end of the curve.
    pub fn linearized(&self, share: f64) -> Vec<Linearized> {
        let Some(peak) = self.peak() else {
            return Vec::new();
        };
        let top = self.points[peak].1.norm();
        let mut found = Vec::new();
        for (index, &(omega, h)) in self.points.iter().enumerate() {
            let level = h.norm();
            if index == peak || level < share * top || level > LARGEST_PAIRED_RECEPTANCE * top {
                continue;
            }
            let other = if index < peak {
                self.crossing(level, (peak..self.points.len() - 1).collect())
            } else {
                self.crossing(level, (0..peak).rev().collect())
            };
            let Some((other_omega, other_h)) = other else {
                continue;
            };
            let mode = two_points([(omega, h), (other_omega, other_h)]);
            if let Some((omega, loss_factor, modal_constant)) = mode {
                found.push(Linearized {
                    force_n: self.force_n,
                    receptance: level,
                    omega,
                    loss_factor,
                    modal_constant,
                });
            }
        }
        found
    }

    fn peak(&self) -> Option<usize> {
        let mut peak = 0;
        for (index, point) in self.points.iter().enumerate() {
            if point.1.norm() > self.points[peak].1.norm() {
                peak = index;
            }
        }
        (peak > 0 && peak + 1 < self.points.len()).then_some(peak)
    }

    /// First crossing of |H| with `level` in the frequency intervals that begin at the points `starts`: its ω, rad/s,
    /// and H; `None` if there is none.
    fn crossing(&self, level: f64, starts: Vec<usize>) -> Option<(f64, Complex64)> {
        let start = starts.into_iter().find(|&i| {
            let (a, b) = (
                self.points[i].1.norm() - level,
                self.points[i + 1].1.norm() - level,
            );
            a * b <= 0.0 && a != b
        })?;
        let ends = [self.points[start].0, self.points[start + 1].0];
        let below = self.points[start].1.norm() < level;
        let [low, _] = bisection(ends, 0.0, |omega| {
            (self.between(start, omega).norm() < level) == below
        });
        Some((low, self.between(start, low)))
    }

    /// Receptance at `omega`, rad/s, from the cubic through four points at the interval that begins at the point
    /// `start`, or through all points if there are fewer.
    fn between(&self, start: usize, omega: f64) -> Complex64 {
        let first = start.saturating_sub(1).min(self.points.len().saturating_sub(4));
        let around = &self.points[first..(first + 4).min(self.points.len())];
        let mut sum = Complex64::ZERO;
        for (i, (xi, hi)) in around.iter().enumerate() {
            let mut weight = 1.0;
            for (j, (xj, _)) in around.iter().enumerate() {
                if i != j {
                    weight *= (omega - xj) / (xi - xj);
                }
            }
            sum += hi * weight;
        }
        sum
    }
}

/// Mode through two points (ω_j, H_j) of a receptance (thesis eqs 4.5 and 4.6): natural frequency ω_r, rad/s, loss
/// factor η_r, modal constant A_r + iB_r. `None` if the equations are singular or ω_r² is not positive.
///
/// With p = ω_r² and g = η_r ω_r² the two complex equations H_j·(p − ω_j² + i·g) = A + iB are linear in p, g, A, B.
pub fn two_points(points: [(f64, Complex64); 2]) -> Option<(f64, f64, Complex64)> {
    // Scaling of H and ω² to the order of 1 keeps the linear system well conditioned.
    let size = points[0].1.norm();
    let scale = points[0].0 * points[0].0;
    let mut matrix = Matrix4::zeros();
    let mut right = Vector4::zeros();
    for (index, (omega, h)) in points.iter().enumerate() {
        let (h, square) = (h / size, omega * omega / scale);
        let (re, im) = (2 * index, 2 * index + 1);
        (matrix[(re, 0)], matrix[(re, 1)], matrix[(re, 2)]) = (h.re, -h.im, -1.0);
        (matrix[(im, 0)], matrix[(im, 1)], matrix[(im, 3)]) = (h.im, h.re, -1.0);
        (right[re], right[im]) = (h.re * square, h.im * square);
    }
    let solution = matrix.lu().solve(&right)?;
    let square = solution[0] * scale;
    (square > 0.0).then(|| {
        let constant = Complex64::new(solution[2], solution[3]) * (size * scale);
        (square.sqrt(), solution[1] / solution[0], constant)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_points_of_a_mode_recover_its_parameters() {
        let (omega, eta) = (109.0, 0.033);
        let constant = Complex64::new(5e-3, 2e-4);
        let h = |w: f64| constant / Complex64::new(omega * omega - w * w, eta * omega * omega);
        let (found, loss, residue) = two_points([(107.0, h(107.0)), (111.5, h(111.5))]).unwrap();
        // The error is rounding, multiplied by 1/η because the two points are close.
        assert!((found / omega - 1.0).abs() < 1e-12 && (loss / eta - 1.0).abs() < 1e-9);
        assert!((residue - constant).norm() < 1e-10 * constant.norm());
    }

    #[test]
    fn the_maps_of_the_thesis_are_as_printed() {
        // Worked out by hand from thesis eq. 4.8 at F = 4.2 N, X/F = 15 µm/N: (−3.7e8·4.2 + 1.3e9)·2.25e-10 +
        // (5.6e3·4.2 − 6.3)·15e-6 + (−0.036·4.2 + 8.7).
        let omega = evaluate(&THESIS_FREQUENCY_HZ, 4.2, 15e-6);
        assert!(
            (omega - (-0.057150 + 0.352_705_5 + 8.5488)).abs() < 1e-9,
            "{omega}"
        );
        // Worked out by hand from thesis eq. 4.9 at the same point: (6.1e7·4.2 − 2.4e8)·2.25e-10 + (−1.1e3·4.2 +
        // 2.1e3)·15e-6 + (0.005·4.2 + 0.039).
        let eta = evaluate(&THESIS_LOSS_FACTOR, 4.2, 15e-6);
        assert!((eta - (0.003_645 - 0.0378 + 0.06)).abs() < 1e-9, "{eta}");
    }

    #[test]
    fn a_map_of_the_printed_form_is_recovered() {
        let mut points = Vec::new();
        for force_n in [4.2, 9.8, 16.5] {
            for k in 0..12 {
                let receptance = 4e-6 + 1e-6 * f64::from(k);
                points.push(Linearized {
                    force_n,
                    receptance,
                    omega: evaluate(&THESIS_FREQUENCY_HZ, force_n, receptance),
                    loss_factor: evaluate(&THESIS_LOSS_FACTOR, force_n, receptance),
                    modal_constant: Complex64::ZERO,
                });
            }
        }
        let frequency = Map::fit(&points, 1, |point| point.omega).unwrap();
        let loss = Map::fit(&points, 1, |point| point.loss_factor).unwrap();
        for i in 0..6 {
            // The data are exact; rounding is magnified by the condition number of the regression, about 1e4.
            assert!((frequency.coefficients[i] / THESIS_FREQUENCY_HZ[i] - 1.0).abs() < 1e-6);
            assert!((loss.coefficients[i] / THESIS_LOSS_FACTOR[i] - 1.0).abs() < 1e-6);
        }
    }
}
