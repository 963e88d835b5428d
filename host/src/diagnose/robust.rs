//! Covariance of a fit by what it leaves, where that is not the white noise that the fit was weighed by.

use nalgebra::{DMatrix, DVector};

/// Xᵀ diag(r²/(1 − h)²) X with h = diag(X V Xᵀ), V = (XᵀX)⁻¹: between two V it is the covariance of a fit whose residual has a power of
/// its own in each of its numbers, one independent of the next (HC3 of MacKinnon and White, 1985).
///
/// Of a spectrum these are its real and imaginary parts: so noise of any colour has its effect where the fit looks, and what the
/// weights take it for costs no truth but only width.
pub(super) fn middle(mut x: DMatrix<f64>, left: &DVector<f64>, covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let leverage = (&x * covariance).component_mul(&x).column_sum();
    for (mut row, (left, leverage)) in x.row_iter_mut().zip(left.iter().zip(leverage.iter())) {
        row *= left / (1.0 - leverage.min(1.0 - f64::EPSILON));
    }
    x.tr_mul(&x)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    #[test]
    fn the_deviation_is_that_of_the_noise_where_the_fit_looks() {
        // One column that is felt in a hundred of two thousand numbers, where the noise is three times what it is elsewhere.
        let mut random = ChaCha8Rng::seed_from_u64(12);
        let x = DMatrix::from_fn(2000, 1, |row, _| if row % 20 == 0 { 1.0 } else { 0.0 });
        let covariance = DMatrix::from_element(1, 1, 0.01);
        let (mut said, mut squares) = (0.0, 0.0);
        let draws = 400;
        for _ in 0..draws {
            let noise = DVector::from_fn(2000, |row, _| {
                let normal: f64 = StandardNormal.sample(&mut random);
                if row % 20 == 0 { 3.0 * normal } else { normal }
            });
            let found = 0.01 * x.column(0).dot(&noise);
            let left = &noise - &x * found;
            said += 1e-4 * middle(x.clone(), &left, &covariance)[(0, 0)];
            squares += found * found;
        }
        // 9/100; the mean square of 400 normal deviates scatters by 7 %, and leverage adds a hundredth.
        let exact = 0.09 * f64::from(draws);
        assert!((said / exact - 1.0).abs() < 0.05, "{said} {exact}");
        assert!((squares / exact - 1.0).abs() < 0.21, "{squares} {exact}");
    }
}
