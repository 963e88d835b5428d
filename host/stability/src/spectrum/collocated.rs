//! Floquet multipliers (characteristic multipliers) at one spindle speed by collocation of the tooth period.

use num_complex::Complex64;

use super::along_depth::Spectrum;
use super::characteristic::{Characteristic, Workspace};
use super::chatter_frequency::chatter_hz;
use super::crossing::Crossing;
use super::period_map;
use super::root::Root;
use crate::criteria::{LEAST_ERROR, MESH_ROOM, SCANNED, SCANNED_SHARE};
use crate::error::{Breakdown, NO_FINER, StabilityError};
use crate::problem::linear::Problem;
use crate::problem::period::{Period, Resolution};

/// Floquet multipliers at one speed: the larger ones together from the collocated map, single ones from the
/// characteristic matrix.
pub(crate) struct Collocated<'a> {
    problem: &'a Problem,
    rpm: f64,
    deepest_m: f64,
    /// Coarse mesh of the tooth period, on which the larger multipliers are computed together.
    coarse: Period,
    /// Working mesh, for limits.
    period: Period,
    characteristic: Characteristic,
    workspace: Workspace,
    /// Characteristic matrix on the finer mesh, for error estimates of limits; `None` before the first use.
    finer: Option<Characteristic>,
}

impl<'a> Collocated<'a> {
    /// Multipliers of a problem at one spindle speed, on meshes for axial depths up to `deepest_m`.
    pub(crate) fn new(problem: &'a Problem, rpm: f64, deepest_m: f64) -> Self {
        // The mesh must resolve the complex depth, which is |w (1 − 1/μ)| ≤ 2 w on the unit circle.
        let period = Period::new(problem, rpm, 2.0 * deepest_m, Resolution::WORKING);
        let characteristic = Characteristic::new(&period, 2.0 * deepest_m);
        Self {
            problem,
            rpm,
            deepest_m,
            coarse: Period::new(problem, rpm, deepest_m, Resolution::SCAN),
            period,
            workspace: characteristic.workspace(),
            characteristic,
            finer: None,
        }
    }
}

impl Spectrum for Collocated<'_> {
    fn multipliers(&mut self, depth_m: f64) -> Result<Vec<Complex64>, Breakdown> {
        period_map::larger_than(&self.coarse, depth_m, SCANNED, SCANNED_SHARE)
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

    fn corrected(&mut self, guess: Complex64, depth_m: f64) -> Option<Complex64> {
        let (characteristic, workspace) = (&self.characteristic, &mut self.workspace);
        let by_one_step = characteristic.root_near(guess, depth_m, workspace);
        by_one_step
            .map(|root| root.multiplier)
            .or_else(|| characteristic.multiplier_near(guess, depth_m, 0.05 * guess.norm(), workspace))
    }

    fn crossing_near(&mut self, guess: Crossing, low_m: f64, high_m: f64) -> Option<Crossing> {
        self.characteristic
            .crossing_near(guess, low_m, high_m, &mut self.workspace)
    }

    fn chatter_hz(&self, crossing: &Crossing) -> Option<f64> {
        let Crossing { multiplier, depth_m } = *crossing;
        chatter_hz(self.problem, self.rpm, &self.period, multiplier, depth_m)
    }

    /// Error of a multiplier at a crossing: its change between the working and the finer mesh, times a safety factor,
    /// but at least `LEAST_ERROR`.
    fn error(&mut self, crossing: &Crossing) -> Result<f64, StabilityError> {
        let Crossing { multiplier, depth_m } = *crossing;
        let (problem, rpm, deepest_m) = (self.problem, self.rpm, self.deepest_m);
        let finer = self.finer.get_or_insert_with(|| {
            let period = Period::new(problem, rpm, 2.0 * deepest_m, Resolution::FINE);
            Characteristic::new(&period, 2.0 * deepest_m)
        });
        let fine = finer
            .multiplier_near(multiplier, depth_m, 0.05, &mut self.workspace)
            .ok_or(StabilityError::BrokeDown {
                rpm,
                depth_mm: depth_m * 1e3,
                what: NO_FINER,
            })?;
        Ok((MESH_ROOM * (fine - multiplier).norm()).max(LEAST_ERROR))
    }
}
