//! Loop of cut and structure with periodic directional coefficients: the truncated harmonic transfer matrix.

use nalgebra::{DMatrix, Matrix3, Vector3};
use num_complex::Complex64;

use super::limits::{AxisCrossing, limits};
use super::open_loop::{OpenLoop, RealEnd, around, ascending};
use super::problem::{FrequencyProblem, Resonance};
use crate::error::Breakdown;
use crate::spectrum::stability_loss::StabilityLoss;
use quietcut_model::milling::Harmonic;
use quietcut_numerics::eigenvalues;

/// Open loop of the periodic cut. With u(t) = e^{st} Σ_p u_p e^{ipΩt}:
///
///   u_p = H(s + ipΩ) Σ_q (κ α_{p−q} − β_{p−q}) u_q,   p, q from −K−1 to K.
///
/// Ω is the tooth-passing frequency; α_k and β_k are the harmonics of the coefficients. e^{−(s+ipΩ)τ} is the same for
/// all p, so that κ multiplies the whole matrix. At s = iΩ/2 the frequencies are symmetric about 0: a multiplier −1 is
/// a real eigenvalue there, and a unitary transformation makes the loop matrix real. The range of s from 0 to iΩ/2,
/// with its conjugate, suffices, since roots repeat with iΩ. Forces jump where a tooth enters or leaves, so that α_k
/// falls as 1/k and H as 1/k². Truncation changes limits as 1/K³, and as 1/K² for a structure whose residues do not sum
/// to zero.
pub(crate) struct HarmonicLoop<'a> {
    problem: &'a FrequencyProblem,
    /// Tooth-passing frequency Ω, rad/s.
    passing: f64,
    /// Highest harmonic K.
    harmonics: usize,
    /// Fourier coefficients of the directional coefficients α and β over a tooth period, of order −(2K + 1) to 2K + 1
    /// in ascending order.
    coefficients: Vec<Harmonic>,
    /// Indices of the directions (0 feed, 1 normal, 2 axial) in which the tool moves and thereby changes the chip
    /// thickness or the axial depth, ascending.
    axes: Vec<usize>,
}

impl<'a> HarmonicLoop<'a> {
    /// Open loop with periodic coefficients at a spindle speed (rev/min), with harmonics of the vibration up to K.
    pub(crate) fn new(problem: &'a FrequencyProblem, rpm: f64, harmonics: usize) -> Self {
        let process = &problem.process;
        let most = 2 * harmonics as i32 + 1;
        let moves = problem.moves();
        let normal = &process.force.normal;
        let is_seen = |axis: usize| {
            let part = normal.constant[axis].abs() + normal.cosine[axis].abs() + normal.sine[axis].abs();
            part > 1e-14 || (axis == 2 && process.axial_depth_modulation)
        };
        Self {
            problem,
            passing: std::f64::consts::TAU / problem.tooth_period_s(rpm),
            harmonics,
            coefficients: (-most..=most)
                .map(|k| {
                    process
                        .force
                        .harmonic(&process.engagement, process.feed_per_tooth_m, k)
                })
                .collect(),
            axes: (0..3).filter(|&axis| moves[axis] && is_seen(axis)).collect(),
        }
    }

    /// Number K of harmonics of the tooth-passing frequency with which the loop is first computed: the least whose
    /// highest frequency KΩ reaches 25 % beyond every resonance, plus four.
    pub(crate) fn least_harmonics(problem: &FrequencyProblem, rpm: f64) -> usize {
        let fastest = problem
            .resonances()
            .iter()
            .map(|resonance| resonance.omega)
            .fold(0.0, f64::max);
        let passing = std::f64::consts::TAU / problem.tooth_period_s(rpm);
        (1.25 * fastest / passing).ceil() as usize + 4
    }

    /// Highest harmonic K.
    pub(crate) fn harmonics(&self) -> usize {
        self.harmonics
    }

    /// Limits from every second line of a table, for the error of limits from all lines; `None` without a table, or if
    /// fewer than four lines remain. If they cannot be computed the list is empty, and limits have no stated error.
    pub(crate) fn thinned_limits(&self, depth_m: f64) -> Option<Vec<AxisCrossing>> {
        let problem = self.problem.thinned()?;
        let thinned = HarmonicLoop {
            problem: &problem,
            passing: self.passing,
            harmonics: self.harmonics,
            coefficients: self.coefficients.clone(),
            axes: self.axes.clone(),
        };
        Some(limits(&thinned, depth_m).unwrap_or_default())
    }

    /// Number of frequencies s + ipΩ of the vibration, with p from −K−1 to K and the tooth-passing frequency Ω: 2K + 2.
    /// The number is even, so that at s = iΩ/2 they are symmetric about 0.
    fn count(&self) -> usize {
        2 * self.harmonics + 2
    }

    /// Receptance matrices H at all frequencies s + ipΩ of the vibration, lowest first; `None` if one of these is a
    /// pole of the modelled structure.
    fn transfers(&self, s: Complex64) -> Option<Vec<Matrix3<Complex64>>> {
        (0..self.count())
            .map(|index| {
                let order = index as f64 - self.harmonics as f64 - 1.0;
                self.problem
                    .transfer(s + Complex64::new(0.0, order * self.passing))
            })
            .collect()
    }

    /// Fourier coefficient of order p − q of α and β, which couples the vibration at frequency q to the force at
    /// frequency p.
    fn coefficient(&self, p: usize, q: usize) -> &Harmonic {
        // Both indices are below the number 2K + 2 of frequencies, so that Fourier coefficients of the order p − q are
        // stored.
        &self.coefficients[p + 2 * self.harmonics + 1 - q]
    }

    /// Block matrices H_p α_{p−q} and H_p β_{p−q} over all frequencies p and q of the vibration, both restricted to
    /// `axes`; the second only with axial-depth modulation. `None` where [`transfers`](Self::transfers) is.
    fn matrices(&self, s: Complex64) -> Option<(DMatrix<Complex64>, Option<DMatrix<Complex64>>)> {
        let transfers = self.transfers(s)?;
        let (count, axes) = (self.count(), &self.axes);
        let size = count * axes.len();
        let mut cut = DMatrix::zeros(size, size);
        let mut forced = self
            .problem
            .process
            .axial_depth_modulation
            .then(|| DMatrix::zeros(size, size));
        for (p, h) in transfers.iter().enumerate() {
            for q in 0..count {
                let coefficient = self.coefficient(p, q);
                let block = h * coefficient.directional;
                for (i, &row) in axes.iter().enumerate() {
                    for (j, &column) in axes.iter().enumerate() {
                        cut[(p * axes.len() + i, q * axes.len() + j)] = block[(row, column)];
                    }
                }
                if let (Some(forced), Some(z)) = (&mut forced, axes.iter().position(|&axis| axis == 2)) {
                    let column = h * coefficient.forced;
                    for (i, &row) in axes.iter().enumerate() {
                        forced[(p * axes.len() + i, q * axes.len() + z)] = column[row];
                    }
                }
            }
        }
        Some((cut, forced))
    }

    /// Matrix (I + Hβ)⁻¹ Hα of the loop at s; its eigenvalues are the λ of [`OpenLoop`]. `None` if H is infinite or I +
    /// Hβ singular.
    fn matrix(&self, s: Complex64) -> Option<DMatrix<Complex64>> {
        let (cut, forced) = self.matrices(s)?;
        match forced {
            None => Some(cut),
            Some(forced) => {
                let size = cut.nrows();
                (DMatrix::identity(size, size) + forced).lu().solve(&cut)
            }
        }
    }

    /// Real eigenvalues λ of the loop matrix at s = iΩ/2, 1/m, half the tooth-passing frequency: they belong to Floquet
    /// multipliers of −1 (flip).
    fn flips(&self) -> Result<Vec<f64>, Breakdown> {
        let matrix = self.matrix(Complex64::new(0.0, 0.5 * self.passing));
        let matrix = matrix.ok_or(Breakdown::NoSolution)?;
        let real = real_form(&matrix, self.count(), self.axes.len());
        let all = eigenvalues::of_real(real)?;
        let real = all.iter().filter(|value| value.im == 0.0);
        Ok(real.map(|value| value.re).collect())
    }

    /// Frequency, Hz, of the harmonic with the largest displacement in the motion of a root s at a depth, m; `None` if
    /// that motion cannot be computed.
    pub(crate) fn vibration_hz(&self, s: Complex64, depth_m: f64) -> Option<f64> {
        let kappa = self.regeneration(s) * depth_m;
        let (cut, forced) = self.matrices(s)?;
        let size = cut.nrows();
        // A depth that differs slightly from that of the root keeps the matrix regular; inverse iteration amplifies the
        // eigenvector by 1e8 in each step.
        let mut matrix = DMatrix::identity(size, size) - &cut * (kappa * (1.0 + 1e-8));
        if let Some(forced) = forced {
            matrix += forced;
        }
        let vector = eigenvalues::null_vector(matrix)?;
        let is_modulated = self.problem.process.axial_depth_modulation;
        let transfers = self.transfers(s)?;
        transfers
            .iter()
            .enumerate()
            .map(|(p, h)| {
                let mut force = Vector3::<Complex64>::zeros();
                for (index, part) in vector.iter().enumerate() {
                    let (q, axis) = (index / self.axes.len(), self.axes[index % self.axes.len()]);
                    let coefficient = self.coefficient(p, q);
                    force += coefficient.directional.column(axis) * (kappa * part);
                    if axis == 2 && is_modulated {
                        force -= coefficient.forced * *part;
                    }
                }
                let mut displacement = h * force;
                // The eigenvector contains the displacements in the directions `axes`; those in other directions follow
                // from the forces.
                for (i, &axis) in self.axes.iter().enumerate() {
                    displacement[axis] = vector[p * self.axes.len() + i];
                }
                let omega = s.im + (p as f64 - self.harmonics as f64 - 1.0) * self.passing;
                (displacement.norm(), omega.abs() / std::f64::consts::TAU)
            })
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, hz)| hz)
    }
}

impl HarmonicLoop<'_> {
    /// Frequency, Hz, of the harmonic with the largest displacement in the vibration at a limit; `None` if that
    /// vibration cannot be computed.
    pub(crate) fn chatter_hz(&self, limit: &AxisCrossing) -> Option<f64> {
        let s = Complex64::new(0.0, limit.omega);
        self.vibration_hz(s, limit.depth_m)
    }
}

/// Loop matrix at s = iΩ/2 transformed to real form, from complex harmonics to cosines and sines. At this s the entry
/// of the loop matrix for the frequencies (p, q) is the conjugate of that for (−p−1, −q−1).
fn real_form(matrix: &DMatrix<Complex64>, count: usize, axes: usize) -> DMatrix<f64> {
    let mirrored = |index: usize| (count - 1 - index / axes) * axes + index % axes;
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let is_upper = |index: usize| index / axes >= count / 2;
    // The two entries of row i of the unitary transformation from complex harmonics to cosines (upper half) and sines
    // (lower half).
    let factors = |index: usize| {
        if is_upper(index) {
            (Complex64::from(half), Complex64::from(half))
        } else {
            (Complex64::new(0.0, half), Complex64::new(0.0, -half))
        }
    };
    let size = count * axes;
    let mut rows = DMatrix::zeros(size, size);
    for i in 0..size {
        let (own, other) = factors(i);
        rows.set_row(i, &(matrix.row(i) * own + matrix.row(mirrored(i)) * other));
    }
    DMatrix::from_fn(size, size, |i, j| {
        let (own, other) = factors(j);
        (rows[(i, j)] * own.conj() + rows[(i, mirrored(j))] * other.conj()).re
    })
}

impl OpenLoop for HarmonicLoop<'_> {
    fn problem(&self) -> &FrequencyProblem {
        self.problem
    }

    fn regeneration(&self, s: Complex64) -> Complex64 {
        Complex64::ONE - (-s * (std::f64::consts::TAU / self.passing)).exp()
    }

    fn folded(&self, s: Complex64) -> Complex64 {
        let rest = s.im - (s.im / self.passing).round() * self.passing;
        Complex64::new(s.re, rest.abs())
    }

    fn eigenvalues(&self, s: Complex64, floor: f64) -> Result<Vec<Complex64>, Breakdown> {
        let matrix = self.matrix(s).ok_or(Breakdown::NoSolution)?;
        Ok(eigenvalues::dominant(&matrix, floor)?)
    }

    fn determinant(&self, s: Complex64, kappa: Complex64) -> Option<Complex64> {
        let (cut, forced) = self.matrices(s)?;
        let size = cut.nrows();
        let mut matrix = DMatrix::identity(size, size) - cut * kappa;
        if let Some(forced) = forced {
            matrix += forced;
        }
        let determinant = matrix.lu().determinant();
        determinant.is_finite().then_some(determinant)
    }

    fn real_end(&self) -> Result<Option<RealEnd>, Breakdown> {
        Ok(Some(RealEnd {
            omega: 0.5 * self.passing,
            // The regeneration factor κ/w = 1 − e^{−sτ} is 2 at s = iΩ/2.
            loci: self.flips()?.into_iter().map(|value| 2.0 * value).collect(),
            kind: StabilityLoss::Flip,
        }))
    }

    fn grid(&self, _floor: f64) -> Result<Vec<f64>, Breakdown> {
        let end = 0.5 * self.passing;
        let folded: Vec<Resonance> = self
            .problem
            .resonances()
            .into_iter()
            .map(|resonance| {
                let rest = resonance.omega.rem_euclid(self.passing);
                Resonance {
                    omega: rest.min(self.passing - rest),
                    ..resonance
                }
            })
            .collect();
        let mut grid = around(&folded, end);
        grid.extend((1..12).map(|i| end * f64::from(i) / 12.0));
        Ok(ascending(grid))
    }
}
