//! The force of a cut linearized about its motion, and the motion in closed loop by it.
//!
//! F(u + δ) ≈ F(u) + Σ_p K_p (δ − δ(t − τ_p)) + K_z δ − C δ̇ with means over the record: K_p of ∂F/∂h nᵀ over the chips whose
//! surface was left τ_p before, K_z of a depth of cut that follows the axial motion, C of process damping (the zeroth-order
//! approximation: Altintas and Budak, CIRP Annals 44 (1995) 357).
//!
//! Along a motion u the structure answers x = H F(u). Where x = u the loop is closed; to put x in the place of u and to go on is to
//! trust in |H L| < 1, L(ω) = Σ_p K_p (1 − e^(−iωτ_p)) + K_z − iωC, which no stable cut owes anyone: much process damping, or a
//! resonance beside a lobe, is enough to break it. Newton's step with these means is u − (I − H L)⁻¹(u − x); that forces are periodic
//! besides only makes it take a few more.

use nalgebra::{Matrix3, Vector3};
use num_complex::Complex64;

/// Means over a record.
#[derive(Clone, Debug, Default)]
pub(crate) struct MeanSlopes {
    /// By the time since the earlier pass, s: K_p, N/m.
    pub by_delay: Vec<(f64, Matrix3<f64>)>,
    /// K_z, N/m.
    pub direct_n_per_m: Matrix3<f64>,
    /// C, N s/m.
    pub damping_ns_per_m: Matrix3<f64>,
    /// By axis of the motion: the mean of k kᵀ, k the column of ∂F/∂h nᵀ at an instant that belongs to the axis, N²/m².
    pub squares: [Matrix3<f64>; 3],
}

impl MeanSlopes {
    /// Adds to the K of a delay.
    pub(crate) fn add(&mut self, delay_s: f64, slope_n_per_m: Matrix3<f64>) {
        match self
            .by_delay
            .iter_mut()
            .find(|(known, _)| (known - delay_s).abs() < 1e-6 * delay_s)
        {
            Some((_, sum)) => *sum += slope_n_per_m,
            None => self.by_delay.push((delay_s, slope_n_per_m)),
        }
    }

    /// Power of the force that noise of the motion makes beyond L, N²: slopes K(t) that come and go with the teeth carry noise n of
    /// this power along each axis, m², from one frequency to others: Σ 2 n (⟨k kᵀ⟩ − Σ_p k_p k_pᵀ), as much at every frequency.
    pub(crate) fn carried(&self, noise_m2: [f64; 3]) -> Matrix3<f64> {
        let mut power = Matrix3::zeros();
        for (axis, noise_m2) in noise_m2.into_iter().enumerate() {
            let mut beyond = self.squares[axis];
            for (_, slope) in &self.by_delay {
                beyond -= slope.column(axis) * slope.column(axis).transpose();
            }
            power += 2.0 * noise_m2 * beyond;
        }
        power
    }

    /// L(ω), N/m.
    pub(crate) fn at(&self, omega: f64) -> Matrix3<Complex64> {
        let constant = self.direct_n_per_m.map(Complex64::from)
            - self.damping_ns_per_m.map(|c| Complex64::new(0.0, omega * c));
        self.by_delay.iter().fold(constant, |sum, (delay_s, slope)| {
            let factor = 1.0 - Complex64::cis(-omega * delay_s);
            sum + slope.map(|k| factor * k)
        })
    }

    /// (I − H L)⁻¹ c: by how much a motion is off the closed loop, where along it structure and force are off by c.
    pub(crate) fn closed(
        &self,
        omega: f64,
        receptance: &Matrix3<Complex64>,
        off: Vector3<Complex64>,
    ) -> Vector3<Complex64> {
        let open = Matrix3::identity() - receptance * self.at(omega);
        open.lu().solve(&off).unwrap_or(off)
    }
}
