//! Identification of the Floquet multipliers (characteristic multipliers) of one orbit of a branch among those of the
//! next.

use num_complex::Complex64;

use crate::criteria::MULTIPLIER_MOVE_MAX;
use crate::spectrum::stability_loss::StabilityLoss;

/// Least |μ| of the multipliers that are followed along a branch: 1 less 2.5 times the largest allowed move of a
/// multiplier in one step, so that it takes at least three steps to reach the unit circle.
pub(super) const FOLLOWED: f64 = 1.0 - 2.5 * MULTIPLIER_MOVE_MAX;

/// Pairs the multipliers of two neighbouring orbits of a branch; `None` if a multiplier near the unit circle cannot be
/// identified.
///
/// With `anyhow` each multiplier is paired with the nearest one that is left of the other orbit, at any distance. Two
/// real multipliers that meet and leave the real axis move infinitely fast there, so that no step is short enough.
pub(super) fn pair(
    from: &[Complex64],
    to: &[Complex64],
    anyhow: bool,
) -> Option<Vec<(Complex64, Complex64)>> {
    let (mut from, mut free) = (from.to_vec(), to.to_vec());
    remove_met_pairs(&mut from, &mut free);
    remove_met_pairs(&mut free, &mut from);
    let mut pairs = Vec::with_capacity(from.len());
    for root in from {
        let best = free
            .iter()
            .enumerate()
            .min_by(|(_, a), (_, b)| (*a - root).norm().total_cmp(&(*b - root).norm()));
        match best {
            Some((index, &next))
                if anyhow
                    || ((next - root).norm() < MULTIPLIER_MOVE_MAX * root.norm().max(1.0)
                        && (StabilityLoss::of(root) == StabilityLoss::of(next)
                            || is_far(root) && is_far(next))) =>
            {
                pairs.push((root, next));
                free.swap_remove(index);
            }
            // No multiplier of the next orbit is left for this one: its partner has become smaller than [`FOLLOWED`],
            // or it belongs to a pair that met on the real axis.
            None if is_far(root) || anyhow => {}
            _ if is_far(root) => {}
            _ => return None,
        }
    }
    (anyhow || free.iter().all(|&root| is_far(root))).then_some(pairs)
}

/// Removes conjugate pairs of one orbit, and the two real multipliers that each has become in the neighbouring orbit,
/// on the same side of the unit circle: they met on the real axis, and neither has crossed the circle.
fn remove_met_pairs(conjugate: &mut Vec<Complex64>, real: &mut Vec<Complex64>) {
    conjugate.retain(|&root| {
        let reach = MULTIPLIER_MOVE_MAX * root.norm().max(1.0);
        let is_near = |other: &Complex64| (other - root).norm() < reach;
        if root.im == 0.0 || real.iter().any(|other| other.im != 0.0 && is_near(other)) {
            return true;
        }
        let is_half = |other: &Complex64| {
            other.im == 0.0 && is_near(other) && (other.norm() > 1.0) == (root.norm() > 1.0)
        };
        if real.iter().filter(|other| is_half(other)).count() != 2 {
            return true;
        }
        real.retain(|other| !is_half(other));
        false
    });
}

/// True if a multiplier lies farther than [`MULTIPLIER_MOVE_MAX`] from the unit circle.
fn is_far(multiplier: Complex64) -> bool {
    (multiplier.norm() - 1.0).abs() > MULTIPLIER_MOVE_MAX
}

/// Largest move of a paired multiplier as a share of its distance from the unit circle, the smaller one of both orbits;
/// infinite if a multiplier crosses the circle.
pub(super) fn share_of_distance(pairs: &[(Complex64, Complex64)]) -> f64 {
    let distance = |multiplier: Complex64| (multiplier.norm() - 1.0).abs();
    let share = |&(from, to): &(Complex64, Complex64)| {
        let is_crossing = (from.norm() > 1.0) != (to.norm() > 1.0);
        if is_crossing {
            f64::INFINITY
        } else {
            (to - from).norm() / distance(from).min(distance(to))
        }
    };
    pairs.iter().map(share).fold(0.0, f64::max)
}

/// Multiplier of a list that lies nearest to an expected value; `None` if the list is empty.
pub(super) fn nearest(roots: &[Complex64], expected: Complex64) -> Option<Complex64> {
    roots
        .iter()
        .copied()
        .min_by(|a, b| (a - expected).norm().total_cmp(&(b - expected).norm()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(re: f64, im: f64) -> Complex64 {
        Complex64::new(re, im)
    }

    #[test]
    fn pairs_that_meet_on_the_real_axis_are_recognized_unless_one_multiplier_crosses_the_circle() {
        let pair_before = [at(0.9, 0.05), at(0.3, 0.75)];
        let real_after = [at(0.95, 0.0), at(0.86, 0.0), at(0.31, 0.74)];
        let rest = vec![(at(0.3, 0.75), at(0.31, 0.74))];
        assert_eq!(pair(&pair_before, &real_after, false), Some(rest));
        let back = vec![(at(0.31, 0.74), at(0.3, 0.75))];
        assert_eq!(pair(&real_after, &pair_before, false), Some(back));
        // One of the two real multipliers has crossed the unit circle: the step contains a fold.
        let crossed = [at(1.01, 0.0), at(0.86, 0.0), at(0.31, 0.74)];
        assert_eq!(pair(&[at(0.95, 0.05), at(0.3, 0.75)], &crossed, false), None);
    }

    #[test]
    fn a_multiplier_that_moves_too_far_near_the_circle_is_not_paired() {
        assert_eq!(pair(&[at(0.0, 0.99)], &[at(0.2, 1.0)], false), None);
        let near = [(at(0.0, 0.99), at(0.05, 1.0))];
        assert_eq!(pair(&[near[0].0], &[near[0].1], false), Some(near.to_vec()));
    }

    #[test]
    fn the_share_of_the_distance_is_that_of_the_multiplier_next_to_the_circle() {
        let far = (at(0.0, 0.5), at(0.1, 0.5));
        let near = (at(0.0, 0.8), at(0.0, 0.9));
        // The second one moves by 0.1 and ends at a distance of 0.1.
        assert!((share_of_distance(&[far, near]) - 1.0).abs() < 1e-12);
        assert_eq!(
            share_of_distance(&[far, (at(0.0, 0.9), at(0.0, 1.1))]),
            f64::INFINITY
        );
        assert_eq!(share_of_distance(&[]), 0.0);
    }
}
