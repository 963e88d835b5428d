//! Runs a model from its initial state to an end.

use super::error::SimulateError;
use super::integrator::{Integrator, Statistics};
use super::model::Model;
use super::passage::Passage;
use super::segment::Segment;
use super::settings::Settings;

impl Model {
    /// Integrates from t = 0, the structure at rest, to `end_s`; `observe` sees every stretch of the motion in order.
    ///
    /// The error per step is controlled (see [`Settings`]); steps end exactly where a tooth enters, leaves, loses or
    /// finds contact, and where the surface in front of a tooth has a kink from one of these.
    ///
    /// # Errors
    /// The motion diverges; a tooth neither cuts nor leaves the surface; the size of the tool is needed and unknown.
    pub fn run(
        &self,
        end_s: f64,
        settings: Settings,
        observe: impl FnMut(&Segment<'_>),
    ) -> Result<Statistics, SimulateError> {
        self.run_from(vec![0.0; self.order()], end_s, settings, observe)
    }

    /// As [`Self::run`], from the states `y` (see [`Self::order`]); before t = 0 the tool was at rest.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn run_from(
        &self,
        y: Vec<f64>,
        end_s: f64,
        settings: Settings,
        observe: impl FnMut(&Segment<'_>),
    ) -> Result<Statistics, SimulateError> {
        if let Some(cutting) = &self.cutting
            && matches!(cutting.passage, Passage::Feed { .. })
            && cutting.cutter.radius_m.is_none()
        {
            return Err(SimulateError::NoDiameter);
        }
        Integrator::new(self, settings, y).run(end_s, observe)
    }
}
