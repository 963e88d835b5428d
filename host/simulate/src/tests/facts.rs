//! Motion beyond the stability limits of thesis chapter 6: period doubling and quasi-periodic motion.

use super::*;

/// Angular frequency, rad/s, by which thesis chapter 6 makes time dimensionless.
const OMEGA: f64 = 109.641_6;
/// Axial depth, mm, of the dimensionless depth w = 1 of thesis chapter 6.
const DEPTH_MM_PER_W: f64 = 1.0 / 0.033_628;

/// Stroboscopic section: displacement x, m, once per tooth-passing period after transients, of the robot with cubic terms at full immersion.
fn once_per_tooth(tau: f64, w: f64, skipped: u32, kept: u32) -> Vec<f64> {
    let case = case("kuka-kr90-full-cubic");
    let spindle_rpm = 30.0 * OMEGA / tau;
    let model = steady(&case, spindle_rpm, w * DEPTH_MM_PER_W);
    let period_s = tau / OMEGA;
    motions(
        &model,
        exact(1e-7),
        (f64::from(skipped) + 0.3) * period_s,
        period_s,
        f64::from(skipped + kept) * period_s,
    )
    .iter()
    .map(|motion| motion.displacement_m[0])
    .collect()
}

fn spread(values: impl Iterator<Item = f64> + Clone) -> f64 {
    values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
}

#[test]
fn below_the_limit_every_tooth_finds_the_same_motion() {
    // The limit (period doubling) is at w = 0.06241.
    let x = once_per_tooth(2.7, 0.055, 3000, 60);
    assert!(spread(x.iter().copied()) < 1e-3 * 0.15e-3, "{x:?}");
}

#[test]
fn fig_6_3_is_a_flip_at_2_7_and_a_torus_at_2_9() {
    let flip = once_per_tooth(2.7, 0.08, 3000, 60);
    let (even, odd) = (
        flip.iter().copied().step_by(2),
        flip.iter().copied().skip(1).step_by(2),
    );
    let apart = (flip[0] - flip[1]).abs();
    assert!(apart > 0.1 * 0.15e-3, "two points apart: {flip:?}");
    assert!(
        spread(even) < 1e-3 * apart && spread(odd) < 1e-3 * apart,
        "two points only: {flip:?}"
    );

    let torus = once_per_tooth(2.9, 0.08, 3000, 60);
    let whole = spread(torus.iter().copied());
    assert!(whole > 0.1 * 0.15e-3, "{torus:?}");
    // The section has no short period: every subsequence spans much of the closed curve.
    for period in 1..8 {
        assert!(
            spread(torus.iter().copied().step_by(period)) > 0.3 * whole,
            "{period}: {torus:?}"
        );
    }
}

#[test]
fn after_the_torus_the_motion_is_quasi_periodic_with_the_rotation_of_fig_6_13() {
    for (tau, w, rotation) in [
        (5.04, 0.085, 2.0 / 5.0),
        (4.17, 0.065, 2.0 / 3.0),
        (2.07, 0.14, 3.0 / 4.0),
        (1.34, 0.19, 1.0 / 2.0),
    ] {
        let per_tooth = once_per_tooth(tau, w, 6000, 2048);
        // Once per spindle revolution: the tool has two teeth.
        let x: Vec<f64> = per_tooth.iter().copied().step_by(2).collect();
        let found = dominant_frequency(&x);
        // Sampled once per revolution, the rotation numbers p/q and 1 − p/q cannot be told apart.
        let off = (found - rotation).abs().min((found - (1.0 - rotation)).abs());
        assert!(off < 0.01, "τ = {tau}: rotation {found}, not {rotation}");
        // A phase-locked motion would repeat exactly after q revolutions, with q at most 5.
        let period = (rotation * 60.0).round() as usize;
        let q = 60 / gcd(period, 60);
        let repeat = x
            .iter()
            .zip(&x[q..])
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        assert!(
            repeat > 1e-3 * spread(x.iter().copied()),
            "τ = {tau}: locked, repeats to {repeat} m"
        );
    }
}

#[test]
fn the_error_of_a_cut_with_loss_of_contact_follows_the_tolerance() {
    let case = case("kuka-kr90-acetal");
    let model = steady(&case, 900.0, 3.0);
    let run = |relative| motions(&model, exact(relative), 0.01, 0.0107, 2.0);
    let truth = run(1e-12);
    let size = truth
        .iter()
        .map(|m| m.displacement_m[1].abs())
        .fold(0.0, f64::max);
    let errors = [1e-5, 1e-7, 1e-9].map(|relative| {
        run(relative)
            .iter()
            .zip(&truth)
            .flat_map(|(a, b)| (0..3).map(|axis| (a.displacement_m[axis] - b.displacement_m[axis]).abs()))
            .fold(0.0, f64::max)
            / size
    });
    // Over 60 tooth passings of growing chatter the error grows to 100 times the tolerance, and is proportional to it.
    assert!(
        errors[0] / errors[1] > 15.0 && errors[1] / errors[2] > 15.0,
        "{errors:?}"
    );
    assert!(errors[1] < 3e-5, "{errors:?}");
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// Dominant frequency of a series, in cycles per sample from 0 to ½: the peak of its Hann-windowed Fourier transform on a fine grid.
fn dominant_frequency(x: &[f64]) -> f64 {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    let power = |frequency: f64| {
        let sum: num_complex::Complex64 = x
            .iter()
            .enumerate()
            .map(|(k, value)| {
                let at = k as f64 / x.len() as f64;
                let window = 0.5 - 0.5 * (std::f64::consts::TAU * at).cos();
                num_complex::Complex64::from_polar(
                    window * (value - mean),
                    -std::f64::consts::TAU * frequency * k as f64,
                )
            })
            .sum();
        sum.norm_sqr()
    };
    let steps = 4 * x.len();
    (0..=steps)
        .map(|i| 0.5 * i as f64 / steps as f64)
        .max_by(|a, b| power(*a).total_cmp(&power(*b)))
        .unwrap()
}
