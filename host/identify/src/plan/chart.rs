//! 90 % intervals of the stability limits of a lobe chart, from the uncertainty of the unknown parameters of the case.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use quietcut_numerics::statistics::sample_quantile;

use crate::criteria::NEVER_LOWEST;
use quietcut_numerics::statistics::NINETY_PERCENT;
use quietcut_stability::Basis;
use quietcut_stability::{Linearized, Plane, SpeedLine, StabilityError};

/// Largest number of stability lobes with derivatives that count at each spindle speed of a chart, from the first
/// stability limit to greater depths.
const LOBES: usize = 4;

/// Number of quasi-random points that represent the distribution of the depth of the lowest of several lobes: a power
/// of 2.
const POINTS: u32 = 256;

/// Stability lobes at a spindle speed, from the first stability limit to greater depths, each linearized in the unknown
/// parameters.
#[derive(Clone, Debug)]
pub(super) struct KnownLimit {
    /// Spindle speed, rev/min.
    pub(super) rpm: f64,
    /// The linearized lobes at this speed, lowest first: the first stability limit, and deeper lobes with derivatives,
    /// up to [`LOBES`] together.
    pub(super) planes: Vec<Plane>,
}

/// A stability limit whose derivatives with respect to the unknown parameters cannot be computed.
#[derive(Clone, Debug, PartialEq)]
pub struct WithoutDerivative {
    /// Spindle speed, rev/min.
    pub rpm: f64,
    /// Axial depth of the limit, mm.
    pub depth_mm: f64,
    /// True for the first limit at the speed, so that the plan leaves the speed out. False for a deeper lobe: the
    /// interval of the first limit then does not include that this lobe may become the lowest.
    pub is_first: bool,
    /// Reason why the limit has no derivatives.
    pub reason: String,
}

impl KnownLimit {
    /// The stability limit at a spindle speed, and the lobes there without derivatives with respect to the unknowns
    /// that are met before [`LOBES`] lobes with derivatives are found.
    ///
    /// The limit is `None` if stability is not lost up to the largest depth of the chart, or if the first limit is
    /// among those without derivatives. The gradients of every lobe have `size` entries; those of unknowns that affect
    /// only tests are zero.
    pub(super) fn new(
        line: &SpeedLine,
        linearized: &Linearized,
        size: usize,
    ) -> (Option<Self>, Vec<WithoutDerivative>) {
        Self::of_planes(line, linearized.planes(line), size)
    }

    /// [`KnownLimit::new`] with the linearization of every loss of stability among the switches of `line`, in their
    /// order.
    pub(super) fn of_planes(
        line: &SpeedLine,
        planes: Vec<Result<Plane, StabilityError>>,
        size: usize,
    ) -> (Option<Self>, Vec<WithoutDerivative>) {
        let Some(first) = line.first_limit else {
            return (None, Vec::new());
        };
        let (mut known, mut without_derivative) = (Vec::new(), Vec::new());
        let losses = line.switches.iter().filter(|switch| !switch.gain);
        for (switch, plane) in losses
            .zip(planes)
            .filter(|(switch, _)| switch.depth_mm >= first.depth_mm)
        {
            if known.len() == LOBES {
                break;
            }
            match plane {
                Ok(mut plane) => {
                    plane.gradient.resize_vertically_mut(size, 0.0);
                    if let Some((_, gradient)) = &mut plane.chatter_hz {
                        gradient.resize_vertically_mut(size, 0.0);
                    }
                    known.push(plane);
                }
                Err(reason) => without_derivative.push(WithoutDerivative {
                    rpm: line.rpm,
                    depth_mm: switch.depth_mm,
                    is_first: switch.depth_mm == first.depth_mm,
                    reason: reason.to_string(),
                }),
            }
        }
        let has_first = known
            .first()
            .is_some_and(|plane| plane.depth_mm == first.depth_mm);
        let limit = has_first.then_some(Self {
            rpm: line.rpm,
            planes: known,
        });
        (limit, without_derivative)
    }

    /// The stability limit of the nominal case, mm.
    pub(super) fn depth_mm(&self) -> f64 {
        self.planes[0].depth_mm
    }

    /// Indices of the lobes that may be the lowest when the unknown parameters deviate; `roots` are the gradients of
    /// all lobes' depths in coordinates in which the unknowns have unit covariance.
    fn rivals(&self, roots: &[DVector<f64>]) -> Vec<usize> {
        let is_near = |index: &usize| {
            let apart = self.planes[*index].depth_mm - self.depth_mm();
            apart <= NEVER_LOWEST * (&roots[*index] - &roots[0]).norm()
        };
        (0..self.planes.len())
            .filter(|index| *index == 0 || is_near(index))
            .collect()
    }
}

/// The first stability limits at the speeds of a chart, each linearized in the unknown parameters, for their 90 %
/// intervals.
#[derive(Clone, Debug)]
pub(super) struct KnownChart {
    pub(super) limits: Vec<KnownLimit>,
    /// Quasi-random points of the standard normal distribution: one list for each number of dimensions from 1 to
    /// [`LOBES`], in ascending order.
    points: Vec<Vec<DVector<f64>>>,
}

impl KnownChart {
    pub(super) fn new(limits: Vec<KnownLimit>) -> Self {
        let points = |size: usize| Basis::new(size, &[]).points(POINTS, 1, size as u64, 0);
        Self {
            limits,
            points: (1..=LOBES).map(points).collect(),
        }
    }

    /// The 90 % interval of every stability limit in the order of `limits`, mm, if the unknowns have the inverse
    /// covariance `information`.
    pub(super) fn intervals(&self, information: &DMatrix<f64>) -> Vec<[f64; 2]> {
        // The inverse covariance starts as the identity and information is only added, so it is positive definite
        // unless a number overflows.
        let Some(root) = Cholesky::new(information.clone()) else {
            return vec![[f64::NEG_INFINITY, f64::INFINITY]; self.limits.len()];
        };
        self.limits
            .iter()
            .map(|limit| self.interval(limit, &root))
            .collect()
    }

    /// Width of the 90 % interval of every stability limit in the order of `limits`, relative to the limit, if the
    /// unknowns have the inverse covariance `information`.
    pub(super) fn widths(&self, information: &DMatrix<f64>) -> Vec<f64> {
        let intervals = self.intervals(information);
        let pairs = intervals.iter().zip(&self.limits);
        pairs
            .map(|([from, to], limit)| (to - from) / limit.depth_mm())
            .collect()
    }

    fn interval(&self, limit: &KnownLimit, root: &Cholesky<f64, Dyn>) -> [f64; 2] {
        // With the inverse covariance Λ = L Lᵀ of the unknowns, a limit with the gradient g has the variance |L⁻¹g|².
        let roots: Vec<DVector<f64>> = limit
            .planes
            .iter()
            .map(|plane| solved(root, &plane.gradient))
            .collect();
        let rivals = limit.rivals(&roots);
        if rivals.len() == 1 {
            let half = NINETY_PERCENT * roots[0].norm();
            return [limit.depth_mm() - half, limit.depth_mm() + half];
        }
        // The distribution of the depth of the lowest lobe depends only on the lobes that may be the lowest: the number
        // of coordinates equals their number, and the first axis lies along the gradient of the nominally lowest lobe.
        let vectors: Vec<DVector<f64>> = rivals.iter().map(|&index| roots[index].clone()).collect();
        let coordinates = triangular(&vectors);
        let mut lowest: Vec<f64> = self.points[rivals.len() - 1]
            .iter()
            .map(|point| {
                let depths = rivals
                    .iter()
                    .zip(&coordinates)
                    .map(|(&index, along)| limit.planes[index].depth_mm + along.dot(point));
                depths.fold(f64::INFINITY, f64::min)
            })
            .collect();
        lowest.sort_by(f64::total_cmp);
        [0.05, 0.95].map(|share| sample_quantile(&lowest, share).unwrap_or(f64::NAN))
    }
}

fn solved(root: &Cholesky<f64, Dyn>, gradient: &DVector<f64>) -> DVector<f64> {
    root.l_dirty()
        .solve_lower_triangular(gradient)
        .unwrap_or_else(|| gradient.clone())
}

/// Coordinates of the vectors along Gram–Schmidt axes, one axis for each vector; the first axis lies along the first
/// vector.
fn triangular(vectors: &[DVector<f64>]) -> Vec<DVector<f64>> {
    let size = vectors.len();
    let mut basis: Vec<DVector<f64>> = Vec::with_capacity(size);
    vectors
        .iter()
        .map(|vector| {
            let mut rest = vector.clone();
            let mut along = DVector::zeros(size);
            for (index, axis) in basis.iter().enumerate() {
                along[index] = axis.dot(&rest);
                rest.axpy(-along[index], axis, 1.0);
            }
            let length = rest.norm();
            along[basis.len()] = length;
            basis.push(if length > 0.0 { rest / length } else { rest });
            along
        })
        .collect()
}
