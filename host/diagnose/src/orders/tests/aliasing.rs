//! A periodic signal without noise has exactly the orders that its coefficients predict.

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::generator::{NAMES, Random, Spindle, pulses, pulses_at, recording, series_at};
use crate::orders::reduction::{Orders, ReductionSettings};
use crate::orders::spindle_angle::SpindleAngle;

const RATE_HZ: f64 = 10_000.0;

fn settings() -> ReductionSettings {
    ReductionSettings {
        highest_hz: 1e9,
        alias_factor: 4.0,
        slowest_decay_s: 0.0,
        settled_s: 0.0,
    }
}

/// A spindle with a speed that wanders by 0.5 %, 25 to 90 samples per revolution, and 30 to 60 revolutions.
fn spindle(seed: u64) -> (Spindle, usize) {
    let mut random = Random::new(seed);
    let per_revolution = 25.0 + 65.0 * random.share();
    let hertz = RATE_HZ / per_revolution;
    let spindle = Spindle {
        hertz,
        start_s: 0.3 / hertz,
        wander: [0.005, hertz / 20.0, random.share()],
    };
    (
        spindle,
        ((30.0 + 30.0 * random.share()) * per_revolution) as usize,
    )
}

fn angle(spindle: &Spindle, count: usize) -> SpindleAngle {
    SpindleAngle::from_edges(spindle.edges_s((count - 1) as f64 / RATE_HZ), RATE_HZ)
}

/// Samples of `signal` at the angles of the room; zero beyond its revolutions.
fn samples(angle: &SpindleAngle, count: usize, signal: impl Fn(f64) -> f64) -> Vec<f64> {
    let times = (0..count).map(|sample| sample as f64 / RATE_HZ);
    angle.revolutions_at(times).into_iter().map(signal).collect()
}

fn largest_difference(a: &[Complex64], b: &[Complex64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

#[test]
fn predicted_orders_with_aliases_equal_the_reduction() {
    for seed in 0..20 {
        let (spindle, count) = spindle(seed);
        let angle = angle(&spindle, count);
        // The prediction reaches to P; the amplitudes of jumps fall as 1/k.
        let zero = recording(RATE_HZ, vec![vec![0.0; count]], 0.0);
        let aliases = Orders::with_angle(&zero, &NAMES[..1], angle.clone(), &settings())
            .unwrap()
            .kernel()
            .aliases();
        let c = pulses(3, 0.1, aliases);
        let record = recording(
            RATE_HZ,
            vec![samples(&angle, count, |revolutions| series_at(&c, revolutions))],
            0.0,
        );
        let orders = Orders::with_angle(&record, &NAMES[..1], angle, &settings()).unwrap();
        let seen = orders.seen(&c);
        let found: Vec<Complex64> = orders.amplitudes.column(0).iter().copied().collect();
        assert_eq!(seen.len(), orders.kernel().orders() + 1);
        // Taylor's series in a sector and 1e4 sums of rounding errors: 1e-12 of a signal of size 1.
        let difference = largest_difference(&seen, &found);
        assert!(difference < 1e-11, "seed {seed}: {difference:e}");
        // Without the aliases the prediction is wrong by much more.
        let without = orders.seen(&c[..=orders.kernel().orders()]);
        assert!(largest_difference(&without, &found) > 1e-4, "seed {seed}");
        let prediction = DMatrix::from_column_slice(seen.len(), 1, &seen);
        assert!(orders.distance(&prediction).value < 1e-3, "seed {seed}");
    }
}

#[test]
fn aliases_beyond_the_highest_order_of_a_jump_stay_small() {
    for seed in 0..10 {
        let (spindle, count) = spindle(seed);
        let angle = angle(&spindle, count);
        let record = recording(
            RATE_HZ,
            vec![samples(&angle, count, |revolutions| {
                pulses_at(3, 0.1, revolutions)
            })],
            0.0,
        );
        let orders = Orders::with_angle(&record, &NAMES[..1], angle, &settings()).unwrap();
        let c = pulses(3, 0.1, orders.kernel().aliases());
        let found: Vec<Complex64> = orders.amplitudes.column(0).iter().copied().collect();
        let difference = largest_difference(&orders.seen(&c), &found);
        // Beyond P the coefficients of three jumps of about one are 3·1.1/(2πP) each; an order takes a small share of
        // each, and their phases differ.
        let tail = 3.3 / (std::f64::consts::TAU * orders.kernel().aliases() as f64);
        assert!(difference < tail, "seed {seed}: {difference:e} {tail:e}");
    }
}

#[test]
fn whole_numbers_of_samples_per_revolution_fold_aliases_onto_orders() {
    // 40 samples per revolution: order 40 − k is the conjugate alias of order k.
    let hertz = RATE_HZ / 40.0;
    let count = 1221;
    let angle = SpindleAngle::steady(hertz, 0.0, [0.0, 1220.0 / RATE_HZ]);
    let mut c = vec![Complex64::ZERO; 40];
    c[37] = Complex64::new(0.3, -0.2);
    let record = recording(
        RATE_HZ,
        vec![
            (0..count)
                .map(|sample| series_at(&c, sample as f64 / 40.0))
                .collect(),
        ],
        0.0,
    );
    let orders = Orders::with_angle(&record, &NAMES[..1], angle, &settings()).unwrap();
    assert!((orders.amplitudes[(3, 0)] - c[37].conj()).norm() < 1e-12);
    assert!((orders.seen(&c)[3] - c[37].conj()).norm() < 1e-12);
}
