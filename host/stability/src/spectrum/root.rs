//! A Floquet multiplier (characteristic multiplier) at one axial depth, with its derivative.

use num_complex::Complex64;

use super::stability_loss::StabilityLoss;
use crate::criteria::TANGENT_MISS;

/// Floquet multiplier at one axial depth, in the upper half plane or on the real axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Root {
    pub(crate) multiplier: Complex64,
    /// Derivative dμ/dw, 1/m.
    pub(crate) slope: Complex64,
}

impl Root {
    /// Removes from `free`, the multipliers at the depth one step deeper, the one on the same branch as this
    /// multiplier, and returns it: the one whose tangent, half way between the two depths, comes closest to the tangent
    /// of this multiplier. `None` if `free` is empty, if the two are neither both complex nor both real of equal sign,
    /// or if the two tangents miss each other half way by more than 1e-6 plus [`TANGENT_MISS`] times the distance that
    /// the multiplier travels at the mean of the two |slopes|. With `None` nothing is removed.
    pub(crate) fn take_next(&self, free: &mut Vec<Self>, step_m: f64) -> Option<Self> {
        let middle = self.multiplier + self.slope * (0.5 * step_m);
        let miss = |to: &Self| (middle - (to.multiplier - to.slope * (0.5 * step_m))).norm();
        let (index, to) = free
            .iter()
            .copied()
            .enumerate()
            .min_by(|(_, a), (_, b)| miss(a).total_cmp(&miss(b)))?;
        let travel = 0.5 * step_m * (self.slope.norm() + to.slope.norm());
        if miss(&to) > TANGENT_MISS * travel + 1e-6
            || StabilityLoss::of(self.multiplier) != StabilityLoss::of(to.multiplier)
        {
            return None;
        }
        free.swap_remove(index);
        Some(to)
    }
}
