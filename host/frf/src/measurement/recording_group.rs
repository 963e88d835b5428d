//! Group of recordings that are evaluated together.

use num_complex::Complex64;

use crate::criteria::IMPACTS_MIN;
use crate::estimate::FrfLine;
use crate::excitation::Excitation;
use crate::hammer::MeasuredImpact;
use crate::periodic_test::PeriodicTest;
use crate::table::Frf;
use crate::test_channels::TestChannels;
use quietcut_model::structure::Direction;

/// Recordings with the same force directions, the same measured responses and the same kind of excitation, evaluated
/// together.
#[derive(Clone, Debug)]
pub struct RecordingGroup {
    /// Number of recordings in the group.
    pub recordings: usize,
    /// Directions of the forces.
    pub forces: Vec<Direction>,
    /// Kind of excitation.
    pub excitation: Excitation,
    /// Effective number of independent averages of the spectra of the group: for periodic excitation the number of
    /// averaged periods of all recordings, for a step-sine test 1.
    pub averages: f64,
    /// Frequencies left out because the forces of the group are linearly dependent there, Hz, ascending. Frequencies at
    /// which no FRF can be computed at all are not listed.
    pub left_out_hz: Vec<f64>,
    /// Smallest singular value of the force spectra over the frequencies of the group that are not left out, each force
    /// normalized at each frequency; 1 for a single force.
    pub least_singular: f64,
    /// Impacts of a hammer test: first the used single ones, second the double ones, which are left out; each in the
    /// order of the recordings and of time. `None` for other excitation.
    pub impacts: Option<(Vec<MeasuredImpact>, Vec<MeasuredImpact>)>,
    /// Degrees of freedom of the standard deviations of a test with periodic excitation; `None` for other excitation,
    /// whose intervals have normal quantiles.
    pub freedoms: Option<usize>,
    /// Periods, realizations and distortion of a test with periodic excitation; `None` for other excitation.
    pub periodic: Option<PeriodicTest>,
}

impl RecordingGroup {
    /// True if coherence and standard deviation of the group are meaningful: for any excitation but a hammer, and for a
    /// hammer test with three or more used impacts. False too if [`Self::freedoms`] are 0: one recording of periodic
    /// excitation, of which one period is used.
    pub fn has_scatter(&self) -> bool {
        let has_impacts = self
            .impacts
            .as_ref()
            .is_none_or(|(used, _)| used.len() >= IMPACTS_MIN);
        has_impacts && self.freedoms != Some(0)
    }
}

/// One receptance of a group of recordings, with its random error at each frequency of the group.
pub(super) struct MeasuredEntry {
    pub(super) frf: Frf,
    /// Standard deviation of the magnitude of the receptance at each frequency of the group, m/N.
    pub(super) deviation: Vec<f64>,
}

/// Receptances of one group, with their standard deviations, at the frequencies of the group.
pub(super) struct MeasuredGroup {
    pub(super) group: RecordingGroup,
    pub(super) frequency_hz: Vec<f64>,
    pub(super) entries: Vec<MeasuredEntry>,
    pub(super) warnings: Vec<String>,
}

/// Converts FRF lines to receptances in m/N: divides velocities by iω and accelerations by (iω)². Adds a warning if the
/// group has frequencies that are left out.
pub(super) fn receptances(
    group: RecordingGroup,
    lines: &[FrfLine],
    channels: &TestChannels<'_>,
    mut warnings: Vec<String>,
) -> MeasuredGroup {
    let frequency_hz: Vec<f64> = lines.iter().map(|line| line.frequency_hz).collect();
    if !group.left_out_hz.is_empty() {
        warnings.push(format!(
            "the forces are not independent at {} frequencies, which are left out (the first is {:.3} Hz)",
            group.left_out_hz.len(),
            group.left_out_hz[0]
        ));
    }
    let mut entries = Vec::new();
    for (p, response) in channels.responses.iter().enumerate() {
        for (q, &force) in group.forces.iter().enumerate() {
            let integrated = |line: &FrfLine| {
                Complex64::new(0.0, std::f64::consts::TAU * line.frequency_hz).powi(-response.derivatives)
            };
            let frf = Frf {
                response: response.direction,
                force,
                receptance: lines.iter().map(|line| line.h[p][q] * integrated(line)).collect(),
                coherence: group
                    .has_scatter()
                    .then(|| lines.iter().map(|line| line.coherence[p]).collect()),
                folding: lines
                    .iter()
                    .any(|line| line.folding[p] > 0.0)
                    .then(|| lines.iter().map(|line| line.folding[p]).collect()),
            };
            let deviation = lines
                .iter()
                .map(|line| line.deviation[p][q] * integrated(line).norm())
                .collect();
            entries.push(MeasuredEntry { frf, deviation });
        }
    }
    MeasuredGroup {
        group,
        frequency_hz,
        entries,
        warnings,
    }
}
