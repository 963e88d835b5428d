//! Summary of one channel: peak, root mean square, mean, clipping, dropouts, and an envelope for a small picture.

use quietcut_numerics::statistics::median;
use serde::Serialize;

use super::criteria::{AT_REST, CLIPPED_RUN, DROPOUT_RUN, FAR_FROM_REST};
use super::{Channel, Quantity};

/// Key figures of one channel, in the SI unit of its quantity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChannelSummary {
    /// Name of the channel.
    pub channel: String,
    /// SI unit of the figures.
    pub unit: &'static str,
    /// First sample.
    pub first: f64,
    /// Smallest sample.
    pub minimum: f64,
    /// Largest sample.
    pub maximum: f64,
    /// Largest absolute sample.
    pub peak: f64,
    /// Root mean square about zero.
    pub rms: f64,
    /// Mean (DC component).
    pub mean: f64,
    /// Number of clipped samples of the channel: those in runs of at least three equal samples at its largest or
    /// smallest value, if this is far from the median; 0 for a constant channel or one without dimension, such as a
    /// tachometer.
    pub clipped: usize,
    /// True if all samples of the channel are equal.
    pub constant: bool,
    /// Dropouts of the channel: long runs of equal samples at a value between its extremes although it changes
    /// otherwise, each with start and excluded end in s. In order of time.
    pub dropouts_s: Vec<[f64; 2]>,
}

impl ChannelSummary {
    /// Key figures of a channel sampled at `rate_hz`, whose first sample is at `start_s`.
    pub fn of(channel: &Channel, rate_hz: f64, start_s: f64) -> Self {
        let samples = channel.samples.as_slice();
        let count = samples.len().max(1) as f64;
        let (minimum, maximum) = samples
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &sample| {
                (low.min(sample), high.max(sample))
            });
        let constant = minimum == maximum;
        let runs = runs(samples);
        let is_extreme = |value: f64| value == minimum || value == maximum;
        let levels = levels(channel, &runs, [minimum, maximum]);
        let clipped = runs
            .iter()
            .filter(|run| run.1 >= CLIPPED_RUN && levels.contains(&samples[run.0]))
            .map(|run| run.1)
            .sum();
        let changes = runs.len();
        let is_lively = samples.len() as f64 - changes as f64 <= AT_REST * count;
        let time = |sample: usize| start_s + sample as f64 / rate_hz;
        let dropouts_s = runs
            .iter()
            .filter(|run| is_lively && run.1 >= DROPOUT_RUN && !is_extreme(samples[run.0]))
            .map(|run| [time(run.0), time(run.0 + run.1)])
            .collect();
        Self {
            channel: channel.name.clone(),
            unit: channel.quantity.unit(),
            first: samples.first().copied().unwrap_or(0.0),
            minimum,
            maximum,
            peak: minimum.abs().max(maximum.abs()),
            rms: (samples.iter().map(|sample| sample * sample).sum::<f64>() / count).sqrt(),
            mean: samples.iter().sum::<f64>() / count,
            clipped,
            constant,
            dropouts_s,
        }
    }
}

/// Values at which a channel is clipped, ascending: its smallest and its largest sample, each only if at least three
/// consecutive samples have this value and it is far from the median. Empty for a constant channel and for one without
/// dimension, such as a tachometer.
pub fn clipping_levels(channel: &Channel) -> Vec<f64> {
    let samples = channel.samples.as_slice();
    let ends = samples
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &sample| {
            [low.min(sample), high.max(sample)]
        });
    levels(channel, &runs(samples), ends)
}

/// [`clipping_levels`] of a channel with these [`runs`] and these smallest and largest samples.
fn levels(channel: &Channel, runs: &[(usize, usize)], [minimum, maximum]: [f64; 2]) -> Vec<f64> {
    let samples = channel.samples.as_slice();
    // A tachometer has runs at two levels without being clipped.
    if minimum == maximum || channel.quantity == Quantity::Level {
        return Vec::new();
    }
    let rest = median(&mut samples.to_vec()).unwrap_or(0.0);
    // Equal samples at an extreme value near the median are no clipping: the force of an impact test may rest at
    // its smallest value.
    [minimum, maximum]
        .into_iter()
        .filter(|&value| (value - rest).abs() > FAR_FROM_REST * (maximum - minimum))
        .filter(|&value| {
            runs.iter()
                .any(|run| run.1 >= CLIPPED_RUN && samples[run.0] == value)
        })
        .collect()
}

/// Runs of equal consecutive samples: index of the first sample and length of each.
fn runs(samples: &[f64]) -> Vec<(usize, usize)> {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for (index, sample) in samples.iter().enumerate() {
        match runs.last_mut() {
            Some((first, length)) if samples[*first] == *sample => *length += 1,
            _ => runs.push((index, 1)),
        }
    }
    runs
}

/// Envelope for a small picture of a channel: largest absolute deviation from the mean of the channel in each of
/// `width` nearly equal runs of samples (one per sample if there are fewer samples), divided by the largest of all runs
/// unless that is 0.
pub fn envelope(samples: &[f64], width: usize) -> Vec<f64> {
    let mean = samples.iter().sum::<f64>() / samples.len().max(1) as f64;
    let width = width.min(samples.len());
    let parts: Vec<f64> = (0..width)
        .map(|part| {
            let from = part * samples.len() / width;
            let to = (part + 1) * samples.len() / width;
            samples[from..to]
                .iter()
                .fold(0.0_f64, |largest, sample| largest.max((sample - mean).abs()))
        })
        .collect();
    let largest = parts.iter().fold(0.0_f64, |largest, part| largest.max(*part));
    if largest > 0.0 {
        parts.iter().map(|part| part / largest).collect()
    } else {
        parts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn summary(samples: Vec<f64>) -> ChannelSummary {
        let channel = Channel {
            name: "ax".into(),
            quantity: Quantity::Acceleration,
            samples,
        };
        ChannelSummary::of(&channel, 1000.0, 0.0)
    }

    #[test]
    fn clipping_dropouts_and_constant_channels_are_found() {
        let sine = |k: u32| (f64::from(k) * 0.1).sin();
        let clean = summary((0..1000).map(sine).collect());
        assert_eq!(
            (clean.clipped, clean.constant, clean.dropouts_s.len()),
            (0, false, 0)
        );
        // The root mean square of a sine is 1/√2; tolerance: the last period is not whole.
        assert!((clean.rms - 0.5_f64.sqrt()).abs() < 0.01 && clean.mean.abs() < 0.02);
        let clipped = summary((0..1000).map(|k| sine(k).clamp(-0.8, 0.8)).collect());
        assert!(clipped.clipped > 300, "{}", clipped.clipped);
        let channel = |samples: Vec<f64>| Channel {
            name: "ax".into(),
            quantity: Quantity::Acceleration,
            samples,
        };
        let both = (0..1000).map(|k| sine(k).clamp(-0.8, 0.8)).collect();
        assert_eq!(clipping_levels(&channel(both)), [-0.8, 0.8]);
        let above = (0..1000).map(|k| sine(k).min(0.8)).collect();
        assert_eq!(clipping_levels(&channel(above)), [0.8]);
        let dropped = summary(
            (0..1000)
                .map(|k| if (200..250).contains(&k) { 0.1 } else { sine(k) })
                .collect(),
        );
        assert_eq!(dropped.dropouts_s, [[0.2, 0.25]]);
        let impact = summary(
            (0..1000)
                .map(|k| {
                    if (200..210).contains(&k) {
                        sine(k - 200)
                    } else {
                        0.0
                    }
                })
                .collect(),
        );
        assert_eq!((impact.clipped, impact.dropouts_s.len()), (0, 0));
        assert!(summary(vec![3.0; 10]).constant);
    }

    #[test]
    fn the_envelope_is_relative_to_its_largest_part() {
        assert_eq!(envelope(&[1.0, -1.0, 2.0, -2.0], 2), [0.5, 1.0]);
        assert_eq!(envelope(&[1.0], 64), [0.0]);
    }
}
