//! Student's distribution: intervals from few samples.

pub use quietcut_numerics::statistics::NINETY_PERCENT;

/// 90 % quantile of Student's distribution with `freedoms` degrees of freedom: 90 % of the distribution lies within
/// this number of standard deviations of zero.
///
/// From three degrees of freedom on, the first five terms of the expansion about the normal distribution (Abramowitz
/// and Stegun 26.7.5), accurate to 0.5 %; exact values for one and two.
pub fn ninety_percent(freedoms: usize) -> f64 {
    match freedoms {
        0 => f64::INFINITY,
        1 => 6.313_751_515,
        2 => 2.919_985_580,
        _ => {
            let (z, n) = (NINETY_PERCENT, freedoms as f64);
            let z2 = z * z;
            let g1 = (z2 + 1.0) * z / 4.0;
            let g2 = ((5.0 * z2 + 16.0) * z2 + 3.0) * z / 96.0;
            let g3 = (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) * z / 384.0;
            let g4 = ((((79.0 * z2 + 776.0) * z2 + 1482.0) * z2 - 1920.0) * z2 - 945.0) * z / 92_160.0;
            z + g1 / n + g2 / n.powi(2) + g3 / n.powi(3) + g4 / n.powi(4)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (freedoms, quantile) in [
            (1, 6.3138),
            (2, 2.9200),
            (3, 2.3534),
            (5, 2.0150),
            (10, 1.8125),
            (30, 1.6973),
        ] {
            assert!(
                (ninety_percent(freedoms) / quantile - 1.0).abs() < 5e-3,
                "{freedoms}"
            );
        }
    }
    #[test]
    fn the_expansion_agrees_with_the_inverted_distribution() {
        use quietcut_numerics::statistics::student_ninety_percent;
        for freedoms in 1..100 {
            let exact = student_ninety_percent(freedoms);
            assert!(
                (ninety_percent(freedoms) / exact - 1.0).abs() < 5e-3,
                "{freedoms}"
            );
        }
    }
}
