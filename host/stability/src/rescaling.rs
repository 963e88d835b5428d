//! Natural frequencies from the chatter frequencies of check cuts: by which factors those of a case, such as one measured
//! at standstill, differ from those of the running spindle.

mod check_cut;

use std::fmt;
use std::path::PathBuf;

use quietcut_model::case::Case;
use quietcut_model::structure::Form;
use quietcut_numerics::statistics::{NINETY_PERCENT, chi_squared_probability, student_ninety_percent};
use rayon::prelude::*;
use serde::Serialize;

use crate::criteria::EXPECTED_SCATTER;
use crate::limits::uncertainty::MethodOfCase;
use crate::trial_cuts::TrialCut;

pub use check_cut::CheckCut;

/// Factors of the natural frequencies of a case, from check cuts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Rescaling {
    /// Modes that chattered in a check cut, ascending.
    pub modes: Vec<RescaledMode>,
    /// All check cuts.
    pub cuts: Vec<CheckCut>,
}

/// Factor of the natural frequency of one mode, at constant modal mass and damping ratio.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RescaledMode {
    /// Number of the mode in the case, from 1.
    pub mode: usize,
    /// Natural frequency in the case, Hz.
    pub frequency_hz: f64,
    /// Factor of the natural frequency: the mean over the check cuts in which the mode chattered, of the logarithms of their
    /// factors with weights 1/σ².
    pub factor: f64,
    /// Standard deviation of the factor from the errors of the measured chatter frequencies alone. If n cuts scatter more than these
    /// errors let expect (χ² exceeds its 95 % quantile), the deviation follows from the scatter: it is multiplied by √(χ²/(n − 1)), and
    /// by the ratio of Student's 90 % quantile to the normal one, so that 1.645 deviations are a 90 % interval.
    pub factor_std: f64,
    /// Spindle speeds of these cuts, rev/min.
    pub speeds_rpm: Vec<f64>,
}

/// Reason why check cuts do not rescale a case.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RescalingError {
    /// The structure is not given by modes.
    #[error(
        "{}: structure.kind = \"modes\" is needed, since a check cut rescales the mode that chattered; identify --method modes writes such a case",
        path.display()
    )]
    NoModes {
        /// Path of the case.
        path: PathBuf,
    },
    /// The structure depends on the spindle speed.
    #[error(
        "{}: structure.at_speed: a structure that is known at several speeds is not rescaled; leave it or the rescaling out",
        path.display()
    )]
    DependsOnSpeed {
        /// Path of the case.
        path: PathBuf,
    },
    /// There is no check cut.
    #[error("there is no check cut: a row with the outcome chatter and its chatter frequency is needed")]
    NoCut,
    /// No check cut identifies a factor.
    #[error(
        "{}: no check cut identifies the natural frequency of a mode: {}; cut a little above the limit where one mode chatters, note the \
         chatter frequency, or tap again",
        path.display(),
        Reasons(cuts)
    )]
    Unidentified {
        /// Path of the case.
        path: PathBuf,
        /// The cuts with the reason for each.
        cuts: Vec<CheckCut>,
    },
}

struct Reasons<'a>(&'a [CheckCut]);

impl fmt::Display for Reasons<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, cut) in self.0.iter().enumerate() {
            let between = if index > 0 { "; " } else { "" };
            let reason = cut.reason.as_deref().unwrap_or_default();
            write!(f, "{between}{} rev/min, {} mm: {reason}", cut.rpm, cut.depth_mm)?;
        }
        Ok(())
    }
}

/// Factors of the natural frequencies of the modes of a case with which the method predicts the measured chatter frequencies
/// of check cuts, at constant modal masses and damping ratios.
///
/// Each cut with Hopf chatter rescales the mode whose natural frequency moves its predicted chatter frequency most. `error` is the
/// standard deviation of a measured chatter frequency, relative to it; the errors of the other parameters of the case do not count.
///
/// # Errors
/// See [`RescalingError`].
pub fn rescaling(
    case: &Case,
    method_of: &MethodOfCase<'_>,
    cuts: &[TrialCut],
    error: f64,
) -> Result<Rescaling, RescalingError> {
    let path = || case.path.clone();
    if case.speed_dependence.is_some() {
        return Err(RescalingError::DependsOnSpeed { path: path() });
    }
    let Some(Form::Modes(modes)) = case.structure.as_ref().map(|structure| &structure.form) else {
        return Err(RescalingError::NoModes { path: path() });
    };
    if cuts.is_empty() {
        return Err(RescalingError::NoCut);
    }
    let mut cuts: Vec<CheckCut> = cuts
        .par_iter()
        .map(|cut| CheckCut::new(case, method_of, cut, error))
        .collect();
    let found: Vec<RescaledMode> = (1..)
        .zip(modes)
        .filter_map(|(number, mode)| mean(number, mode.frequency_hz, &cuts))
        .collect();
    if found.is_empty() {
        return Err(RescalingError::Unidentified { path: path(), cuts });
    }
    let rescaled = with_factors(case, &found);
    cuts.par_iter_mut()
        .filter(|cut| cut.mode.is_some())
        .for_each(|cut| {
            let point = method_of(&rescaled)
                .ok()
                .and_then(|method| method.point(cut.rpm, cut.depth_mm).ok());
            cut.multiplier_abs = point.map(|point| point.multiplier_abs);
        });
    Ok(Rescaling { modes: found, cuts })
}

/// The case with the natural frequencies of its modes multiplied.
fn with_factors(case: &Case, found: &[RescaledMode]) -> Case {
    let mut case = case.clone();
    if let Some(Form::Modes(modes)) = case.structure.as_mut().map(|structure| &mut structure.form) {
        for rescaled in found {
            if let Some(mode) = modes.get_mut(rescaled.mode - 1) {
                *mode = mode.with_frequency_scaled(rescaled.factor);
            }
        }
    }
    case
}

fn mean(number: usize, frequency_hz: f64, cuts: &[CheckCut]) -> Option<RescaledMode> {
    let of_mode: Vec<(&CheckCut, f64, f64)> = cuts
        .iter()
        .filter(|cut| cut.mode == Some(number))
        .filter_map(|cut| {
            let (factor, std) = (cut.factor?, cut.factor_std?);
            Some((cut, factor.ln(), std / factor))
        })
        .collect();
    if of_mode.is_empty() {
        return None;
    }
    let weight: f64 = of_mode.iter().map(|(_, _, std)| std.powi(-2)).sum();
    let sum: f64 = of_mode.iter().map(|(_, log, std)| log / (std * std)).sum();
    let log = sum / weight;
    let chi2: f64 = of_mode
        .iter()
        .map(|(_, one, std)| ((one - log) / std).powi(2))
        .sum();
    let factor = log.exp();
    Some(RescaledMode {
        mode: number,
        frequency_hz,
        factor,
        factor_std: factor * excess_scatter(chi2, of_mode.len() - 1) / weight.sqrt(),
        speeds_rpm: of_mode.iter().map(|(cut, ..)| cut.rpm).collect(),
    })
}

/// Factor on a standard deviation by the scatter χ² with so many degrees of freedom; 1 if the stated errors let expect it.
fn excess_scatter(chi2: f64, freedom: usize) -> f64 {
    if freedom == 0 || chi2_is_expected(chi2, freedom) {
        return 1.0;
    }
    (chi2 / freedom as f64).sqrt() * student_ninety_percent(freedom) / NINETY_PERCENT
}

fn chi2_is_expected(chi2: f64, freedom: usize) -> bool {
    chi_squared_probability(chi2, freedom as f64) < EXPECTED_SCATTER
}

#[cfg(test)]
mod tests;
