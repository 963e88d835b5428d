//! Closed forms, an independent method, and random properties.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::stop::Stop;

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
    // One vector as right side and weights.
    let doubled = LinearProblem::new(&matrix, &negative)
        .with_weights(&negative)
        .solve();
    assert_eq!(
        doubled.unwrap_err(),
        LeastSquaresError::NotFinite {
            what: "the vector of weights"
        }
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

/// A problem whose residuals and Jacobian are held whole, in the form of closures.
struct Whole<R, J> {
    residual: R,
    jacobian: J,
    tolerance: f64,
}

impl<R: Fn(&DVector<f64>) -> DVector<f64>, J: Fn(&DVector<f64>) -> DMatrix<f64>> Objective for Whole<R, J> {
    type Point = DVector<f64>;
    type Value = f64;

    fn value(&mut self, point: &DVector<f64>) -> Option<f64> {
        let sum = (self.residual)(point).norm_squared();
        sum.is_finite().then_some(sum)
    }

    fn linearize(&mut self, point: &DVector<f64>, _: &f64) -> Option<NormalSums> {
        let jacobian = (self.jacobian)(point);
        Some(NormalSums {
            matrix: jacobian.tr_mul(&jacobian),
            gradient: jacobian.tr_mul(&(self.residual)(point)),
        })
    }

    fn moved(&self, point: &DVector<f64>, step: &DVector<f64>) -> DVector<f64> {
        point + step
    }

    fn is_no_worse(&self, next: &f64, now: &f64) -> bool {
        next <= now
    }

    fn has_converged(&self, length: f64, next: &f64, now: &f64) -> bool {
        length < self.tolerance && next <= now
    }
}

fn iteration(first: f64, iterations_max: usize) -> LevenbergMarquardt {
    LevenbergMarquardt {
        damping: Damping::tenfold(first),
        iterations_max,
        trials_max: 13,
        ridge: 0.0,
        idle: Idle::Refuse,
    }
}

#[test]
fn a_decay_is_found_from_far_and_its_covariance_is_that_of_the_linear_fit() {
    // y = a exp(−b t).
    let times: Vec<f64> = (0..40).map(|i| 0.05 * f64::from(i)).collect();
    let (a, b) = (3.0, 1.7);
    let jacobian = |theta: &DVector<f64>| {
        DMatrix::from_fn(40, 2, |i, j| {
            let e = (-theta[1] * times[i]).exp();
            if j == 0 { e } else { -theta[0] * times[i] * e }
        })
    };
    let mut decay = Whole {
        residual: |theta: &DVector<f64>| {
            DVector::from_fn(40, |i, _| {
                a * (-b * times[i]).exp() - theta[0] * (-theta[1] * times[i]).exp()
            })
        },
        jacobian,
        tolerance: 1e-10,
    };
    let found = iteration(1e-2, 60)
        .minimize(&mut decay, DVector::from_vec(vec![0.5, 6.0]))
        .unwrap();
    assert_eq!(found.stop, Stop::Converged);
    assert!((found.point[0] - a).abs() < 1e-10 && (found.point[1] - b).abs() < 1e-10);
    assert!(found.value < 1e-20);
    let covariance = invert_normal_equations(&found.sums.unwrap().matrix).unwrap();
    let linear = LinearProblem::new(&jacobian(&found.point), &DVector::zeros(40))
        .solve()
        .unwrap();
    // The sums are those of the point before the last step of 1e-10.
    assert!((covariance - linear.covariance).amax() < 1e-9);
}

#[test]
fn every_reason_to_stop_is_met() {
    let start = || DVector::from_vec(vec![50.0]);
    let mut quadratic = Whole {
        residual: |theta: &DVector<f64>| DVector::from_vec(vec![1.0 - theta[0], 0.0]),
        jacobian: |_: &DVector<f64>| DMatrix::from_column_slice(2, 1, &[1.0, 0.0]),
        tolerance: 1e-9,
    };
    let found = iteration(0.0, 10).minimize(&mut quadratic, start()).unwrap();
    assert_eq!((found.stop, found.iterations), (Stop::Converged, 2));
    let found = iteration(0.0, 1).minimize(&mut quadratic, start()).unwrap();
    assert_eq!(found.stop, Stop::Iterations);
    // A derivative of the wrong sign: every step is uphill.
    let mut wrong = Whole {
        residual: |theta: &DVector<f64>| DVector::from_vec(vec![1.0 - theta[0]]),
        jacobian: |_: &DVector<f64>| DMatrix::from_element(1, 1, -1.0),
        tolerance: 1e-9,
    };
    let found = iteration(0.0, 60).minimize(&mut wrong, start()).unwrap();
    assert_eq!((found.stop, found.point[0]), (Stop::Stagnated, 50.0));
    // A parameter without effect.
    let mut idle = Whole {
        residual: |_: &DVector<f64>| DVector::repeat(1, 1.0),
        jacobian: |_: &DVector<f64>| DMatrix::zeros(1, 1),
        tolerance: 1e-9,
    };
    let found = iteration(0.0, 60).minimize(&mut idle, start()).unwrap();
    assert_eq!(found.stop, Stop::Singular);
    let held = LevenbergMarquardt {
        idle: Idle::Hold,
        ..iteration(0.0, 60)
    };
    let found = held.minimize(&mut idle, start()).unwrap();
    assert_eq!((found.stop, found.point[0]), (Stop::Converged, 50.0));
    // Not a number from the start.
    let mut nan = Whole {
        residual: |_: &DVector<f64>| DVector::repeat(1, f64::NAN),
        jacobian: |_: &DVector<f64>| DMatrix::repeat(1, 1, f64::NAN),
        tolerance: 1e-9,
    };
    assert!(iteration(0.0, 60).minimize(&mut nan, start()).is_none());
}

/// Quadratic residuals with bounds, which give up as they are told.
struct Bounded {
    gives_up_at: usize,
    is_linearized: bool,
    fails: bool,
}

impl Objective for Bounded {
    type Point = f64;
    type Value = f64;

    fn value(&mut self, point: &f64) -> Option<f64> {
        (*point > -10.0).then(|| (point - 2.0).powi(2))
    }

    fn linearize(&mut self, point: &f64, _: &f64) -> Option<NormalSums> {
        (!self.fails).then(|| NormalSums {
            matrix: DMatrix::from_element(1, 1, 1.0),
            gradient: DVector::from_element(1, 2.0 - point),
        })
    }

    fn moved(&self, point: &f64, step: &DVector<f64>) -> f64 {
        (point + step[0]).clamp(-20.0, 1.0)
    }

    fn limited(&self, step: DVector<f64>) -> DVector<f64> {
        step.map(|entry| entry.clamp(-0.5, 0.5))
    }

    fn is_no_worse(&self, next: &f64, now: &f64) -> bool {
        next <= now
    }

    fn has_converged(&self, _: f64, next: &f64, now: &f64) -> bool {
        now == next
    }

    fn gives_up(&self, round: usize, _: &f64, before: Option<&f64>) -> bool {
        assert_eq!(before.is_some(), round > 0);
        !self.is_linearized && round == self.gives_up_at
    }

    fn gives_up_linearized(&self, round: usize, _: &f64, _: &NormalSums) -> bool {
        self.is_linearized && round == self.gives_up_at
    }
}

#[test]
fn steps_are_limited_and_bounds_are_kept() {
    let mut bounded = Bounded {
        gives_up_at: usize::MAX,
        is_linearized: false,
        fails: false,
    };
    let found = iteration(0.0, 60).minimize(&mut bounded, -1.0).unwrap();
    // −1, −0.5, 0, 0.5, 1, and once more to see that it stays.
    assert_eq!(
        (found.stop, found.point, found.iterations),
        (Stop::Converged, 1.0, 5)
    );
    for is_linearized in [false, true] {
        (bounded.gives_up_at, bounded.is_linearized) = (2, is_linearized);
        let found = iteration(0.0, 60).minimize(&mut bounded, -1.0).unwrap();
        assert_eq!((found.stop, found.point), (Stop::GivenUp, 0.0));
    }
    bounded.fails = true;
    let found = iteration(0.0, 60).minimize(&mut bounded, -1.0).unwrap();
    assert_eq!(found.stop, Stop::LeftDomain);
    assert!(iteration(0.0, 60).minimize(&mut bounded, -11.0).is_none());
}

#[test]
fn complex_normal_equations_have_many_right_sides_and_parameters_that_are_held() {
    let mut rng = generator(5);
    for _ in 0..50 {
        let columns = rng.random_range(1..7);
        let rows = columns + rng.random_range(0..20);
        let units = DVector::from_fn(columns, |j, _| 10.0_f64.powi(3 * j as i32 - 9));
        let complex =
            |rng: &mut ChaCha8Rng| Complex64::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
        let matrix = DMatrix::from_fn(rows, columns, |_, j| complex(&mut rng) * units[j]);
        let wanted = DMatrix::from_fn(columns, 3, |j, _| complex(&mut rng) / units[j]);
        let normal = matrix.adjoint() * &matrix;
        let right = &normal * &wanted;
        let equations = NormalEquations::new(&normal, 0.0, Idle::Refuse).unwrap();
        let found = equations.solve_columns(&right);
        let one = equations.solve(&right.column(1).into_owned());
        let decrease = (right.column(1).adjoint() * &one)[(0, 0)].re;
        assert!((equations.explained(&right.column(1).into_owned()) / decrease - 1.0).abs() < 1e-9);
        for j in 0..columns {
            // Rounding 1e-16 times the condition of the Gram matrix of square random matrices (seen: below 1e6).
            assert!((found[(j, 1)] - wanted[(j, 1)]).norm() * units[j] < 1e-8);
            assert_eq!(found[(j, 1)], one[j]);
        }
        let unit = equations.inverse() * &normal;
        for i in 0..columns {
            for j in 0..columns {
                let expected = f64::from(u8::from(i == j));
                assert!((unit[(i, j)] * (units[i] / units[j]) - expected).norm() < 1e-8);
            }
        }
    }
    let mut normal = DMatrix::<f64>::identity(3, 3) * 4.0;
    normal[(1, 1)] = 0.0;
    let right = DVector::repeat(3, 8.0);
    assert!(NormalEquations::new(&normal, 0.0, Idle::Refuse).is_none());
    let held = NormalEquations::new(&normal, 0.0, Idle::Hold).unwrap();
    assert_eq!(held.solve(&right).as_slice(), [2.0, 0.0, 2.0]);
    assert_eq!(held.inverse().diagonal().as_slice(), [0.25, 0.0, 0.25]);
    assert_eq!(held.explained(&right), 32.0);
    // A ridge of 1 halves a diagonal solution.
    let ridged = NormalEquations::new(&normal, 1.0, Idle::Hold).unwrap();
    assert!((ridged.solve(&right) - held.solve(&right) * 0.5).amax() < 1e-15);
    assert!(NormalEquations::new(&DMatrix::repeat(2, 2, f64::NAN), 0.0, Idle::Refuse).is_none());
    // Indefinite or not finite, real and complex.
    for corner in [2.0, f64::INFINITY, f64::NAN] {
        let normal = DMatrix::from_row_slice(2, 2, &[1.0, corner, corner, 1.0]);
        assert!(NormalEquations::new(&normal, 0.0, Idle::Refuse).is_none());
        assert!(NormalEquations::new(&normal.map(Complex64::from), 0.0, Idle::Refuse).is_none());
    }
}

#[test]
fn eliminated_columns_leave_the_solution_and_the_residual_of_the_whole_problem() {
    let mut rng = generator(6);
    for _ in 0..50 {
        let (first, last) = (rng.random_range(0..5), rng.random_range(1..5));
        let rows = first + last + 1 + rng.random_range(0..20);
        let units = DVector::from_fn(first + last, |j, _| 10.0_f64.powi(2 * j as i32 - 6));
        let matrix = random(rows, first + last, &mut rng) * DMatrix::from_diagonal(&units);
        let right = random_vector(rows, &mut rng);
        let whole = LinearProblem::new(&matrix, &right).solve().unwrap();
        let mut stacked = matrix.clone().insert_column(first + last, 0.0);
        stacked.set_column(first + last, &right);
        let left = eliminated(stacked, first);
        assert_eq!(left.shape(), (last + 1, last + 1));
        let (matrix, right) = (left.columns(0, last).into_owned(), left.column(last).into_owned());
        let fit = LinearProblem::new(&matrix, &right).solve().unwrap();
        for j in 0..last {
            let difference = fit.parameters[j] - whole.parameters[first + j];
            assert!(difference.abs() < 1e-9 * whole.covariance[(first + j, first + j)].sqrt());
        }
        assert!((fit.sum_of_squares - whole.sum_of_squares).abs() < 1e-12 * rows as f64);
    }
    // Fewer rows than columns to eliminate: nothing remains.
    assert_eq!(eliminated(DMatrix::repeat(2, 5, 1.0), 3).shape(), (0, 2));
    // More columns to eliminate than there are.
    assert_eq!(eliminated(DMatrix::repeat(5, 2, 1.0), 3).ncols(), 0);
}

#[test]
fn dependent_columns_share_the_solution_of_least_norm() {
    // Two equal columns: x₀ = x₁ = ½ of the sum.
    let matrix = DMatrix::from_row_slice(3, 3, &[1.0, 1.0, 0.0, 2.0, 2.0, 1.0, 0.0, 0.0, 1.0]);
    let right = &matrix * DVector::from_vec(vec![3.0, 1.0, 5.0]);
    for tolerance in [Tolerance::Relative(1e-12), Tolerance::Absolute(1e-12)] {
        let found = MinimumNorm::new(matrix.clone(), tolerance).unwrap().solve(&right);
        assert!((found - DVector::from_vec(vec![2.0, 2.0, 5.0])).amax() < 1e-14);
    }
    // Where the columns are independent, the solution is that of QR.
    let mut rng = generator(7);
    let matrix = random(12, 4, &mut rng);
    let right = random_vector(12, &mut rng);
    let fit = LinearProblem::new(&matrix, &right).solve().unwrap();
    let found = MinimumNorm::new(matrix, Tolerance::Absolute(0.0)).unwrap();
    assert!((found.solve(&right) - fit.parameters).amax() < 1e-13);
    assert!(MinimumNorm::new(DMatrix::zeros(0, 3), Tolerance::Absolute(0.0)).is_err());
}

#[test]
fn the_covariance_comes_from_the_triangle_and_keeps_the_digits_that_normal_equations_lose() {
    // Unit upper triangular with −1 above the diagonal: A⁻¹ has 1 on the diagonal and 2^(j − i − 1) above it, so that
    // (AᵀA)⁻¹ = A⁻¹A⁻ᵀ is a sum of powers of two. The condition number is 20 · 2¹⁹ = 1e7.
    let size = 20;
    let matrix = DMatrix::from_fn(size, size, |i, j| match i.cmp(&j) {
        std::cmp::Ordering::Less => -1.0,
        std::cmp::Ordering::Equal => 1.0,
        std::cmp::Ordering::Greater => 0.0,
    });
    let inverse = DMatrix::from_fn(size, size, |i, j| match i.cmp(&j) {
        std::cmp::Ordering::Less => 2.0_f64.powi((j - i) as i32 - 1),
        std::cmp::Ordering::Equal => 1.0,
        std::cmp::Ordering::Greater => 0.0,
    });
    let exact = &inverse * inverse.transpose();
    let error = |covariance: &DMatrix<f64>| (covariance - &exact).amax() / exact.amax();
    let fit = LinearProblem::new(&matrix, &DVector::repeat(size, 1.0))
        .solve()
        .unwrap();
    // Rounding 1e-16 times the condition number.
    assert!(error(&fit.covariance) < 1e-8, "{:e}", error(&fit.covariance));
    // The square of the condition number leaves two or three digits, or none.
    let by_squares = invert_normal_equations(&matrix.tr_mul(&matrix));
    assert!(by_squares.is_none_or(|covariance| error(&covariance) > 1e-6));
}
