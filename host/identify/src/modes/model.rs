//! The identified modal model.

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::mode::IdentifiedMode;
use super::rejected::Rejected;
use super::shape;
use super::stabilization::Stabilization;
use crate::criteria::{
    LARGEST_DAMPING_DEVIATION, LARGEST_FIT_ERROR, LINES_PER_HALF_POWER_WIDTH, SEPARABLE_DEVIATIONS,
};
use quietcut_model::structure::Direction;

/// Result of the modal identification.
#[derive(Clone, Debug)]
pub struct ModalModel {
    /// Directions of the forces, to which the entries of the left shapes belong.
    pub forces: Vec<Direction>,
    /// Directions of the responses, to which the entries of the right shapes belong.
    pub responses: Vec<Direction>,
    /// The modes, sorted by frequency.
    pub modes: Vec<IdentifiedMode>,
    /// Joint covariance of the parameters of all modes. For each mode, in the order of `modes`: natural frequency in
    /// Hz, damping ratio, entries of the left shape in the order of `forces`, entries of the right shape in the order
    /// of `responses`; of each entry the real part before the imaginary one.
    pub covariance: DMatrix<f64>,
    /// Relative standard deviation of the gain of every sensor, whose effect `covariance` contains; `None` if the gains
    /// are taken as exact.
    pub gain_error: Option<f64>,
    /// For each pair of response and force direction: the compliance of the modes above the band, m/N, and the inertia
    /// term of the modes below it, the coefficient of 1/s², in 1/kg.
    pub outside: Vec<(Direction, Direction, [f64; 2])>,
    /// NRMSE of the fitted receptances, each with equal weight; after a fit to whole records, of the responses in the
    /// records.
    pub fit_error: f64,
    /// χ² per degree of freedom of the fitted receptances, or of the fitted records: near 1 if the residual is noise.
    /// `None` if receptances are fitted whose variance is not stated.
    pub misfit: Option<f64>,
    /// Poles of every model order.
    pub stabilization: Stabilization,
    /// Poles that were rejected as modes, with the reasons.
    pub rejected: Vec<Rejected>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}

/// Warnings about a poor modal fit, and about modal parameters that data with the line spacing `spacing_hz` determine
/// poorly.
pub(super) fn warnings(spacing_hz: f64, model: &ModalModel) -> Vec<String> {
    let mut warnings = Vec::new();
    if model.fit_error > LARGEST_FIT_ERROR {
        warnings.push(format!(
            "the residual is {:.0} % of the receptances; more modes, a narrower band, or a linear structure are needed",
            100.0 * model.fit_error
        ));
    }
    for mode in &model.modes {
        let (hertz, damping) = (mode.mode.frequency_hz, mode.mode.damping_ratio);
        let width_hz = 2.0 * damping * hertz;
        let lines = width_hz / spacing_hz;
        if lines < LINES_PER_HALF_POWER_WIDTH {
            warnings.push(format!(
                "{lines:.1} lines within the width of the mode at {hertz:.3} Hz ({width_hz:.3} Hz); a finer resolution is needed for its damping"
            ));
        }
        if mode.damping_ratio_std > LARGEST_DAMPING_DEVIATION * damping {
            warnings.push(format!(
                "the standard deviation of the damping of the mode at {hertz:.3} Hz is {:.0} %",
                100.0 * mode.damping_ratio_std / damping
            ));
        }
    }
    for pair in model.modes.windows(2) {
        let apart = pair[1].mode.frequency_hz - pair[0].mode.frequency_hz;
        let deviation = pair[0].frequency_std_hz.hypot(pair[1].frequency_std_hz);
        if apart < SEPARABLE_DEVIATIONS * deviation {
            warnings.push(format!(
                "the modes at {:.3} and {:.3} Hz are not separable in the data",
                pair[0].mode.frequency_hz, pair[1].mode.frequency_hz
            ));
        }
    }
    warnings
}

impl ModalModel {
    /// Directions that are both excited and measured; a case file has its modes in these directions.
    pub fn directions(&self) -> Vec<Direction> {
        let both = self.responses.iter().copied();
        both.filter(|direction| self.forces.contains(direction)).collect()
    }

    /// Pairs of response and force direction, among the directions of the model, whose receptance was not measured; that of the
    /// model is zero there.
    pub fn not_measured(&self) -> Vec<(Direction, Direction)> {
        let forces = || self.forces.iter().copied();
        let pairs = self.responses.iter().flat_map(|&p| forces().map(move |q| (p, q)));
        pairs
            .filter(|&(p, q)| !self.outside.iter().any(|&(r, f, _)| (r, f) == (p, q)))
            .collect()
    }

    /// The fitted receptance, including the terms of modes outside the band, m/N; `None` if the pair of directions was
    /// not measured.
    pub fn receptance(&self, response: Direction, force: Direction, frequency_hz: f64) -> Option<Complex64> {
        let p = self.responses.iter().position(|known| *known == response)?;
        let q = self.forces.iter().position(|known| *known == force)?;
        let (.., [above, below]) = self
            .outside
            .iter()
            .find(|(known, by, _)| (*known, *by) == (response, force))?;
        let s = Complex64::new(0.0, std::f64::consts::TAU * frequency_hz);
        let modes = self.modes.iter().map(|mode| {
            let residue = mode.mode.right[p] * mode.mode.left[q];
            shape::pair(residue, s, mode.mode.pole())
        });
        Some(modes.sum::<Complex64>() + above + below / (s * s))
    }
}
