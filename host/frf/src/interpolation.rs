//! Interpolation and extrapolation of an FRF table.

use nalgebra::{Matrix3, SMatrix};
use num_complex::Complex64;

use super::{FrfError, FrfTable};
use quietcut_model::structure::feed_axes;

/// Smallest number of frequency lines of a table that is interpolated: a cubic polynomial needs four points.
const LINES_MIN: usize = 4;

/// Receptance matrix H(f), m/N, at any frequency, from a table; rows displacement, columns force. Entries that the
/// table lacks are zero.
///
/// Between the lines each entry is the cubic through the two nearest lines on each side (Lagrange; at the ends of the
/// table, through its first or last four lines). It equals the table on its lines. Near the resonance of a mode with
/// the half bandwidth ζf, the error midway between lines at the spacing Δf is 0.56 (Δf/ζf)⁴ of the peak: 0.09 % with
/// five lines per half bandwidth, 3.5 % with two. [`Interpolation::error`] estimates the error from the table itself.
///
/// Below the first line H is that of stiffness and viscous damping: Re H constant, Im H ∝ f. Above the last line H is
/// that of inertia, H ∝ f⁻². Both continue the table without a step, and hold only far from resonances. For real f,
/// H(−f) is the conjugate of H(f).
#[derive(Clone, Debug)]
pub struct Interpolation {
    frequency_hz: Vec<f64>,
    lines: Vec<Matrix3<Complex64>>,
    /// Errors |ΔH| by aliasing at the lines, m/N; empty where the table states none.
    folding: Vec<Matrix3<f64>>,
}

impl Interpolation {
    /// Interpolation of a table.
    ///
    /// # Errors
    /// The table has fewer than four lines.
    pub fn new(table: &FrfTable) -> Result<Self, FrfError> {
        let frequency_hz = table.frequency_hz().to_vec();
        let lines: Vec<_> = (0..frequency_hz.len())
            .filter_map(|index| table.line(index))
            .collect();
        if frequency_hz.len() < LINES_MIN {
            return Err(FrfError::Content {
                path: table.path().into(),
                what: format!(
                    "it has {} lines; at least {LINES_MIN} are needed to know what lies between them",
                    frequency_hz.len()
                ),
            });
        }
        let is_stated = table.entries().iter().any(|entry| entry.folding.is_some());
        let all = 0..if is_stated { frequency_hz.len() } else { 0 };
        Ok(Self {
            folding: all.filter_map(|index| table.folding(index)).collect(),
            frequency_hz,
            lines,
        })
    }

    /// Interpolation through every second line of this table, from the first, and its last line; `None` if fewer than
    /// four lines remain. The difference between both interpolations shows the effect of the line spacing.
    pub fn thinned(&self) -> Option<Self> {
        let last = self.lines.len() - 1;
        let kept = || (0..last).step_by(2).chain([last]);
        (kept().count() >= LINES_MIN).then(|| Self {
            frequency_hz: kept().map(|index| self.frequency_hz[index]).collect(),
            lines: kept().map(|index| self.lines[index]).collect(),
            folding: kept()
                .filter_map(|index| self.folding.get(index).copied())
                .collect(),
        })
    }

    /// First and last frequency of the table, Hz.
    pub fn band_hz(&self) -> (f64, f64) {
        match self.frequency_hz.as_slice() {
            [first, .., last] => (*first, *last),
            // A table has at least four lines, so that the arm above always matches.
            _ => (0.0, 0.0),
        }
    }

    /// Frequencies of the lines of the table, Hz.
    pub fn frequency_hz(&self) -> &[f64] {
        &self.frequency_hz
    }

    /// The receptances in feed, normal and axial direction, Rᵀ H R with the columns of R from [`feed_axes`], for a feed
    /// at `angle_deg` degrees from x towards y.
    pub fn rotated(&self, angle_deg: f64) -> Self {
        let axes = feed_axes(angle_deg);
        let (machine_from_feed, sizes) = (axes.map(Complex64::from), axes.abs());
        Self {
            frequency_hz: self.frequency_hz.clone(),
            lines: self
                .lines
                .iter()
                .map(|line| machine_from_feed.transpose() * line * machine_from_feed)
                .collect(),
            // Errors of unknown phase add up by their absolute values.
            folding: self
                .folding
                .iter()
                .map(|line| sizes.transpose() * line * sizes)
                .collect(),
        }
    }

    /// Receptance matrices H at the lines of the table, m/N.
    pub fn lines(&self) -> &[Matrix3<Complex64>] {
        &self.lines
    }

    /// Errors |ΔH| of the receptance matrix by aliasing at the line nearest to a frequency, m/N: the half width of a 90 %
    /// interval of real and imaginary part; 0 where the table states none.
    pub fn folding(&self, frequency_hz: f64) -> Matrix3<f64> {
        let above = self
            .frequency_hz
            .partition_point(|line| *line < frequency_hz.abs());
        let near = [above.saturating_sub(1), above].into_iter();
        let off = |index: &usize| (self.frequency_hz[*index] - frequency_hz.abs()).abs();
        let nearest = near
            .filter(|index| *index < self.folding.len())
            .min_by(|a, b| off(a).total_cmp(&off(b)));
        nearest.map_or_else(Matrix3::zeros, |index| self.folding[index])
    }

    /// Receptance matrix H, m/N, at the complex frequency f = s/(2πi), Hz.
    ///
    /// Off the real axis the functions of the real frequency are continued analytically, the cubic of the lines nearest
    /// to Re f among them. The cubic is accurate only within about one line spacing of the axis, and well within the
    /// distance of the nearest pole.
    pub fn at(&self, frequency_hz: Complex64) -> Matrix3<Complex64> {
        if frequency_hz.re < 0.0 {
            // H of the conjugate s is the conjugate of H; conjugation of s maps f to −f̄.
            self.at_positive(-frequency_hz.conj()).map(|entry| entry.conj())
        } else {
            self.at_positive(frequency_hz)
        }
    }

    fn at_positive(&self, frequency_hz: Complex64) -> Matrix3<Complex64> {
        let (first, last) = self.band_hz();
        if frequency_hz.re < first {
            let share = frequency_hz / first;
            return self.lines[0].map(|entry| entry.re + Complex64::I * entry.im * share);
        }
        if frequency_hz.re > last {
            return self.lines[self.lines.len() - 1] * (last / frequency_hz).powi(2);
        }
        // The four nearest lines: two below the frequency and two at or above it, shifted inwards at the ends of the
        // table.
        let above = self.frequency_hz.partition_point(|&line| line < frequency_hz.re);
        let from = above.saturating_sub(2).min(self.lines.len() - 4);
        self.cubic([from, from + 1, from + 2, from + 3], frequency_hz)
    }

    /// Value at `frequency_hz` of the cubic Lagrange polynomial through the four lines `nodes`.
    fn cubic(&self, nodes: [usize; 4], frequency_hz: Complex64) -> Matrix3<Complex64> {
        let at = nodes.map(|node| self.frequency_hz[node]);
        let mut sum = SMatrix::zeros();
        for (i, &node) in nodes.iter().enumerate() {
            let mut weight = Complex64::ONE;
            for j in (0..4).filter(|&j| j != i) {
                weight *= (frequency_hz - at[j]) / (at[i] - at[j]);
            }
            sum += self.lines[node] * weight;
        }
        sum
    }

    /// Estimate of the largest interpolation error, as a fraction of the largest entry of H on the lines.
    ///
    /// Each line except the first three and the last three is predicted from the first and the third line on each side,
    /// at equal spacing a cubic with twice the spacing. The error of a cubic is proportional to the fourth power of the
    /// spacing, so that the estimate is 1/16 of the largest prediction error. Measurement noise counts as error. The
    /// estimate is 0 for tables of fewer than seven lines and for tables of zeros.
    pub fn error(&self) -> f64 {
        let peak = self.lines.iter().map(largest).fold(0.0, f64::max);
        let count = self.lines.len();
        let worst = (3..count.saturating_sub(3))
            .map(|index| {
                let nodes = [index - 3, index - 1, index + 1, index + 3];
                let predicted = self.cubic(nodes, self.frequency_hz[index].into());
                largest(&(predicted - self.lines[index]))
            })
            .fold(0.0, f64::max);
        if peak > 0.0 { worst / (16.0 * peak) } else { 0.0 }
    }
}

fn largest(matrix: &Matrix3<Complex64>) -> f64 {
    matrix.iter().map(|entry| entry.norm()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;
    use std::path::Path;

    use super::*;
    use crate::Frf;
    use quietcut_model::structure::Direction;

    /// Receptance of one mode of 17 Hz with 3 % damping and unit mass.
    fn mode(frequency_hz: f64) -> Complex64 {
        let (omega, pole) = (TAU * frequency_hz, TAU * 17.0);
        Complex64::new(pole * pole - omega * omega, 2.0 * 0.03 * pole * omega).inv()
    }

    fn table(first: f64, last: f64, step: f64) -> FrfTable {
        let count = ((last - first) / step).round() as usize;
        let frequency_hz: Vec<f64> = (0..=count).map(|i| first + step * i as f64).collect();
        let entry = |response, force, factor: f64| Frf {
            response,
            force,
            receptance: frequency_hz.iter().map(|&f| mode(f) * factor).collect(),
            coherence: None,
            folding: None,
        };
        let entries = vec![
            entry(Direction::X, Direction::X, 1.0),
            entry(Direction::Y, Direction::X, -0.5),
        ];
        FrfTable::new(Path::new("mode.csv"), frequency_hz.clone(), entries).unwrap()
    }

    fn peak() -> f64 {
        mode(17.0).norm()
    }

    #[test]
    fn lines_are_met_and_what_lies_between_is_within_the_error_estimated() {
        // Half bandwidth ζf = 0.51 Hz.
        for (step, bound) in [(0.1, 1.2e-3), (0.2, 0.02), (0.05, 8e-5)] {
            let interpolation = Interpolation::new(&table(5.0, 40.0, step)).unwrap();
            assert!(
                (interpolation.at((17.0 + step).into())[(0, 0)] - mode(17.0 + step)).norm() < 1e-12 * peak()
            );
            let worst = (0..3500)
                .map(|i| 5.0 + 0.01 * f64::from(i))
                .map(|f| (interpolation.at(f.into())[(0, 0)] - mode(f)).norm() / peak())
                .fold(0.0, f64::max);
            assert!(worst < bound, "{step}: {worst}");
            // An estimate: right within a factor of two.
            let estimate = interpolation.error();
            assert!(
                (0.5..2.0).contains(&(worst / estimate)),
                "{step}: {worst} {estimate}"
            );
        }
    }

    #[test]
    fn outside_the_lines_it_is_stiffness_and_inertia() {
        let interpolation = Interpolation::new(&table(3.0, 100.0, 0.1)).unwrap();
        // The mode itself is off the stiffness line by (3/17)² of it, and off the inertia line by (17/100)².
        for f in [0.0, 1.0, 2.9] {
            assert!((interpolation.at(f.into())[(0, 0)] - mode(f)).norm() < 0.033 * mode(f).norm());
        }
        for f in [101.0, 200.0, 1000.0] {
            assert!((interpolation.at(f.into())[(0, 0)] - mode(f)).norm() < 0.033 * mode(f).norm());
        }
        assert_eq!(interpolation.at(0.0.into())[(0, 0)].im, 0.0);
        let negative = interpolation.at((-16.93).into());
        assert_eq!(negative[(1, 0)], interpolation.at(16.93.into())[(1, 0)].conj());
        assert_eq!(negative[(0, 1)], Complex64::ZERO);
    }

    #[test]
    fn beside_the_axis_it_is_the_mode_continued() {
        let interpolation = Interpolation::new(&table(5.0, 40.0, 0.1)).unwrap();
        for sigma in [-0.3, 0.3, 1.0] {
            let s = Complex64::new(sigma, TAU * 16.95);
            let pole = TAU * 17.0;
            let exact = (s * s + s * (2.0 * 0.03 * pole) + pole * pole).inv();
            let continued = interpolation.at(s / Complex64::new(0.0, TAU))[(0, 0)];
            // One rad/s is 0.16 Hz: 1.6 lines off the axis, where the pole is 0.51 Hz away.
            assert!((continued - exact).norm() < 0.02 * exact.norm(), "{sigma}");
        }
    }

    #[test]
    fn too_few_lines_are_refused() {
        let error = Interpolation::new(&table(3.0, 3.2, 0.1)).unwrap_err();
        assert!(error.to_string().contains("3 lines"), "{error}");
    }
}
