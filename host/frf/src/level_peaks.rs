//! Frequency and damping of the largest peak of each receptance over the force level, and whether they depend on it.

use std::f64::consts::TAU;

use quietcut_numerics::statistics::chi_squared_quantile;
use quietcut_recording::Recording;
use realfft::RealFftPlanner;

use super::criteria::HOMOGENEOUS_PROBABILITY;
use super::error::FrfError;
use super::excitation::Excitation;
use super::force_levels::LevelMeasurement;
use super::measurement_settings::MeasurementSettings;
use super::peak_fit::{FittedPeak, fitted_peaks};
use super::test_channels::TestChannels;

/// The largest peak of a receptance at one force level.
#[derive(Clone, Copy, Debug)]
pub struct LevelPeak {
    /// Index of the level among those of [`super::measure_levels`].
    pub level: usize,
    /// The fitted peak.
    pub peak: FittedPeak,
    /// Amplitude of the displacement of this mode at this level, m. Stepped sine: the force times |H|. Other steady
    /// excitation: √2 times the RMS of the displacement within five half-power bandwidths about the peak, the mean over
    /// the recordings of the level. `None` for a hammer, whose response falls from impact to impact.
    pub amplitude_m: Option<f64>,
}

/// The largest peak of one receptance at each level at which it has one, by ascending level.
#[derive(Clone, Debug)]
pub struct PeaksOverLevel {
    /// Name of the receptance, such as `xy`.
    pub name: String,
    /// The peaks; at least one.
    pub peaks: Vec<LevelPeak>,
    /// True if frequency or damping differ between the levels beyond their errors: the χ² of a constant exceeds the
    /// quantile of `HOMOGENEOUS_PROBABILITY`, or the 90 % interval of the change from the lowest to the highest level
    /// does not contain 0. The receptance of a linear structure is the same at each level (homogeneity).
    pub is_nonlinear: bool,
}

/// The largest peak of each receptance over the levels that [`super::measure_levels`] found in `recordings`.
///
/// # Errors
/// As [`super::measure_levels`] for the channels.
pub fn level_peaks(
    recordings: &[Recording],
    settings: &MeasurementSettings,
    levels: &[LevelMeasurement],
) -> Result<Vec<PeaksOverLevel>, FrfError> {
    let mut found: Vec<PeaksOverLevel> = Vec::new();
    for (index, level) in levels.iter().enumerate() {
        for entry in level.measurement.table.entries() {
            let largest = fitted_peaks(&level.measurement.table, entry)
                .into_iter()
                .max_by(|a, b| a.receptance.total_cmp(&b.receptance));
            let Some(peak) = largest else { continue };
            let amplitude_m = if level.is_amplitude {
                Some(level.force_n * peak.receptance)
            } else {
                let mut sizes = Vec::new();
                for recording in level.recordings.iter().filter_map(|at| recordings.get(*at)) {
                    let channels = TestChannels::of(recording, &settings.channels)?;
                    let excitation = settings
                        .excitation
                        .unwrap_or_else(|| Excitation::of_recording(recording));
                    let driven = channels.force_directions().contains(&entry.force);
                    let response = channels
                        .responses
                        .iter()
                        .find(|response| response.direction == entry.response);
                    if let Some(response) = response.filter(|_| driven && excitation != Excitation::Hammer) {
                        let samples = &response.channel.samples;
                        sizes.push(amplitude_about(
                            samples,
                            recording.sample_rate_hz,
                            response.derivatives,
                            &peak,
                        ));
                    }
                }
                (!sizes.is_empty()).then(|| sizes.iter().sum::<f64>() / sizes.len() as f64)
            };
            let one = LevelPeak {
                level: index,
                peak,
                amplitude_m,
            };
            let name = entry.name();
            match found.iter_mut().find(|other| other.name == name) {
                Some(other) => other.peaks.push(one),
                None => found.push(PeaksOverLevel {
                    name,
                    peaks: vec![one],
                    is_nonlinear: false,
                }),
            }
        }
    }
    for one in &mut found {
        one.is_nonlinear = depends_on_level(&one.peaks);
    }
    Ok(found)
}

/// Number of half-power bandwidths on each side of a peak within which the response counts as that of its mode. A
/// choice: a mode has 94 % of its mean square within five.
const BANDWIDTHS: f64 = 5.0;

/// √2 times the RMS of the displacement about `peak`, m; the samples are its derivative of the order `derivatives`.
fn amplitude_about(samples: &[f64], rate_hz: f64, derivatives: i32, peak: &FittedPeak) -> f64 {
    let count = samples.len().max(1) as f64;
    let plan = RealFftPlanner::new().plan_fft_forward(samples.len());
    let (mut input, mut lines) = (samples.to_vec(), plan.make_output_vec());
    // The lengths fit, so that the transform cannot fail; its error is about the imaginary part of the first line.
    let _ = plan.process(&mut input, &mut lines);
    let half_hz = BANDWIDTHS * 2.0 * peak.damping_ratio * peak.frequency_hz;
    let square: f64 = lines
        .iter()
        .enumerate()
        .skip(1)
        .map(|(line, value)| (line as f64 * rate_hz / count, value))
        .filter(|(hertz, _)| (hertz - peak.frequency_hz).abs() <= half_hz)
        .map(|(hertz, value)| value.norm_sqr() * (TAU * hertz).powi(-2 * derivatives))
        .sum();
    // Each line has the amplitude 2|X|/N; the sum of the squared amplitudes is twice the mean square.
    2.0 / count * square.sqrt()
}

fn depends_on_level(peaks: &[LevelPeak]) -> bool {
    let [first, .., last] = peaks else { return false };
    let quantities: [fn(&FittedPeak) -> [f64; 2]; 2] = [
        |peak| [peak.frequency_hz, peak.frequency_std_hz],
        |peak| [peak.damping_ratio, peak.damping_ratio_std],
    ];
    quantities.into_iter().any(|quantity| {
        let ([old, old_std], [new, new_std]) = (quantity(&first.peak), quantity(&last.peak));
        let half = (first.peak.ninety_percent() * old_std).hypot(last.peak.ninety_percent() * new_std);
        let (mut weights, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for one in peaks {
            let [value, deviation] = quantity(&one.peak);
            let weight = deviation.max(f64::MIN_POSITIVE).powi(-2);
            weights += weight;
            sum += weight * (value - old);
            squares += weight * (value - old).powi(2);
        }
        let chi_squared = squares - sum * sum / weights;
        (new - old).abs() > half
            || chi_squared > chi_squared_quantile(HOMOGENEOUS_PROBABILITY, (peaks.len() - 1) as f64)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn peak(frequency_hz: f64) -> LevelPeak {
        LevelPeak {
            level: 0,
            peak: FittedPeak {
                frequency_hz,
                frequency_std_hz: 0.1,
                damping_ratio: 0.01,
                damping_ratio_std: 1e-3,
                receptance: 1e-6,
                receptance_std: 1e-8,
                freedoms: 40,
            },
            amplitude_m: None,
        }
    }

    #[test]
    fn a_frequency_that_returns_at_the_highest_level_is_not_constant() {
        let of = |hertz: &[f64]| depends_on_level(&hertz.iter().map(|f| peak(*f)).collect::<Vec<_>>());
        assert!(!of(&[20.0]));
        assert!(!of(&[20.0, 20.1, 19.95]));
        // Softening, then hardening: the ends agree.
        assert!(of(&[20.0, 19.5, 20.0]));
        assert!(of(&[20.0, 20.3]));
    }

    #[test]
    fn the_amplitude_about_a_peak_is_that_of_its_sine() {
        let about = peak(20.0).peak;
        let samples: Vec<f64> = (0..2000)
            .map(|i| {
                let t = f64::from(i) / 200.0;
                -(TAU * 20.0).powi(2) * 3e-6 * (TAU * 20.0 * t).sin() + 5.0 * (TAU * 50.0 * t).sin()
            })
            .collect();
        let amplitude = amplitude_about(&samples, 200.0, 2, &about);
        assert!((amplitude / 3e-6 - 1.0).abs() < 1e-9, "{amplitude}");
    }
}
