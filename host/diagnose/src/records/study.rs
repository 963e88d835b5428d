//! What a diagnosis looks at: the baseline, as the case has it, and the records, each beside its prediction.

use crate::baseline::Baseline;
use crate::error::DiagnoseError;
use crate::records::domain::Domain;
use crate::records::prepare::prepare;
use crate::records::record::{Known, Record};
use quietcut_model::case::Case;
use quietcut_model::structure::Form;
use quietcut_recording::Recording;

/// Baseline and records.
pub(crate) struct Study<'a> {
    /// What is believed.
    pub baseline: Baseline<'a>,
    /// What was measured.
    pub records: Vec<Record>,
}

impl<'a> Study<'a> {
    /// Reads the records against the baseline.
    ///
    /// # Errors
    /// A case that cannot be simulated, or a record that tells nothing.
    pub(crate) fn new(case: &'a Case, recordings: &[Recording]) -> Result<Self, DiagnoseError> {
        Self::with(case, recordings, |_| Known::default())
    }

    /// The same with what is `known`: the motion as a case that explains a record says that its channels read it, where there is such.
    ///
    /// Along a measured motion every term carries the noise of that motion, which is also in the residual: the coefficient of a
    /// term is then off by about the square of noise over signal, which is more than its deviation once
    /// (noise over signal)·√(number of samples) is above one. Along the motion of a model that explains the records it is not.
    ///
    /// # Errors
    /// As [`Self::new`].
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
        Ok(Self { baseline, records })
    }

    /// Axes that a force or a motion drives in some record, with a motion to show for it.
    pub(crate) fn driven_axes(&self) -> Vec<usize> {
        self.baseline
            .axes
            .iter()
            .copied()
            .filter(|axis| self.records.iter().any(|record| record.moves(*axis)))
            .collect()
    }

    /// True where every record is judged in `domain`.
    pub(crate) fn all_in(&self, domain: Domain) -> bool {
        self.records.iter().all(|record| record.domain == domain)
    }

    /// True where a sidecar says that a channel, or with no channel named any, sits somewhere else than at the tool tip.
    pub(crate) fn sits_elsewhere(&self, channel: Option<&str>) -> bool {
        self.records
            .iter()
            .flat_map(|record| &record.elsewhere)
            .any(|name| channel.is_none_or(|channel| channel == name))
    }

    /// True where the case has its structure as modes.
    pub(crate) fn has_modes(&self) -> bool {
        matches!(self.baseline.structure.form, Form::Modes(_))
    }
}
