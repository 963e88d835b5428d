//! The prediction error of a case.

use crate::conclusion::answer::Quality;
use crate::error::DiagnoseError;
use crate::fit::output_error::OutputError;
use crate::fit::regression::{Regression, Subset};
use crate::records::study::Study;
use quietcut_model::case::Case;
use quietcut_recording::Recording;

/// Prediction error of the case of a study as it is, without causes and with its uncertain parameters as they are written.
///
/// A linear structure is predicted by its response to the forces, any other by a simulation where its records can be simulated: forces
/// along a measured motion contain the noise of this motion.
pub(crate) fn prediction_error(study: &Study<'_>, regression: &Regression) -> Quality {
    let simulated = (!study.baseline.terms.is_empty())
        .then(|| OutputError::new(study)?.left_by_case())
        .flatten();
    let nrmse = |subset| match &simulated {
        Some(left) => regression.nrmse_of(study, left, subset),
        None => regression.nrmse(study, subset),
    };
    Quality {
        nrmse_heldout: nrmse(Subset::HeldOut),
        nrmse_whole: nrmse(Subset::Whole),
    }
}

/// [`prediction_error`] of a case of which there is no study yet: what a diagnosis of this case prints of its baseline.
///
/// # Errors
/// The case cannot be simulated, or a recording cannot be compared.
pub(crate) fn prediction_error_of(case: &Case, recordings: &[Recording]) -> Result<Quality, DiagnoseError> {
    let study = Study::new(case, recordings)?;
    Ok(prediction_error(&study, &Regression::new(&study)))
}
