//! The residual as people look at it.

use num_complex::Complex64;

use super::evidence::{Explanation, Library};
use super::grid::Grid;
use super::noise::rms;
use super::scene::Scene;

/// One channel of one record: what was measured, what the case misses of it, and what the extended case misses.
#[derive(Clone, Debug)]
pub struct View {
    /// The record.
    pub record: String,
    /// The channel.
    pub channel: String,
    /// Its unit.
    pub unit: &'static str,
    /// Samples per second.
    pub rate_hz: f64,
    /// Deviation of its noise.
    pub deviation: f64,
    /// What was measured.
    pub measured: Vec<f64>,
    /// Measured less what the case says along the measured motion.
    pub residual: Vec<f64>,
    /// The same with what was found; empty where nothing was.
    pub left: Vec<f64>,
    /// Displacement along the axis of the channel at the samples, m; empty where it is not known.
    pub displacement: Vec<f64>,
}

impl View {
    /// Amplitudes of a signal of this channel over frequency, averaged to at most `points` points: (Hz, RMS per line).
    pub fn spectrum(&self, samples: &[f64], points: usize) -> Vec<(f64, f64)> {
        if samples.is_empty() {
            return Vec::new();
        }
        let grid = Grid::new(samples.len(), self.rate_hz, 0.0, 1);
        let bins: Vec<Complex64> = grid.spectrum(samples);
        let per = bins.len().div_ceil(points.max(1)).max(1);
        let scale = 2.0 / samples.len() as f64;
        bins.chunks(per)
            .enumerate()
            .map(|(index, chunk)| {
                let middle = index * per + chunk.len() / 2;
                let power: f64 = chunk.iter().map(|bin| bin.norm_sqr()).sum::<f64>() / chunk.len() as f64;
                (grid.omega(middle) / std::f64::consts::TAU, scale * power.sqrt())
            })
            .collect()
    }

    /// Root mean squares: measured, residual, left.
    pub fn sizes(&self) -> [f64; 3] {
        [rms(&self.measured), rms(&self.residual), rms(&self.left)]
    }
}

/// Views of every channel, with the explanation taken off where there is one.
pub(super) fn views(scene: &Scene<'_>, library: &Library, best: Option<&Explanation>) -> Vec<View> {
    let mut all = Vec::new();
    for record in &scene.records {
        let explained: Option<Vec<Vec<f64>>> = best.map(|best| library.explained(scene, record, best));
        for (index, channel) in record.channels.iter().enumerate() {
            let residual = channel.residual();
            let left = explained.as_ref().map_or_else(Vec::new, |explained| {
                residual
                    .iter()
                    .zip(&explained[index])
                    .map(|(a, b)| a - b)
                    .collect()
            });
            let axis = (0..3)
                .find(|axis| channel.pickup.weights[*axis] != 0.0)
                .unwrap_or(0);
            all.push(View {
                record: record.path.display().to_string(),
                channel: channel.pickup.name.clone(),
                unit: channel.pickup.quantity.unit(),
                rate_hz: record.grid.rate_hz(),
                deviation: channel.deviation,
                measured: channel.measured.clone(),
                residual,
                left,
                displacement: record.motion.x[axis]
                    .iter()
                    .copied()
                    .step_by(record.grid.finer())
                    .collect(),
            });
        }
    }
    all
}
