//! Quantiles of the normal, Student's, χ² and F distributions, and intervals of a proportion.
//!
//! A quantile of a distribution inverts the monotone distribution function by bracketing and bisection, that of the
//! normal distribution by Halley's method. The number of iterations is bounded for every argument. In the tests, with
//! 0.3 to 300 degrees of freedom and given probabilities from 0.001 to 0.999, the probability at a quantile differs
//! from the given one by less than 1e-11. Continued fractions and series of the incomplete gamma and beta functions:
//! Press et al., *Numerical Recipes*, 3rd edition, 6.2 and 6.4 (Lentz's method).

use std::f64::consts::{PI, SQRT_2};

use crate::roots::bisection;

/// Half the width of a two-sided 90 % interval of a normal distribution, in standard deviations: Φ⁻¹(0.95).
pub const NINETY_PERCENT: f64 = 1.644_853_626_951_472_7;

/// Relative change of a series or a continued fraction of a distribution function by one more term below which it has
/// converged.
const SETTLED: f64 = 1e-16;

/// Largest number of terms of a series or a continued fraction of a distribution function. A few times √(degrees of
/// freedom) are needed.
const TERMS_MAX: usize = 100_000;

/// Φ(x): the probability that a standard normal variable stays below x.
pub fn normal_probability(x: f64) -> f64 {
    0.5 * libm::erfc(-x / SQRT_2)
}

/// Quantile Φ⁻¹ of the standard normal distribution: the number below which the variable stays with the probability
/// `share`; error 1e-12.
///
/// A `share` below 1e-300 or above 1 − 2.2e-16 is replaced by this bound.
pub fn normal_quantile(share: f64) -> f64 {
    // A double cannot represent probabilities far below 1e-300, nor those that differ from 1 by less than its rounding.
    let share = share.clamp(1e-300, 1.0 - f64::EPSILON);
    // Φ⁻¹ is antisymmetric about the probability 1/2. In the lower half, erfc keeps its relative precision.
    if share > 0.5 {
        return -normal_quantile(1.0 - share);
    }
    // Start value of the quantile from the tail bound of Φ. Halley's method then about triples the number of correct
    // digits in each iteration.
    let mut x = -(-2.0 * (2.0 * share).ln()).sqrt();
    for _ in 0..8 {
        let density = (-0.5 * x * x).exp() / (2.0 * PI).sqrt();
        let excess = (0.5 * libm::erfc(-x / SQRT_2) - share) / density;
        let step = excess / (1.0 + 0.5 * x * excess);
        x -= step;
        if step.abs() < 1e-13 * x.abs().max(1.0) {
            break;
        }
    }
    x
}

/// The probability that |t| of Student's distribution with ν = `freedoms` degrees of freedom stays below `t`: 1 −
/// I_{ν/(ν + t²)}(ν/2, 1/2).
fn student_two_sided_probability(t: f64, freedoms: f64) -> f64 {
    // As I_{t²/(ν + t²)}(1/2, ν/2), which is equal and free of cancellation for small t.
    incomplete_beta(0.5, 0.5 * freedoms, t * t / (freedoms + t * t))
}

/// Half the width of the interval about zero that contains a variable of Student's distribution with the probability
/// `share`.
///
/// Infinite without degrees of freedom.
fn student_two_sided_quantile(share: f64, freedoms: f64) -> f64 {
    if freedoms <= 0.0 {
        return f64::INFINITY;
    }
    quantile(share, |t| student_two_sided_probability(t, freedoms))
}

/// Half the width of the 90 % interval of an estimate, in multiples of the standard deviation of the estimate, if
/// this standard deviation is estimated with `freedoms` degrees of freedom; infinite for 0.
pub fn student_ninety_percent(freedoms: usize) -> f64 {
    student_two_sided_quantile(0.9, freedoms as f64)
}

/// The probability that χ² with ν = `freedoms` degrees of freedom stays below x: P(ν/2, x/2).
pub fn chi_squared_probability(x: f64, freedoms: f64) -> f64 {
    incomplete_gamma(0.5 * freedoms, 0.5 * x)
}

/// The number below which χ² with `freedoms` degrees of freedom stays with the probability `share`.
pub fn chi_squared_quantile(share: f64, freedoms: f64) -> f64 {
    quantile(share, |x| chi_squared_probability(x, freedoms))
}

/// The probability that F with (ν₁, ν₂) degrees of freedom stays below x: I_{ν₁x/(ν₁x + ν₂)}(ν₁/2, ν₂/2).
fn f_probability(x: f64, [above, below]: [f64; 2]) -> f64 {
    incomplete_beta(0.5 * above, 0.5 * below, above * x / (above * x + below))
}

/// The number below which F with the degrees of freedom (ν₁, ν₂) = `freedoms` stays with the probability `share`.
pub fn f_quantile(share: f64, freedoms: [f64; 2]) -> f64 {
    quantile(share, |x| f_probability(x, freedoms))
}

/// Exact two-sided confidence interval, at the level `share`, of a probability after `hits` successes in `trials`
/// trials (Clopper and Pearson, Biometrika 26 (1934) 404).
pub fn binomial_interval(share: f64, hits: usize, trials: usize) -> [f64; 2] {
    let tail = 0.5 * (1.0 - share);
    let (k, n) = (hits.min(trials) as f64, trials as f64);
    let end = |share: f64, a: f64, b: f64| bisect(share, [0.0, 1.0], |x| incomplete_beta(a, b, x));
    let low = if k == 0.0 { 0.0 } else { end(tail, k, n - k + 1.0) };
    let high = if k == n {
        1.0
    } else {
        end(1.0 - tail, k + 1.0, n - k)
    };
    [low, high]
}

/// Median of `values`, which the call reorders; for an even number of values, the upper of the two in the middle.
/// `None` without values.
pub fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Quantile of a sample in ascending order, interpolated linearly between the order statistics at (i + 1/2)/n, i from 0
/// (Hazen), and constant beyond the first and the last; `None` for an empty sample.
pub fn sample_quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let position = (share * sorted.len() as f64 - 0.5).max(0.0);
    let (below, rest) = (position.floor() as usize, position.fract());
    let at = |index: usize| sorted.get(index).or(sorted.last()).copied();
    let (low, high) = (at(below)?, at(below + 1)?);
    // Without interpolation the order statistic itself is returned: a product with an infinite neighbour would not be a
    // number.
    Some(if rest == 0.0 {
        low
    } else {
        low + (high - low) * rest
    })
}

/// Inverts a distribution function on [0, ∞): the argument at which `probability` reaches the value `share`; infinite
/// if it does not below about 1e200.
fn quantile(share: f64, probability: impl Fn(f64) -> f64) -> f64 {
    if share.is_nan() {
        return f64::NAN;
    }
    if share <= 0.0 {
        return 0.0;
    }
    let mut high = 1.0;
    while probability(high) < share {
        high *= 2.0;
        if high > 1e200 {
            return f64::INFINITY;
        }
    }
    let mut low = 0.5 * high;
    while low > 1e-200 && probability(low) > share {
        (low, high) = (0.5 * low, low);
    }
    bisect(share, [low, high], probability)
}

/// Argument between `ends` at which the increasing function `probability` reaches `share`, by bisection to neighbouring
/// numbers.
fn bisect(share: f64, ends: [f64; 2], probability: impl Fn(f64) -> f64) -> f64 {
    let [low, high] = bisection(ends, 0.0, |x| probability(x) < share);
    0.5 * (low + high)
}

/// P(a, x), the regularized lower incomplete gamma function.
fn incomplete_gamma(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    if x.is_infinite() {
        return 1.0;
    }
    let factor = (a * x.ln() - x - libm::lgamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum) = (1.0 / a, 1.0 / a);
        for k in 1..TERMS_MAX {
            term *= x / (a + k as f64);
            sum += term;
            if term < SETTLED * sum {
                break;
            }
        }
        return factor * sum;
    }
    let step = |k: usize| -> [f64; 2] {
        let k = k as f64;
        [k * (a - k), x + 2.0 * k + 1.0 - a]
    };
    1.0 - factor / continued_fraction(x + 1.0 - a, step)
}

/// I_x(a, b), the regularized incomplete beta function.
fn incomplete_beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 || x.is_nan() {
        return x.clamp(0.0, 1.0);
    }
    // The continued fraction converges fast for x below about the mean of the beta distribution; above, I_x(a, b) = 1 −
    // I_{1−x}(b, a) is used.
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(b, a, 1.0 - x);
    }
    let factor = (a * x.ln() + b * (-x).ln_1p() - log_beta(a, b)).exp() / a;
    let step = |k: usize| -> [f64; 2] {
        let m = (k / 2) as f64;
        let numerator = if k.is_multiple_of(2) {
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m))
        } else {
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0))
        };
        [numerator, 1.0]
    };
    factor / continued_fraction(1.0, step)
}

/// ln B(a, b) = ln Γ(a) + ln Γ(b) − ln Γ(a + b).
///
/// If the larger argument l is 20 or more, ln Γ(l) − ln Γ(a + b) is computed from Stirling's series, without
/// cancellation (Abramowitz & Stegun 6.1.41).
fn log_beta(a: f64, b: f64) -> f64 {
    let (small, large) = (a.min(b), a.max(b));
    // For arguments from 20 on, four terms of Stirling's series are accurate to 1e-14.
    if large < 20.0 {
        return libm::lgamma(a) + libm::lgamma(b) - libm::lgamma(a + b);
    }
    let rest = |z: f64| {
        (1.0 / 12.0 - (1.0 / 360.0 - (1.0 / 1260.0 - 1.0 / (1680.0 * z * z)) / (z * z)) / (z * z)) / z
    };
    let ratio = (large - 0.5) * (small / large).ln_1p() + small * (large + small).ln() - small
        + rest(large + small)
        - rest(large);
    libm::lgamma(small) - ratio
}

/// Continued fraction b₀ + a₁/(b₁ + a₂/(b₂ + …)) by Lentz's method; b₀ is `first`, and `step(k)` gives [a_k, b_k].
fn continued_fraction(first: f64, step: impl Fn(usize) -> [f64; 2]) -> f64 {
    let tiny = |value: f64| if value.abs() < 1e-300 { 1e-300 } else { value };
    let mut value = tiny(first);
    let (mut c, mut d) = (value, 0.0);
    for k in 1..TERMS_MAX {
        let [a, b] = step(k);
        d = 1.0 / tiny(b + a * d);
        c = tiny(b + a / c);
        value *= c * d;
        if (c * d - 1.0).abs() < SETTLED {
            break;
        }
    }
    value
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    #[test]
    fn the_median_is_in_the_middle_of_the_order() {
        assert_eq!(median(&mut [3.0, -1.0, 2.0]), Some(2.0));
        assert_eq!(median(&mut [4.0, 1.0, 3.0, 2.0]), Some(3.0));
        assert_eq!(median(&mut []), None);
    }

    #[test]
    fn normal_quantiles_are_those_of_the_tables() {
        // Abramowitz & Stegun, table 26.5.
        for (share, x) in [
            (0.05, -1.644_853_626_951_473),
            (0.5, 0.0),
            (0.95, NINETY_PERCENT),
            (0.975, 1.959_963_984_540_054),
            (1e-6, -4.753_424_308_822_899),
            (0.3, -0.524_400_512_708_041),
        ] {
            assert!((normal_quantile(share) - x).abs() < 1e-11, "{share}");
        }
    }

    #[test]
    fn student_quantiles_are_those_of_the_tables() {
        // Abramowitz & Stegun, table 26.10, A = 0.9; ν = 1 and 2 in closed form.
        assert!((student_ninety_percent(1) - (0.45 * PI).tan()).abs() < 1e-9);
        let two = (2.0 * 0.9_f64.powi(2) / (1.0 - 0.9_f64.powi(2))).sqrt();
        assert!((student_ninety_percent(2) - two).abs() < 1e-10);
        for (freedoms, quantile) in [
            (3, 2.353),
            (4, 2.132),
            (5, 2.015),
            (10, 1.812),
            (30, 1.697),
            (120, 1.658),
        ] {
            assert!(
                (student_ninety_percent(freedoms) - quantile).abs() < 6e-4,
                "{freedoms}"
            );
        }
        assert_eq!(student_ninety_percent(0), f64::INFINITY);
        assert!((student_ninety_percent(100_000_000) - NINETY_PERCENT).abs() < 1e-7);
    }

    #[test]
    fn chi_squared_quantiles_are_those_of_the_tables() {
        // With two degrees of freedom −2 ln(1 − p); else Abramowitz & Stegun, table 26.8.
        for share in [1e-6, 0.1, 0.5, 0.999] {
            let exact = -2.0 * f64::ln_1p(-share);
            assert!(
                (chi_squared_quantile(share, 2.0) / exact - 1.0).abs() < 1e-9,
                "{share}"
            );
        }
        for (share, freedoms, x) in [
            (0.95, 1.0, 3.841_46),
            (0.99, 5.0, 15.086_3),
            (0.05, 10.0, 3.940_30),
            (0.975, 30.0, 46.979_2),
            (0.95, 100.0, 124.342),
        ] {
            assert!(
                (chi_squared_quantile(share, freedoms) / x - 1.0).abs() < 4e-6,
                "{share} {freedoms}"
            );
        }
    }

    #[test]
    fn f_quantiles_are_those_of_the_tables() {
        // Abramowitz & Stegun, table 26.9.
        for (share, freedoms, x) in [
            (0.95, [1.0, 1.0], 161.4),
            (0.95, [5.0, 10.0], 3.33),
            (0.99, [3.0, 20.0], 4.94),
            (0.90, [2.0, 60.0], 2.39),
        ] {
            assert!(
                (f_quantile(share, freedoms) / x - 1.0).abs() < 2e-3,
                "{freedoms:?}"
            );
        }
        // t² is F with one degree of freedom above.
        let t = student_two_sided_quantile(0.9, 7.0);
        assert!((f_quantile(0.9, [1.0, 7.0]) - t * t).abs() < 1e-9);
    }

    #[test]
    fn binomial_intervals_hold_the_tail_that_they_are_made_for() {
        // 0 of n: 1 − (α/2)^(1/n).
        let [low, high] = binomial_interval(0.9, 0, 20);
        assert_eq!(low, 0.0);
        assert!((high - (1.0 - 0.05_f64.powf(1.0 / 20.0))).abs() < 1e-12);
        let seed = 23;
        println!("seed {seed}");
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        for _ in 0..50 {
            let trials = rng.random_range(1..40_usize);
            let hits = rng.random_range(0..=trials);
            let [low, high] = binomial_interval(0.9, hits, trials);
            // Independently: the sums of the binomial distribution.
            let tail = |p: f64, range: std::ops::RangeInclusive<usize>| -> f64 {
                let term = |k: usize| {
                    let ways: f64 = (0..k).map(|i| (trials - i) as f64 / (i + 1) as f64).product();
                    ways * p.powi(k as i32) * (1.0 - p).powi((trials - k) as i32)
                };
                range.map(term).sum()
            };
            if hits > 0 {
                assert!((tail(low, hits..=trials) - 0.05).abs() < 1e-9, "{hits}/{trials}");
            }
            if hits < trials {
                assert!((tail(high, 0..=hits) - 0.05).abs() < 1e-9, "{hits}/{trials}");
            }
        }
    }

    #[test]
    fn quantiles_invert_their_probabilities() {
        let seed = 29;
        println!("seed {seed}");
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        for _ in 0..200 {
            let share: f64 = rng.random_range(0.001..0.999);
            let freedoms: f64 = rng.random_range(0.3..300.0);
            let other: f64 = rng.random_range(0.3..300.0);
            let back = [
                normal_probability(normal_quantile(share)),
                student_two_sided_probability(student_two_sided_quantile(share, freedoms), freedoms),
                chi_squared_probability(chi_squared_quantile(share, freedoms), freedoms),
                f_probability(f_quantile(share, [freedoms, other]), [freedoms, other]),
            ];
            for back in back {
                assert!((back - share).abs() < 1e-11, "{share} {freedoms} {other} {back}");
            }
        }
    }

    #[test]
    fn sample_quantiles_interpolate() {
        assert_eq!(sample_quantile(&[], 0.5), None);
        assert_eq!(sample_quantile(&[3.0], 0.2), Some(3.0));
        assert_eq!(sample_quantile(&[1.0, 2.0, 4.0, 8.0], 0.5), Some(3.0));
        assert_eq!(sample_quantile(&[1.0, f64::INFINITY], 0.25), Some(1.0));
        assert_eq!(sample_quantile(&[1.0, 2.0], 1.0), Some(2.0));
    }
}
