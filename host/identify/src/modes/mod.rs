//! Complex modes from measured receptances, with left and right shapes (thesis eq. 7.15).
//!
//! H_pq(s) = Σ_r Ψᴿ_pr Ψᴸ_qr/(s − λ_r) + conjugate at the conjugate pole, where s = iω and
//! λ_r = −ζ_r ω_r + i ω_r √(1 − ζ_r²). The residue contains neither a conjugation nor a further factor. Left and right
//! shapes may differ: reciprocity is not assumed.
//!
//! `denominator` computes the poles of every model order, [`stabilization`] selects those that are stable over the
//! order, and `refinement` fits the modes in pole–residue form with their covariance.

mod comparison;
mod covariance;
mod denominator;
mod error;
mod folding_errors;
mod further_mode;
mod gain_errors;
mod jacobian;
mod joint_covariance;
mod leakage;
mod modal_parameters;
mod mode;
mod model;
pub mod point_direction;
pub mod points;
mod pole_derivatives;
mod pole_residue;
mod receptances;
mod record_fit;
mod refinement;
mod rejected;
mod residual_search;
pub(super) mod shape;
pub mod stabilization;
mod uncoupled;
mod weights;

#[cfg(test)]
mod tests;

pub use comparison::{ComparedMode, ModePair, pairs};
pub use error::ModesError;
pub use folding_errors::MadeApart;
pub use modal_parameters::ModalParameters;
pub use mode::IdentifiedMode;
pub use model::ModalModel;
pub use receptances::Receptances;
pub use record_fit::{ChannelNoise, refine_by_records};
pub use rejected::Rejected;
pub use stabilization::{Candidate, Stabilization};

use num_complex::Complex64;

use further_mode::with_further_mode;
use model::warnings;
use pole_residue::PoleResidue;
use refinement::{Refined, residue_freedom};
use rejected::reject;

use quietcut_numerics::statistics::chi_squared_quantile;

use crate::criteria::{CHANCE_OF_RESIDUES, OVERDAMPED};

/// Options of the modal identification.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Highest model order of the stabilization diagram; few frequency lines allow only a lower one.
    pub highest_order: usize,
    /// Number of stable poles to fit, the strongest ones, in each part that is identified by itself; `None` takes all stable poles. Poles that are spurious after
    /// refinement are removed.
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

/// Identifies the modes of measured receptances: poles, stabilization over the model order, and refinement.
///
/// Directions between which no receptance was measured, such as x and y of a table with only h_xx and h_yy, are identified
/// one by one, each with the number of modes of the options; the receptances between them are zero.
///
/// # Errors
/// See [`ModesError`].
pub fn identify(data: &Receptances, options: &Options) -> Result<ModalModel, ModesError> {
    let parts = data.parts();
    if parts.len() < 2 {
        return identify_coupled(data, options);
    }
    let models = parts
        .iter()
        .map(|part| {
            let of_part = data.of_part(part);
            let axis = of_part.forces[0];
            identify_coupled(&of_part, options).map_err(|error| ModesError::Direction {
                axis,
                error: Box::new(error),
            })
        })
        .collect::<Result<Vec<_>, _>>()?;
    Ok(uncoupled::joined(data, models))
}

/// Identifies the modes of receptances among which every response has one for every force.
fn identify_coupled(data: &Receptances, options: &Options) -> Result<ModalModel, ModesError> {
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
            rejected.push(reject(pole, "weaker than the requested modes".into()));
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
        let start = PoleResidue::start(data, &starts)?;
        let Some(mut refined) = refinement::refine(data, start) else {
            // The weakest pole is the last one; two poles of one mode, for example, keep the fit from converging.
            let count = starts.len();
            match starts.pop() {
                Some(pole) if count > 1 && options.modes.is_none() => {
                    rejected.push(reject(pole, "the fit does not converge with it".into()));
                    continue;
                }
                _ => return Err(ModesError::NotConverged(count)),
            }
        };
        let Some((mode, why)) = spurious(data, &refined, [from_hz, to_hz]) else {
            let is_spurious = |fit: &Refined| spurious(data, fit, [from_hz, to_hz]).is_some();
            while options.modes.is_none()
                && let Some(larger) = with_further_mode(data, &refined, is_spurious)
            {
                refined = larger;
            }
            return Ok(model(data, &refined, stabilization, rejected));
        };
        rejected.push(reject(refined.fit.modes[mode].pole, why));
        starts = refined.fit.modes.iter().map(|mode| mode.pole).collect();
        starts.remove(mode);
    }
}

/// Index of the first spurious mode of the refined fit, and the reason; `None` if no mode is spurious.
fn spurious(data: &Receptances, refined: &Refined, [from_hz, to_hz]: [f64; 2]) -> Option<(usize, String)> {
    refined.fit.modes.iter().enumerate().find_map(|(index, mode)| {
        let (pole, hertz) = (mode.pole, mode.pole.norm() / std::f64::consts::TAU);
        let damping = -pole.re / pole.norm();
        let evidence = refined.evidence(data, index);
        let freedom = residue_freedom(mode.right.len(), mode.left.len()) as f64;
        let needed = chi_squared_quantile(1.0 - CHANCE_OF_RESIDUES, freedom);
        let why = if damping <= 0.0 {
            "negative damping after refinement".into()
        } else if damping >= OVERDAMPED {
            format!("damping ratio {damping:.2} after refinement: no resonance")
        } else if !(from_hz..=to_hz).contains(&hertz) {
            format!("outside the band from {from_hz:.2} to {to_hz:.2} Hz after refinement")
        } else if evidence < needed {
            format!("its residues differ from noise by χ² = {evidence:.1}; {needed:.1} is needed")
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
    let (modes, covariance) = refined.sorted();
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
        covariance,
        gain_error: None,
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
