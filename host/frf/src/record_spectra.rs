//! Fourier transforms of whole recordings, for fits without averages and windows.

use std::f64::consts::TAU;
use std::path::PathBuf;

use num_complex::Complex64;
use realfft::RealFftPlanner;

use super::FrfError;
use super::criteria::{BANDS, LINES_PER_BAND_MIN, PLATEAU_BANDS, PLATEAU_RANGE};
use super::excitation::Excitation;
use super::measurement_settings::MeasurementSettings;
use super::test_channels::TestChannels;
use quietcut_model::structure::Direction;
use quietcut_recording::{Quantity, Recording};

/// Fourier transform of one channel over its whole record, in the frequency band of [`RecordSpectra`].
#[derive(Clone, Debug)]
pub struct ChannelLines {
    /// Name of the channel.
    pub name: String,
    /// Direction of the force or response.
    pub direction: Direction,
    /// Measured quantity.
    pub quantity: Quantity,
    /// Order of the time derivative of displacement that the channel measures: 0 displacement, 1 velocity, 2
    /// acceleration; 0 for a force.
    pub derivatives: i32,
    /// Root mean square of the channel's samples, SI unit.
    pub root_mean_square: f64,
    /// Variance of the white noise of the channel per sample, SI unit squared, from the noise plateau of the spectrum;
    /// `None` if no plateau is found.
    pub plateau: Option<f64>,
    /// Transform X(f) = Σ x_k e^{−2πi·fk/rate}/√N at each frequency of [`RecordSpectra`]; white noise of variance σ²
    /// per sample has E|X|² = σ².
    pub lines: Vec<Complex64>,
}

/// Fourier transforms of the forces and responses of a whole recording in a frequency band, without window and without
/// removal of the mean.
#[derive(Clone, Debug)]
pub struct RecordSpectra {
    /// File of the recording.
    pub path: PathBuf,
    /// Duration of the recording, s.
    pub seconds: f64,
    /// Frequencies of the lines, Hz, ascending.
    pub frequency_hz: Vec<f64>,
    /// Transforms of the force channels, in the order x, y, z.
    pub forces: Vec<ChannelLines>,
    /// Transforms of the response channels, in the order x, y, z.
    pub responses: Vec<ChannelLines>,
}

/// Transforms of recordings with the excitation [`Excitation::Random`] or [`Excitation::Sweep`], in the order of the
/// recordings. `None` if one of them has another excitation, stated by the settings or, if they state none, shown by
/// its sidecar or by a force that is a hammer's.
///
/// # Errors
/// A recording has no force or no response; a chosen channel or an input of the sidecar does not exist; an input is not
/// a force.
pub fn record_spectra(
    recordings: &[Recording],
    settings: &MeasurementSettings,
) -> Result<Option<Vec<RecordSpectra>>, FrfError> {
    let is_continuous = |recording: &Recording| {
        let excitation = settings
            .excitation
            .unwrap_or_else(|| Excitation::of_recording(recording));
        matches!(excitation, Excitation::Random | Excitation::Sweep)
    };
    if !recordings.iter().all(is_continuous) {
        return Ok(None);
    }
    let spectra = recordings.iter().map(|recording| {
        let channels = TestChannels::of(recording, &settings.channels)?;
        Ok(of_record(&channels, settings.band_hz))
    });
    spectra.collect::<Result<Vec<_>, _>>().map(Some)
}

fn of_record(channels: &TestChannels<'_>, band_hz: Option<(f64, f64)>) -> RecordSpectra {
    let recording = channels.recording;
    let samples = recording.len();
    let seconds = samples as f64 / recording.sample_rate_hz;
    let (low, high) = band_hz.unwrap_or((0.0, f64::INFINITY));
    let first = ((low * seconds).ceil() as usize).max(1);
    let end = ((high * seconds).floor() as usize)
        .saturating_add(1)
        .min(samples.div_ceil(2))
        .max(first);
    let plan = RealFftPlanner::new().plan_fft_forward(samples);
    let (mut time, mut lines) = (plan.make_input_vec(), plan.make_output_vec());
    let mut scratch = plan.make_scratch_vec();
    let scale = (samples.max(1) as f64).sqrt().recip();
    let mut channel = |channel: &quietcut_recording::Channel, direction, derivatives| {
        time.copy_from_slice(&channel.samples);
        // The Fourier transform fails only for buffers of the wrong length; these were made by the plan.
        let done = plan.process_with_scratch(&mut time, &mut lines, &mut scratch);
        debug_assert!(done.is_ok());
        let squares: f64 = channel.samples.iter().map(|x| x * x).sum();
        ChannelLines {
            name: channel.name.clone(),
            direction,
            quantity: channel.quantity,
            derivatives,
            root_mean_square: scale * squares.sqrt(),
            plateau: plateau(&lines, scale * scale),
            lines: lines[first..end].iter().map(|line| scale * line).collect(),
        }
    };
    RecordSpectra {
        path: recording.path.clone(),
        seconds,
        frequency_hz: (first..end).map(|line| line as f64 / seconds).collect(),
        forces: channels
            .forces
            .iter()
            .map(|(direction, force)| channel(force, *direction, 0))
            .collect(),
        responses: channels
            .responses
            .iter()
            .map(|response| channel(response.channel, response.direction, response.derivatives))
            .collect(),
    }
}

/// Noise plateau of a spectrum: the median of the mean powers of those bands whose mean power exceeds the lowest one by
/// less than six standard deviations (1/√n of the lowest power for n lines per band). `None` if these bands are fewer
/// than [`PLATEAU_BANDS`], or if a band has fewer than [`LINES_PER_BAND_MIN`] lines. Bands without signal are taken to
/// hold white noise, whose power is equal in all of them. `scale` is the factor of the powers.
fn plateau(lines: &[Complex64], scale: f64) -> Option<f64> {
    let count = lines.len() / BANDS;
    if count < LINES_PER_BAND_MIN {
        return None;
    }
    let mut powers: Vec<f64> = lines[1..]
        .chunks_exact(count)
        .map(|band| scale * band.iter().map(|line| line.norm_sqr()).sum::<f64>() / count as f64)
        .collect();
    powers.sort_by(f64::total_cmp);
    let most = powers.first()? * (1.0 + PLATEAU_RANGE / (count as f64).sqrt());
    let equal = powers.iter().take_while(|power| **power < most).count();
    (equal >= PLATEAU_BANDS).then(|| powers[equal / 2])
}

impl RecordSpectra {
    /// Laplace variable s = i2πf of a frequency line, rad/s.
    pub fn s(&self, line: usize) -> Complex64 {
        Complex64::new(0.0, TAU * self.frequency_hz[line])
    }
}
