//! Map of a forced problem over a tooth period.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::explicit::{AtNode, Explicit};
use super::forced::ForcedProblem;
use super::parameter::Parameter;
use super::periodic_orbit::{Orbit, PeriodIntegration, PeriodMap, SubintervalNodes};
use super::tooth_period::{ToothPeriod, rates};
use super::variation;
use crate::error::Breakdown;
use crate::spectrum::chatter_frequency::chatter_hz;
use crate::spectrum::period_map;

impl ToothPeriod<'_> {
    /// Newton step over the period, as [`PeriodMap::integrate`], with derivatives with respect to the state at the start
    /// and several parameters.
    pub(super) fn integrate_by(
        &self,
        explicit: &Explicit<'_>,
        start: &DVector<f64>,
        depth_m: f64,
        guess: &[DMatrix<f64>],
    ) -> Option<PeriodIntegration> {
        let (order, count) = (self.size(), explicit.parameters.len());
        let mut integration = PeriodIntegration::from(start.clone(), order + count);
        for (subinterval, guess) in self.subintervals.iter().zip(guess) {
            let rates = rates(self.problem, subinterval, guess, depth_m);
            let forces: Vec<DMatrix<f64>> = rates
                .iter()
                .enumerate()
                .map(|(node, rate)| {
                    let at = AtNode {
                        subinterval,
                        node,
                        state: &guess.as_slice()[node * order..(node + 1) * order],
                        rate,
                        depth_m,
                    };
                    let mut force = DMatrix::zeros(order, order + count);
                    force
                        .columns_mut(order, count)
                        .copy_from(&explicit.columns(self, &at));
                    force
                })
                .collect();
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

    /// All Floquet multipliers about the orbit with given states at the nodes, at an axial depth, largest first.
    ///
    /// # Errors
    /// The linearized equations are singular, or the eigenvalues cannot be computed.
    pub(super) fn multipliers_about(
        &self,
        states: &[DMatrix<f64>],
        depth_m: f64,
    ) -> Result<Vec<Complex64>, Breakdown> {
        let period = variation::about(self, states, depth_m).ok_or(Breakdown::NoSolution)?;
        period_map::multipliers(&period, depth_m)
    }

    /// Vibration frequency of a Floquet multiplier about the orbit with given states at the nodes, at an axial depth,
    /// Hz; `None` if it cannot be computed.
    pub(super) fn chatter_hz_about(
        &self,
        states: &[DMatrix<f64>],
        depth_m: f64,
        multiplier: Complex64,
    ) -> Option<f64> {
        let period = variation::about(self, states, depth_m)?;
        chatter_hz(&self.problem.linear, self.rpm, &period, multiplier, depth_m)
    }
}

impl PeriodMap for ToothPeriod<'_> {
    fn parameter(&self) -> Parameter {
        Parameter::Depth
    }

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
        let depth = Explicit {
            base: self.problem,
            parameters: &[Parameter::Depth],
        };
        self.integrate_by(&depth, start, depth_m, guess)
    }

    fn start_of(&self, state: DVector<f64>, _states: &[DMatrix<f64>]) -> DVector<f64> {
        state
    }

    fn multipliers(&self, orbit: &Orbit) -> Result<Vec<Complex64>, Breakdown> {
        self.multipliers_about(&orbit.states, orbit.value)
    }

    fn chatter_hz(&self, orbit: &Orbit, multiplier: Complex64) -> Option<f64> {
        self.chatter_hz_about(&orbit.states, orbit.value, multiplier)
    }

    fn finer(&self) -> Option<Self> {
        Some(Self::with_subintervals(
            self.problem,
            self.rpm,
            0.5 * self.subinterval_angle,
        ))
    }
}
