//! Counts multipliers without the map of the cut surface: from the phase of G(z) = det(I − z Φ(w (1 − z))), whose zeros
//! are 1/μ, along circles. Φ is the transition matrix from Taylor series, with a delayed displacement of z times the
//! present one.

use std::f64::consts::TAU;

use nalgebra::DMatrix;
use num_complex::Complex64;

use crate::problem::linear::Problem;
use crate::tests::taylor::{Series, TaylorPeriod, are_short, least_counts, refine};

/// Largest number of points on half of a circle: a limit on computing time.
const POINTS_MAX: usize = 800;

/// Largest number of floating-point operations of a count: some seconds.
const OPERATIONS_MAX: f64 = 1e10;

/// Largest change of the phase of G between neighbouring points, rad; a larger change adds a point between them.
const PHASE: f64 = 0.6;

/// Number of multipliers with |μ| larger than a radius; `None` if the largest numbers of steps and points do not
/// suffice.
pub(crate) fn count_beyond(problem: &Problem, rpm: f64, depth_m: f64, radius: f64) -> Option<usize> {
    let series = Series::FINE;
    let mut counts = least_counts(problem, rpm, series);
    for _ in 0..12 {
        let period = TaylorPeriod::new(problem, rpm, depth_m, series, &counts);
        let mut tails = vec![0.0; counts.len()];
        for z in [1.0, -1.0].map(|sign| Complex64::from(sign / radius)) {
            period.transition(Complex64::ONE - z, &mut tails);
        }
        if are_short(&tails, series.tail) {
            return Counter { period }.beyond(radius);
        }
        refine(&mut counts, &tails, series)?;
    }
    None
}

struct Counter {
    period: TaylorPeriod,
}

impl Counter {
    /// Phase of G at z, rad, modulo 2π; `None` if Φ is not finite.
    fn phase(&self, z: Complex64) -> Option<f64> {
        let n = self.period.order;
        let mut tails = vec![0.0; self.period.steps.len()];
        let mut g = self.period.transition(Complex64::ONE - z, &mut tails);
        for (index, entry) in g.iter_mut().enumerate() {
            *entry *= -z;
            if index / n == index % n {
                *entry += 1.0;
            }
        }
        let largest = g.iter().map(|entry| entry.l1_norm()).fold(0.0, f64::max);
        if !largest.is_finite() {
            return None;
        }
        let mut matrix = DMatrix::from_vec(n, n, g) / Complex64::from(largest);
        let mut phase = 0.0;
        for column in 0..n {
            let size = |row: &usize| matrix[(*row, column)].l1_norm();
            let pivot = (column..n)
                .max_by(|p, q| size(p).total_cmp(&size(q)))
                .unwrap_or(column);
            if pivot != column {
                matrix.swap_rows(pivot, column);
                phase += 0.5 * TAU;
            }
            let head = matrix[(column, column)];
            phase += head.arg();
            if head == Complex64::ZERO {
                return None;
            }
            for row in column + 1..n {
                let factor = matrix[(row, column)] / head;
                for j in column + 1..n {
                    let known = matrix[(column, j)];
                    matrix[(row, j)] -= factor * known;
                }
            }
        }
        Some(phase)
    }

    fn beyond(&self, radius: f64) -> Option<usize> {
        const FIRST: usize = 32;
        let points_max = POINTS_MAX.min((OPERATIONS_MAX / self.period.transition_operations()) as usize);
        let half = 0.5 * TAU;
        let at = |angle: f64| self.phase(Complex64::from_polar(radius.recip(), angle));
        let turn = |from: f64, to: f64| {
            let turn = to - from;
            turn - TAU * (turn / TAU).round()
        };
        let (mut increase, mut points) = (0.0, FIRST);
        // Values at conjugate points are conjugate, so that half of the circle suffices.
        let mut last = (0.0, at(0.0)?);
        for i in 1..=FIRST {
            let angle = half * i as f64 / FIRST as f64;
            // Ends of the angle intervals along the circle that are not passed yet, the nearest last.
            let mut ends = vec![(angle, at(angle)?)];
            while let Some(&end) = ends.last() {
                let middle = 0.5 * (last.0 + end.0);
                let between = (middle, at(middle)?);
                points += 1;
                let turns = [turn(last.1, between.1), turn(between.1, end.1)];
                if turns.iter().all(|turn| turn.abs() < PHASE) {
                    increase += turns[0] + turns[1];
                    last = end;
                    ends.pop();
                } else if points > points_max {
                    return None;
                } else {
                    ends.push(between);
                }
            }
        }
        let count = increase / half;
        ((count - count.round()).abs() < 0.01 && count > -0.5).then_some(count.round() as usize)
    }
}
