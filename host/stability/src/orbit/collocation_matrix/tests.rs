use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;

/// Residual of the collocation equations (I − h a⊗J) Y = R, formed block by block.
fn residual(
    gauss: &Gauss,
    duration_s: f64,
    jacobians: &[DMatrix<f64>],
    values: &DMatrix<f64>,
    right: &DMatrix<f64>,
) -> f64 {
    let order = jacobians[0].nrows();
    let mut left = values.clone();
    for i in 0..jacobians.len() {
        for (j, jacobian) in jacobians.iter().enumerate() {
            let pushed = jacobian * values.rows(j * order, order) * (duration_s * gauss.integrals[(i, j)]);
            let mut rows = left.rows_mut(i * order, order);
            rows -= pushed;
        }
    }
    (left - right).amax()
}

#[test]
fn both_forms_of_the_factors_solve_the_collocation_equations() {
    let seed = 20_261_125;
    println!("seed {seed}");
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let gauss = Gauss::new(9);
    let duration_s = 0.02;
    for size in 1..=3 {
        let order = 2 * size;
        let mut random = |rows: usize, columns: usize, scale: f64| {
            DMatrix::from_fn(rows, columns, |_, _| scale * (2.0 * rng.random::<f64>() - 1.0))
        };
        let jacobians: Vec<DMatrix<f64>> = (0..9)
            .map(|_| {
                let mut jacobian = random(order, order, 80.0);
                jacobian.rows_mut(0, size).fill(0.0);
                (0..size).for_each(|row| jacobian[(row, size + row)] = 110.0);
                jacobian
            })
            .collect();
        let right = random(9 * order, order + 2, 1.0);
        let solved = |jacobians: &[DMatrix<f64>], is_reduced: bool| {
            let matrix = CollocationMatrix::new(&gauss, duration_s, jacobians);
            assert_eq!(matches!(matrix, CollocationMatrix::Velocities(_)), is_reduced);
            let mut values = right.clone();
            assert!(matrix.solve_mut(&mut values));
            values
        };
        // Tolerance: rounding of values of the size of 10.
        let values = solved(&jacobians, true);
        assert!(residual(&gauss, duration_s, &jacobians, &values, &right) < 1e-11);
        // A structure without mass has no such upper half at some node.
        let mut massless = jacobians;
        massless[4][(0, 0)] = -30.0;
        let values = solved(&massless, false);
        assert!(residual(&gauss, duration_s, &massless, &values, &right) < 1e-11);
    }
}
