//! The flank rubs on the wave just cut: −(C/V)·b·v_n on the edge, V the cutting speed.
//!
//! Shows: damping that grows with depth and with 1/speed, in the direction normal to the edge. Does not show: anything at standstill,
//! where damping of the structure would. At one speed and depth it is damping.
//! Fit: linear in C, along the measured velocity. Source: Altintas, Eynian and Onozuka, CIRP Annals 57 (2008).

use super::{changed, cutter, everywhere};
use crate::candidates::cause::{Cause, Parameter, Place, Regressor};
use crate::records::record::Record;
use crate::records::study::Scene;
use quietcut_simulate::ProcessDamping;

pub(super) struct OfFlank;

impl Cause for OfFlank {
    fn name(&self) -> &'static str {
        "process-damping"
    }

    fn places(&self, scene: &Scene<'_>) -> Vec<Place> {
        // Without the diameter the cutting speed is not known.
        if cutter(scene).is_some_and(|cutter| cutter.radius_m.is_some()) {
            everywhere(scene, self.name())
        } else {
            Vec::new()
        }
    }

    fn regressors(&self, _: &Scene<'_>, record: &Record, _: &Place, _: &[f64]) -> Option<Vec<Regressor>> {
        let unit = ProcessDamping {
            n_per_m: 1.0,
            friction: 0.0,
        };
        Some(vec![changed(
            record,
            |cutter| cutter.force.process_damping = Some(unit),
            1.0,
        )])
    }

    fn parameters(
        &self,
        _: &Scene<'_>,
        _: &Place,
        _: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        // A flank takes energy.
        coefficients
            .first()
            .filter(|damping| **damping > 0.0)
            .map(|damping| vec![("process_damping_n_per_m", *damping)])
    }
}
