//! A multiplier at one depth and where it goes.

use num_complex::Complex64;

use super::stability_loss::StabilityLoss;

/// One multiplier at one depth, in the upper half plane or on the real axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Root {
    pub(crate) multiplier: Complex64,
    /// dμ/dw, 1/m.
    pub(crate) slope: Complex64,
}

impl Root {
    /// Distance from the unit circle, positive outside.
    pub(crate) fn excess(&self) -> f64 {
        self.multiplier.norm() - 1.0
    }

    /// d|μ|/dw.
    pub(crate) fn excess_slope(&self) -> f64 {
        (self.multiplier.conj() * self.slope).re / self.multiplier.norm()
    }

    /// Takes from `free` the root a step deeper that lies on the same branch: of the same kind, and both tangents meet half way
    /// to within a quarter of the way.
    pub(crate) fn take_next(&self, free: &mut Vec<Self>, step_m: f64) -> Option<Self> {
        let middle = self.multiplier + self.slope * (0.5 * step_m);
        let miss = |to: &Self| (middle - (to.multiplier - to.slope * (0.5 * step_m))).norm();
        let (index, to) = free
            .iter()
            .copied()
            .enumerate()
            .min_by(|(_, a), (_, b)| miss(a).total_cmp(&miss(b)))?;
        let travel = 0.5 * step_m * (self.slope.norm() + to.slope.norm());
        if miss(&to) > 0.25 * travel + 1e-6
            || StabilityLoss::of(self.multiplier) != StabilityLoss::of(to.multiplier)
        {
            return None;
        }
        free.swap_remove(index);
        Some(to)
    }
}
