//! Matrices on which an iteration without bound spins, and closed forms.

use std::time::{Duration, Instant};

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};

use super::*;

/// A matrix of the size below takes milliseconds; a spinning iteration takes forever.
const BOUND: Duration = Duration::from_secs(10);

fn complex(matrix: &DMatrix<f64>) -> DMatrix<Complex64> {
    matrix.map(Complex64::from)
}

/// The largest distance of an expected eigenvalue from the nearest found one.
fn distance(found: &[Complex64], expected: &[Complex64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let nearest = |value: &Complex64| {
        let distances = found.iter().map(|other| (other - value).norm());
        distances.fold(f64::INFINITY, f64::min)
    };
    expected.iter().map(nearest).fold(0.0, f64::max)
}

fn random(size: usize, rng: &mut impl RngExt) -> DMatrix<f64> {
    DMatrix::from_fn(size, size, |_, _| rng.random_range(-1.0..1.0))
}

#[test]
fn orthogonal_permutations_have_the_roots_of_unity() {
    let start = Instant::now();
    for size in [2, 3, 4, 7, 16, 50, 128] {
        let cyclic = DMatrix::from_fn(size, size, |i, j| f64::from(u8::from(i == (j + 1) % size)));
        let roots: Vec<_> = (0..size)
            .map(|k| Complex64::cis(k as f64 * std::f64::consts::TAU / size as f64))
            .collect();
        // Normal matrices: the backward error, 1e-16 times the size, is the error.
        assert!(
            distance(&of_real(cyclic.clone()).unwrap(), &roots) < 1e-12,
            "{size}"
        );
        assert!(
            distance(&of_complex(complex(&cyclic)).unwrap(), &roots) < 1e-12,
            "{size}"
        );
    }
    assert!(start.elapsed() < BOUND);
}

#[test]
fn entries_that_are_not_finite_are_refused_by_name() {
    let start = Instant::now();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for size in [1, 2, 3, 30] {
            let mut matrix = DMatrix::identity(size, size);
            matrix[(size - 1, 0)] = bad;
            let expected = EigenvalueError::NotFinite { size };
            assert_eq!(of_real(matrix.clone()).unwrap_err(), expected);
            assert_eq!(of_complex(complex(&matrix)).unwrap_err(), expected);
            assert_eq!(dominant(&complex(&matrix), 0.1).unwrap_err(), expected);
            assert_eq!(of_symmetric(matrix.clone()).unwrap_err(), expected);
            let identity = DMatrix::identity(size, size);
            assert_eq!(of_symmetric_pencil(&identity, &matrix).unwrap_err(), expected);
            assert!(expected.to_string().contains("check the data"));
        }
    }
    assert!(start.elapsed() < BOUND);
}

#[test]
fn matrices_that_are_not_square_are_refused() {
    let matrix = DMatrix::<f64>::zeros(3, 2);
    let expected = EigenvalueError::NotSquare { rows: 3, columns: 2 };
    assert_eq!(of_real(matrix.clone()).unwrap_err(), expected);
    assert_eq!(of_complex(complex(&matrix)).unwrap_err(), expected);
    assert_eq!(dominant(&complex(&matrix), 0.0).unwrap_err(), expected);
    assert_eq!(of_symmetric(matrix).unwrap_err(), expected);
}

#[test]
fn jordan_blocks_are_found_to_the_root_of_the_rounding() {
    let start = Instant::now();
    for size in [2, 3, 5, 8] {
        let block = DMatrix::from_fn(size, size, |i, j| match (i == j, i + 1 == j) {
            (true, _) => 2.0,
            (_, true) => 1.0,
            _ => 0.0,
        });
        // In another basis, so that the block is not triangular.
        let basis = DMatrix::from_fn(size, size, |i, j| f64::from(u8::from(i == j)) - 2.0 / size as f64);
        let mixed = &basis * block * &basis;
        // An error ε of the matrix moves an eigenvalue of multiplicity m by ε^(1/m).
        let bound = 4.0 * (1e-14_f64).powf(1.0 / size as f64);
        for found in [
            of_real(mixed.clone()).unwrap(),
            of_complex(complex(&mixed)).unwrap(),
        ] {
            let worst = found.iter().map(|value| (value - 2.0).norm()).fold(0.0, f64::max);
            assert!(worst < bound, "{size} {worst}");
        }
    }
    assert!(start.elapsed() < BOUND);
}

#[test]
fn graded_and_tiny_and_huge_matrices_return() {
    let start = Instant::now();
    let seed = 11;
    println!("seed {seed}");
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    for size in [3, 10, 25] {
        for decades in [-12, -3, 3, 12] {
            let grade = |i: usize| 10.0_f64.powi(decades * i as i32 % 280);
            let base = random(size, &mut rng);
            let graded = DMatrix::from_fn(size, size, |i, j| base[(i, j)] * grade(i) / grade(j));
            // A similarity by a diagonal matrix: balancing undoes it.
            let values = of_real(base).unwrap();
            if size == 3 {
                assert!(distance(&of_real(graded).unwrap(), &values) < 1e-9);
            } else if let Ok(found) = of_real(graded) {
                assert_eq!(found.len(), size);
            }
        }
        for scale in [1e-300, 1e-150, 1e150, 1e300] {
            let base = random(size, &mut rng);
            let found = of_real(&base * scale).unwrap();
            let scaled: Vec<_> = of_real(base).unwrap().into_iter().map(|v| v * scale).collect();
            assert!(distance(&found, &scaled) < 1e-10 * scale, "{size} {scale}");
        }
    }
    assert!(start.elapsed() < BOUND);
}

#[test]
fn symmetric_chains_have_their_closed_form() {
    // Fixed-fixed chain of unit masses and springs: λ_k = 4 sin²(kπ / 2(n + 1)).
    for size in [1, 2, 5, 40] {
        let chain = DMatrix::from_fn(size, size, |i, j| match i.abs_diff(j) {
            0 => 2.0,
            1 => -1.0,
            _ => 0.0,
        });
        let expected = |k: usize| {
            let angle = (k + 1) as f64 * std::f64::consts::PI / (2.0 * (size + 1) as f64);
            4.0 * angle.sin().powi(2)
        };
        let mut found: Vec<f64> = of_symmetric(chain.clone())
            .unwrap()
            .eigenvalues
            .iter()
            .copied()
            .collect();
        found.sort_by(f64::total_cmp);
        // Masses of 4 kg: λ falls to a quarter.
        let mass = DMatrix::identity(size, size) * 4.0;
        let pencil = of_symmetric_pencil(&chain, &mass).unwrap();
        let mut quarter: Vec<f64> = pencil.eigenvalues.iter().copied().collect();
        quarter.sort_by(f64::total_cmp);
        for k in 0..size {
            assert!((found[k] - expected(k)).abs() < 1e-13, "{size} {k}");
            assert!((4.0 * quarter[k] - expected(k)).abs() < 1e-13, "{size} {k}");
        }
        let modal_mass = pencil.eigenvectors.tr_mul(&(&mass * &pencil.eigenvectors));
        assert!((modal_mass - DMatrix::identity(size, size)).norm() < 1e-12);
    }
    assert!(
        of_symmetric(DMatrix::<f64>::zeros(0, 0))
            .unwrap()
            .eigenvalues
            .is_empty()
    );
    let mass = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, 0.0]));
    assert_eq!(
        of_symmetric_pencil(&DMatrix::identity(2, 2), &mass).unwrap_err(),
        EigenvalueError::NotDefinite { size: 2 }
    );
}

#[test]
fn random_symmetric_matrices_agree_with_the_general_iteration() {
    let seed = 5;
    println!("seed {seed}");
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    for size in [2, 3, 9, 30] {
        let base = random(size, &mut rng);
        let symmetric = &base + base.transpose();
        let values = of_symmetric(symmetric.clone()).unwrap().eigenvalues;
        let values: Vec<_> = values.iter().map(|&value| Complex64::from(value)).collect();
        assert!(distance(&of_real(symmetric).unwrap(), &values) < 1e-12 * size as f64);
    }
}

#[test]
fn polynomials_have_the_roots_that_they_are_made_of() {
    let seed = 3;
    println!("seed {seed}");
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    for degree in 0..10 {
        let roots: Vec<_> = (0..degree)
            .map(|k| Complex64::from_polar(rng.random_range(0.7..1.3), 0.6 * f64::from(k)))
            .collect();
        let mut coefficients = vec![Complex64::new(2.0, -1.0)];
        for root in &roots {
            // Times (z − root).
            let mut next = vec![Complex64::ZERO; coefficients.len() + 1];
            for (k, c) in coefficients.iter().enumerate() {
                next[k + 1] += c;
                next[k] -= c * root;
            }
            coefficients = next;
        }
        coefficients.push(Complex64::ZERO);
        // Roots at least 0.4 apart on a ring: their condition is below 1e3.
        assert!(distance(&polynomial_roots(&coefficients).unwrap(), &roots) < 1e-11);
    }
    assert!(polynomial_roots(&[]).unwrap().is_empty());
    let infinite = Complex64::from(f64::INFINITY);
    assert!(polynomial_roots(&[infinite]).is_err());
    assert!(polynomial_roots(&[Complex64::ONE, infinite]).is_err());
}
