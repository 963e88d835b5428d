//! Joint friction in rigs against a sum of sliders and against closed forms of a free decay.

use std::f64::consts::TAU;

use super::tests::{linear, rig, samples};
use super::*;

const MASS: f64 = 188.0;
const DAMPING: f64 = 305.0;
const STIFFNESS: f64 = 2.26e6;

/// Displacement at instants `step_s` apart, under a force, of the mass on its spring with sliders of [stiffness,
/// strength, position]: velocity Verlet.
fn integrated(
    mut sliders: Vec<[f64; 3]>,
    force_n: impl Fn(f64) -> f64,
    (step_s, count): (f64, usize),
) -> Vec<f64> {
    let mut slipped_n = |x: f64| -> f64 {
        sliders
            .iter_mut()
            .map(|[stiffness, strength, place]| {
                *place = place.clamp(x - *strength, x + *strength);
                -*stiffness * *place
            })
            .sum()
    };
    let (mut x, mut v, mut a) = (0.0_f64, 0.0_f64, force_n(0.0) / MASS);
    let mut path = vec![x];
    for n in 1..count {
        x += step_s * (v + 0.5 * step_s * a);
        let half = v + 0.5 * step_s * a;
        let driving = force_n(n as f64 * step_s) - STIFFNESS * x - slipped_n(x);
        // The damping force of the velocity at the end of the step.
        a = (driving - DAMPING * half) / (MASS + 0.5 * step_s * DAMPING);
        v = half + 0.5 * step_s * a;
        path.push(x);
    }
    path
}

#[test]
fn a_joint_moves_as_a_sum_of_sliders() {
    let (softening, reference_m, e) = (2e5, 1e-4, 0.6_f64);
    for (slip_m, beta) in [(None, 0.0), (Some(8e-5), 0.5)] {
        let mut effects = vec![
            "joint-friction=2e5".to_owned(),
            "joint-friction.reference_m=1e-4".to_owned(),
            format!("joint-friction.exponent={e}"),
        ];
        let most_m = slip_m.unwrap_or(6e-4);
        if slip_m.is_some() {
            effects.push(format!("joint-friction.slip_m={most_m:e}"));
            effects.push(format!("joint-friction.beta={beta}"));
        }
        let effects: Vec<&str> = effects.iter().map(String::as_str).collect();
        let tones = Signal::tones(&[16.0, 17.4], [20.0, 60.0], 2.0, 2);
        let (recording, _) = rig(tones.clone(), &effects)
            .record(&linear(), Path::new("a.csv"))
            .unwrap();
        let density = softening * e * (e + 1.0) / f64::powf(reference_m, e);
        let limit = |k: usize| most_m * (k as f64 / 800.0).powi(2);
        let mut sliders: Vec<[f64; 3]> = (0..800)
            .map(|k| {
                let (a, b) = (limit(k), limit(k + 1));
                let stiffness = density * (b.powf(e) - a.powf(e)) / e;
                let moment = density * (b.powf(e + 1.0) - a.powf(e + 1.0)) / (e + 1.0);
                [stiffness, moment / stiffness, 0.0]
            })
            .collect();
        sliders.push([beta * density * most_m.powf(e) / e, most_m, 0.0]);
        const FINER: usize = 100;
        let step_s = 1.0 / (500.0 * FINER as f64);
        let count = FINER * (recording.len() - 1) + 1;
        let wanted = integrated(sliders, |t| tones.force_n(t), (step_s, count));
        let y = samples(&recording, "y");
        let size = y.iter().fold(0.0_f64, |most, y| most.max(y.abs()));
        // With complete slip the tool moves beyond it, without it not beyond the strongest slider.
        assert!(size > 1.5e-4 && (slip_m.is_some() == (size > most_m)), "{size}");
        let apart = y.iter().zip(wanted.iter().step_by(FINER));
        let apart = apart.fold(0.0_f64, |most, (y, wanted)| most.max((y - wanted).abs()));
        println!("{slip_m:?}: {:e}", apart / size);
        assert!(apart < 1e-4 * size, "{slip_m:?}: {apart} of {size}");
    }
}

#[test]
fn a_decay_by_a_joint_loses_amplitude_and_gains_frequency_by_powers_of_the_amplitude() {
    // To first order in s/k, a cycle dissipates 4e/(e + 2)·s·A²·(A/x_ref)^e of the energy ½·k·A²:
    // d(A^−e)/dn = 4e²/(e + 2)·(s/k)/x_ref^e. The frequency is lower by c₁·s·(A/x_ref)^e/(2k).
    let (softening, reference_m) = (4e3, 1e-4);
    for (e, first) in [(0.4, 1.0193), (1.0, 1.0)] {
        let effects = [
            "damping=-0.99999999".to_owned(),
            format!("joint-friction={softening}"),
            "joint-friction.reference_m=1e-4".to_owned(),
            format!("joint-friction.exponent={e}"),
        ];
        let effects: Vec<&str> = effects.iter().map(String::as_str).collect();
        let release = Signal::Release {
            force_n: 500.0,
            pull_s: 3.0,
            seconds: 10.0,
        };
        let rate_hz = 20_000.0;
        let (recording, _) = Rig {
            sample_rate_hz: rate_hz,
            ..rig(release, &effects)
        }
        .record(&linear(), Path::new("a.csv"))
        .unwrap();
        let y = &samples(&recording, "y")[(3.7 * rate_hz) as usize..];
        // Upward crossings of zero, and the maxima between them, by parabolas.
        let crossings: Vec<f64> = (1..y.len())
            .filter(|&i| y[i - 1] < 0.0 && y[i] >= 0.0)
            .map(|i| (i as f64 - y[i] / (y[i] - y[i - 1])) / rate_hz)
            .collect();
        let tops: Vec<f64> = y
            .windows(3)
            .filter(|top| top[1] > 0.0 && top[0] < top[1] && top[1] >= top[2])
            .map(|top| top[1] - (top[2] - top[0]).powi(2) / (8.0 * (top[2] - 2.0 * top[1] + top[0])))
            .collect();
        let (from, to) = (10, 110);
        let rise = (tops[to].powf(-e) - tops[from].powf(-e)) / (to - from) as f64;
        let ratio = softening / STIFFNESS;
        let wanted = 4.0 * e * e / (e + 2.0) * ratio / f64::powf(reference_m, e);
        // Terms of the next order are s/k·(A/x_ref)^e.
        let next = ratio * (tops[0] / reference_m).powf(e);
        println!(
            "{e}: {} of {next}, {}",
            rise / wanted - 1.0,
            tops[to] / tops[from]
        );
        assert!((rise / wanted - 1.0).abs() < 4.0 * next, "{e}: {rise} {wanted}");
        let natural = (STIFFNESS / MASS).sqrt();
        for cycle in [20, 100] {
            let omega = TAU * 8.0 / (crossings[cycle + 4] - crossings[cycle - 4]);
            let lower = 1.0 - omega / natural;
            let wanted = 0.5 * first * ratio * (tops[cycle] / reference_m).powf(e);
            println!("{e} {cycle}: {}", lower / wanted - 1.0);
            assert!(
                (lower / wanted - 1.0).abs() < 0.005,
                "{e} {cycle}: {lower} {wanted}"
            );
        }
    }
}
