//! Result of a test with periodic excitation beside its receptances: periods, realizations, noise and nonlinear
//! distortion.

use quietcut_model::structure::Direction;

/// Periods and realizations of a group of recordings with periodic excitation, and the distortion of its responses.
#[derive(Clone, Debug, PartialEq)]
pub struct PeriodicTest {
    /// Period of the excitation, s.
    pub period_s: f64,
    /// Period of the excitation, samples.
    pub period_samples: usize,
    /// Number of averaged periods of each recording, in the order of the recordings.
    pub used: Vec<usize>,
    /// Number of whole periods of each recording that are not averaged, in the order of the recordings.
    pub dropped: Vec<usize>,
    /// Number of different sets of phases among the recordings.
    pub realizations: usize,
    /// Noise and nonlinear distortion of each response, in the order x, y, z.
    pub distortions: Vec<ResponseDistortion>,
}

/// Noise and nonlinear distortion of one response as ratios of root mean squares. The reference lines are the excited
/// lines around the peak of its receptance, those above 1/√2 of the peak and at least five.
#[derive(Clone, Debug, PartialEq)]
pub struct ResponseDistortion {
    /// Direction of the response.
    pub response: Direction,
    /// Frequency of the peak of the receptance, Hz.
    pub peak_hz: f64,
    /// Noise of the receptance after averaging over periods and recordings, relative to the receptance, at the
    /// reference lines.
    pub noise: f64,
    /// Nonlinear distortion of one realization at the reference lines, from the scatter over realizations beyond the
    /// noise; `None` with one realization, or for a receptance of zero.
    pub total: Option<DistortionLevel>,
    /// Distortion at even lines that are not excited, relative to the response at the reference lines; `None` if there
    /// are no such lines between excited ones, or for a response of zero.
    pub even: Option<DistortionLevel>,
    /// Distortion at odd lines that are not excited, otherwise as `even`.
    pub odd: Option<DistortionLevel>,
}

/// Level of a nonlinear distortion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistortionLevel {
    /// Amplitude of the distortion relative to the response; 0 if the measured power is not above that of the noise.
    pub ratio: f64,
    /// True if the ratio is above 1e-5 and noise alone is as large with a probability below 1e-3 (F-test).
    pub is_significant: bool,
}

impl PeriodicTest {
    /// Warning of the largest significant distortion at lines that are not excited; `None` if there is none, or with
    /// several realizations, whose intervals include the distortion.
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
