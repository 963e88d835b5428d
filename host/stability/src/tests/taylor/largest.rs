//! Absolute value of the largest multiplier of a period, from Taylor series and Arnoldi's method.

use nalgebra::{DMatrix, DVector};

use crate::problem::linear::Problem;
use crate::spectrum::hessenberg::Shifted;
use crate::tests::taylor::{Series, TaylorPeriod, are_short, least_counts, refine};
use quietcut_numerics::eigenvalues::of_real;

/// Largest number of vectors of a Krylov space; beyond it counting multipliers is cheaper.
const VECTORS_MAX: usize = 120;

/// Residual of the eigenvector, and change of the eigenvalue since its last computation, at which the eigenvalue is
/// accepted, relative to the norm of the projected map.
const SETTLED: f64 = 1e-10;

/// Absolute value |μ| of the largest multiplier, and its error due to truncated series and unconverged iteration;
/// `None` if a result is not finite or Arnoldi's method does not converge.
pub(crate) fn largest_abs(problem: &Problem, rpm: f64, depth_m: f64, series: Series) -> Option<(f64, f64)> {
    let mut counts = least_counts(problem, rpm, series);
    for _ in 0..12 {
        let period = TaylorPeriod::new(problem, rpm, depth_m, series, &counts);
        let mut tails = vec![0.0; counts.len()];
        period.apply(&period.start(), &mut tails);
        let found = are_short(&tails, series.tail).then(|| arnoldi(&period, &mut tails));
        if let Some(found) = found
            && are_short(&tails, 100.0 * series.tail)
        {
            return found;
        }
        refine(&mut counts, &tails, series)?;
    }
    None
}

/// Absolute value of the largest eigenvalue of the period map, and its error: the last change of the iteration plus the
/// effect of the truncated series.
fn arnoldi(period: &TaylorPeriod, tails: &mut [f64]) -> Option<(f64, f64)> {
    let most = VECTORS_MAX.min(period.size);
    let mut basis: Vec<DVector<f64>> = vec![DVector::from_vec(period.start()).normalize()];
    let mut hessenberg = DMatrix::zeros(most + 1, most);
    let (mut next_eigenvalues, mut before) = (8, f64::INFINITY);
    // The map is divided by the largest entry of its first image: squares of motions that grow beyond 1e150 would
    // overflow.
    let mut unit = 1.0;
    for k in 0..most {
        let mut image = DVector::from_vec(period.apply(basis[k].as_slice(), tails));
        if k == 0 {
            unit = image.amax();
        }
        image /= unit;
        let whole = image.norm();
        for _ in 0..2 {
            for (j, known) in basis.iter().enumerate() {
                let part = known.dot(&image);
                hessenberg[(j, k)] += part;
                image.axpy(-part, known, 1.0);
            }
        }
        let left = image.norm();
        let is_closed = left <= 1e-14 * whole || k + 1 == most;
        if is_closed || k + 1 == next_eigenvalues {
            next_eigenvalues += (next_eigenvalues / 3).max(4);
            let within = hessenberg.view((0, 0), (k + 1, k + 1)).into_owned();
            let found = of_real(within.clone())
                .ok()?
                .into_iter()
                .max_by(|p, q| p.norm_sqr().total_cmp(&q.norm_sqr()))?;
            let size = found.norm();
            let shifted = Shifted::new(&within, 1, found);
            // Truncation of the series changes the map by this share of its norm, and the eigenvalue by its condition
            // number times as much.
            let left_out = period.series.tail * within.norm() * shifted.condition()?;
            if k + 1 == period.size || left <= 1e-14 * whole {
                return Some((size * unit, left_out * unit));
            }
            // In maps far from normal eigenvalues are accurate only to rounding of the norm of the map.
            let scale = SETTLED * size.max(within.norm());
            let change = (size - before).abs();
            if change < scale {
                let vector = shifted.right()?;
                if left * vector[k].norm() < scale {
                    return Some((size * unit, (change + left_out) * unit));
                }
            }
            before = size;
        }
        hessenberg[(k + 1, k)] = left;
        basis.push(image / left);
    }
    None
}
