//! Points of a curve of stability losses at which a second multiplier meets the unit circle: double Hopf, fold–flip and
//! the other bifurcations of codimension two at which two losses meet.
//!
//! Along the curve the number of other multipliers outside the unit circle changes by those that pass. With k of them
//! outside on the side with fewer, the modulus of the one with the rank k among the others, in descending order, passes 1
//! where they meet: it is continuous along the curve, and its root is found by regula falsi (Illinois).

use num_complex::Complex64;

use super::follow::CurveFollower;
use super::newton::CurveOrbit;
use super::points::DoubleLoss;
use crate::spectrum::stability_loss::StabilityLoss;

/// Largest number of orbits at which the modulus is evaluated. A choice: about eight suffice.
const EVALUATIONS_MAX: usize = 40;

/// Distance of the modulus from 1 at which the point is found. A choice: far below the errors of multipliers on the working
/// mesh, 1e-9.
const MET: f64 = 1e-10;

impl CurveFollower<'_> {
    /// Multipliers about an orbit of the curve, other than the critical ones; `None` if they cannot be computed.
    pub(super) fn others(&self, orbit: &CurveOrbit) -> Option<Vec<Complex64>> {
        let setting = self.system.setting_of(&orbit.orbit.unknowns);
        let angle = self.system.angle_of(&orbit.orbit.unknowns).0;
        let problem = self.system.base.at(&setting);
        let map = self.system.period(&problem, setting.rpm);
        let mut multipliers = map
            .multipliers_about(&orbit.orbit.states, setting.depth_m())
            .ok()?;
        let critical = Complex64::from_polar(1.0, angle);
        let pair = [critical, critical.conj()];
        for critical in pair.iter().take(self.system.kind.count() as usize) {
            let nearest = multipliers
                .iter()
                .enumerate()
                .min_by(|(_, a), (_, b)| (*a - critical).norm().total_cmp(&(*b - critical).norm()));
            if let Some((index, _)) = nearest {
                multipliers.swap_remove(index);
            }
        }
        multipliers.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
        Some(multipliers)
    }

    /// Point between two neighbours at which another multiplier meets the unit circle; `None` if none passes it, or if it
    /// is not found. `outside` are the numbers of other multipliers outside the circle at both.
    pub(super) fn double(&self, [from, to]: [&CurveOrbit; 2], outside: [i32; 2]) -> Option<DoubleLoss> {
        let [before, after] = outside;
        if before == after || before.min(after) < 0 {
            return None;
        }
        let rank = before.min(after) as usize;
        let excess = |orbit: &CurveOrbit| Some(self.others(orbit)?.get(rank)?.norm() - 1.0);
        let [mut low, mut high] = [(0.0, excess(from)?), (1.0, excess(to)?)];
        for _ in 0..EVALUATIONS_MAX {
            let share = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            let orbit = self.between(from, to, share)?;
            let here = excess(&orbit)?;
            if here.abs() < MET {
                return self.double_at(&orbit, rank);
            }
            if (here > 0.0) == (high.1 > 0.0) {
                high = (share, here);
                low.1 *= 0.5;
            } else {
                low = high;
                high = (share, here);
            }
        }
        None
    }

    /// The orbit at a share of the way between two neighbours.
    fn between(&self, from: &CurveOrbit, to: &CurveOrbit, share: f64) -> Option<CurveOrbit> {
        let units = &self.corrector.units;
        let length = (&to.orbit.unknowns - &from.orbit.unknowns)
            .component_div(units)
            .dot(&to.along);
        let guess = to.extrapolated(from, length * (share - 1.0), units);
        self.corrector.correct(&guess, &to.phase, &to.along)
    }

    fn double_at(&self, orbit: &CurveOrbit, rank: usize) -> Option<DoubleLoss> {
        let multiplier = *self.others(orbit)?.get(rank)?;
        let mut point = self.point(orbit);
        // The multiplier that meets the circle counts as neither inside nor outside.
        point.outside = rank as i32;
        Some(DoubleLoss {
            other: StabilityLoss::of(multiplier),
            other_rotation_per_tooth: multiplier.arg().abs() / std::f64::consts::TAU,
            point,
        })
    }
}
