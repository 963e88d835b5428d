//! Modes in pole–residue form.
//!
//! H_pq(s) = Σ_r Ψᴿ_pr Ψᴸ_qr/(s − λ_r) + conjugates + U_pq + L_pq/s², with real U (compliance of the modes above the
//! band) and real L (inertia of the modes below it). All residue matrices have rank one.

use nalgebra::DVector;
use num_complex::Complex64;
use std::f64::consts::TAU;

use super::error::ModesError;
use super::receptances::Receptances;
use super::shape;
use super::stabilization::matrix_of;
use quietcut_frf::rational_fit::residues;

/// A pole λ, rad/s, with the right and left shape of its mode.
#[derive(Clone, Debug)]
pub(super) struct ShapedPole {
    pub(super) pole: Complex64,
    pub(super) right: Vec<Complex64>,
    pub(super) left: Vec<Complex64>,
}

impl ShapedPole {
    /// Number of real parameters of the mode in the fit: pole, right and left shape.
    pub(super) fn width(&self) -> usize {
        2 + 2 * (self.right.len() + self.left.len())
    }
}

/// Parameters of a modal fit: poles and shapes of the modes, and terms of the modes outside the band.
#[derive(Clone, Debug)]
pub(super) struct PoleResidue {
    pub(super) modes: Vec<ShapedPole>,
    /// Terms U and L of the modes outside the band for each receptance: compliance U, m/N, and inertia term L, 1/kg.
    pub(super) outside: Vec<[f64; 2]>,
}

impl PoleResidue {
    /// Start of the modal fit: residues at the given poles by linear least squares, each residue matrix reduced to rank
    /// one.
    ///
    /// # Errors
    /// The residues cannot be computed, or the singular value decomposition of a residue matrix fails.
    pub(super) fn start(data: &Receptances, poles: &[Complex64]) -> Result<Self, ModesError> {
        let functions: Vec<&[Complex64]> = data.values.iter().map(Vec::as_slice).collect();
        let fit = residues(&data.frequency_hz, &functions, poles.to_vec())?;
        let modes = poles
            .iter()
            .enumerate()
            .map(|(r, &pole)| {
                let (mut right, mut left, _) = shape::rank_one(&matrix_of(data, &fit.residues, r))?;
                shape::normalize(&mut right, &mut left, &shared(data));
                Some(ShapedPole { pole, right, left })
            })
            .collect::<Option<Vec<_>>>()
            .ok_or(ModesError::NotConverged(poles.len()))?;
        let mut start = Self {
            modes,
            outside: vec![[0.0; 2]; data.values.len()],
        };
        start.fit_outside(data);
        Ok(start)
    }

    /// Fits the terms U and L of the modes outside the band to the real part of the receptances minus the modes in the
    /// band, by weighted linear least squares.
    fn fit_outside(&mut self, data: &Receptances) {
        for k in 0..data.values.len() {
            let (mut gram, mut right) = ([[0.0; 2]; 2], [0.0; 2]);
            for (line, &hertz) in data.frequency_hz.iter().enumerate() {
                let s = Complex64::new(0.0, TAU * hertz);
                let left = (data.values[k][line] - self.of_modes(data.places[k], s)).re;
                let weight = data.deviation[k][line].powi(-2);
                let row = [1.0, (s * s).inv().re];
                for i in 0..2 {
                    right[i] += weight * row[i] * left;
                    for j in 0..2 {
                        gram[i][j] += weight * row[i] * row[j];
                    }
                }
            }
            let determinant = gram[0][0] * gram[1][1] - gram[0][1] * gram[1][0];
            if determinant > 0.0 {
                self.outside[k] = [
                    (right[0] * gram[1][1] - right[1] * gram[0][1]) / determinant,
                    (right[1] * gram[0][0] - right[0] * gram[1][0]) / determinant,
                ];
            }
        }
    }

    fn of_modes(&self, (p, q): (usize, usize), s: Complex64) -> Complex64 {
        self.modes
            .iter()
            .map(|mode| shape::pair(mode.right[p] * mode.left[q], s, mode.pole))
            .sum()
    }

    pub(super) fn value(&self, place: (usize, usize), k: usize, s: Complex64) -> Complex64 {
        let [above, below] = self.outside[k];
        self.of_modes(place, s) + above + below / (s * s)
    }

    /// Parameters of the fit as a vector: for each mode Re λ, Im λ, right shape (real and imaginary parts in turn),
    /// left shape; then the terms U and L of the modes outside the band for each receptance.
    pub(super) fn parameters(&self) -> DVector<f64> {
        let modes = self.modes.iter().flat_map(|mode| {
            let numbers = std::iter::once(&mode.pole).chain(&mode.right).chain(&mode.left);
            numbers.flat_map(|z| [z.re, z.im]).collect::<Vec<f64>>()
        });
        let all: Vec<f64> = modes.chain(self.outside.iter().flatten().copied()).collect();
        DVector::from_vec(all)
    }

    /// These modes with their parameters changed by `step`, in the order of [`Self::parameters`].
    pub(super) fn moved(&self, step: &[f64]) -> Self {
        let mut moved = self.clone();
        let mut values = step.iter();
        let mut next = || values.next().copied().unwrap_or(0.0);
        for mode in &mut moved.modes {
            for z in std::iter::once(&mut mode.pole)
                .chain(&mut mode.right)
                .chain(&mut mode.left)
            {
                *z += Complex64::new(next(), next());
            }
        }
        for value in moved.outside.iter_mut().flatten() {
            *value += next();
        }
        moved
    }

    /// Measured minus fitted receptance `k` at every frequency line, divided by the standard deviation `deviation` of
    /// the measured one.
    pub(super) fn left_of(&self, data: &Receptances, deviation: &[Vec<f64>], k: usize) -> Vec<Complex64> {
        data.frequency_hz
            .iter()
            .enumerate()
            .map(|(line, hertz)| {
                let s = Complex64::new(0.0, TAU * hertz);
                (data.values[k][line] - self.value(data.places[k], k, s)) / deviation[k][line]
            })
            .collect()
    }

    /// Writes the derivatives of the fitted receptance H_k by all parameters at one line, divided by the standard
    /// deviation `deviation` of the measured value, into `row`.
    pub(super) fn derivatives(
        &self,
        data: &Receptances,
        k: usize,
        s: Complex64,
        deviation: f64,
        row: &mut [Complex64],
    ) {
        row.fill(Complex64::ZERO);
        let (p, q) = data.places[k];
        let rights = data.responses.len();
        let width = self.modes.first().map_or(0, ShapedPole::width);
        for (r, mode) in self.modes.iter().enumerate() {
            let (a, b) = ((s - mode.pole).inv(), (s - mode.pole.conj()).inv());
            let mut put = |at: usize, factor: Complex64, a: Complex64, b: Complex64| {
                let (up, down) = (factor * a, factor.conj() * b);
                row[r * width + at] = (up + down) / deviation;
                row[r * width + at + 1] = Complex64::i() * (up - down) / deviation;
            };
            put(0, mode.right[p] * mode.left[q], a * a, b * b);
            put(2 + 2 * p, mode.left[q], a, b);
            put(2 + 2 * (rights + q), mode.right[p], a, b);
        }
        let at = self.modes.len() * width + 2 * k;
        row[at] = Complex64::from(deviation.recip());
        row[at + 1] = (s * s).inv() / deviation;
    }
}

/// Degrees of freedom (directions at points) that are both excited and measured, as pairs of indices in the right and in
/// the left shape.
pub(super) fn shared(data: &Receptances) -> Vec<(usize, usize)> {
    let response = |p: usize| (data.responses[p], data.response_points[p]);
    let force = |q: usize| (data.forces[q], data.force_points[q]);
    let of = |p: usize| Some((p, (0..data.forces.len()).find(|&q| force(q) == response(p))?));
    (0..data.responses.len()).filter_map(of).collect()
}
