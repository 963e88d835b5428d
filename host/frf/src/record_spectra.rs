//! The transform of whole recordings, for fits that go without averages and windows.

use std::f64::consts::TAU;
use std::path::PathBuf;

use num_complex::Complex64;
use realfft::RealFftPlanner;

use super::FrfError;
use super::driven::Driven;
use super::excitation::Excitation;
use super::measurement_settings::MeasurementSettings;
use quietcut_model::structure::Direction;
use quietcut_recording::{Quantity, Recording};

/// A channel at the lines of the transform of its whole record.
#[derive(Clone, Debug)]
pub struct ChannelLines {
    /// Its name.
    pub name: String,
    /// Its direction.
    pub direction: Direction,
    /// What it measures.
    pub quantity: Quantity,
    /// How often a displacement is differentiated: 0, 1 for a velocity, 2 for an acceleration; 0 of a force.
    pub derivatives: i32,
    /// Root mean square of its samples, SI.
    pub root_mean_square: f64,
    /// Variance of the white noise of a sample, where the lowest parts of the whole spectrum are one plateau.
    pub plateau: Option<f64>,
    /// Σ x_k e^{−2πi·fk/rate}/√N at each line: white noise of variance σ² per sample has E|·|² = σ² here.
    pub lines: Vec<Complex64>,
}

/// A recording at the lines of its whole transform that lie in a band; no window, no mean taken out.
#[derive(Clone, Debug)]
pub struct RecordSpectra {
    /// Where it came from.
    pub path: PathBuf,
    /// Its duration, s.
    pub seconds: f64,
    /// The lines, Hz.
    pub frequency_hz: Vec<f64>,
    /// Forces, in the order x, y, z.
    pub forces: Vec<ChannelLines>,
    /// Responses, in the order x, y, z.
    pub responses: Vec<ChannelLines>,
}

/// The spectra of recordings that go on from start to end: random excitation, cuts and sweeps. `None` where one of them
/// has blows or steps, which are evaluated piece by piece.
///
/// # Errors
/// No force, no response, a channel that is not there.
pub fn record_spectra(
    recordings: &[Recording],
    settings: &MeasurementSettings,
) -> Result<Option<Vec<RecordSpectra>>, FrfError> {
    let goes_on = |recording: &Recording| {
        let excitation = settings
            .excitation
            .unwrap_or_else(|| Excitation::of(&recording.sidecar));
        matches!(excitation, Excitation::Random | Excitation::Sweep)
    };
    if !recordings.iter().all(goes_on) {
        return Ok(None);
    }
    let spectra = recordings.iter().map(|recording| {
        let driven = Driven::of(recording, &settings.channels)?;
        Ok(of_record(&driven, settings.band_hz))
    });
    spectra.collect::<Result<Vec<_>, _>>().map(Some)
}

fn of_record(driven: &Driven<'_>, band_hz: Option<(f64, f64)>) -> RecordSpectra {
    let recording = driven.recording;
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
        // Only buffers of other lengths than planned are refused.
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
        forces: driven
            .forces
            .iter()
            .map(|(direction, force)| channel(force, *direction, 0))
            .collect(),
        responses: driven
            .responses
            .iter()
            .map(|response| channel(response.channel, response.direction, response.derivatives))
            .collect(),
    }
}

/// Parts of the spectrum whose mean powers are compared, the number that must be alike, and the fewest lines of a part.
const PARTS: usize = 64;
const ALIKE: usize = 3;
const LINES_MIN: usize = 50;

/// The power that the lowest parts of a spectrum have in common: within six standard deviations 1/√n of a mean of n lines.
/// White noise is what all parts have; where the signal falls below it, nothing else is left.
fn plateau(lines: &[Complex64], scale: f64) -> Option<f64> {
    let count = lines.len() / PARTS;
    if count < LINES_MIN {
        return None;
    }
    let mut powers: Vec<f64> = lines[1..]
        .chunks_exact(count)
        .map(|part| scale * part.iter().map(|line| line.norm_sqr()).sum::<f64>() / count as f64)
        .collect();
    powers.sort_by(f64::total_cmp);
    let most = powers.first()? * (1.0 + 6.0 / (count as f64).sqrt());
    let alike = powers.iter().take_while(|power| **power < most).count();
    (alike >= ALIKE).then(|| powers[alike / 2])
}

impl RecordSpectra {
    /// i2πf of a line.
    pub fn s(&self, line: usize) -> Complex64 {
        Complex64::new(0.0, TAU * self.frequency_hz[line])
    }
}
