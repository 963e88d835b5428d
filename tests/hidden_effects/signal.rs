//! Excitation forces of shakers and hammers, and interpolation between samples.

use std::f64::consts::{PI, TAU};

use quietcut::recording::TestKind;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::machine::Machine;

/// A force as a function of time, of about unit amplitude, for a test of this kind and duration.
pub(crate) fn signal(
    kind: TestKind,
    seconds: f64,
    random: &mut ChaCha8Rng,
    machine: &Machine,
) -> Box<dyn Fn(f64) -> f64> {
    let [low, high] = machine.omega.map(|omega| omega / TAU);
    let (first, last) = (0.35 * low, 2.2 * high);
    match kind {
        TestKind::Hammer => {
            let spacing = seconds / 4.0;
            // The pulse is smooth and has at least twenty samples, so that interpolation between samples is accurate.
            let pulse = 1.2 / high;
            let impacts: Vec<(f64, f64)> = (0..4)
                .map(|i| ((0.03 + f64::from(i)) * spacing, random.random_range(0.7..1.3)))
                .collect();
            Box::new(move |t| {
                impacts
                    .iter()
                    .filter(|(start, _)| (*start..start + pulse).contains(&t))
                    .map(|(start, peak)| peak * (PI * (t - start) / pulse).sin().powi(4))
                    .sum()
            })
        }
        TestKind::Sweep => {
            let (from, to) = if random.random::<bool>() {
                (first, last)
            } else {
                (last, first)
            };
            Box::new(move |t| (TAU * (from * t + 0.5 * (to - from) / seconds * t * t)).sin())
        }
        TestKind::StepSine => {
            let count = 8;
            let dwell = seconds / f64::from(count);
            let tones: Vec<f64> = (0..count)
                .map(|i| 0.8 * low * (1.25 * high / (0.8 * low)).powf(f64::from(i) / f64::from(count - 1)))
                .collect();
            // The phase is continuous from tone to tone, as that of a generator.
            let cycles_before = |index: usize| tones[..index].iter().sum::<f64>() * dwell;
            let steps: Vec<(f64, f64)> = (0..count as usize)
                .map(|i| (tones[i], cycles_before(i)))
                .collect();
            Box::new(move |t| {
                let index = ((t / dwell) as usize).min(steps.len() - 1);
                let (tone, turns) = steps[index];
                (TAU * (turns + tone * (t - index as f64 * dwell))).sin()
            })
        }
        _ => {
            let tones: Vec<(f64, f64)> = (0..40)
                .map(|i| {
                    let share = (f64::from(i) + random.random::<f64>()) / 40.0;
                    (first + (last - first) * share, random.random_range(0.0..TAU))
                })
                .collect();
            Box::new(move |t| tones.iter().map(|(f, phase)| (TAU * f * t + phase).cos()).sum())
        }
    }
}

/// Value of `series` at `place`, a fractional index: cubic interpolation through the four nearest points.
pub(crate) fn interpolated(series: &[[f64; 3]], place: f64) -> [f64; 3] {
    let nearest = place.round();
    if (place - nearest).abs() < 1e-6 {
        return series[nearest as usize];
    }
    let first = (place.floor() as usize).saturating_sub(1).min(series.len() - 4);
    let s = place - first as f64;
    let weights = [
        -(s - 1.0) * (s - 2.0) * (s - 3.0) / 6.0,
        s * (s - 2.0) * (s - 3.0) / 2.0,
        -s * (s - 1.0) * (s - 3.0) / 2.0,
        s * (s - 1.0) * (s - 2.0) / 6.0,
    ];
    std::array::from_fn(|axis| {
        weights
            .iter()
            .zip(&series[first..])
            .map(|(w, value)| w * value[axis])
            .sum()
    })
}
