//! Where the unexplained part of a residual sits.

use std::f64::consts::TAU;

use super::scene::Scene;

/// The frequency, channel and time in which most of the residual of the baseline sits.
pub(super) fn describe(scene: &Scene<'_>) -> String {
    let mut worst = (0.0, String::new());
    for record in &scene.records {
        for channel in &record.channels {
            let residual = channel.residual();
            let spectrum = record.grid.spectrum(&residual);
            let power: Vec<f64> = spectrum.iter().map(|bin| bin.norm_sqr()).collect();
            let bins = power
                .iter()
                .enumerate()
                .take_while(|(bin, _)| record.grid.omega(*bin) <= TAU * record.band_hz);
            let Some((peak, height)) = bins.max_by(|a, b| a.1.total_cmp(b.1)) else {
                continue;
            };
            let size = super::noise::rms(&residual) / channel.deviation;
            if size <= worst.0 {
                continue;
            }
            let near: f64 = power[peak.saturating_sub(8)..(peak + 9).min(power.len())]
                .iter()
                .sum();
            let whole: f64 = power.iter().sum::<f64>().max(*height);
            let times = loudest_tenth(&residual);
            worst = (
                size,
                format!(
                    "{} of {}: {:.3e} RMS, {:.0} times its noise; most at {:.3} Hz ({:.0} % of the energy within a few lines), loudest at {:.2} s",
                    channel.pickup.name,
                    record.path.display(),
                    super::noise::rms(&residual),
                    size,
                    record.grid.omega(peak) / TAU,
                    100.0 * near / whole,
                    times * record.grid.count() as f64 / record.grid.rate_hz(),
                ),
            );
        }
    }
    worst.1
}

/// The middle of the loudest tenth, as a share of the whole.
fn loudest_tenth(samples: &[f64]) -> f64 {
    let length = (samples.len() / 10).max(1);
    let (index, _) = samples
        .chunks(length)
        .enumerate()
        .map(|(index, chunk)| (index, super::noise::rms(chunk)))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((0, 0.0));
    (index as f64 + 0.5) * length as f64 / samples.len().max(1) as f64
}
