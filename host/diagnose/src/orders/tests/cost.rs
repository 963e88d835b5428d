//! Cost, independence of the number of threads, and refusals.

use std::time::{Duration, Instant};

use super::generator::{NAMES, Random, Spindle, noise, pulses_at, recording};
use crate::orders::reduction::{Orders, ReductionSettings};
use crate::orders::spindle_angle::SpindleAngle;
use quietcut_recording::{Channel, Quantity, Recording};

const RATE_HZ: f64 = 10_000.0;

fn settings() -> ReductionSettings {
    ReductionSettings {
        highest_hz: 1e9,
        alias_factor: 4.0,
        slowest_decay_s: 0.1,
        settled_s: 0.0,
    }
}

/// A cut of seven channels with 225 samples per revolution, so that K = 101, and the times of its revolutions.
fn cut(count: usize) -> (Recording, Vec<f64>) {
    let spindle = Spindle {
        hertz: RATE_HZ / 225.3,
        start_s: 0.005,
        wander: [0.002, 0.7, 0.3],
    };
    let mut channels = noise(&mut Random::new(3), NAMES.len(), count, 0.02);
    for samples in &mut channels {
        for (sample, value) in samples.iter_mut().enumerate() {
            *value += pulses_at(3, 0.1, spindle.revolutions(sample as f64 / RATE_HZ));
        }
    }
    let edges_s = spindle.edges_s((count - 1) as f64 / RATE_HZ);
    (recording(RATE_HZ, channels, 0.0), edges_s)
}

fn reduced(recording: &Recording, edges_s: &[f64]) -> (Orders, Duration) {
    let start = Instant::now();
    let angle = SpindleAngle::from_edges(edges_s.to_vec(), RATE_HZ);
    let orders = Orders::with_angle(recording, &NAMES, angle, &settings()).unwrap();
    (orders, start.elapsed())
}

#[test]
#[ignore = "cost: the times of a reduction, for a machine that does nothing else"]
fn the_cost_is_proportional_to_the_number_of_samples() {
    let times: Vec<f64> = [22_000, 220_000, 2_200_000]
        .into_iter()
        .map(|count| {
            let (recording, edges_s) = cut(count);
            let (orders, _) = reduced(&recording, &edges_s);
            // The faster of two, because the system runs programs of its own.
            let time = reduced(&recording, &edges_s)
                .1
                .min(reduced(&recording, &edges_s).1);
            println!("{count} samples, K = {}: {time:?}", orders.kernel().orders());
            time.as_secs_f64()
        })
        .collect();
    // Ten times the samples: a cost with the square of their number would be a hundred times as large.
    assert!(times[2] < 25.0 * times[1], "{times:?}");
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let (recording, edges_s) = cut(22_000);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| reduced(&recording, &edges_s).0)
    };
    let (one, three) = (with(1), with(3));
    assert_eq!(one.amplitudes, three.amplitudes);
    for (one, three) in one.covariances.iter().zip(&three.covariances) {
        assert_eq!(one.matrix, three.matrix);
    }
    assert_eq!(one.common.directions, three.common.directions);
}

/// The cut with a tachometer: a pulse over the first third of each revolution.
fn with_tachometer(count: usize) -> Recording {
    let (mut recording, edges_s) = cut(count);
    let mut edge = 0;
    let samples = (0..count)
        .map(|sample| {
            let t = sample as f64 / RATE_HZ;
            while edge + 1 < edges_s.len() && edges_s[edge + 1] <= t {
                edge += 1;
            }
            let since = (t - edges_s[edge]) * RATE_HZ;
            if (0.0..75.0).contains(&since) { 1.0 } else { 0.0 }
        })
        .collect();
    recording.channels.push(Channel {
        name: "tacho".into(),
        quantity: Quantity::Level,
        samples,
    });
    recording
}

#[test]
fn fewer_than_ten_revolutions_are_refused() {
    let recording = with_tachometer(2400);
    let orders = Orders::new(&recording, &NAMES, &settings()).unwrap();
    assert_eq!(orders.angle.count(), 10);
    let later = ReductionSettings {
        settled_s: 0.01,
        ..settings()
    };
    let message = Orders::new(&recording, &NAMES, &later).err().unwrap().to_string();
    assert!(
        message.contains("contains only 9 whole revolutions of settled cutting; at least 10"),
        "{message}"
    );
}

#[test]
fn missing_channels_and_gaps_are_refused() {
    let mut recording = with_tachometer(4600);
    let message = Orders::new(&recording, &["vx"], &settings())
        .err()
        .unwrap()
        .to_string();
    assert!(message.contains("channel vx"), "{message}");
    recording.channels[2].samples[3000] = f64::NAN;
    let message = Orders::new(&recording, &NAMES, &settings())
        .err()
        .unwrap()
        .to_string();
    assert!(
        message.contains("fz") && message.contains("not a number"),
        "{message}"
    );
    assert!(Orders::new(&recording, &NAMES[..2], &settings()).is_ok());
    recording.channels.pop();
    assert!(Orders::new(&recording, &NAMES[..2], &settings()).is_err());
}
