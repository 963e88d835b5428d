//! Modal mass, damping and stiffness of identified modes, and the modal assurance criterion between their shapes.

use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

use super::model::ModalModel;
use super::shape::assurance;
use quietcut_model::structure::Direction;

/// Modal mass, damping and stiffness of one mode at its drive point, with standard deviations: the mode as an oscillator of one degree of
/// freedom in that direction.
///
/// A real mode has the residue R = 1/(2i ω_d m) at its drive point, with the damped natural frequency ω_d. For a complex one m = 1/(2 ω_d |R|)
/// is the mass of the real mode with the same size of the residue; k = m ω² and c = 2ζωm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModalParameters {
    /// Direction of the drive point: of those that are both driven and measured, the one with the largest residue.
    pub direction: Direction,
    /// Modal mass m, kg, and its standard deviation.
    pub mass_kg: [f64; 2],
    /// Modal damping c, N·s/m, and its standard deviation.
    pub damping_ns_per_m: [f64; 2],
    /// Modal stiffness k, N/m, and its standard deviation.
    pub stiffness_n_per_m: [f64; 2],
    /// Angle of the residue from that of a real mode, −i|R|, rad: 0 for proportional damping.
    pub phase_rad: f64,
}

impl ModalModel {
    /// Modal mass, damping and stiffness of a mode; `None` if no direction is both driven and measured, or if the residue there is zero.
    ///
    /// The standard deviations are those of the covariance by linear propagation, relative to the value.
    pub fn modal_parameters(&self, index: usize) -> Option<ModalParameters> {
        let mode = &self.modes.get(index)?.mode;
        let place =
            |all: &[Direction], direction: Direction| all.iter().position(|known| *known == direction);
        let residue = |direction: &Direction| {
            let (p, q) = (
                place(&self.responses, *direction)?,
                place(&self.forces, *direction)?,
            );
            Some((p, q, mode.right[p] * mode.left[q]))
        };
        let size = |direction: &Direction| residue(direction).map_or(0.0, |(.., residue)| residue.norm());
        let direction = self
            .directions()
            .into_iter()
            .max_by(|a, b| size(a).total_cmp(&size(b)))?;
        let (p, q, residue) = residue(&direction)?;
        if residue.norm() == 0.0 {
            return None;
        }
        let (hertz, zeta) = (mode.frequency_hz, mode.damping_ratio);
        let (omega, undamped) = (TAU * hertz, 1.0 - zeta * zeta);
        let mass = 1.0 / (2.0 * omega * undamped.sqrt() * residue.norm());
        // Derivatives of ln m by the parameters of the mode. Those of ln k and ln c differ in frequency and damping ratio only.
        let lefts = 2 * self.forces.len();
        let width = 2 + lefts + 2 * self.responses.len();
        let mut by_shapes = DVector::<f64>::zeros(self.covariance.nrows());
        for (at, entry) in [(2 + 2 * q, mode.left[q]), (2 + lefts + 2 * p, mode.right[p])] {
            by_shapes[width * index + at] = -entry.re / entry.norm_sqr();
            by_shapes[width * index + at + 1] = -entry.im / entry.norm_sqr();
        }
        let deviation = |by_frequency: f64, by_damping: f64| {
            let mut gradient = by_shapes.clone();
            gradient[width * index] = by_frequency;
            gradient[width * index + 1] = by_damping;
            (gradient.transpose() * &self.covariance * &gradient)[(0, 0)]
                .max(0.0)
                .sqrt()
        };
        let of_undamped = zeta / undamped;
        let with = |value: f64, relative: f64| [value, value * relative];
        Some(ModalParameters {
            direction,
            mass_kg: with(mass, deviation(-1.0 / hertz, of_undamped)),
            damping_ns_per_m: with(
                2.0 * zeta * omega * mass,
                deviation(0.0, of_undamped + 1.0 / zeta),
            ),
            stiffness_n_per_m: with(omega * omega * mass, deviation(1.0 / hertz, of_undamped)),
            phase_rad: (num_complex::Complex64::i() * residue).arg(),
        })
    }

    /// Modal assurance criterion between the shapes of all modes, |aᴴb|²/(aᴴa · bᴴb): right shapes, or left ones if more directions are driven
    /// than measured. `None` with one direction, where it is 1 by construction.
    pub fn modal_assurance(&self) -> Option<DMatrix<f64>> {
        let is_right = self.responses.len() >= self.forces.len();
        let count = self.responses.len().max(self.forces.len());
        let shape = |index: usize| {
            let mode = &self.modes[index].mode;
            if is_right { &mode.right } else { &mode.left }
        };
        let size = self.modes.len();
        (count > 1).then(|| DMatrix::from_fn(size, size, |i, j| assurance(shape(i), shape(j))))
    }
}

#[cfg(test)]
mod tests;
