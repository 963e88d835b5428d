//! The half-band cascade: frequency response, delay, exactness, independence of blocks.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // a test may fail

use std::f64::consts::TAU;

use proptest::prelude::*;
use quietcut_core::acceleration::Counts;
use quietcut_core::decimation::{Decimation, FRACTION_BITS, Output, Sample, State};
use quietcut_core::units::Hertz;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Input rates that give every layout of the cascade, from none to five stages.
const RATES: [f32; 12] = [
    1_000.0, 2_048.0, 3_200.0, 6_400.0, 10_000.0, 12_800.0, 25_600.0, 26_667.0, 32_000.0, 51_200.0, 78_000.0,
    102_400.0,
];

fn run(decimation: &Decimation, counts: impl IntoIterator<Item = Counts>) -> Vec<Output> {
    let mut state = State::new();
    counts
        .into_iter()
        .map(|c| decimation.step(&mut state, c))
        .collect()
}

/// Impulse responses of both bands at the input rate, from impulses at all positions relative to the output samples.
struct Responses {
    tool: Vec<f64>,
    structure: Vec<f64>,
}

/// Measures the impulse responses of axis x with an impulse of the largest count. Axes y and z are zero.
fn impulse_responses(decimation: &Decimation) -> Responses {
    let height = i16::MAX;
    // A symmetric filter is twice as long as its delay.
    let length = 2 * decimation.structure_delay() as usize + 2;
    let mut responses = Responses {
        tool: vec![0.0; length],
        structure: vec![0.0; length],
    };
    for phase in 0..decimation.structure_divisor() as usize {
        let start = 16 + phase;
        let outputs = run(
            decimation,
            (0..start + length).map(|n| [if n == start { height } else { 0 }, 0, 0]),
        );
        let scale = f64::from(height) * f64::from(1 << FRACTION_BITS);
        for (n, output) in outputs.iter().enumerate().skip(start) {
            let note = |sample: Option<Sample>, response: &mut Vec<f64>| {
                if let Some([x, y, z]) = sample {
                    assert_eq!((y, z), (0, 0), "axes mix");
                    response[n - start] = f64::from(x) / scale;
                }
            };
            note(output.tool, &mut responses.tool);
            note(output.structure, &mut responses.structure);
        }
    }
    responses
}

/// |H| in decibel at `hertz`, from the sum Σ h[n]·exp(−2πi·f·n/rate).
fn gain_db(response: &[f64], hertz: f64, rate: f64) -> f64 {
    let (mut re, mut im) = (0.0, 0.0);
    for (n, h) in response.iter().enumerate() {
        let (sin, cos) = (TAU * hertz * n as f64 / rate).sin_cos();
        re += h * cos;
        im -= h * sin;
    }
    20.0 * re.hypot(im).log10()
}

/// Largest deviation from 0 dB up to `flat_hz`, and smallest attenuation of the frequencies that alias into this range.
fn ripple_and_rejection_db(response: &[f64], rate: f64, divisor: u32, flat_hz: f64) -> (f64, f64) {
    let points = 100;
    let output_rate = rate / f64::from(divisor);
    let (mut ripple, mut rejection) = (0f64, f64::INFINITY);
    for i in 0..=points {
        let f = flat_hz * f64::from(i) / f64::from(points);
        ripple = ripple.max(gain_db(response, f, rate).abs());
        for image in 1..=divisor / 2 {
            for alias in [
                f64::from(image) * output_rate - f,
                f64::from(image) * output_rate + f,
            ] {
                if alias <= rate / 2.0 {
                    rejection = rejection.min(-gain_db(response, alias, rate));
                }
            }
        }
    }
    (ripple, rejection)
}

/// The ripple is at most 0.001 dB and aliases are attenuated by 90 dB, for the nominal sample clock and for one that is 3 %
/// slow. The rounding of the measured taps is far smaller.
#[test]
fn bands_are_flat_and_free_of_aliases() {
    for rate in RATES {
        let decimation = Decimation::new(Hertz(rate)).unwrap();
        let responses = impulse_responses(&decimation);
        for clock in [1.0, 0.97] {
            let rate = f64::from(rate) * clock;
            let nyquist = |divisor: u32| rate / 2.0 / f64::from(divisor);
            for (name, response, divisor, flat) in [
                ("tool", &responses.tool, decimation.tool_divisor(), 5_000.0),
                (
                    "structure",
                    &responses.structure,
                    decimation.structure_divisor(),
                    400.0,
                ),
            ] {
                let (ripple, rejection) =
                    ripple_and_rejection_db(response, rate, divisor, f64::min(flat, nyquist(divisor)));
                println!(
                    "{rate:8.1} Hz, {name}: 1/{divisor}, ripple {ripple:.6} dB, rejection {rejection:.1} dB"
                );
                assert!(ripple <= 0.001, "{rate} Hz, {name}: ripple {ripple} dB");
                assert!(rejection >= 90.0, "{rate} Hz, {name}: rejection {rejection} dB");
            }
        }
    }
}

#[test]
fn rates_of_the_bands() {
    for (rate, tool, structure) in [
        (1_000.0, 1, 1),
        (3_199.0, 1, 1),
        (3_200.0, 1, 2),
        (10_000.0, 1, 4),
        (20_000.0, 1, 8),
        (25_600.0, 1, 16),
        (26_667.0, 2, 16),
        (32_000.0, 2, 16),
        (38_400.0, 2, 16),
        (51_200.0, 2, 32),
        (78_000.0, 4, 32),
        (102_400.0, 4, 64),
    ] {
        let decimation = Decimation::new(Hertz(rate)).unwrap();
        let found = (decimation.tool_divisor(), decimation.structure_divisor());
        assert_eq!(found, (tool, structure), "{rate} Hz");
    }
    for rate in [999.0, 102_401.0, -1.0, f32::NAN, f32::INFINITY] {
        let error = Decimation::new(Hertz(rate)).unwrap_err();
        assert!(error.to_string().contains("1000 Hz to 102400 Hz"), "{error}");
    }
}

/// A linear-phase filter passes a straight line without change except for its delay, so that the delay must be exact to the
/// rounding.
#[test]
fn delay_is_exact() {
    for rate in RATES {
        let decimation = Decimation::new(Hertz(rate)).unwrap();
        let settled = 2 * decimation.structure_delay() as i32;
        let outputs = run(
            &decimation,
            (0..4096).map(|n| [n as i16, -n as i16, (3 * n) as i16]),
        );
        for (n, output) in (0..).zip(outputs).skip(settled as usize) {
            for (sample, delay) in [
                (output.tool, decimation.tool_delay()),
                (output.structure, decimation.structure_delay()),
            ] {
                let Some(sample) = sample else { continue };
                let line = (n - delay as i32) << FRACTION_BITS;
                for (value, expected) in sample.into_iter().zip([line, -line, 3 * line]) {
                    // Each stage rounds by half a unit.
                    assert!(
                        (value - expected).abs() <= 3,
                        "{rate} Hz at {n}: {value} for {expected}"
                    );
                }
            }
        }
    }
}

/// The gain at 0 Hz is exactly 1, from the first sample on.
#[test]
fn gravity_passes_unchanged_and_makes_no_step() {
    for rate in RATES {
        let decimation = Decimation::new(Hertz(rate)).unwrap();
        let counts = [2048, i16::MIN, i16::MAX];
        let expected = counts.map(|c| i32::from(c) << FRACTION_BITS);
        let outputs = run(&decimation, vec![counts; 2000]);
        assert_eq!(
            outputs[0],
            Output {
                tool: Some(expected),
                structure: Some(expected)
            }
        );
        for output in outputs {
            assert!(output.tool.is_none_or(|s| s == expected), "{rate} Hz");
            assert!(output.structure.is_none_or(|s| s == expected), "{rate} Hz");
        }
    }
}

/// The input with the largest possible output, the sum of the magnitudes of the impulse response, gives less than twice full
/// scale.
#[test]
fn worst_case_input_does_not_overflow() {
    for rate in RATES {
        let decimation = Decimation::new(Hertz(rate)).unwrap();
        let responses = impulse_responses(&decimation);
        for (response, divisor, structure) in [
            (&responses.tool, decimation.tool_divisor(), false),
            (&responses.structure, decimation.structure_divisor(), true),
        ] {
            // An output comes with the first sample and then every `divisor` samples.
            let end = response.len().next_multiple_of(divisor as usize);
            let counts = (0..=end).map(|n| {
                let h = response.get(end - n).copied().unwrap_or(0.0);
                let (along, against) = if h < 0.0 {
                    (i16::MIN, i16::MAX)
                } else {
                    (i16::MAX, i16::MIN)
                };
                [along, against, 0]
            });
            let last = run(&decimation, counts).pop().unwrap();
            let [x, y, _] = if structure { last.structure } else { last.tool }.unwrap();
            let gain: f64 = response.iter().map(|h| h.abs()).sum();
            for value in [x, -y] {
                let found = f64::from(value) / f64::from(1 << (15 + FRACTION_BITS));
                // The measured responses are rounded to 2⁻²⁷.
                assert!((found - gain).abs() < 1e-3, "{rate} Hz: {found} for {gain}");
                assert!(value < 2 << (15 + FRACTION_BITS), "{rate} Hz");
            }
            println!("{rate} Hz, 1/{divisor}: at most {gain:.3} times full scale");
        }
    }
}

/// After a reset the cascade is in its initial state.
#[test]
fn reset_gives_the_initial_state() {
    let seed = 5;
    println!("seed {seed}");
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let decimation = Decimation::new(Hertz(26_667.0)).unwrap();
    let counts: Vec<Counts> = (0..3000).map(|_| rng.random()).collect();
    let mut state = State::new();
    for &c in &counts[..777] {
        decimation.step(&mut state, c);
    }
    state.reset();
    let after: Vec<_> = counts.iter().map(|&c| decimation.step(&mut state, c)).collect();
    assert_eq!(after, run(&decimation, counts));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, failure_persistence: None, ..ProptestConfig::default() })]

    /// The outputs do not depend on the lengths of the blocks, nor on another cascade that runs between them.
    #[test]
    fn blocks_do_not_matter(
        counts in proptest::collection::vec(any::<Counts>(), 1..600),
        cuts in proptest::collection::vec(1usize..64, 1..20),
        rate in 1_000f32..102_400.0,
    ) {
        let decimation = Decimation::new(Hertz(rate)).unwrap();
        let whole = run(&decimation, counts.iter().copied());
        let (mut state, mut other) = (State::new(), State::new());
        let mut pieces = Vec::new();
        let mut rest = &counts[..];
        for cut in cuts.iter().cycle() {
            if rest.is_empty() {
                break;
            }
            let (block, tail) = rest.split_at((*cut).min(rest.len()));
            pieces.extend(block.iter().map(|&c| decimation.step(&mut state, c)));
            decimation.step(&mut other, block[0]);
            rest = tail;
        }
        prop_assert_eq!(pieces, whole);
    }
}
