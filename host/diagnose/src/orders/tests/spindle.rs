//! Spindle angle from edges with jitter.

use std::f64::consts::TAU;

use super::generator::{Random, Spindle};
use crate::orders::spindle_angle::SpindleAngle;

/// Root mean square of the error of θ against its mean over the record, and that mean, rad.
fn errors(angle: &SpindleAngle, spindle: &Spindle) -> (f64, f64) {
    let edges_s = angle.edges_s();
    let [first, last] = [edges_s[0], edges_s[edges_s.len() - 1]];
    let times: Vec<f64> = (0..5000)
        .map(|i| first + (last - first) * f64::from(i) / 4999.0)
        .collect();
    let found = angle.revolutions_at(times.iter().copied());
    let apart: Vec<f64> = times
        .iter()
        .zip(&found)
        .map(|(t, found)| TAU * (found - spindle.revolutions(*t)))
        .collect();
    let mean = apart.iter().sum::<f64>() / 5000.0;
    let square = apart.iter().map(|error| (error - mean).powi(2)).sum::<f64>() / 5000.0;
    (square.sqrt(), mean)
}

#[test]
fn errors_of_the_angle_are_those_that_it_states() {
    // Seeds, wander, jitter: a constant speed, a slow wander, and jitter that hides the wander.
    for (first, delta, jitter_s) in [
        (0, 0.0, 2e-5),
        (1000, 0.005, 1e-5),
        (2000, 0.005, 2e-7),
        (3000, 0.001, 1e-4),
    ] {
        let (mut square, mut mean, mut frequency) = (0.0, 0.0, 0.0);
        for seed in first..first + 100 {
            let mut random = Random::new(seed);
            let spindle = Spindle {
                hertz: 50.0 + 20.0 * random.share(),
                start_s: 0.01,
                wander: [delta, 0.4 + random.share(), TAU * random.share()],
            };
            let truth = spindle.edges_s(3.0);
            let edges_s = truth.iter().map(|t| t + jitter_s * random.normal()).collect();
            let angle = SpindleAngle::from_edges(edges_s, 1e9);
            let (of_angle, of_phase) = errors(&angle, &spindle);
            square += (of_angle / angle.angle_deviation_rad).powi(2) / 100.0;
            mean += (of_phase / angle.phase_deviation_rad).powi(2) / 100.0;
            let true_hz = (truth.len() - 1) as f64 / (truth[truth.len() - 1] - truth[0]);
            frequency += ((angle.frequency_hz - true_hz) / angle.frequency_deviation_hz).powi(2) / 100.0;
        }
        println!(
            "seeds from {first}: squared errors over their variances: {square:.2} {mean:.2} {frequency:.2}"
        );
        // χ² of 100 records varies by √(2/100) = 0.14. A smooth wander is no integrated Wiener process: the angle may be
        // better or worse than stated by a factor of two in variance. Edges scatter about their own mean angle.
        assert!((0.4..2.0).contains(&square), "{square}");
        assert!((0.5..1.5).contains(&mean), "{mean}");
        assert!((0.4..2.0).contains(&frequency), "{frequency}");
    }
}

#[test]
fn a_long_record_keeps_a_steady_spindle_straight() {
    let mut random = Random::new(5);
    let edges_s = (0..100_000)
        .map(|edge| f64::from(edge) / 60.0 + 1e-5 * random.normal())
        .collect();
    let angle = SpindleAngle::from_edges(edges_s, 1e9);
    // The mean over 100 000 edges and the ends of a smooth curve.
    assert!(
        (angle.frequency_hz / 60.0 - 1.0).abs() < 1e-8,
        "{}",
        angle.frequency_hz
    );
    assert!(angle.angle_deviation_rad < 0.2 * TAU * 60.0 * 1e-5);
}
