//! Spherical Bessel functions of the first kind.

/// Argument below which the first two terms of the power series are exact to rounding.
const SMALL: f64 = 1e-4;
/// Further functions above the last one with which the downward recurrence starts: the error of the start falls by z/(2n + 1) with
/// every step, so that it is rounding after these many.
const AHEAD: usize = 30;

/// Sets `values` to j_0(z), j_1(z), … for z ≥ 0, to rounding in the largest of them.
///
/// Upwards, j_{n+1} = (2n + 1)/z · j_n − j_{n−1} is stable as long as n < z. From there on it is run downwards from zero, and the
/// result scaled by j_0 or j_1 (Miller; Abramowitz & Stegun, 10.1.19 and 10.5).
///
/// ```
/// let mut values = [0.0; 2];
/// quietcut_numerics::spherical_bessel::spherical_bessel(2.0, &mut values);
/// assert!((values[1] - (2.0_f64.sin() / 4.0 - 2.0_f64.cos() / 2.0)).abs() < 1e-15);
/// ```
pub fn spherical_bessel(z: f64, values: &mut [f64]) {
    let count = values.len();
    if z < SMALL {
        let mut leading = 1.0;
        for (n, value) in values.iter_mut().enumerate() {
            let odd = (2 * n + 1) as f64;
            *value = leading * (1.0 - z * z / (2.0 * (odd + 2.0)));
            leading *= z / (odd + 2.0);
        }
        return;
    }
    let (sin, cos) = z.sin_cos();
    let first = [sin / z, (sin / z - cos) / z];
    if count as f64 <= z {
        for n in 0..count {
            values[n] = match n {
                0 | 1 => first[n],
                _ => (2 * n - 1) as f64 / z * values[n - 1] - values[n - 2],
            };
        }
        return;
    }
    let last = count + AHEAD;
    let [mut above, mut value] = [0.0, f64::MIN_POSITIVE / f64::EPSILON];
    let mut lowest = [0.0; 2];
    for n in (0..=last).rev() {
        if n < count {
            values[n] = value;
        }
        if n < 2 {
            lowest[n] = value;
        }
        (above, value) = (value, (2 * n + 1) as f64 / z * value - above);
        // Far above z the functions grow by many orders of magnitude downwards.
        if value.abs() > 1e200 {
            let shrink = 1e-200;
            above *= shrink;
            value *= shrink;
            values.iter_mut().skip(n).for_each(|known| *known *= shrink);
        }
    }
    let scale = if first[0].abs() > first[1].abs() {
        first[0] / lowest[0]
    } else {
        first[1] / lowest[1]
    };
    values.iter_mut().for_each(|value| *value *= scale);
}

#[cfg(test)]
mod tests {
    use crate::quadrature::Gauss;

    use super::spherical_bessel;

    #[test]
    fn values_are_poissons_integral() {
        // j_n(z) = zⁿ/(2ⁿ⁺¹ n!) ∫₀^π cos(z cos θ) sin^{2n+1} θ dθ (Abramowitz & Stegun 10.1.13).
        let gauss = Gauss::shared(40);
        for z in [
            0.0,
            1e-9,
            5e-5,
            2e-4,
            0.3,
            1.0,
            3.3,
            std::f64::consts::PI,
            7.9,
            8.1,
            25.0,
            60.0,
        ] {
            let mut values = [0.0; 9];
            spherical_bessel(z, &mut values);
            let mut factor = 0.5;
            for (n, value) in values.iter().enumerate() {
                if n > 0 {
                    factor *= z / (2.0 * n as f64);
                }
                let pieces = 40;
                let integral: f64 = (0..pieces)
                    .flat_map(|piece| {
                        gauss
                            .nodes
                            .iter()
                            .zip(&gauss.weights)
                            .map(move |(x, w)| (piece, x, w))
                    })
                    .map(|(piece, x, weight)| {
                        let step = std::f64::consts::PI / f64::from(pieces);
                        let theta = step * (f64::from(piece) + x);
                        weight * step * (z * theta.cos()).cos() * theta.sin().powi(2 * n as i32 + 1)
                    })
                    .sum();
                // The integral has the rounding of its terms.
                let exact = factor * integral;
                let error = (value - exact).abs();
                assert!(
                    error < 1e-14 * (1.0 + factor) + 1e-14 * exact.abs(),
                    "j_{n}({z}): {value} {exact}"
                );
            }
        }
    }

    #[test]
    fn values_satisfy_their_sum_rule() {
        // Σ (2n + 1) j_n² = 1.
        for z in [1e-5, 1e-3, 0.5, 4.0, 11.0] {
            let mut values = [0.0; 40];
            spherical_bessel(z, &mut values);
            let sum: f64 = values
                .iter()
                .enumerate()
                .map(|(n, value)| (2 * n + 1) as f64 * value * value)
                .sum();
            assert!((sum - 1.0).abs() < 1e-14, "{z}: {sum}");
        }
    }
}
