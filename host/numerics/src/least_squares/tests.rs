//! Closed forms, an independent method, and random properties.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;

fn generator(seed: u64) -> ChaCha8Rng {
    println!("seed {seed}");
    ChaCha8Rng::seed_from_u64(seed)
}

fn random(rows: usize, columns: usize, rng: &mut ChaCha8Rng) -> DMatrix<f64> {
    DMatrix::from_fn(rows, columns, |_, _| rng.random_range(-1.0..1.0))
}

fn random_vector(rows: usize, rng: &mut ChaCha8Rng) -> DVector<f64> {
    DVector::from_fn(rows, |_, _| rng.random_range(-1.0..1.0))
}

#[test]
fn a_line_has_its_closed_form() {
    // ȳ, slope Sxy/Sxx, variances σ²/Sxx of the slope.
    let (x, y) = ([0.0, 1.0, 2.0, 4.0], [1.0, 2.5, 2.0, 6.0]);
    let mean = |values: &[f64; 4]| values.iter().sum::<f64>() / 4.0;
    let (mx, my) = (mean(&x), mean(&y));
    let sxx: f64 = x.iter().map(|x| (x - mx).powi(2)).sum();
    let sxy: f64 = x.iter().zip(&y).map(|(x, y)| (x - mx) * (y - my)).sum();
    let matrix = DMatrix::from_fn(4, 2, |i, j| if j == 0 { 1.0 } else { x[i] });
    let right = DVector::from_column_slice(&y);
    let fit = LinearProblem::new(&matrix, &right).solve().unwrap();
    let slope = sxy / sxx;
    assert!((fit.parameters[1] - slope).abs() < 1e-14);
    assert!((fit.parameters[0] - (my - slope * mx)).abs() < 1e-14);
    assert!((fit.covariance[(1, 1)] - 1.0 / sxx).abs() < 1e-15);
    assert_eq!(fit.degrees_of_freedom, 2);
    let syy: f64 = y.iter().map(|y| (y - my).powi(2)).sum();
    assert!((fit.sum_of_squares - (syy - slope * sxy)).abs() < 1e-13);
    assert!((fit.variance() - fit.sum_of_squares / 2.0).abs() < 1e-15);
}

#[test]
fn weights_and_priors_agree_with_the_normal_equations() {
    let mut rng = generator(1);
    for _ in 0..50 {
        let columns = rng.random_range(1..7);
        let rows = columns + rng.random_range(0..20);
        // Parameters of very different units.
        let units = DVector::from_fn(columns, |j, _| 10.0_f64.powi(3 * j as i32 - 9));
        let matrix = random(rows, columns, &mut rng) * DMatrix::from_diagonal(&units);
        let right = random_vector(rows, &mut rng);
        let weights = random_vector(rows, &mut rng).map(|w| w.abs() + 0.1);
        let mean = random_vector(columns, &mut rng).component_div(&units);
        let inverse = random_vector(columns, &mut rng)
            .map(f64::abs)
            .component_mul(&units.map(|u| u * u));
        let fit = LinearProblem::new(&matrix, &right)
            .with_weights(&weights)
            .with_prior(&mean, &inverse)
            .solve()
            .unwrap();
        let weighted = DMatrix::from_diagonal(&weights) * &matrix;
        let normal = matrix.tr_mul(&weighted) + DMatrix::from_diagonal(&inverse);
        let gradient = weighted.tr_mul(&right) + inverse.component_mul(&mean);
        let expected = solve_normal_equations(&normal, &gradient).unwrap();
        let covariance = invert_normal_equations(&normal).unwrap();
        for j in 0..columns {
            let deviation = covariance[(j, j)].sqrt();
            assert!((fit.parameters[j] - expected[j]).abs() < 1e-9 * deviation.max(expected[j].abs()));
            assert!((fit.covariance[(j, j)] / covariance[(j, j)] - 1.0).abs() < 1e-8);
        }
    }
}

#[test]
fn the_residual_is_orthogonal_to_the_columns() {
    let mut rng = generator(2);
    for _ in 0..50 {
        let columns = rng.random_range(1..10);
        let rows = columns + rng.random_range(0..30);
        let matrix = random(rows, columns, &mut rng);
        let right = random_vector(rows, &mut rng);
        let fit = LinearProblem::new(&matrix, &right).solve().unwrap();
        let residual = &right - &matrix * &fit.parameters;
        assert!(matrix.tr_mul(&residual).amax() < 1e-12 * rows as f64);
        assert!(fit.condition >= 1.0);
    }
}

#[test]
fn an_ill_conditioned_problem_keeps_the_digits_that_normal_equations_lose() {
    // Läuchli's matrix: its Gram matrix is singular in double precision, its solution is (1, 1, 1).
    let small = 1e-9;
    let matrix = DMatrix::from_fn(4, 3, |i, j| match (i, j) {
        (0, _) => 1.0,
        (i, j) if i == j + 1 => small,
        _ => 0.0,
    });
    let right = &matrix * DVector::repeat(3, 1.0);
    assert!(invert_normal_equations(&matrix.tr_mul(&matrix)).is_none());
    let fit = LinearProblem::new(&matrix, &right).solve().unwrap();
    // Rounding 1e-16 times the condition 1e9.
    assert!((fit.parameters - DVector::repeat(3, 1.0)).amax() < 1e-5);
    assert!(fit.condition > 1e8);
}

#[test]
fn dependent_columns_are_named() {
    let mut rng = generator(3);
    let mut matrix = random(12, 4, &mut rng);
    let sum = matrix.column(0) + matrix.column(1);
    matrix.set_column(3, &sum);
    let right = random_vector(12, &mut rng);
    let error = LinearProblem::new(&matrix, &right).solve().unwrap_err();
    let LeastSquaresError::RankDeficient {
        rank,
        parameters,
        undetermined,
    } = &error
    else {
        panic!("{error}");
    };
    assert_eq!((*rank, *parameters, undetermined.len()), (3, 4, 1));
    assert_ne!(undetermined[0], 2, "column 2 is independent");
    assert!(error.to_string().contains("3 of 4"));
    // A prior determines them.
    let (mean, inverse) = (DVector::zeros(4), DVector::repeat(4, 1e-6));
    assert!(
        LinearProblem::new(&matrix, &right)
            .with_prior(&mean, &inverse)
            .solve()
            .is_ok()
    );
    matrix.column_mut(2).fill(0.0);
    let error = LinearProblem::new(&matrix, &right).solve().unwrap_err();
    assert!(matches!(error, LeastSquaresError::RankDeficient { undetermined, .. } if undetermined == [2]));
    let few = random(2, 3, &mut rng);
    let right = random_vector(2, &mut rng);
    assert!(LinearProblem::new(&few, &right).solve().is_err());
}

#[test]
fn what_cannot_be_solved_is_refused() {
    let matrix = DMatrix::identity(3, 2);
    let right = DVector::repeat(3, 1.0);
    let short = DVector::repeat(2, 1.0);
    assert!(matches!(
        LinearProblem::new(&matrix, &short).solve(),
        Err(LeastSquaresError::Shape {
            found: 2,
            expected: 3,
            ..
        })
    ));
    let negative = DVector::repeat(3, -1.0);
    assert!(
        LinearProblem::new(&matrix, &right)
            .with_weights(&negative)
            .solve()
            .is_err()
    );
    let mut bad = matrix.clone();
    bad[(0, 1)] = f64::NAN;
    assert_eq!(
        LinearProblem::new(&bad, &right).solve().unwrap_err(),
        LeastSquaresError::NotFinite { what: "the matrix" }
    );
    let nothing = DMatrix::<f64>::zeros(3, 0);
    assert_eq!(
        LinearProblem::new(&nothing, &right)
            .solve()
            .unwrap()
            .sum_of_squares,
        3.0
    );
}

#[test]
fn outliers_do_not_move_a_robust_fit() {
    let mut rng = generator(4);
    let truth = DVector::from_vec(vec![2.0, -3.0]);
    for loss in [Loss::Huber, Loss::Tukey] {
        let matrix = random(200, 2, &mut rng);
        let mut right = &matrix * &truth + 0.01 * random_vector(200, &mut rng);
        for i in (0..200).step_by(10) {
            right[i] += 5.0;
        }
        let plain = LinearProblem::new(&matrix, &right).solve().unwrap();
        let robust = LinearProblem::new(&matrix, &right).solve_robust(loss).unwrap();
        let error = |fit: &LinearFit| (&fit.parameters - &truth).norm();
        assert!(robust.is_settled);
        // Of one tenth of outliers Huber's keeps a bias of a fraction of the noise, Tukey's none.
        assert!(error(&robust.fit) < 0.01, "{loss:?} {}", error(&robust.fit));
        assert!(error(&robust.fit) < 0.2 * error(&plain), "{loss:?}");
        assert!(robust.kept[0] < 0.02);
    }
    // Data without noise are met exactly.
    let matrix = random(10, 2, &mut rng);
    let right = &matrix * &truth;
    let robust = LinearProblem::new(&matrix, &right)
        .solve_robust(Loss::Tukey)
        .unwrap();
    assert!((robust.fit.parameters - truth).norm() < 1e-13);
}

#[test]
fn a_decay_is_found_from_far_and_its_covariance_is_that_of_the_linear_fit() {
    // y = a exp(−b t).
    let times: Vec<f64> = (0..40).map(|i| 0.05 * f64::from(i)).collect();
    let (a, b) = (3.0, 1.7);
    let linearize = |theta: &DVector<f64>| {
        let model = |t: f64| (-theta[1] * t).exp();
        let residual = DVector::from_fn(40, |i, _| a * (-b * times[i]).exp() - theta[0] * model(times[i]));
        let jacobian = DMatrix::from_fn(40, 2, |i, j| {
            let e = model(times[i]);
            if j == 0 { e } else { -theta[0] * times[i] * e }
        });
        Residuals::new(&residual, &jacobian)
    };
    let iteration = LevenbergMarquardt {
        damping: 1e-2,
        iterations_max: 60,
        tolerance: 1e-10,
    };
    let found = iteration.minimize(DVector::from_vec(vec![0.5, 6.0]), linearize);
    assert_eq!(found.stop, Stop::Converged);
    assert!((found.parameters[0] - a).abs() < 1e-10 && (found.parameters[1] - b).abs() < 1e-10);
    assert!(found.at.sum_of_squares() < 1e-20);
    let jacobian = DMatrix::from_fn(40, 2, |i, j| {
        let e = (-b * times[i]).exp();
        if j == 0 { e } else { -a * times[i] * e }
    });
    let linear = LinearProblem::new(&jacobian, &DVector::zeros(40))
        .solve()
        .unwrap();
    assert!((found.at.covariance().unwrap() - linear.covariance).amax() < 1e-9);
}

#[test]
fn every_reason_to_stop_is_met() {
    let quadratic = |theta: &DVector<f64>| {
        Residuals::new(
            &DVector::from_vec(vec![1.0 - theta[0], 0.0]),
            &DMatrix::from_column_slice(2, 1, &[1.0, 0.0]),
        )
    };
    let start = || DVector::from_vec(vec![50.0]);
    let iteration = |iterations_max| LevenbergMarquardt {
        damping: 0.0,
        iterations_max,
        tolerance: 1e-9,
    };
    let found = iteration(10).minimize(start(), quadratic);
    assert_eq!((found.stop, found.iterations), (Stop::Converged, 2));
    assert_eq!(iteration(1).minimize(start(), quadratic).stop, Stop::Iterations);
    // A derivative of the wrong sign: every step is uphill.
    let wrong = |theta: &DVector<f64>| {
        Residuals::new(
            &DVector::from_vec(vec![1.0 - theta[0]]),
            &DMatrix::from_element(1, 1, -1.0),
        )
    };
    assert_eq!(iteration(60).minimize(start(), wrong).stop, Stop::Stagnated);
    // A parameter without effect.
    let idle = |_: &DVector<f64>| Residuals::new(&DVector::repeat(1, 1.0), &DMatrix::zeros(1, 1));
    assert_eq!(iteration(60).minimize(start(), idle).stop, Stop::Singular);
    // Not a number from the start.
    let nan =
        |_: &DVector<f64>| Residuals::new(&DVector::repeat(1, f64::NAN), &DMatrix::repeat(1, 1, f64::NAN));
    assert_eq!(iteration(60).minimize(start(), nan).stop, Stop::Singular);
}
