//! Map of a forced problem over a tooth period.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::forced::ForcedProblem;
use super::periodic_orbit::{Orbit, PeriodIntegration, PeriodMap, SubintervalNodes};
use super::tooth_period::{ToothPeriod, per_depth, rates};
use super::variation;
use crate::error::Breakdown;
use crate::spectrum::chatter_frequency::chatter_hz;
use crate::spectrum::period_map;

impl PeriodMap for ToothPeriod<'_> {
    fn problem(&self) -> &ForcedProblem {
        self.problem
    }

    fn size(&self) -> usize {
        self.problem.order()
    }

    fn subinterval_nodes(&self) -> Vec<SubintervalNodes<'_>> {
        let mut start_s = 0.0;
        let nodes = self.subintervals.iter().map(|subinterval| {
            let nodes_here = SubintervalNodes {
                start_s,
                duration_s: subinterval.duration,
                gauss: &self.gauss,
            };
            start_s += subinterval.duration;
            nodes_here
        });
        nodes.collect()
    }

    fn integrate(
        &self,
        start: &DVector<f64>,
        depth_m: f64,
        guess: &[DMatrix<f64>],
    ) -> Option<PeriodIntegration> {
        let order = self.size();
        let structure = &self.problem.linear.structure;
        let mut integration = PeriodIntegration::from(start.clone(), order + 1);
        for (subinterval, guess) in self.subintervals.iter().zip(guess) {
            let forces: Vec<DMatrix<f64>> = (0..guess.ncols())
                .map(|node| {
                    let mut force = DMatrix::zeros(order, order + 1);
                    force.set_column(order, &per_depth(structure, subinterval, guess, node));
                    force
                })
                .collect();
            let rates = rates(self.problem, subinterval, guess, depth_m);
            let linearized = self.linearized(subinterval, guess, depth_m);
            integration.take(linearized.advance(
                &integration.end,
                &integration.by,
                guess,
                &rates,
                &forces,
            )?);
        }
        Some(integration)
    }

    fn start_of(&self, state: DVector<f64>, _states: &[DMatrix<f64>]) -> DVector<f64> {
        state
    }

    fn multipliers(&self, orbit: &Orbit) -> Result<Vec<Complex64>, Breakdown> {
        let period = variation::about(self, orbit).ok_or(Breakdown::NoSolution)?;
        period_map::multipliers(&period, orbit.depth_m)
    }

    fn chatter_hz(&self, orbit: &Orbit, multiplier: Complex64) -> Option<f64> {
        let period = variation::about(self, orbit)?;
        chatter_hz(&self.problem.linear, self.rpm, &period, multiplier, orbit.depth_m)
    }

    fn finer(&self) -> Option<Self> {
        Some(Self::with_subintervals(
            self.problem,
            self.rpm,
            0.5 * self.subinterval_angle,
        ))
    }
}
