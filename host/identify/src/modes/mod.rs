//! Complex modes through measured receptances, with left and right shapes (thesis eq. 7.15):
//!
//! H_pq(s) = Σ_r Ψᴿ_pr Ψᴸ_qr/(s − λ_r) + conjugate at the conjugate pole, λ = −ζω + iω√(1 − ζ²), s = iω;
//! no conjugation and no further factor in the residue. Left and right shapes may differ: nothing is taken for reciprocal.
//!
//! `denominator` gives poles of every order of model, [`stabilization`] those that come again from order to order,
//! `pole_residue` the modes that fit best with their covariance.

mod covariance;
mod denominator;
mod pole_residue;
mod receptances;
mod record_fit;
pub(super) mod shape;
pub mod stabilization;
mod weights;

#[cfg(test)]
mod tests;

pub use receptances::Receptances;
pub use record_fit::{ChannelNoise, refine_by_records};
pub use stabilization::{Candidate, Stabilization};

use num_complex::Complex64;

use pole_residue::{PoleResidue, Refined};
use quietcut_model::structure::{Direction, Mode};

/// Why no modes come out.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModesError {
    /// Nothing to fit.
    #[error("{0}")]
    Data(String),
    /// No pole came again from order to order.
    #[error(
        "no pole is stable over the orders of the model from {from_hz:.2} to {to_hz:.2} Hz ({rejected} poles were rejected); a band with a resonance, or better receptances, are needed"
    )]
    NoMode {
        /// First frequency, Hz.
        from_hz: f64,
        /// Last frequency, Hz.
        to_hz: f64,
        /// Poles that were looked at.
        rejected: usize,
    },
    /// Other than the wanted number of modes.
    #[error("{found} poles are stable over the orders of the model, but {wanted} modes are asked for")]
    Fewer {
        /// Modes found.
        found: usize,
        /// Modes wanted.
        wanted: usize,
    },
    /// The fit broke down.
    #[error("the fit of {0} modes does not converge; fewer modes or another band are needed")]
    NotConverged(usize),
}

/// What to look for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// The highest order of the models whose poles are compared.
    pub highest_order: usize,
    /// The number of modes, where it is known: the strongest of those that are stable.
    pub modes: Option<usize>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            highest_order: 24,
            modes: None,
        }
    }
}

/// One mode with standard deviations.
#[derive(Clone, Debug, PartialEq)]
pub struct IdentifiedMode {
    /// The mode; its left shape has an entry per driven direction, its right one per response.
    pub mode: Mode,
    /// Standard deviation of the frequency, Hz.
    pub frequency_std_hz: f64,
    /// Standard deviation of the damping ratio.
    pub damping_ratio_std: f64,
    /// Standard deviations of real and imaginary part of the left shape.
    pub left_std: Vec<[f64; 2]>,
    /// Standard deviations of real and imaginary part of the right shape.
    pub right_std: Vec<[f64; 2]>,
}

/// A pole that is no mode.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Rejected {
    /// Its frequency |λ|/2π, Hz.
    pub frequency_hz: f64,
    /// Its damping ratio.
    pub damping_ratio: f64,
    /// What speaks against it.
    pub why: String,
}

/// What was found.
#[derive(Clone, Debug)]
pub struct ModalModel {
    /// Directions of the entries of the left shapes.
    pub forces: Vec<Direction>,
    /// Directions of the entries of the right shapes.
    pub responses: Vec<Direction>,
    /// The modes by rising frequency.
    pub modes: Vec<IdentifiedMode>,
    /// For each receptance, by its directions of response and force: the compliance of modes above the band, m/N, and the
    /// inertia of those below, the coefficient of 1/s², 1/kg.
    pub outside: Vec<(Direction, Direction, [f64; 2])>,
    /// Root mean square of what is left over that of the receptances, each receptance counting alike.
    pub fit_error: f64,
    /// Mean square of what is left over its stated variance; near 1 where only noise is left. `None` where the data have
    /// no stated variance.
    pub misfit: Option<f64>,
    /// Poles of every order.
    pub stabilization: Stabilization,
    /// Poles that are no modes.
    pub rejected: Vec<Rejected>,
    /// What whoever uses it should know.
    pub warnings: Vec<String>,
}

/// Damping ratios from here on are no resonance: what bends the receptances so slowly is the residual of other modes.
const OVERDAMPED: f64 = 0.5;

/// A mode whose residue is less than so many of its standard deviations is not there.
const SEEN: f64 = 3.0;

/// Identifies the modes of receptances.
///
/// # Errors
/// Too few lines, no stable pole or fewer than wanted, a fit that does not converge.
pub fn identify(data: &Receptances, options: &Options) -> Result<ModalModel, ModesError> {
    let stabilization = stabilization::stabilize(data, options.highest_order)?;
    let mut rejected = stabilization.rejected();
    let mut starts: Vec<Complex64> = stabilization.selected.clone();
    if let Some(wanted) = options.modes {
        if starts.len() < wanted {
            return Err(ModesError::Fewer {
                found: starts.len(),
                wanted,
            });
        }
        for pole in starts.split_off(wanted) {
            rejected.push(reject(pole, "weaker than the modes that were asked for".into()));
        }
    }
    let [from_hz, to_hz] = data.band_hz();
    loop {
        if starts.is_empty() {
            return Err(ModesError::NoMode {
                from_hz,
                to_hz,
                rejected: rejected.len(),
            });
        }
        let start = PoleResidue::start(data, &starts).ok_or(ModesError::NotConverged(starts.len()))?;
        let refined = pole_residue::refine(data, start).ok_or(ModesError::NotConverged(starts.len()))?;
        let Some((mode, why)) = spurious(&refined, [from_hz, to_hz]) else {
            return Ok(model(data, &refined, stabilization, rejected));
        };
        rejected.push(reject(refined.fit.modes[mode].pole, why));
        starts = refined.fit.modes.iter().map(|mode| mode.pole).collect();
        starts.remove(mode);
    }
}

fn reject(pole: Complex64, why: String) -> Rejected {
    Rejected {
        frequency_hz: pole.norm() / std::f64::consts::TAU,
        damping_ratio: -pole.re / pole.norm(),
        why,
    }
}

/// A mode of the refined fit that is none, and why.
fn spurious(refined: &Refined, [from_hz, to_hz]: [f64; 2]) -> Option<(usize, String)> {
    refined.fit.modes.iter().enumerate().find_map(|(index, mode)| {
        let (pole, hertz) = (mode.pole, mode.pole.norm() / std::f64::consts::TAU);
        let damping = -pole.re / pole.norm();
        let significance = refined.significance(index);
        let why = if damping <= 0.0 {
            "negative damping after refinement".into()
        } else if damping >= OVERDAMPED {
            format!("damping ratio {damping:.2} after refinement: no resonance")
        } else if !(from_hz..=to_hz).contains(&hertz) {
            format!("outside the band from {from_hz:.2} to {to_hz:.2} Hz after refinement")
        } else if significance < SEEN {
            format!("its residue is {significance:.1} standard deviations; {SEEN} are needed")
        } else {
            return None;
        };
        Some((index, why))
    })
}

fn model(
    data: &Receptances,
    refined: &Refined,
    stabilization: Stabilization,
    rejected: Vec<Rejected>,
) -> ModalModel {
    let mut modes: Vec<IdentifiedMode> = (0..refined.fit.modes.len())
        .map(|index| refined.mode(index))
        .collect();
    modes.sort_by(|a, b| a.mode.frequency_hz.total_cmp(&b.mode.frequency_hz));
    let outside = data
        .places
        .iter()
        .zip(&refined.fit.outside)
        .map(|(&(p, q), &values)| (data.responses[p], data.forces[q], values))
        .collect();
    let mut model = ModalModel {
        forces: data.forces.clone(),
        responses: data.responses.clone(),
        modes,
        outside,
        fit_error: refined.relative_error,
        misfit: data.has_deviation.then_some(refined.misfit),
        stabilization,
        rejected,
        warnings: Vec::new(),
    };
    model.warnings = warnings(data.spacing_hz(), &model);
    model
}

/// Part of the receptances that may be left of a good fit.
const GOOD_FIT: f64 = 0.1;

/// Fewest lines within the width of a resonance, 2ζf, for its damping to be measured rather than extrapolated.
const LINES_PER_WIDTH: f64 = 3.0;

/// What a model from lines so far apart does not know well.
fn warnings(spacing_hz: f64, model: &ModalModel) -> Vec<String> {
    let mut warnings = Vec::new();
    if model.fit_error > GOOD_FIT {
        warnings.push(format!(
            "{:.0} % of the receptances are left; more modes, a narrower band, or a linear structure are needed",
            100.0 * model.fit_error
        ));
    }
    for mode in &model.modes {
        let (hertz, damping) = (mode.mode.frequency_hz, mode.mode.damping_ratio);
        let width_hz = 2.0 * damping * hertz;
        let lines = width_hz / spacing_hz;
        if lines < LINES_PER_WIDTH {
            warnings.push(format!(
                "{lines:.1} lines within the width of the mode at {hertz:.3} Hz ({width_hz:.3} Hz); a finer resolution is needed for its damping"
            ));
        }
        if mode.damping_ratio_std > 0.1 * damping {
            warnings.push(format!(
                "the damping of the mode at {hertz:.3} Hz is known to {:.0} % only (one standard deviation)",
                100.0 * mode.damping_ratio_std / damping
            ));
        }
    }
    for pair in model.modes.windows(2) {
        let apart = pair[1].mode.frequency_hz - pair[0].mode.frequency_hz;
        let deviation = pair[0].frequency_std_hz.hypot(pair[1].frequency_std_hz);
        if apart < 3.0 * deviation {
            warnings.push(format!(
                "the modes at {:.3} and {:.3} Hz are not told apart by the data",
                pair[0].mode.frequency_hz, pair[1].mode.frequency_hz
            ));
        }
    }
    warnings
}

impl ModalModel {
    /// Directions in which the structure is both driven and seen: those that a case can have.
    pub fn directions(&self) -> Vec<Direction> {
        let both = self.responses.iter().copied();
        both.filter(|direction| self.forces.contains(direction)).collect()
    }

    /// The receptance of the fit, with what stands for modes outside the band, m/N; `None` where it was not measured.
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
