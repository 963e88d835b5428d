//! The flank rubs on the wave that the edge has just cut: a force −(C/V)·b·v_n on the edge along the chip thickness,
//! with the axial depth b, the cutting speed V and the velocity v_n of the edge in that direction.
//!
//! Shows: damping that grows with axial depth and with 1/(spindle speed), in the direction normal to the edge. Does not
//! show: anything without cutting, unlike damping of the structure. At one spindle speed and axial depth it is
//! equivalent to damping of the structure. Fit: linear in C, along the measured motion. Source: Altintas, Eynian and
//! Onozuka, CIRP Annals 57 (2008).

use super::process::{changed, cutter, everywhere};
use crate::candidates::cause::{Cause, Location, Parameter, Regressors};
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::effects::EffectName;
use quietcut_simulate::ProcessDamping;

pub(super) struct ProcessDampingCause;

impl Cause for ProcessDampingCause {
    fn effect(&self) -> EffectName {
        EffectName::ProcessDamping
    }

    fn locations(&self, study: &Study<'_>) -> Vec<Location> {
        // Without the diameter of the tool the cutting speed V of the force −(C/V)·b·v_n is not known.
        if cutter(study).is_some_and(|cutter| cutter.radius_m.is_some()) {
            everywhere(study, self.name())
        } else {
            Vec::new()
        }
    }

    fn regressors(&self, _: &Study<'_>, record: &Record, _: &Location, _: &[f64]) -> Regressors {
        let unit = ProcessDamping {
            n_per_m: 1.0,
            friction: 0.0,
        };
        Ok(vec![changed(
            record,
            |cutter| cutter.force.process_damping = Some(unit),
            1.0,
        )])
    }

    fn parameters(
        &self,
        _: &Study<'_>,
        _: &Location,
        _: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        // A rubbing flank dissipates energy: C is positive.
        coefficients
            .first()
            .filter(|damping| **damping > 0.0)
            .map(|damping| vec![("process_damping_n_per_m", *damping)])
    }
}
