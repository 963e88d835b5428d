//! The estimators on passings in closed form: deviations c·μ^k with a shape over the channels, offsets of the classes, noise.

use super::{CAPACITY, Exponential, Guess, Plan, Stroboscope};
use crate::synchronous::{CHANNELS, ToothPassing};

/// Uniform numbers of variance 1 (Knuth's linear congruential generator).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        12f64.sqrt() * ((self.0 >> 11) as f64 / (1u64 << 53) as f64 - 0.5)
    }
}

/// A deviation of one multiplier.
#[derive(Clone, Copy)]
struct Deviation {
    abs: f64,
    angle_turns: f64,
    /// Cycles per tooth period.
    cycles: f64,
    /// Amplitude at the first passing.
    amplitude: f64,
}

/// So many passings of deviations, of a runout of the classes and of noise.
fn stroboscope(classes: u8, passings: u64, deviations: &[Deviation], runout: f64, noise: f64) -> Stroboscope {
    noisy(7, classes, passings, deviations, runout, noise)
}

fn noisy(
    seed: u64,
    classes: u8,
    passings: u64,
    deviations: &[Deviation],
    runout: f64,
    noise: f64,
) -> Stroboscope {
    let mut source = Noise(seed);
    let mut stroboscope = Stroboscope::new(classes);
    for k in 0..passings {
        let passing: ToothPassing = std::array::from_fn(|channel| {
            let (slot, axis) = (channel / 3, channel % 3);
            let offset = runout * f64::from((k as u8 % classes) * 7 % 5) * (1.0 + channel as f64);
            let deviation: f64 = deviations
                .iter()
                .map(|d| {
                    let turns = d.angle_turns * k as f64 + d.cycles * slot as f64 / 8.0 + 0.1 * axis as f64;
                    d.amplitude * d.abs.powi(k as i32) * (std::f64::consts::TAU * turns).cos()
                })
                .sum();
            (9.8 + offset + deviation + noise * source.next()) as f32
        });
        stroboscope.push(k, &passing);
    }
    stroboscope
}

const SLOW: Deviation = Deviation {
    abs: 1.02,
    angle_turns: 0.343,
    cycles: 0.343,
    amplitude: 0.01,
};

fn fitted(stroboscope: &Stroboscope, rate: f32, angle_turns: f32) -> Option<Exponential> {
    let window = stroboscope.window(stroboscope.filled()).unwrap();
    window.exponential([Guess { rate, angle_turns }])
}

#[test]
fn an_exponential_without_noise_is_found_exactly() {
    for classes in [1, 2, 4] {
        let stroboscope = stroboscope(classes, 64, &[SLOW], 0.3, 0.0);
        // Two steps of Gauss and Newton from half a resolution away.
        let found = fitted(&stroboscope, 0.01, 0.338).unwrap();
        assert!((found.rate - 1.02f32.ln()).abs() < 5e-4, "{}", found.rate);
        assert!((found.angle_turns - 0.343).abs() < 2e-4, "{}", found.angle_turns);
        let level = 0.01 * 1.02f32.powi(63) / 2f32.sqrt();
        assert!((found.level / level - 1.0).abs() < 0.03, "{}", found.level);
        let cycles = found.cycles().unwrap();
        assert!((cycles - 0.343).abs() < 1e-3, "{cycles}");
        assert!(found.certainty > 20.0);
    }
}

#[test]
fn an_exponential_below_the_noise_is_sure() {
    // At the end the deviation is 0.025 rms in noise of 0.03.
    const SEEDS: u64 = 50;
    let (mut rates, mut certainties) = (0.0, 0.0);
    for seed in 0..SEEDS {
        let found = fitted(&noisy(seed, 2, 64, &[SLOW], 0.3, 0.03), 0.01, 0.343).unwrap();
        rates += found.rate / SEEDS as f32;
        certainties += found.certainty / SEEDS as f32;
    }
    // The bound of Cramér and Rao, σ·√((2g)³/(channels·level²)), is 0.002 for an endless window without offsets. The
    // mean of fifty is within half of a few times that.
    assert!((rates - 1.02f32.ln()).abs() < 0.003, "{rates}");
    // Degree 1 of a growth from 0.28 to 1 is 0.2·√64·level·√24, over the noise 6.4.
    assert!((5.0..8.0).contains(&certainties), "{certainties}");
    let dying = Deviation {
        abs: 0.98,
        amplitude: 0.1,
        ..SLOW
    };
    let dying = fitted(&stroboscope(2, 64, &[dying], 0.3, 0.03), 0.01, 0.343).unwrap();
    assert!(dying.rate < -0.01 && dying.certainty < 0.0);
}

#[test]
fn noise_and_what_wanders_do_not_grow() {
    for seed in 0..200 {
        let mut source = Noise(seed);
        let (mut white, mut wanders) = (Stroboscope::new(2), Stroboscope::new(2));
        let [mut re, mut im] = [0.0; 2];
        for k in 0..64 {
            // A mode of 40 passings per e-fold that noise drives.
            (re, im) = (0.975 * re + source.next(), 0.975 * im + source.next());
            let noise: ToothPassing = std::array::from_fn(|_| source.next() as f32);
            white.push(k, &noise);
            wanders.push(
                k,
                &std::array::from_fn(|channel| {
                    let turns = 0.343 * (k as f64 + (channel / 3) as f64 / 8.0);
                    let (sin, cos) = (std::f64::consts::TAU * turns).sin_cos();
                    (re * cos - im * sin + 0.5 * f64::from(noise[channel])) as f32
                }),
            );
        }
        for angle in [0.1, 0.2, 0.343, 0.45] {
            let certainty = fitted(&white, 0.01, angle).unwrap().certainty;
            assert!(certainty < 7.0, "noise, seed {seed}, {angle}: {certainty}");
        }
        let certainty = fitted(&wanders, 0.01, 0.343).unwrap().certainty;
        assert!(certainty < 7.0, "wandering, seed {seed}: {certainty}");
    }
}

#[test]
fn short_windows_and_angles_of_classes_are_not_fitted() {
    assert_eq!(fitted(&stroboscope(2, 39, &[SLOW], 0.0, 0.0), 0.01, 0.343), None);
    // A quarter turn is what comes back with each revolution of four teeth.
    assert_eq!(fitted(&stroboscope(4, 64, &[SLOW], 0.0, 0.0), 0.0, 0.25), None);
}

#[test]
fn linear_prediction_finds_the_largest_of_two_pairs() {
    let fast = Deviation { abs: 1.05, ..SLOW };
    let dying = Deviation {
        abs: 0.8,
        angle_turns: 0.12,
        cycles: 1.12,
        amplitude: 0.05,
    };
    let stroboscope = stroboscope(2, 40, &[fast, dying], 0.3, 0.0);
    let plan = Plan {
        window: 24,
        order: 4,
        stride: 1,
    };
    let found = stroboscope.window(24).unwrap().predict(plan, 0.0).unwrap();
    // Single precision beside an offset of 10 m/s².
    assert!(
        (found.multiplier_abs - 1.05).abs() < 2e-3,
        "{}",
        found.multiplier_abs
    );
    assert!((found.angle_turns - 0.343).abs() < 1e-3, "{}", found.angle_turns);
}

#[test]
fn strides_sharpen_and_unfold() {
    let stroboscope = stroboscope(2, 64, &[SLOW], 0.3, 1e-4);
    let plan = Plan {
        window: CAPACITY,
        order: 3,
        stride: 11,
    };
    let window = stroboscope.window(CAPACITY).unwrap();
    let found = window.predict(plan, 0.0).unwrap();
    assert!(
        (found.multiplier_abs - 1.02).abs() < 1e-3,
        "{}",
        found.multiplier_abs
    );
    let angle = window.unfold(found.angle_turns, 11);
    assert!((angle - 0.343).abs() < 1e-3, "{angle}");
}

#[test]
fn what_alternates_is_told_from_runout_by_its_curve() {
    let flip = |abs| Deviation {
        abs,
        angle_turns: 0.5,
        cycles: 0.5,
        amplitude: 0.02,
    };
    let look = |abs, runout| {
        let stroboscope = stroboscope(2, 64, &[flip(abs)], runout, 0.003);
        stroboscope.window(64).unwrap().alternation(9e-6, 4.0).unwrap()
    };
    for runout in [0.0, 0.3] {
        let (growing, dying) = (look(1.03, runout), look(0.95, runout));
        assert!(growing.least > 1.0 && (growing.multiplier_abs - 1.03).abs() < 0.01);
        assert!(dying.most < 1.0 && (dying.multiplier_abs - 0.95).abs() < 0.02);
    }
    // Odd numbers of teeth have no class that alternates.
    let odd = stroboscope(3, 64, &[flip(1.03)], 0.0, 0.003);
    assert_eq!(odd.window(64).unwrap().alternation(9e-6, 4.0), None);
}

#[test]
fn rows_know_their_class() {
    let stroboscope = stroboscope(4, 71, &[], 0.0, 0.0);
    let window = stroboscope.window(10).unwrap();
    // The newest is passing 70, the oldest 61.
    assert_eq!((window.class(0), window.class(9)), (1, 2));
    assert_eq!(stroboscope.filled(), CAPACITY);
    assert!(window.row(3).iter().all(|v| *v == 0.0) && window.row(3).len() == CHANNELS);
}

#[test]
fn the_passing_of_a_revolution_ago_is_that_of_the_same_tooth() {
    let mut stroboscope = Stroboscope::new(3);
    assert_eq!(stroboscope.a_revolution_ago(), None);
    for tooth in 0..10 {
        stroboscope.push(tooth, &[tooth as f32; CHANNELS]);
        let expected = (tooth >= 2).then_some([tooth as f32 - 2.0; CHANNELS]);
        assert_eq!(stroboscope.a_revolution_ago(), expected);
    }
    // The memory of the device is zero before its first settings.
    stroboscope.reset();
    stroboscope.classes = 0;
    assert_eq!(stroboscope.a_revolution_ago(), None);
}
