//! The fixed-point transform compared with an exact transform.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // a test may fail

use std::f64::consts::TAU;

use proptest::prelude::*;
use quietcut_core::fft::{self, Transform};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex64;

/// Calls the transform for this number of samples. Returns X[0] … X[N/2] as floats.
fn transform(samples: &[i32]) -> Vec<Complex64> {
    fn unpack(t: Transform<'_>) -> Vec<Complex64> {
        let scale = f64::from(t.exponent).exp2();
        let number = |re: i32, im: i32| Complex64::new(f64::from(re), f64::from(im)) * scale;
        let [dc, nyquist] = t.bins[0];
        let mut all = vec![number(dc, 0)];
        all.extend(t.bins[1..].iter().map(|z| number(z[0], z[1])));
        all.push(number(nyquist, 0));
        all
    }
    match samples.len() {
        256 => unpack(fft::rfft_256(&mut samples.try_into().unwrap())),
        512 => unpack(fft::rfft_512(&mut samples.try_into().unwrap())),
        1024 => unpack(fft::rfft_1024(&mut samples.try_into().unwrap())),
        2048 => unpack(fft::rfft_2048(&mut samples.try_into().unwrap())),
        4096 => unpack(fft::rfft_4096(&mut samples.try_into().unwrap())),
        n => panic!("no transform of {n} points"),
    }
}

/// The exact spectrum X[0] … X[N/2], in double precision.
fn exact(samples: &[i32]) -> Vec<Complex64> {
    let mut data: Vec<_> = samples
        .iter()
        .map(|&v| Complex64::new(f64::from(v), 0.0))
        .collect();
    FftPlanner::new().plan_fft_forward(data.len()).process(&mut data);
    data.truncate(data.len() / 2 + 1);
    data
}

/// Signal-to-noise ratio of the transform in decibel: energy of the exact spectrum over energy of the difference.
fn snr_db(samples: &[i32]) -> f64 {
    let (ours, exact) = (transform(samples), exact(samples));
    let signal: f64 = exact.iter().map(|z| z.norm_sqr()).sum();
    let noise: f64 = ours.iter().zip(&exact).map(|(a, b)| (a - b).norm_sqr()).sum();
    10.0 * (signal / noise).log10()
}

/// A tone with `dbfs` relative to the 16-bit full scale and `bin` cycles per block, rounded to 16 bits.
fn tone(points: usize, dbfs: f64, bin: f64, phase: f64) -> Vec<i32> {
    let amplitude = 32767.0 * 10f64.powf(dbfs / 20.0);
    (0..points)
        .map(|n| (amplitude * (TAU * bin * n as f64 / points as f64 + phase).cos()).round() as i32)
        .collect()
}

const SIZES: [usize; 5] = [256, 512, 1024, 2048, 4096];

/// Accuracy for all sizes, with tones on and between bins and with noise. The required figures are 130 and 90 dB for 1024
/// points. For 4096 points the word length allows 130 dB: a tone of 2³⁰ against a few units of rounding in each of N results.
#[test]
fn accuracy_against_the_exact_transform() {
    for points in SIZES {
        for dbfs in [-1.0, -40.0] {
            for bin in [
                37.0,
                37.4,
                100.5,
                0.3,
                points as f64 / 8.0,
                points as f64 / 2.0 - 1.7,
            ] {
                let snr = snr_db(&tone(points, dbfs, bin, 0.3));
                println!("{points} points, tone at {dbfs} dBFS, bin {bin}: {snr:.1} dB");
                assert!(
                    snr >= 130.0,
                    "{points} points, {dbfs} dBFS, bin {bin}: {snr:.1} dB"
                );
            }
        }
        let two: Vec<i32> = tone(points, -7.0, 20.3, 0.0)
            .iter()
            .zip(tone(points, -40.0, 71.8, 1.0))
            .map(|(a, b)| a + b)
            .collect();
        let seed = 17;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let noise: Vec<i32> = (0..points).map(|_| i32::from(rng.random::<i16>())).collect();
        for (name, samples) in [("two tones", two), ("noise", noise)] {
            let snr = snr_db(&samples);
            println!("{points} points, {name}: {snr:.1} dB (seed {seed})");
            assert!(snr >= 130.0, "{points} points, {name}: {snr:.1} dB (seed {seed})");
        }
    }
}

/// The exact transform of this test equals the sum of the definition.
#[test]
fn reference_is_the_definition() {
    let samples: Vec<i32> = (0..256).map(|n| (n * n * 31 + 7 * n) % 1009 - 500).collect();
    for (k, found) in exact(&samples).iter().enumerate() {
        let sum: Complex64 = (0..256)
            .map(|n| f64::from(samples[n]) * Complex64::cis(-TAU * ((k * n) % 256) as f64 / 256.0))
            .sum();
        assert!((found - sum).norm() < 1e-7, "bin {k}");
    }
}

/// Blocks that give the largest possible values of single bins, of sums of bins and inside of the butterflies.
fn extreme_blocks(points: usize, high: i32, low: i32) -> Vec<(String, Vec<i32>)> {
    let mut blocks = vec![
        ("all high".into(), vec![high; points]),
        ("all low".into(), vec![low; points]),
        (
            "first high".into(),
            (0..points).map(|n| if n == 0 { high } else { 0 }).collect(),
        ),
        (
            "last low".into(),
            (0..points)
                .map(|n| if n == points - 1 { low } else { 0 })
                .collect(),
        ),
    ];
    // The sign of a tone gives its bin the sum of all |cos|. Bins at and near fractions of the sample rate are used.
    for part in [2, 3, 4, 5, 6, 8, 12, 16, 32, points] {
        for bin in [points / part, points / part - 1, points / 2 - points / part + 1] {
            for phase in [0.0, 0.125, 0.25, 0.3] {
                let sign =
                    |n: usize| (TAU * ((bin * n % points) as f64 / points as f64 + phase)).cos() >= 0.0;
                let block = (0..points).map(|n| if sign(n) { high } else { low }).collect();
                blocks.push((format!("square wave of bin {bin}, phase {phase}"), block));
            }
        }
    }
    blocks
}

/// With overflow checks, an overflow ends the test.
///
/// Without them, the comparison with the exact result shows that nothing wraps.
#[test]
fn extreme_inputs_neither_overflow_nor_lose_accuracy() {
    for points in SIZES {
        // 16-bit full scale, the largest block that needs no shift, one bit more, and full 32 bits.
        let bits = points.trailing_zeros();
        let radix4_passes = 2 + (bits - 7) / 2;
        let largest = 1 << (31 + radix4_passes - bits);
        for (high, low) in [
            (32_767, -32_768),
            (largest - 1, -largest),
            (largest, -largest - 1),
            (i32::MAX, i32::MIN),
        ] {
            for (name, block) in extreme_blocks(points, high, low) {
                let snr = snr_db(&block);
                // A single impulse has N times less energy than a tone of the same amplitude. With 4096 points its spectrum is
                // near 2¹⁸.
                assert!(
                    snr >= 105.0,
                    "{points} points, {high} … {low}, {name}: {snr:.1} dB"
                );
            }
        }
        assert!(transform(&vec![0; points]).iter().all(|z| *z == Complex64::ZERO));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// Blocks of random extremes combine in more ways than the list of extreme blocks.
    #[test]
    fn random_extremes_do_not_overflow(
        size in 0..SIZES.len(),
        signs in proptest::collection::vec(any::<bool>(), 4096),
        bits in 0..32u32,
    ) {
        let (high, low) = (i32::MAX >> (31 - bits), i32::MIN >> (31 - bits));
        let block: Vec<i32> = signs[..SIZES[size]].iter().map(|&s| if s { high } else { low }).collect();
        let snr = snr_db(&block);
        prop_assert!(snr >= 120.0, "{snr} dB");
    }

    /// T(a·x + b·y) = a·T(x) + b·T(y), and Σ|x|² = Σ|X|²/N, to the accuracy of the word length.
    #[test]
    fn linear_and_true_to_energy(
        size in 0..SIZES.len(),
        x in proptest::collection::vec(-8_000..8_000i32, 4096),
        y in proptest::collection::vec(-8_000..8_000i32, 4096),
        a in -2..=2i32,
        b in -2..=2i32,
    ) {
        let points = SIZES[size];
        let (x, y) = (&x[..points], &y[..points]);
        let sum: Vec<i32> = x.iter().zip(y).map(|(x, y)| a * x + b * y).collect();
        let (tx, ty, ts) = (transform(x), transform(y), transform(&sum));
        // The tolerance is 130 dB below the largest value of the spectrum of this noise.
        let tolerance = 32_000.0 * (points as f64).sqrt() * 10f64.powf(-130.0 / 20.0) * 4.0;
        for k in 0..ts.len() {
            let expected = f64::from(a) * tx[k] + f64::from(b) * ty[k];
            prop_assert!((ts[k] - expected).norm() <= tolerance, "bin {k}: {} for {expected}", ts[k]);
        }
        let energy: f64 = x.iter().map(|&v| f64::from(v).powi(2)).sum();
        let ends = tx[0].norm_sqr() + tx[points / 2].norm_sqr();
        let spectrum = (2.0 * tx.iter().map(|z| z.norm_sqr()).sum::<f64>() - ends) / points as f64;
        prop_assert!((spectrum - energy).abs() <= 1e-6 * energy, "{spectrum} for {energy}");
    }
}

/// The independent single-precision transform of microfft agrees to its accuracy, about 120 dB.
#[test]
fn agrees_with_microfft() {
    macro_rules! compare {
        ($($points:literal $theirs:ident),*) => {$(
            let samples = tone($points, -6.0, 31.3, 0.7);
            let mut floats: [f32; $points] = std::array::from_fn(|n| samples[n] as f32);
            let theirs = microfft::real::$theirs(&mut floats);
            let ours = transform(&samples);
            let largest = ours.iter().map(|z| z.norm()).fold(0.0, f64::max);
            for k in 1..$points / 2 {
                let theirs = Complex64::new(f64::from(theirs[k].re), f64::from(theirs[k].im));
                assert!((ours[k] - theirs).norm() <= 1e-6 * largest, "{} points, bin {k}", $points);
            }
            let ends = Complex64::new(f64::from(theirs[0].re), f64::from(theirs[0].im));
            assert!((ours[0].re - ends.re).abs() <= 1e-6 * largest);
            assert!((ours[$points / 2].re - ends.im).abs() <= 1e-6 * largest);
        )*};
    }
    compare!(256 rfft_256, 512 rfft_512, 1024 rfft_1024, 2048 rfft_2048, 4096 rfft_4096);
}
