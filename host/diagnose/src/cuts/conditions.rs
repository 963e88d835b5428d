//! A machine in one recorded cut.

use std::f64::consts::TAU;

use crate::baseline::cubic_term::cubic_term;
use crate::error::DiagnoseError;
use crate::motion::recorded_cut::cut_of;
use crate::orders::reduction::Orders;
use quietcut_model::case::Case;
use quietcut_model::effects::{EffectError, EffectName};
use quietcut_model::milling::Cut;
use quietcut_model::{Cutter, Effects, ModelError};
use quietcut_recording::Recording;
use quietcut_stability::cut_orbit::CutModel;

/// Speed, depth, feed and engagement of a recorded cut.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Conditions {
    /// Spindle frequency, Hz.
    pub spindle_hz: f64,
    /// Axial depth, m.
    pub depth_m: f64,
    /// Engagement and feed.
    pub cut: Cut,
    /// Time, s from the start of the record, at which wear and drift are evaluated.
    pub time_s: f64,
}

impl Conditions {
    /// Those of a recorded cut, in the middle of its reduced part.
    ///
    /// # Errors
    /// The sidecar lacks the axial depth, or the case a cut.
    pub(super) fn of_record(
        case: &Case,
        recording: &Recording,
        orders: &Orders,
    ) -> Result<Self, DiagnoseError> {
        let given = recording.sidecar.cut.unwrap_or_default();
        let depth_mm = given.axial_depth_mm.ok_or_else(|| {
            recording.lacks("axial_depth_mm under [cut] in its sidecar (.toml), the axial depth of the cut")
        })?;
        let edges_s = orders.angle.edges_s();
        Ok(Self {
            spindle_hz: orders.angle.frequency_hz,
            depth_m: 1e-3 * depth_mm,
            cut: cut_of(case, recording)?,
            time_s: 0.5 * (edges_s[0] + edges_s[orders.angle.count()]),
        })
    }
}

/// The machine of `case` with further effects in a cut.
///
/// # Errors
/// The case lacks a section, or an effect does not apply to it or has a memory of its path.
pub(crate) fn cut_model(
    case: &Case,
    effects: &Effects,
    conditions: &Conditions,
) -> Result<CutModel, DiagnoseError> {
    let wrong = |error: ModelError| DiagnoseError::simulate(&case.path, error);
    let structure = case.structure()?;
    let (dynamics, mut restoring_forces) = effects.dynamics(structure).map_err(wrong)?;
    // The periodic orbit integrates internal states; a memory of the path has no derivative.
    if restoring_forces.iter().any(|force| force.remembers()) {
        let error = EffectError::Cut {
            name: EffectName::JointFriction.name(),
            what: "the periodic orbit of a cut has no memory of turning points",
        };
        return Err(wrong(error.into()));
    }
    restoring_forces.extend(cubic_term(structure));
    let cutter = Cutter::new(
        case.tool()?,
        case.material()?,
        &conditions.cut,
        conditions.depth_m,
    )
    .map_err(wrong)?;
    let cutter = effects
        .cutter(cutter.at_speed(60.0 * conditions.spindle_hz))
        .map_err(wrong)?;
    Ok(CutModel {
        structure: dynamics.first_order(),
        restoring_forces,
        cutter,
        rad_per_s: TAU * conditions.spindle_hz,
        time_s: conditions.time_s,
    })
}
