//! Map of a forced problem over a tooth period, with any of the cutting parameters varied.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::explicit::Explicit;
use super::follower::orbit_at_depth;
use super::forced::ForcedProblem;
use super::parameter::{Parameter, Setting};
use super::periodic_orbit::{Orbit, OrbitError, PeriodIntegration, PeriodMap, SubintervalNodes};
use super::tooth_period::{SUBINTERVAL_ANGLE, ToothPeriod};
use crate::error::Breakdown;

/// Tooth period of a setting, of which one parameter varies.
///
/// The mesh is that of the slowest spindle speed, so that it does not change along a branch.
pub(super) struct VariedPeriod<'a> {
    base: &'a ForcedProblem,
    setting: Setting,
    parameter: Parameter,
    /// Slowest spindle speed, rev/min.
    slowest_rpm: f64,
    subinterval_angle: f64,
    /// Period at the setting: its mesh, relative to the period, is that of all others.
    mesh: ToothPeriod<'a>,
}

impl<'a> VariedPeriod<'a> {
    /// Period of a setting, of which `parameter` varies over a range in the unit of results.
    pub(super) fn new(
        base: &'a ForcedProblem,
        setting: Setting,
        parameter: Parameter,
        range: [f64; 2],
    ) -> Self {
        let slowest_rpm = match parameter {
            Parameter::Rpm => range[0].min(range[1]),
            _ => setting.rpm,
        };
        Self::on_mesh_of(slowest_rpm, base, setting, parameter, SUBINTERVAL_ANGLE)
    }

    fn on_mesh_of(
        slowest_rpm: f64,
        base: &'a ForcedProblem,
        setting: Setting,
        parameter: Parameter,
        subinterval_angle: f64,
    ) -> Self {
        Self {
            base,
            setting,
            parameter,
            slowest_rpm,
            subinterval_angle,
            mesh: ToothPeriod::on_mesh_of(slowest_rpm, base, slowest_rpm, subinterval_angle),
        }
    }

    /// Forced problem with the factors κ = ν = 1.
    pub(super) fn base(&self) -> &'a ForcedProblem {
        self.base
    }

    /// Setting at a value of the parameter.
    pub(super) fn at(&self, value: f64) -> Setting {
        self.setting.at(self.parameter, value)
    }

    /// Forced problem at a setting.
    pub(super) fn problem_at(&self, setting: &Setting) -> ForcedProblem {
        self.base.at(setting)
    }

    /// Tooth period of a problem at a setting.
    pub(super) fn period<'b>(&self, problem: &'b ForcedProblem, setting: &Setting) -> ToothPeriod<'b> {
        ToothPeriod::on_mesh_of(self.slowest_rpm, problem, setting.rpm, self.subinterval_angle)
    }

    /// The orbit at a setting, reached by continuation in depth from depth 0.
    ///
    /// # Errors
    /// The orbit cannot be followed to the depth of the setting.
    pub(super) fn first_orbit(&self, setting: Setting) -> Result<Orbit, OrbitError> {
        let problem = self.problem_at(&setting);
        let period = self.period(&problem, &setting);
        let orbit = orbit_at_depth(period, setting.rpm, setting.depth_m())?;
        Ok(Orbit {
            value: setting.get(self.parameter) * self.parameter.result_unit(),
            ..orbit
        })
    }
}

impl PeriodMap for VariedPeriod<'_> {
    fn parameter(&self) -> Parameter {
        self.parameter
    }

    fn problem(&self) -> &ForcedProblem {
        self.base
    }

    fn size(&self) -> usize {
        self.base.order()
    }

    fn subinterval_nodes(&self) -> Vec<SubintervalNodes<'_>> {
        self.mesh.subinterval_nodes()
    }

    fn integrate(
        &self,
        start: &DVector<f64>,
        value: f64,
        guess: &[DMatrix<f64>],
    ) -> Option<PeriodIntegration> {
        let setting = self.at(value);
        let problem = self.problem_at(&setting);
        let explicit = Explicit {
            base: self.base,
            parameters: &[self.parameter],
        };
        self.period(&problem, &setting)
            .integrate_by(&explicit, start, setting.depth_m(), guess)
    }

    fn start_of(&self, state: DVector<f64>, _states: &[DMatrix<f64>]) -> DVector<f64> {
        state
    }

    fn multipliers(&self, orbit: &Orbit) -> Result<Vec<Complex64>, Breakdown> {
        let setting = self.at(orbit.value);
        let problem = self.problem_at(&setting);
        self.period(&problem, &setting)
            .multipliers_about(&orbit.states, setting.depth_m())
    }

    fn chatter_hz(&self, orbit: &Orbit, multiplier: Complex64) -> Option<f64> {
        let setting = self.at(orbit.value);
        let problem = self.problem_at(&setting);
        self.period(&problem, &setting)
            .chatter_hz_about(&orbit.states, setting.depth_m(), multiplier)
    }

    fn finer(&self) -> Option<Self> {
        Some(Self::on_mesh_of(
            self.slowest_rpm,
            self.base,
            self.setting,
            self.parameter,
            0.5 * self.subinterval_angle,
        ))
    }
}
