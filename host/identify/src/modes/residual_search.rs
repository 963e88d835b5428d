//! Poles at which a further mode explains most of the residual of a modal fit.
//!
//! With the weighted residual e of the fit, its Jacobian J, and the columns B of a residue matrix at a pole λ (real and
//! imaginary parts of R in R/(s − λ) + R̄/(s − λ̄) for every receptance), least squares lowers eᵀe by gᵀ S⁻¹ g, with
//! g = Bᵀ(e − J N⁻¹ Jᵀe), S = BᵀB − (JᵀB)ᵀ N⁻¹ JᵀB and N = JᵀJ: the score test, with the parameters of the fit
//! adjusted along. The poles are those of a grid as fine as the half-power bandwidth.

use nalgebra::{Cholesky, DMatrix, DVector};
use num_complex::Complex64;
use rayon::prelude::*;
use std::f64::consts::TAU;

use super::covariance::constrained_inverse;
use super::pole_residue::{PoleResidue, ShapedPole, shared};
use super::receptances::Receptances;
use super::shape;
use super::weights::Weights;
use crate::criteria::OVERDAMPED;

/// Ratio of neighbouring damping ratios of the grid. A choice: two peaks whose damping ratios differ by the factor 2 have
/// the squared correlation 4·2/(1 + 2)² = 0.89.
const DAMPING_STEP: f64 = 4.0;

/// Distance of neighbouring frequencies of the grid, in halves of the half-power bandwidth. A choice: two peaks half as far
/// from each other have the squared correlation 1/(1 + 1/4) = 0.8.
const FREQUENCY_STEP: f64 = 2.0;

/// Distance of the lines from a pole up to which they are used, in decay rates: 2/(50π) = 1.3 % of the squared receptance of a mode lies beyond.
const WINDOW: f64 = 50.0;

/// Part of the decrease of the squared residual by the best pole that the nearest pole of the grid gives at least: 0.89·0.8.
pub(super) const GRID_SHARE: f64 = 0.7;

/// Largest damping ratio of the grid. A choice below `OVERDAMPED`.
const LARGEST_DAMPING: f64 = 0.4 * OVERDAMPED;

/// A pole of the grid with the residues of least squares.
struct Place {
    pole: Complex64,
    /// Decrease of the weighted squared residual.
    gain: f64,
    /// Residues by receptance.
    residues: Vec<Complex64>,
}

/// The residual of a modal fit with what the score test needs of the fit.
struct Residual<'a> {
    data: &'a Receptances,
    weights: Weights,
    /// Weighted Jacobian by receptance: a row per parameter, and two columns per line for real and imaginary part.
    jacobian: Vec<DMatrix<f64>>,
    /// N⁻¹ under the constraints on the mode shapes.
    inverse: DMatrix<f64>,
    /// Weighted residual by receptance, real and imaginary part of each line.
    left: Vec<DVector<f64>>,
    /// N⁻¹ Jᵀe.
    adjusted: DVector<f64>,
}

impl<'a> Residual<'a> {
    fn new(data: &'a Receptances, fit: &PoleResidue) -> Option<Self> {
        let mut weights = Weights::of(&data.deviation);
        weights.update(data, fit);
        let unknowns = fit.parameters().len();
        let lines = data.frequency_hz.len();
        let mut row = vec![Complex64::ZERO; unknowns];
        let mut jacobian = Vec::with_capacity(data.values.len());
        let mut left = Vec::with_capacity(data.values.len());
        for (k, deviation) in weights.deviation.iter().enumerate() {
            let mut matrix = DMatrix::<f64>::zeros(unknowns, 2 * lines);
            for (line, hertz) in data.frequency_hz.iter().enumerate() {
                fit.derivatives(
                    data,
                    k,
                    Complex64::new(0.0, TAU * hertz),
                    deviation[line],
                    &mut row,
                );
                for (i, value) in row.iter().enumerate() {
                    matrix[(i, 2 * line)] = value.re;
                    matrix[(i, 2 * line + 1)] = value.im;
                }
            }
            jacobian.push(matrix);
            let residual = fit.left_of(data, &weights.deviation, k);
            left.push(DVector::from_iterator(
                2 * lines,
                residual.iter().flat_map(|z| [z.re, z.im]),
            ));
        }
        let normal = jacobian
            .iter()
            .fold(DMatrix::zeros(unknowns, unknowns), |sum, of| {
                sum + of * of.transpose()
            });
        let inverse = constrained_inverse(fit, &shared(data), &normal)?;
        let gradient = jacobian
            .iter()
            .zip(&left)
            .fold(DVector::zeros(unknowns), |sum, (of, left)| sum + of * left);
        let adjusted = &inverse * gradient;
        Some(Self {
            data,
            weights,
            jacobian,
            inverse,
            left,
            adjusted,
        })
    }

    /// Range of the lines within [`WINDOW`] decay rates of a pole.
    fn lines_about(&self, pole: Complex64) -> (usize, usize) {
        let (hertz, width_hz) = (pole.im / TAU, WINDOW * -pole.re / TAU);
        let below = |limit_hz: f64| self.data.frequency_hz.partition_point(|line| *line < limit_hz);
        (below(hertz - width_hz), below(hertz + width_hz))
    }

    /// Score test of a mode with this pole; `None` where the fit can represent it already.
    fn place(&self, pole: Complex64) -> Option<Place> {
        let count = self.jacobian.len();
        let (first, last) = self.lines_about(pole);
        let lines = last - first;
        let mut shared = DMatrix::<f64>::zeros(self.inverse.nrows(), 2 * count);
        let mut normal = DMatrix::<f64>::zeros(2 * count, 2 * count);
        let mut gradient = DVector::<f64>::zeros(2 * count);
        let mut basis = DMatrix::<f64>::zeros(2 * lines, 2);
        for k in 0..count {
            let deviation = &self.weights.deviation[k][first..last];
            for (line, hertz) in self.data.frequency_hz[first..last].iter().enumerate() {
                let s = Complex64::new(0.0, TAU * hertz);
                let (up, down) = ((s - pole).inv(), (s - pole.conj()).inv());
                let of_real = (up + down) / deviation[line];
                let of_imaginary = Complex64::i() * (up - down) / deviation[line];
                basis[(2 * line, 0)] = of_real.re;
                basis[(2 * line + 1, 0)] = of_real.im;
                basis[(2 * line, 1)] = of_imaginary.re;
                basis[(2 * line + 1, 1)] = of_imaginary.im;
            }
            let with_fit = self.jacobian[k].columns(2 * first, 2 * lines) * &basis;
            let own = basis.transpose() * &basis;
            let left = self.left[k].rows(2 * first, 2 * lines);
            let of_left = basis.transpose() * left - with_fit.transpose() * &self.adjusted;
            shared.columns_mut(2 * k, 2).copy_from(&with_fit);
            normal.view_mut((2 * k, 2 * k), (2, 2)).copy_from(&own);
            gradient.rows_mut(2 * k, 2).copy_from(&of_left);
        }
        let scale = normal.diagonal().map(|entry| entry.sqrt().recip());
        let mut score = normal - shared.transpose() * &self.inverse * &shared;
        for i in 0..2 * count {
            gradient[i] *= scale[i];
            for j in 0..2 * count {
                score[(i, j)] *= scale[i] * scale[j];
            }
            // A part that the fit can represent already, up to rounding, explains nothing more.
            score[(i, i)] += 1e-9;
        }
        let solution = Cholesky::new(score)?.solve(&gradient);
        let residues = (0..count)
            .map(|k| {
                Complex64::new(
                    solution[2 * k] * scale[2 * k],
                    solution[2 * k + 1] * scale[2 * k + 1],
                )
            })
            .collect();
        Some(Place {
            pole,
            gain: gradient.dot(&solution),
            residues,
        })
    }
}

/// Poles of the grid over the band of the data: half-power bandwidths from one line spacing up, and frequencies as dense as
/// half-power bandwidths.
fn grid(data: &Receptances) -> Vec<Complex64> {
    let [from_hz, to_hz] = data.band_hz();
    let mut poles = Vec::new();
    let mut damping = LARGEST_DAMPING;
    while is_resolved(data, to_hz, damping) {
        let mut hertz = from_hz;
        while hertz < to_hz {
            if is_resolved(data, hertz, damping) {
                let omega = TAU * hertz;
                poles.push(Complex64::new(
                    -damping * omega,
                    omega * (1.0 - damping * damping).sqrt(),
                ));
            }
            hertz *= 1.0 + FREQUENCY_STEP * damping;
        }
        damping /= DAMPING_STEP;
    }
    poles
}

/// True if the half-power bandwidth 2ζf is at least the distance of the lines. A narrower pole is the value of one line.
pub(super) fn is_resolved(data: &Receptances, hertz: f64, damping_ratio: f64) -> bool {
    2.0 * damping_ratio * hertz >= data.spacing_hz()
}

/// Fits with one more mode each, and how many poles were tried.
pub(super) struct Search {
    /// Number of poles.
    pub(super) tried: usize,
    /// The fits with the decrease of the weighted squared residual that linear least squares lets expect, largest first.
    pub(super) starts: Vec<(f64, PoleResidue)>,
}

/// The fit with one more mode, at the poles of a grid over the band where that explains most of its residual, at most `count`. Of
/// poles closer than a decay rate only the better one is taken.
pub(super) fn further(data: &Receptances, fit: &PoleResidue, count: usize) -> Search {
    let poles = grid(data);
    let tried = poles.len();
    let mut places: Vec<Place> = Residual::new(data, fit).map_or_else(Vec::new, |residual| {
        poles
            .into_par_iter()
            .filter_map(|pole| residual.place(pole))
            .collect()
    });
    places.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let mut taken: Vec<Complex64> = Vec::new();
    let mut starts = Vec::new();
    for place in places {
        let is_near = |other: &Complex64| (place.pole - other).norm() < (-place.pole.re).max(-other.re);
        if starts.len() == count {
            break;
        }
        if taken.iter().any(is_near) {
            continue;
        }
        taken.push(place.pole);
        starts.extend(with_mode(data, fit, &place).map(|start| (place.gain, start)));
    }
    Search { tried, starts }
}

/// The fit with a mode of the residues at a pole, reduced to rank one.
fn with_mode(data: &Receptances, fit: &PoleResidue, place: &Place) -> Option<PoleResidue> {
    let mut matrix = DMatrix::zeros(data.responses.len(), data.forces.len());
    for (&at, residue) in data.places.iter().zip(&place.residues) {
        matrix[at] = *residue;
    }
    let (mut right, mut left, _) = shape::rank_one(&matrix)?;
    shape::normalize(&mut right, &mut left, &shared(data));
    let mut larger = fit.clone();
    larger.modes.push(ShapedPole {
        pole: place.pole,
        right,
        left,
    });
    Some(larger)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use quietcut_model::structure::Direction;

    use super::*;

    const SEED: u64 = 20_261_127;

    fn mode(hertz: f64, damping_ratio: f64, right: [f64; 2]) -> ShapedPole {
        let omega = TAU * hertz;
        let turned = |entry: f64| Complex64::new(entry, -entry) * 2e-3;
        ShapedPole {
            pole: Complex64::new(-damping_ratio, (1.0 - damping_ratio * damping_ratio).sqrt()) * omega,
            right: right.map(turned).to_vec(),
            left: right.map(turned).to_vec(),
        }
    }

    /// Receptances in x and y of modes, with white noise whose standard deviation in y is ten times that in x.
    fn measured(modes: Vec<ShapedPole>, seed: u64) -> (Receptances, PoleResidue) {
        let structure = PoleResidue {
            modes,
            outside: vec![[0.0; 2]; 4],
        };
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let frequency_hz: Vec<f64> = (0..300).map(|line| 200.0 + 3.0 * f64::from(line)).collect();
        let places = vec![(0, 0), (0, 1), (1, 0), (1, 1)];
        let deviation: Vec<Vec<f64>> = places
            .iter()
            .map(|&(p, _)| vec![if p == 0 { 2e-10 } else { 2e-9 }; frequency_hz.len()])
            .collect();
        let values = (0..places.len())
            .map(|k| {
                let at = |(line, hertz): (usize, &f64)| {
                    let noise = Complex64::new(normal(), normal()) * deviation[k][line];
                    structure.value(places[k], k, Complex64::new(0.0, TAU * hertz)) + noise
                };
                frequency_hz.iter().enumerate().map(at).collect()
            })
            .collect();
        let data = Receptances {
            frequency_hz,
            responses: vec![Direction::X, Direction::Y],
            forces: vec![Direction::X, Direction::Y],
            response_points: vec![0; 2],
            force_points: vec![0; 2],
            places,
            values,
            deviation,
            folding: Vec::new(),
            has_deviation: true,
            has_coherence: false,
        };
        (data, structure)
    }

    /// The decrease of the squared residual is that of a dense least-squares fit of all parameters with all residues.
    #[test]
    fn the_gain_of_a_pole_is_that_of_least_squares() {
        let (data, mut structure) = measured(
            vec![mode(500.0, 0.03, [1.0, 0.2]), mode(640.0, 0.02, [0.1, 0.3])],
            SEED,
        );
        let hidden = structure.modes.pop().unwrap();
        let residual = Residual::new(&data, &structure).unwrap();
        let place = residual.place(hidden.pole).unwrap();

        let lines = data.frequency_hz.len();
        let (rows, unknowns) = (2 * lines * 4, structure.parameters().len());
        let mut matrix = DMatrix::<f64>::zeros(rows, unknowns + 8);
        let mut left = DVector::<f64>::zeros(rows);
        for k in 0..4 {
            for (line, hertz) in data.frequency_hz.iter().enumerate() {
                let row = 2 * (k * lines + line);
                let s = Complex64::new(0.0, TAU * hertz);
                let deviation = residual.weights.deviation[k][line];
                let mut by = vec![Complex64::ZERO; unknowns];
                structure.derivatives(&data, k, s, deviation, &mut by);
                let of = |residue: Complex64| shape::pair(residue, s, hidden.pole) / deviation;
                by.extend(vec![Complex64::ZERO; 8]);
                by[unknowns + 2 * k] = of(Complex64::ONE);
                by[unknowns + 2 * k + 1] = of(Complex64::i());
                let rest = (data.values[k][line] - structure.value(data.places[k], k, s)) / deviation;
                left[row] = rest.re;
                left[row + 1] = rest.im;
                for (column, value) in by.iter().enumerate() {
                    matrix[(row, column)] = value.re;
                    matrix[(row + 1, column)] = value.im;
                }
            }
        }
        for mut column in matrix.column_iter_mut() {
            let norm = column.norm();
            column /= norm;
        }
        let squares = |columns: usize| {
            let svd = matrix.columns(0, columns).svd(true, true);
            let solution = svd.solve(&left, 1e-9).unwrap();
            (&left - matrix.columns(0, columns) * solution).norm_squared()
        };
        let expected = squares(unknowns) - squares(unknowns + 8);
        assert!(
            (place.gain / expected - 1.0).abs() < 1e-4,
            "{} {expected}",
            place.gain
        );
    }

    #[test]
    fn a_mode_that_a_fit_lacks_has_the_largest_gain() {
        let (data, mut structure) = measured(
            vec![mode(500.0, 0.03, [1.0, 0.2]), mode(640.0, 0.02, [0.1, 0.3])],
            SEED,
        );
        let hidden = structure.modes.pop().unwrap();
        let search = further(&data, &structure, 2);
        let (gain, best) = &search.starts[0];
        let found = best.modes.last().unwrap().pole;
        // The grid has a pole within a half-power bandwidth.
        assert!(
            (found - hidden.pole).norm() < -2.0 * hidden.pole.re,
            "{found} {}",
            hidden.pole
        );
        assert!(*gain > 100.0, "{gain}");
    }

    /// Noise has the largest gain of some 200 poles, each χ² of the eight numbers of its residues.
    #[test]
    fn noise_gains_no_more_than_chance() {
        println!("seed {SEED}");
        let mut gains: Vec<f64> = (0..40)
            .map(|seed| {
                let (data, structure) = measured(vec![mode(500.0, 0.03, [1.0, 0.2])], SEED + seed);
                let search = further(&data, &structure, 1);
                search.starts.first().map_or(0.0, |(gain, _)| *gain)
            })
            .collect();
        gains.sort_by(f64::total_cmp);
        println!("{gains:.1?}");
        // P(χ²₈ > 15.5) = 5 % and P(χ²₈ > 40) = 3e-6.
        assert!(gains[20] > 15.5, "{gains:?}");
        assert!(gains[39] < 40.0, "{gains:?}");
    }
}
