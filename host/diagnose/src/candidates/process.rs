//! What a cutting process may have otherwise: every one changes the force of the cut along the measured motion.
//!
//! The force with the cause is that of the simulation's own [`Cutter`](quietcut_simulate::Cutter) and
//! [`ForceLaw`](quietcut_simulate::ForceLaw). What it adds is filtered by the structure where motion is compared, and compared
//! as it is where the force was measured.

use crate::candidates::cause::{Location, Regressor};
use crate::motion::cut_force::CutForce;
use crate::records::cutting::Cutting;
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_simulate::Cutter;

/// The whole cut, where the scene has one that is not known to have the cause already.
pub(super) fn everywhere(study: &Study<'_>, name: &str) -> Vec<Location> {
    let known = study.baseline.case.extensions.contains_key(name);
    if known || cutter(study).is_none() {
        Vec::new()
    } else {
        vec![Location::Everywhere]
    }
}

/// The tool of the first cut of a scene.
pub(super) fn cutter<'a>(study: &'a Study<'_>) -> Option<&'a Cutter> {
    study
        .records
        .iter()
        .find_map(|record| Some(&record.cut.as_ref()?.cut.cutter))
}

/// True where the axial direction is part of the cut: it moves, or its force is seen.
pub(super) fn has_axial(study: &Study<'_>) -> bool {
    study.baseline.axes.contains(&2)
}

/// What a cut adds per unit when its tool changes from `before` to `after`, `over` units apart; nothing in a record without a
/// cut.
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

/// What a cut adds per unit when its tool changes from the one that is believed.
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

/// A step that stands for a size that may vanish.
pub(super) fn step(size: f64, least: f64) -> f64 {
    if size.abs() < least { least } else { size }
}
