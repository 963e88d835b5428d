//! Time of least squares and eigenvalues: `quietcut-numerics`, nalgebra and faer, on one thread.
//!
//! ```text
//! CARGO_TARGET_DIR=target cargo run --release --manifest-path host/numerics/benches/Cargo.toml
//! ```
//!
//! prints, for matrices of 10, 50 and 200 columns, the time of nalgebra and of faer divided by that of this crate. A
//! ratio above 1 says that this crate is faster. Each time is the smallest of several runs. The time of least squares
//! in this crate includes the scaling of the columns, the rank, the covariance and the checks of the input.
//!
//! Ratios of nalgebra 0.35 and faer 0.24 on one x86-64 core with AVX2:
//!
//! | problem | nalgebra: 10, 50, 200 | faer: 10, 50, 200 |
//! |---|---|---|
//! | least squares, 4n × n | 2.1, 2.3, 2.0 | 0.85, 0.18, 0.02 |
//! | normal equations, n × n | 0.8, 0.9, 1.0 | 1.3, 1.0, 0.26 |
//! | eigenvalues, real | 1.3, 1.2, 1.3 | 2.3, 1.9, 0.9 |
//! | eigenvalues, complex | 1.8, 2.7, 3.6 | 0.9, 0.7, 0.4 |
//! | eigenvectors, symmetric | 1.0, 1.0, 1.2 | 1.7, 1.0, 0.11 |
//!
//! faer is not used inside: it would add forty packages, two versions of `equator`, and old versions of `syn` and
//! `thiserror`, which the rules for dependencies refuse. For ten columns it takes between 0.85 and 2.3 times the time
//! of this crate, for eigenvalues of fifty columns between 0.7 and 1.9 times. Least squares of fifty columns and more
//! would gain: the pivoted QR decomposition of nalgebra is slow there.

#![allow(clippy::expect_used)]

use std::hint::black_box;
use std::time::{Duration, Instant};

use faer::Side;
use faer::linalg::solvers::{Solve, SolveLstsqCore};
use faer::{Conj, Mat};
use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use quietcut_numerics::eigenvalues::{of_complex, of_real, of_symmetric};
use quietcut_numerics::least_squares::{Idle, LinearProblem, NormalEquations};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Numbers of columns of the matrices that are timed, as in a fit of a few modes, in a map of the state over one
/// period, and in a large such map.
const SIZES: [usize; 3] = [10, 50, 200];

/// Least total time of the repeated runs by which one method is timed on one matrix.
const ENOUGH: Duration = Duration::from_millis(300);

/// Smallest time of a run, s: at least three runs are timed, and more until they take [`ENOUGH`] together.
fn seconds<T>(mut run: impl FnMut() -> T) -> f64 {
    let start = Instant::now();
    let (mut best, mut runs) = (f64::INFINITY, 0);
    while runs < 3 || start.elapsed() < ENOUGH {
        let before = Instant::now();
        black_box(run());
        best = before.elapsed().as_secs_f64().min(best);
        runs += 1;
    }
    best
}

fn row(what: &str, size: usize, ours: f64, nalgebra: f64, faer: f64) {
    println!(
        "{what:<34} {size:>5} {:>12.1} {:>10.2} {:>8.2}",
        1e6 * ours,
        nalgebra / ours,
        faer / ours
    );
}

fn main() {
    let seed = 1;
    println!("seed {seed}; times on one thread");
    println!(
        "{:<34} {:>5} {:>12} {:>10} {:>8}",
        "problem", "n", "ours, µs", "nalgebra", "faer"
    );
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for size in SIZES {
        let rows = 4 * size;
        let matrix = DMatrix::from_fn(rows, size, |_, _| rng.random_range(-1.0..1.0));
        let right = DVector::from_fn(rows, |_, _| rng.random_range(-1.0..1.0));
        least_squares(size, &matrix, &right);
        normal_equations(size, &matrix, &right);
        let square = DMatrix::from_fn(size, size, |_, _| rng.random_range(-1.0..1.0));
        let complex = DMatrix::from_fn(size, size, |_, _| {
            Complex64::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0))
        });
        eigenvalues(size, &square, &complex);
    }
}

/// Times the solution of min ‖A x − b‖²: by the pivoted QR decompositions of this crate and of faer, and by the
/// singular values of nalgebra.
fn least_squares(size: usize, matrix: &DMatrix<f64>, right: &DVector<f64>) {
    let ours = seconds(|| LinearProblem::new(matrix, right).solve().expect("full rank"));
    let nalgebra = seconds(|| {
        let decomposed = matrix.clone().svd(true, true);
        decomposed.solve(right, 1e-12).expect("full rank")
    });
    let faer_matrix = Mat::from_fn(matrix.nrows(), size, |i, j| matrix[(i, j)]);
    let faer_right = Mat::from_fn(matrix.nrows(), 1, |i, _| right[i]);
    let faer = seconds(|| {
        let mut solution = faer_right.clone();
        faer_matrix
            .col_piv_qr()
            .solve_lstsq_in_place_with_conj(Conj::No, solution.as_mut());
        solution
    });
    row("least squares, 4n × n", size, ours, nalgebra, faer);
}

/// Times the solution of the normal equations N x = g by Cholesky decomposition in this crate, nalgebra and faer.
fn normal_equations(size: usize, matrix: &DMatrix<f64>, right: &DVector<f64>) {
    let (normal, gradient) = (matrix.tr_mul(matrix), matrix.tr_mul(right));
    let ours = seconds(|| {
        let equations = NormalEquations::new(&normal, 0.0, Idle::Refuse).expect("definite");
        equations.solve(&gradient)
    });
    let nalgebra = seconds(|| normal.clone().cholesky().expect("definite").solve(&gradient));
    let faer_normal = Mat::from_fn(size, size, |i, j| normal[(i, j)]);
    let faer_gradient = Mat::from_fn(size, 1, |i, _| gradient[i]);
    let faer = seconds(|| {
        faer_normal
            .llt(Side::Lower)
            .expect("definite")
            .solve(&faer_gradient)
    });
    row("normal equations, n × n", size, ours, nalgebra, faer);
}

fn eigenvalues(size: usize, real: &DMatrix<f64>, complex: &DMatrix<Complex64>) {
    let ours = seconds(|| of_real(real.clone()).expect("converges"));
    let nalgebra = seconds(|| real.complex_eigenvalues());
    let faer_real = Mat::from_fn(size, size, |i, j| real[(i, j)]);
    let faer = seconds(|| faer_real.eigenvalues().expect("converges"));
    row("eigenvalues, real", size, ours, nalgebra, faer);

    let ours = seconds(|| of_complex(complex.clone()).expect("converges"));
    let nalgebra = seconds(|| complex.clone().schur().unpack().1.diagonal());
    let faer_complex = Mat::from_fn(size, size, |i, j| complex[(i, j)]);
    let faer = seconds(|| faer_complex.eigenvalues().expect("converges"));
    row("eigenvalues, complex", size, ours, nalgebra, faer);

    let symmetric = real + real.transpose();
    let ours = seconds(|| of_symmetric(symmetric.clone()).expect("converges"));
    let nalgebra = seconds(|| symmetric.clone().symmetric_eigen());
    let faer_symmetric = Mat::from_fn(size, size, |i, j| symmetric[(i, j)]);
    let faer = seconds(|| faer_symmetric.self_adjoint_eigen(Side::Lower).expect("converges"));
    row("eigenvectors, symmetric", size, ours, nalgebra, faer);
}
