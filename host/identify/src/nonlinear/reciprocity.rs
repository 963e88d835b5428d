//! Reciprocity test: H_ij = H_ji holds for a linear structure without gyroscopic forces.

use num_complex::Complex64;

use crate::criteria::{LEAST_RECIPROCITY_CHANGE, RECIPROCAL_DEVIATIONS, SAME_STEP};
use crate::dwells::differentiation::derivative;
use crate::dwells::dwell::Dwell;
use quietcut_model::structure::Direction;

/// Comparison of the cross receptances H_ij and H_ji.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Reciprocity {
    /// The directions i and j of force and motion.
    pub directions: [&'static str; 2],
    /// Mean over the frequencies of |H_ij − H_ji|² divided by its variance: near 1 for a reciprocal structure.
    pub misfit: f64,
    /// Largest difference of H_ij and H_ji over the frequencies, relative to the largest receptance of a force in
    /// direction i and a motion in direction j.
    pub largest_change: f64,
    /// True if the data are consistent with reciprocity.
    pub reciprocal: bool,
}

/// Receptance in direction `to` under a force in direction `from` in one dwell, m/N, its variance, and the force
/// amplitude, N. `None` if the largest force is not in direction `from`, or if no motion in direction `to` was
/// measured.
fn receptance(dwell: &Dwell, from: Direction, to: Direction) -> Option<(Complex64, f64, f64)> {
    let force = dwell.force().filter(|line| line.direction == from)?;
    let motion = dwell.motions.iter().find(|line| line.direction == to)?;
    let per_unit = dwell.gram_inverse[(1, 1)];
    let (f, y) = (force.phasor(1), motion.phasor(1));
    let order = Complex64::new(0.0, dwell.omega).powi(i32::from(derivative(motion.quantity)));
    let h = y / order / f;
    let own = motion.variance / (order * f).norm_sqr();
    let of_force = h.norm_sqr() * force.variance / f.norm_sqr();
    // The variance of the receptance is that of real and imaginary part together.
    Some((h, 2.0 * per_unit * (own + of_force), f.norm()))
}

/// Compares the two cross receptances at every frequency at which both were measured, each at its lowest force, where a
/// nonlinear structure is closest to a linear one. `None` if there is no such frequency.
pub fn compare(dwells: &[Dwell], [i, j]: [Direction; 2]) -> Option<Reciprocity> {
    let of = |from, to| -> Vec<(f64, Complex64, f64)> {
        let mut found: Vec<(f64, Complex64, f64, f64)> = dwells
            .iter()
            .filter_map(|dwell| {
                let (h, variance, force) = receptance(dwell, from, to)?;
                Some((dwell.omega, h, variance, force))
            })
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.3.total_cmp(&b.3)));
        let mut lowest: Vec<(f64, Complex64, f64, f64)> = Vec::new();
        for point in found {
            match lowest.last_mut() {
                Some(last) if point.0 <= last.0 * (1.0 + SAME_STEP) => {
                    if point.3 < last.3 {
                        *last = point;
                    }
                }
                _ => lowest.push(point),
            }
        }
        lowest
            .into_iter()
            .map(|(omega, h, variance, _)| (omega, h, variance))
            .collect()
    };
    let (one, other) = (of(i, j), of(j, i));
    let (mut sum, mut count, mut change, mut largest) = (0.0, 0.0, 0.0_f64, 0.0_f64);
    for (omega, h, variance) in &one {
        let Some((_, g, of_g)) = other.iter().find(|(w, ..)| (w / omega - 1.0).abs() < SAME_STEP) else {
            continue;
        };
        sum += (h - g).norm_sqr() / (variance + of_g);
        count += 1.0;
        change = change.max((h - g).norm());
        largest = largest.max(h.norm());
    }
    if count == 0.0 {
        return None;
    }
    let misfit = sum / count;
    let largest_change = change / largest;
    Some(Reciprocity {
        directions: [i.name(), j.name()],
        misfit,
        largest_change,
        // The misfit is a mean of `count` exponential variables of mean 1, which rarely exceeds 1 by five standard
        // deviations. A difference of 1 % is within the accuracy of the position of a shaker.
        reciprocal: misfit < 1.0 + RECIPROCAL_DEVIATIONS / f64::sqrt(count)
            || largest_change < LEAST_RECIPROCITY_CHANGE,
    })
}
