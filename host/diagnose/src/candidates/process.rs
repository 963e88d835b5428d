//! Causes in the cutting process: each changes the cutting force along the measured motion.
//!
//! The simulation's own [`Cutter`](quietcut_simulate::Cutter) and [`ForceLaw`](quietcut_simulate::ForceLaw) compute the
//! force with the cause. The difference from the cutting force of the baseline, filtered by the receptance of the
//! baseline, is the contribution to a channel of motion; the difference itself is that to a channel of force.

use crate::candidates::cause::{Location, Regressor};
use crate::motion::cut_force::CutForce;
use crate::records::cutting::Cutting;
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_simulate::Cutter;

/// Location of a cause in the cutting process: the whole machine. Empty if the study has no cut, or if the case already
/// has an extension with the cause's name.
pub(super) fn everywhere(study: &Study<'_>, name: &str) -> Vec<Location> {
    let known = study.baseline.case.extensions.contains_key(name);
    if known || cutter(study).is_none() {
        Vec::new()
    } else {
        vec![Location::Everywhere]
    }
}

/// The cutter (teeth, geometry and force law) of the first cut of the study; `None` without a cut.
pub(super) fn cutter<'a>(study: &'a Study<'_>) -> Option<&'a Cutter> {
    study
        .records
        .iter()
        .find_map(|record| Some(&record.cut.as_ref()?.cut.cutter))
}

/// True if the structure moves along the axial direction z.
pub(super) fn has_axial(study: &Study<'_>) -> bool {
    study.baseline.axes.contains(&2)
}

/// Regressor of a parameter of the cutter: the cutting force with the cutter changed by `after` minus that with the
/// cutter changed by `before`, divided by the parameter change `over`; empty for a record without a cut.
pub(super) fn added(
    record: &Record,
    before: impl Fn(&mut Cutter),
    after: impl Fn(&mut Cutter),
    over: f64,
) -> Regressor {
    let Some(cut) = &record.cut else {
        return Regressor::default();
    };
    let (before, after) = (with(record, cut, before), with(record, cut, after));
    Regressor::of_cut(after.difference(&before, over))
}

/// Regressor of a parameter of the cutter: the cutting force with the cutter changed by `after` minus that of the
/// baseline, divided by the parameter change `over`; empty for a record without a cut.
pub(super) fn changed(record: &Record, after: impl Fn(&mut Cutter), over: f64) -> Regressor {
    let Some(cut) = &record.cut else {
        return Regressor::default();
    };
    Regressor::of_cut(with(record, cut, after).difference(&cut.force, over))
}

pub(super) fn with(record: &Record, cut: &Cutting, change: impl Fn(&mut Cutter)) -> CutForce {
    let mut cutter = cut.cut.cutter.clone();
    change(&mut cutter);
    cut.force_of(&cutter, &record.motion)
}

/// Step of a finite difference: `size`, or `least` if the magnitude of `size` is smaller.
pub(super) fn step(size: f64, least: f64) -> f64 {
    if size.abs() < least { least } else { size }
}
