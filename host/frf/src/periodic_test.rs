//! Result of a test with periodic excitation beside its receptances: periods, realizations, noise and nonlinear distortion.

use quietcut_model::structure::Direction;

/// Periods and realizations of a group of recordings with periodic excitation, and the distortion of its responses.
#[derive(Clone, Debug, PartialEq)]
pub struct PeriodicTest {
    /// Period of the excitation, s.
    pub period_s: f64,
    /// Period of the excitation, samples.
    pub period_samples: usize,
    /// Number of periods of each recording that are averaged.
    pub used: Vec<usize>,
    /// Number of whole periods of each recording that are left out: those of the transient, and those in which the force changes.
    pub dropped: Vec<usize>,
    /// Number of different sets of phases among the recordings.
    pub realizations: usize,
    /// Noise and nonlinear distortion of each response.
    pub distortions: Vec<ResponseDistortion>,
}

/// Noise and nonlinear distortion of one response around its peak: amplitude ratios to the response, as root mean squares over the excited
/// lines of the peak (above 1/√2 of it, but no fewer than five).
#[derive(Clone, Debug, PartialEq)]
pub struct ResponseDistortion {
    /// Direction of the response.
    pub response: Direction,
    /// Frequency of the peak of the receptance, Hz.
    pub peak_hz: f64,
    /// Noise of the receptance after averaging over periods and recordings, relative to the receptance.
    pub noise: f64,
    /// Nonlinear distortion of one realization, from the scatter over realizations beyond the noise; `None` with one realization.
    pub total: Option<DistortionLevel>,
    /// Distortion at even lines that are not excited; `None` if there are none.
    pub even: Option<DistortionLevel>,
    /// Distortion at odd lines that are not excited; `None` if there are none.
    pub odd: Option<DistortionLevel>,
}

/// Level of a nonlinear distortion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistortionLevel {
    /// Amplitude of the distortion relative to the response; 0 if the scatter is less than that of the noise.
    pub ratio: f64,
    /// True if noise alone is as large with a probability below 1e-3 (F-test).
    pub is_significant: bool,
}

impl PeriodicTest {
    /// Warning of a nonlinear distortion that no interval holds.
    pub(super) fn warning(&self) -> Option<String> {
        if self.realizations > 1 {
            return None;
        }
        let (response, level) = self
            .distortions
            .iter()
            .flat_map(|found| [(found.response, found.even), (found.response, found.odd)])
            .filter_map(|(response, level)| Some((response, level.filter(|level| level.is_significant)?)))
            .max_by(|a, b| a.1.ratio.total_cmp(&b.1.ratio))?;
        Some(format!(
            "the structure is nonlinear: at lines without force the response in {response} has {:.0} dB of that at its peak; the interval holds \
             noise only: record two or more realizations with other random phases",
            20.0 * level.ratio.log10()
        ))
    }
}
