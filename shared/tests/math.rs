//! The elementary functions compared with double precision, over their whole domains.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // a test may fail

use std::f64::consts::TAU;

use quietcut_core::math;

/// Distance of `value` from `exact`, in units of the distance between neighbouring `f32` numbers there.
fn ulps(value: f32, exact: f64) -> f64 {
    let gap = |x: f32| f64::from(f32::from_bits(x.abs().to_bits() + 1)) - f64::from(x.abs());
    (f64::from(value) - exact).abs() / gap(exact as f32)
}

/// Every `step`-th positive finite number. `step` is odd, so that all mantissa bits vary.
fn positive(step: usize) -> impl Iterator<Item = f32> {
    (1..f32::INFINITY.to_bits()).step_by(step).map(f32::from_bits)
}

/// The largest error. Prints it with its argument.
fn worst<T: std::fmt::Debug>(errors: impl Iterator<Item = (T, f64)>) -> f64 {
    let (argument, error) = errors.max_by(|a, b| a.1.total_cmp(&b.1)).expect("some arguments");
    println!("worst {error:.3e} at {argument:?}");
    error
}

#[test]
fn overflow_checks_are_on() {
    let one = std::hint::black_box(1_u8);
    assert!(
        std::panic::catch_unwind(|| u8::MAX + one).is_err(),
        "the profile must have overflow checks"
    );
}

#[test]
fn sqrt_is_within_one_ulp() {
    // Every third number of two octaves: the algorithm depends on the exponent through its parity only.
    let two_octaves = (1f32.to_bits()..4f32.to_bits()).step_by(3).map(f32::from_bits);
    let error = worst(
        positive(1009)
            .chain(two_octaves)
            .map(|x| (x, ulps(math::sqrt(x), f64::from(x).sqrt()))),
    );
    assert!(error <= 1.0);
    assert_eq!(math::sqrt(0.0).to_bits(), 0);
    assert_eq!(math::sqrt(f32::INFINITY), f32::INFINITY);
    assert!(math::sqrt(-1.0).is_nan() && math::sqrt(f32::NAN).is_nan());
    for end in [f32::from_bits(1), f32::MIN_POSITIVE, 2f32.powi(126), f32::MAX] {
        for x in [end.next_down(), end, end.next_up()]
            .into_iter()
            .filter(|x| x.is_finite())
        {
            assert!(ulps(math::sqrt(x), f64::from(x).sqrt()) <= 1.0, "{x:e}");
        }
    }
    for n in 0..=4096u16 {
        assert_eq!(
            math::sqrt(f32::from(n) * f32::from(n)),
            f32::from(n),
            "root of {n}²"
        );
    }
}

#[test]
fn hypot_is_within_three_ulp_and_does_not_overflow() {
    let error = worst(positive(4_000_037).flat_map(|x| {
        positive(4_100_003).filter_map(move |y| {
            let exact = f64::from(x).hypot(f64::from(y));
            (exact < f64::from(f32::MAX)).then(|| ((x, y), ulps(math::hypot(x, -y), exact)))
        })
    }));
    assert!(error <= 3.0);
    assert_eq!(math::hypot(0.0, 0.0), 0.0);
    assert_eq!(math::hypot(f32::NEG_INFINITY, 1.0), f32::INFINITY);
}

#[test]
fn sine_and_cosine_hold_for_every_angle() {
    let near = (-2_000_000..=2_000_000).map(|i| i as f32 * 1e-6);
    let error = worst(
        near.chain(positive(2017))
            .chain(positive(2017).map(|x| -x))
            .map(|turns| {
                // The reduction of an f32 angle in revolutions is exact in f64 too.
                let angle = TAU * f64::from(turns).fract();
                let (sin, cos) = math::sin_cos_turns(turns);
                (
                    turns,
                    (f64::from(sin) - angle.sin())
                        .abs()
                        .max((f64::from(cos) - angle.cos()).abs()),
                )
            }),
    );
    assert!(error <= 1.2e-7);
    for (turns, expected) in [
        (0.0, (0.0, 1.0)),
        (0.25, (1.0, 0.0)),
        (0.5, (0.0, -1.0)),
        (0.75, (-1.0, 0.0)),
    ] {
        assert_eq!(math::sin_cos_turns(turns), expected, "{turns} turns");
    }
    assert!(math::sin_turns(f32::NAN).is_nan() && math::cos_turns(f32::INFINITY).is_nan());
}

#[test]
fn atan2_is_within_two_ulp_and_in_turns_within_three() {
    let points = || {
        positive(3_000_017)
            .flat_map(|x| positive(3_100_001).map(move |y| (x, y)))
            .flat_map(|(x, y)| [(x, y), (-x, y), (x, -y), (-x, -y)])
    };
    // Results below the smallest normal number have no relative accuracy.
    let normal = |exact: f64| exact.abs() >= f64::from(f32::MIN_POSITIVE);
    let radians = worst(points().filter_map(|(x, y)| {
        let exact = f64::from(y).atan2(f64::from(x));
        normal(exact).then(|| ((x, y), ulps(math::atan2(y, x), exact)))
    }));
    assert!(radians <= 2.0);
    let turns = worst(points().filter_map(|(x, y)| {
        let exact = f64::from(y).atan2(f64::from(x)) / TAU;
        normal(exact).then(|| ((x, y), ulps(math::atan2_turns(y, x), exact)))
    }));
    assert!(turns <= 3.0);
}

#[test]
fn logarithms_are_within_their_bounds() {
    let near_one = || (-100_000..=100_000).map(|i| 1.0 + i as f32 * 1e-6);
    let ln = worst(
        positive(1009)
            .chain(near_one())
            .map(|x| (x, ulps(math::ln(x), f64::from(x).ln()))),
    );
    assert!(ln <= 1.0);
    let log10 = worst(
        positive(1009)
            .chain(near_one())
            .map(|x| (x, ulps(math::log10(x), f64::from(x).log10()))),
    );
    assert!(log10 <= 2.0);
    assert_eq!(math::ln(0.0), f32::NEG_INFINITY);
    assert!(math::ln(-1.0).is_nan());
}

#[test]
fn exp_is_within_one_ulp() {
    let error = worst((-87_000_000..=88_700_000).step_by(31).map(|i| {
        let x = i as f32 * 1e-6;
        (x, ulps(math::exp(x), f64::from(x).exp()))
    }));
    assert!(error <= 1.0);
    assert_eq!(math::exp(-200.0), 0.0);
    assert_eq!(math::exp(200.0), f32::INFINITY);
}

#[test]
fn floor_and_round_are_exact() {
    for x in positive(100_003).chain((0..1000).map(|i| i as f32 * 0.25)) {
        for x in [x, -x] {
            assert_eq!(math::floor(x), x.floor(), "{x}");
            assert_eq!(math::round(x), x.round(), "{x}");
        }
    }
}

#[test]
fn decibel_is_within_its_bound() {
    let error = worst(positive(1009).filter(|x| x.is_normal()).map(|x| {
        (
            x,
            (f64::from(math::decibel(x)) - 10.0 * f64::from(x).log10()).abs(),
        )
    }));
    assert!(error <= 1e-4);
    assert_eq!(math::decibel(0.0), math::decibel(f32::MIN_POSITIVE));
    assert_eq!(math::decibel(f32::NAN), math::decibel(-3.0));
}

#[test]
fn powers_of_two_are_exact() {
    for exponent in -126..=127 {
        assert_eq!(math::exp2i(exponent), 2f32.powi(exponent), "{exponent}");
    }
    assert_eq!(math::exp2i(i32::MIN), f32::MIN_POSITIVE);
    assert_eq!(math::exp2i(i32::MAX), 2f32.powi(127));
}
