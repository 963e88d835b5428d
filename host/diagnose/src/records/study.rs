//! The baseline and the recordings of one diagnosis.

use crate::baseline::Baseline;
use crate::baseline::uncertain::Uncertain;
use crate::error::DiagnoseError;
use crate::records::domain::Domain;
use crate::records::prepare::prepare;
use crate::records::record::{Known, Record};
use quietcut_model::case::Case;
use quietcut_model::structure::Form;
use quietcut_recording::Recording;

/// The baseline and the recordings of one diagnosis.
pub(crate) struct Study<'a> {
    /// The baseline model: the case file with its extensions.
    pub baseline: Baseline<'a>,
    /// Parameters of its structure that are fitted with every candidate model; none for a study of the case as it is.
    pub uncertain: Uncertain,
    /// Recordings of tests or cuts, each with the prediction of the baseline.
    pub records: Vec<Record>,
}

impl<'a> Study<'a> {
    /// Compares recordings with the baseline of a case.
    ///
    /// # Errors
    /// No recording is given, the case cannot be simulated, or a recording cannot be compared.
    pub(crate) fn new(case: &'a Case, recordings: &[Recording]) -> Result<Self, DiagnoseError> {
        Self::with(case, recordings, |_| Known::default())
    }

    /// [`Self::new`] with information on each record from an earlier prediction, such as noise-free samples of its
    /// channels.
    ///
    /// Along a measured motion every regressor contains the noise of that motion, and so does the residual. This biases
    /// coefficients by about (noise/signal)², relative, which exceeds their standard deviation if
    /// (noise/signal)·√(number of samples) > 1. Along the motion of a candidate model there is no such bias.
    ///
    /// # Errors
    /// No recording is given, the case cannot be simulated, or a recording cannot be compared.
    pub(crate) fn with(
        case: &'a Case,
        recordings: &[Recording],
        known: impl Fn(usize) -> Known,
    ) -> Result<Self, DiagnoseError> {
        if recordings.is_empty() {
            return Err(DiagnoseError::NoRecording);
        }
        let baseline = Baseline::new(case)?;
        let records = recordings
            .iter()
            .enumerate()
            .map(|(index, recording)| prepare(&baseline, recording, known(index)))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self {
            baseline,
            uncertain: Uncertain::default(),
            records,
        })
    }

    /// [`Self::new`] with parameters of the structure that are fitted with every candidate model; the case is at
    /// [`Uncertain::at`].
    ///
    /// # Errors
    /// No recording is given, the case cannot be simulated, or a recording cannot be compared.
    pub(crate) fn uncertain(
        case: &'a Case,
        recordings: &[Recording],
        uncertain: Uncertain,
    ) -> Result<Self, DiagnoseError> {
        Ok(Self {
            uncertain,
            ..Self::new(case, recordings)?
        })
    }

    /// Axes of the machine along which the structure moves and some record has a force, or a motion above the noise.
    pub(crate) fn driven_axes(&self) -> Vec<usize> {
        self.baseline
            .axes
            .iter()
            .copied()
            .filter(|axis| self.records.iter().any(|record| record.moves(*axis)))
            .collect()
    }

    /// True if every record is compared in `domain`.
    pub(crate) fn all_in(&self, domain: Domain) -> bool {
        self.records.iter().all(|record| record.domain == domain)
    }

    /// True if a sidecar places the sensor of `channel` away from the tool tip. With `None` as `channel`, true if that
    /// holds for any channel.
    pub(crate) fn sits_elsewhere(&self, channel: Option<&str>) -> bool {
        self.records
            .iter()
            .flat_map(|record| &record.elsewhere)
            .any(|name| channel.is_none_or(|channel| channel == name))
    }

    /// True if the case gives its structure as modes.
    pub(crate) fn has_modes(&self) -> bool {
        matches!(self.baseline.structure.form, Form::Modes(_))
    }
}
