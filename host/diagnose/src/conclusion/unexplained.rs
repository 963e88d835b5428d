//! Frequency, time and amplitude of an unexplained residual.

use std::f64::consts::TAU;

use crate::conclusion::residual_views::ResidualView;
use crate::signal::grid::Grid;
use crate::signal::noise::rms;

/// Largest number of segments of equal length (the last may be shorter) into which a record is divided to find when the
/// residual energy is largest.
const SEGMENTS: usize = 40;
/// Number of spectral lines on each side of the residual's largest line whose energy is counted with that of the line.
const NEAR: usize = 8;

/// Words for the channel whose residual is largest relative to its noise: RMS of the residual, largest spectral line
/// (in a cut with its spindle order), time of the largest energy, and share of the energy at large amplitudes. Empty
/// without views. The residual is that of the extended case, or of the baseline if there is no extension.
pub(crate) fn describe(views: &[ResidualView]) -> String {
    let worst = views.iter().max_by(|a, b| {
        let beside_noise =
            |view: &ResidualView| rms(view.unexplained()) / view.deviation.max(f64::MIN_POSITIVE);
        beside_noise(a).total_cmp(&beside_noise(b))
    });
    worst.map_or_else(String::new, of_channel)
}

fn of_channel(view: &ResidualView) -> String {
    let residual = view.unexplained();
    let size = rms(residual);
    let mut text = format!(
        "{} of {}: {size:.3e} {} RMS, {:.1} times its noise",
        view.channel,
        view.record,
        view.unit,
        size / view.deviation.max(f64::MIN_POSITIVE)
    );
    if let Some((hz, share)) = peak(view, residual) {
        text += &format!("; largest at {hz:.3} Hz");
        if let Some(spindle_motion) = &view.spindle_motion {
            text += &format!(", spindle order {:.2}", 60.0 * hz / spindle_motion.rpm);
        }
        text += &format!(" ({:.0} % of the energy within a few lines)", 100.0 * share);
    }
    let by_segment = segment_energies(residual);
    let largest = (0..by_segment.len()).max_by(|a, b| by_segment[*a].total_cmp(&by_segment[*b]));
    if let Some(largest) = largest {
        let middle = (largest as f64 + 0.5) * segment_length(residual) as f64 / view.rate_hz;
        text += &format!(", largest at {middle:.2} s");
    }
    text + &format!(
        "; {:.0} % of the energy in the quarter of the record with the largest amplitude",
        100.0 * share_at_large_amplitude(&by_segment, &segment_energies(&view.measured))
    )
}

/// Frequency, Hz, of the largest spectral line of the residual `samples` up to the highest frequency at which its
/// channel is compared, and the share of the residual's energy in that line and the [`NEAR`] lines on each side; `None`
/// for a zero or empty residual.
fn peak(view: &ResidualView, samples: &[f64]) -> Option<(f64, f64)> {
    if samples.is_empty() {
        return None;
    }
    let grid = Grid::new(samples.len(), view.rate_hz, 0.0, 1);
    let power: Vec<f64> = grid.spectrum(samples).iter().map(|bin| bin.norm_sqr()).collect();
    let within = power.iter().enumerate();
    let within = within.take_while(|(bin, _)| grid.omega(*bin) <= TAU * view.highest_hz);
    let (peak, _) = within.max_by(|a, b| a.1.total_cmp(b.1))?;
    let near: f64 = power[peak.saturating_sub(NEAR)..(peak + NEAR + 1).min(power.len())]
        .iter()
        .sum();
    let whole: f64 = power.iter().sum();
    (whole > 0.0).then(|| (grid.omega(peak) / TAU, near / whole))
}

fn segment_length(samples: &[f64]) -> usize {
    samples.len().div_ceil(SEGMENTS).max(1)
}

/// Energy (sum of squared samples) in each of at most [`SEGMENTS`] segments of a residual or a measured signal.
fn segment_energies(samples: &[f64]) -> Vec<f64> {
    samples
        .chunks(segment_length(samples))
        .map(|chunk| chunk.iter().map(|value| value * value).sum())
        .collect()
}

/// Share of the residual energy in those segments of a record (a quarter of them, rounded up) that have the largest
/// measured energy: about a quarter if the residual does not depend on the amplitude, more if it grows with the
/// amplitude.
fn share_at_large_amplitude(energy: &[f64], measured: &[f64]) -> f64 {
    let mut order: Vec<usize> = (0..measured.len().min(energy.len())).collect();
    order.sort_by(|a, b| measured[*b].total_cmp(&measured[*a]));
    let most: f64 = order[..order.len().div_ceil(4)]
        .iter()
        .map(|index| energy[*index])
        .sum();
    most / energy.iter().sum::<f64>().max(f64::MIN_POSITIVE)
}
