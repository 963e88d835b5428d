//! The path of a Floquet multiplier (characteristic multiplier) μ between two sampled axial depths, as ln μ.
//!
//! The logarithm makes growth and rotation of a multiplier nearly straight. Complex multipliers are represented by the
//! upper one of each pair, whose angle stays between 0 and π: it can leave this range only through a double real
//! multiplier.

use std::f64::consts::PI;

use num_complex::Complex64;

use crate::criteria::{LINE_FOLLOWED, PATH_MISS, REACH_FACTOR, REACH_LEAST, TOUCHING};
use crate::spectrum::root::Root;
use crate::spectrum::stability_loss::StabilityLoss;

/// Number of equal steps at which a path between two depths is evaluated to find its crossings of the unit circle. A
/// choice; [`TOUCHING`] covers what may lie between two steps.
const STEPS: usize = 16;

/// Logarithm of a Floquet multiplier at one axial depth, with its derivative.
#[derive(Clone, Copy, Debug)]
pub(super) struct Exponent {
    /// ln μ; its imaginary part is the angle of μ, from 0 to π.
    pub(super) value: Complex64,
    /// Derivative d(ln μ)/dw, 1/m.
    slope: Complex64,
    kind: StabilityLoss,
}

impl From<&Root> for Exponent {
    fn from(root: &Root) -> Self {
        let kind = StabilityLoss::of(root.multiplier);
        let (size, angle) = root.multiplier.to_polar();
        let slope = root.slope / root.multiplier;
        Self {
            value: Complex64::new(size.ln(), angle),
            slope,
            kind,
        }
    }
}

impl Exponent {
    /// True if the multiplier is large enough to be followed along the depth.
    pub(super) fn is_followed(&self) -> bool {
        self.value.re > LINE_FOLLOWED.ln()
    }

    /// True if the multiplier may reach the unit circle within a step in axial depth.
    pub(super) fn may_reach(&self, step_m: f64) -> bool {
        self.value.re.abs() < REACH_FACTOR * self.slope.norm() * step_m + REACH_LEAST
    }

    /// Removes from `free`, the multipliers one step deeper, the one on the same path, and returns it: that of the
    /// same kind whose tangent comes closest to the tangent of this one half way. `None` if there is none of the same
    /// kind, or if the two tangents miss each other by more than 1e-6 plus the share [`PATH_MISS`] of the distance
    /// travelled.
    pub(super) fn take_next(&self, free: &mut Vec<Self>, step_m: f64) -> Option<Self> {
        let middle = self.value + self.slope * (0.5 * step_m);
        let miss = |to: &Self| (middle - (to.value - to.slope * (0.5 * step_m))).norm();
        let (index, to) = free
            .iter()
            .copied()
            .enumerate()
            .filter(|(_, to)| to.kind == self.kind)
            .min_by(|(_, a), (_, b)| miss(a).total_cmp(&miss(b)))?;
        let travel = 0.5 * step_m * (self.slope.norm() + to.slope.norm());
        if miss(&to) > PATH_MISS * travel + 1e-6 {
            return None;
        }
        free.swap_remove(index);
        Some(to)
    }
}

/// Floquet multiplier between two sampled depths: the cubic in depth for ln μ through both ends with their derivatives,
/// plus a quartic that vanishes with its slope at both ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct MultiplierPath {
    from: Exponent,
    to: Exponent,
    step_m: f64,
    /// Coefficient of the quartic: 16 times the error of the cubic half way; 0 before [`MultiplierPath::correct`].
    correction: Complex64,
}

/// Crossing of the unit circle by a path, not yet refined by Newton's method.
#[derive(Clone, Copy, Debug)]
pub(super) struct PathCrossing {
    /// Depth of the crossing as a fraction of the depth interval.
    pub(super) share: f64,
    pub(super) outward: bool,
}

impl MultiplierPath {
    pub(super) fn new(from: Exponent, to: Exponent, step_m: f64) -> Self {
        Self {
            from,
            to,
            step_m,
            correction: Complex64::ZERO,
        }
    }

    /// True if the multiplier may reach the unit circle between the two depths, and is large enough to be followed at
    /// one of them at least.
    pub(super) fn may_reach(&self) -> bool {
        let ends = [&self.from, &self.to];
        ends.iter().any(|end| end.is_followed()) && ends.iter().any(|end| end.may_reach(self.step_m))
    }

    /// ln μ at a fraction of the depth interval.
    pub(super) fn at(&self, share: f64) -> Complex64 {
        let (u, product) = (1.0 - share, share * (1.0 - share));
        self.from.value * (u * u * (1.0 + 2.0 * share))
            + self.to.value * (share * share * (3.0 - 2.0 * share))
            + (self.from.slope * u - self.to.slope * share) * (self.step_m * product)
            + self.correction * (product * product)
    }

    /// Multiplier at a fraction of the depth interval, of the same kind as at both ends.
    pub(super) fn multiplier_at(&self, share: f64) -> Complex64 {
        let exponent = self.at(share);
        let size = exponent.re.exp();
        match self.from.kind {
            StabilityLoss::Hopf => Complex64::from_polar(size, exponent.im),
            StabilityLoss::Flip => Complex64::from(-size),
            StabilityLoss::Fold => Complex64::from(size),
        }
    }

    /// Sets the quartic from the multiplier half way; returns the absolute error of the cubic in ln μ there.
    pub(super) fn correct(&mut self, middle: Complex64) -> f64 {
        let error = (middle / self.multiplier_at(0.5)).ln();
        self.correction = error * 16.0;
        error.norm()
    }

    /// Absolute error of the cubic in ln μ half way; 0 before [`correct`](Self::correct).
    pub(super) fn error(&self) -> f64 {
        self.correction.norm() / 16.0
    }

    /// Crossings of the unit circle between the two depths, by ascending depth. `None` if the path may touch the circle
    /// in between, or if the path of a complex multiplier reaches the real axis.
    pub(super) fn crossings(&self) -> Option<Vec<PathCrossing>> {
        let points: [Complex64; STEPS + 1] = std::array::from_fn(|step| self.at(step as f64 / STEPS as f64));
        let is_complex = self.from.kind == StabilityLoss::Hopf;
        if is_complex && points.iter().any(|point| !(0.0..PI).contains(&point.im)) {
            return None;
        }
        let mut crossings = Vec::new();
        for step in 0..STEPS {
            let (a, b) = (points[step].re, points[step + 1].re);
            if (a > 0.0) != (b > 0.0) {
                crossings.push(PathCrossing {
                    share: (step as f64 + a / (a - b)) / STEPS as f64,
                    outward: b > 0.0,
                });
            }
        }
        let within = points.windows(3).any(|three| {
            let [a, b, c] = [three[0].re, three[1].re, three[2].re];
            let is_nearest =
                are_on_one_side(a, b) && are_on_one_side(b, c) && b.abs() <= a.abs().min(c.abs());
            // The extremum of a parabola through three points lies beyond the nearest of them by an eighth of their
            // second difference at most.
            is_nearest && b.abs() < self.error() + TOUCHING * (a - 2.0 * b + c).abs()
        });
        let [first, second, .., last_but_one, last] = points.map(|point| point.re);
        let part_m = self.step_m / STEPS as f64;
        let ends = [
            (first, second, self.from.slope.re * part_m),
            (last, last_but_one, -self.to.slope.re * part_m),
        ];
        let at_an_end = ends.into_iter().any(|(a, b, move_in)| {
            // A parabola that begins towards the circle and ends farther from it comes nearer by a quarter of the
            // initial change at most.
            let turns = are_on_one_side(a, b) && a * move_in < 0.0 && b.abs() >= a.abs();
            turns && a.abs() < self.error() + TOUCHING * move_in.abs()
        });
        (!within && !at_an_end).then_some(crossings)
    }
}

fn are_on_one_side(a: f64, b: f64) -> bool {
    (a > 0.0) == (b > 0.0)
}
