//! Collocation of the one-period map: all multipliers at one speed and depth at once.

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::cells::{Cell, cells_of};
use super::characteristic::{Characteristic, Crossing, Workspace};
use super::line::{SpeedLine, line};
use super::method::Method;
use super::multiplier::chatter_hz;
use super::period::{Period, Resolution};
use super::point::{Point, point};
use super::root::Root;
use super::spectrum::Spectrum;
use super::{Problem, StabilityError};
use crate::eigenvalues::eigenvalues;

/// The default method: collocation of the one-period map, limits from the characteristic matrix.
#[derive(Clone, Debug, PartialEq)]
pub struct Collocation {
    /// The problem that it solves.
    pub problem: Problem,
}

impl Method for Collocation {
    fn name(&self) -> &'static str {
        "collocation"
    }

    fn point(&self, rpm: f64, depth_mm: f64) -> Result<Point, StabilityError> {
        point(&self.problem, rpm, depth_mm)
    }

    fn line(&self, rpm: f64, depth_mm: f64, samples: usize) -> Result<SpeedLine, StabilityError> {
        line(&self.problem, rpm, depth_mm, samples)
    }

    fn cells(&self, rpm: f64, depths_mm: &[f64]) -> Result<Vec<Cell>, StabilityError> {
        cells_of(rpm, depths_mm, |deepest_m| {
            Collocated::new(&self.problem, rpm, deepest_m)
        })
    }
}

/// The multipliers at one speed: all of them by collocation, single ones from the characteristic matrix.
pub(super) struct Collocated<'a> {
    problem: &'a Problem,
    rpm: f64,
    /// For all multipliers at once.
    coarse: Period,
    /// For limits.
    period: Period,
    characteristic: Characteristic,
    workspace: Workspace,
}

impl<'a> Collocated<'a> {
    /// Fine enough for depths up to `deepest_m`.
    pub(super) fn new(problem: &'a Problem, rpm: f64, deepest_m: f64) -> Self {
        // At the unit circle |w (1 − 1/μ)| ≤ 2 w.
        let period = Period::new(problem, rpm, 2.0 * deepest_m, Resolution::WORKING);
        let characteristic = Characteristic::new(&period, 2.0 * deepest_m);
        Self {
            problem,
            rpm,
            coarse: Period::new(problem, rpm, deepest_m, Resolution::SCAN),
            period,
            workspace: characteristic.workspace(),
            characteristic,
        }
    }
}

impl Spectrum for Collocated<'_> {
    fn multipliers(&mut self, depth_m: f64) -> Option<Vec<Complex64>> {
        multipliers(&self.coarse, depth_m)
    }

    fn multiplier_near(&mut self, guess: Complex64, depth_m: f64, reach: f64) -> Option<Complex64> {
        self.characteristic
            .multiplier_near(guess, depth_m, reach, &mut self.workspace)
    }

    fn sensitivity(&mut self, multiplier: Complex64, depth_m: f64) -> Option<Complex64> {
        self.characteristic
            .sensitivity(multiplier, depth_m, &mut self.workspace)
    }

    fn root_near(&mut self, guess: Complex64, depth_m: f64) -> Option<Root> {
        self.characteristic.root_near(guess, depth_m, &mut self.workspace)
    }

    fn crossing_near(&mut self, guess: Crossing, low_m: f64, high_m: f64) -> Option<Crossing> {
        self.characteristic
            .crossing_near(guess, low_m, high_m, &mut self.workspace)
    }

    fn chatter_hz(&self, crossing: &Crossing) -> Option<f64> {
        let Crossing { multiplier, depth_m } = *crossing;
        chatter_hz(self.problem, self.rpm, &self.period, multiplier, depth_m)
    }
}

/// The matrix of the map (x, p_τ) → (x⁺, p) over one tooth period at a depth, m.
///
/// p are the displacements along the chip normal at the collocation nodes while teeth cut. `None` where a depth is so
/// large that the collocation equations are singular.
pub(crate) fn monodromy(period: &Period, depth_m: f64) -> Option<DMatrix<f64>> {
    let order = period.order();
    let history: usize = period.elements.iter().map(|element| element.kernel.nrows()).sum();
    let size = order + history;
    let mut map = DMatrix::zeros(size, size);
    let mut state = DMatrix::zeros(order, size);
    state.view_mut((0, 0), (order, order)).fill_with_identity();
    let mut first = order;
    for element in &period.elements {
        let ports = element.kernel.nrows();
        // p − w Q p = E x − w Q p_τ
        let weighted = &element.kernel * depth_m;
        let implicit = DMatrix::identity(ports, ports) - &weighted;
        // Chips of later elements are not in it yet.
        let known = first + ports;
        let mut seen = &element.observe * state.columns(0, known);
        let mut past = seen.columns_mut(first, ports);
        past -= &weighted;
        if !implicit.lu().solve_mut(&mut seen) {
            return None;
        }
        map.view_mut((first, 0), (ports, known)).copy_from(&seen);
        for port in 0..ports {
            seen[(port, first + port)] -= 1.0;
        }
        let mut next = &element.flow * state.columns(0, known);
        next.gemm(depth_m, &element.drive, &seen, 1.0);
        state.columns_mut(0, known).copy_from(&next);
        first = known;
    }
    map.rows_mut(0, order).copy_from(&(&period.flight * state));
    Some(map)
}

/// All multipliers of the collocated map, largest first; those of the history that have no physical meaning are near
/// zero.
pub(crate) fn multipliers(period: &Period, depth_m: f64) -> Option<Vec<Complex64>> {
    let map = monodromy(period, depth_m)?;
    let mut multipliers = eigenvalues(map)?;
    multipliers.sort_by(|p, q| q.norm_sqr().total_cmp(&p.norm_sqr()).then(q.im.total_cmp(&p.im)));
    Some(multipliers)
}

/// The largest multiplier; of a pair the one above the real axis.
pub(crate) fn dominant(period: &Period, depth_m: f64) -> Option<Complex64> {
    multipliers(period, depth_m)?.first().copied()
}
