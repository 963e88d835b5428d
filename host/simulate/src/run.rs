//! Time integration of a model from its initial state.

use super::dense_step::{DenseStep, Motion, Workspace};
use super::error::SimulateError;
use super::integrator::{Integrator, Statistics};
use super::model::Model;
use super::settings::Settings;
use super::workpiece_traverse::WorkpieceTraverse;

impl Model {
    /// Integrates from rest at t = 0 to `end_s`, s; `observe` receives every accepted step in the order of time.
    ///
    /// The local error is controlled (see [`Settings`]). Steps end where the right-hand side is not smooth: for example
    /// where a tooth enters or leaves the arc, loses or regains contact, meets a kink of the surface from one of these
    /// events, or where friction begins to stick.
    ///
    /// # Errors
    /// The motion diverges, the integration takes too many steps, a tooth can neither keep nor lose contact, no regime
    /// of the restoring forces is consistent, or the tool diameter is required and missing.
    pub fn run(
        &self,
        end_s: f64,
        settings: Settings,
        observe: impl FnMut(&DenseStep<'_>),
    ) -> Result<Statistics, SimulateError> {
        self.run_from(vec![0.0; self.order()], end_s, settings, observe)
    }

    /// Integrates from the initial states `y` (see [`Self::order`]), otherwise as [`Self::run`]; before t = 0 the tool
    /// is at rest.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn run_from(
        &self,
        y: Vec<f64>,
        end_s: f64,
        settings: Settings,
        observe: impl FnMut(&DenseStep<'_>),
    ) -> Result<Statistics, SimulateError> {
        if let Some(cutting) = &self.cutting
            && matches!(cutting.traverse, WorkpieceTraverse::Feed { .. })
            && cutting.cutter.radius_m.is_none()
        {
            return Err(SimulateError::NoDiameter);
        }
        Integrator::new(self, settings, y).run(end_s, observe)
    }

    /// Motion at the times `first_s` + k·`every_s` up to `end_s`, s, in the order of k, from the initial states `y`;
    /// otherwise as [`Self::run_from`]. `first_s` is at least 0, `every_s` positive.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn motions_from(
        &self,
        y: Vec<f64>,
        settings: Settings,
        [first_s, every_s, end_s]: [f64; 3],
    ) -> Result<Vec<Motion>, SimulateError> {
        let mut motions: Vec<Motion> = Vec::new();
        let mut workspace = Workspace::new(self);
        self.run_from(y, end_s, settings, |step| {
            loop {
                let t = first_s + motions.len() as f64 * every_s;
                if t > step.to_s() {
                    break;
                }
                motions.push(step.motion(t, &mut workspace));
            }
        })?;
        Ok(motions)
    }
}
