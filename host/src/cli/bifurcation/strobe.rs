//! Stroboscopic bifurcation diagram by integration in time: the displacement of the tool once per tooth passing, over the
//! varied parameter.
//!
//! Each value of the parameter is a cut of its own. The depth grows from 0 over the first tooth passings; when the
//! transient has decayed, the displacement is taken whenever a tooth enters. A forced orbit of the tooth period is one
//! point there, a doubled one two, a torus a closed curve. Loss of contact and the surface of all earlier tooth passings
//! are simulated, as `quietcut simulate` does.

use serde::Serialize;

use super::super::{Error, progress};
use super::request::Request;
use crate::case::Case;
use crate::simulate::{Entry, Settings, SimulateError, VirtualCut, Workspace};
use crate::structure::Form;

/// Tooth passings over which the depth grows from 0. A choice: about ten periods of a vibration near the tooth passing
/// frequency.
const ENTRY_PASSINGS: usize = 100;

/// Tooth passings before the first point. A choice: a Floquet multiplier of 0.99 leaves 0.25 % of a transient after the
/// entry.
const FIRST_PASSING: usize = 700;

/// Points at each value of the parameter. A choice: they fill a closed curve in a chart.
const POINTS: usize = 100;

/// Points of the stroboscopic diagram at one value of the parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct StrobeSet {
    /// Value of the varied parameter.
    #[serde(skip)]
    pub(super) value: f64,
    /// Displacement when a tooth enters, in feed, normal and axial direction, mm, for successive tooth passings; empty
    /// where the motion grows beyond all bounds.
    pub(super) displacement_mm: Vec<[f64; 3]>,
}

/// Simulates cuts at values of the varied parameter.
///
/// # Errors
/// The case cannot be simulated.
pub(super) fn strobe(case: &Case, request: &Request, values: &[f64]) -> Result<Vec<StrobeSet>, Error> {
    let bar = progress::bar(
        Some(values.len() as u64),
        "{spinner} simulated cuts {bar:40} {pos}/{len} {elapsed}",
    );
    let sets = values.iter().map(|&value| {
        let set = at(case, request, value);
        bar.inc(1);
        set
    });
    let sets = sets.collect();
    bar.finish_and_clear();
    sets
}

fn at(case: &Case, request: &Request, value: f64) -> Result<StrobeSet, Error> {
    let setting = request.setting.with(request.vary, value);
    let changed = changed(case, [setting.feed_mm, setting.kappa, setting.nu]);
    let teeth = f64::from(changed.tool()?.teeth as u32);
    let tooth_s = 60.0 / (setting.rpm * teeth);
    let last = FIRST_PASSING + POINTS;
    let cut = VirtualCut {
        entry: Entry::Ramp {
            seconds: ENTRY_PASSINGS as f64 * tooth_s,
        },
        air_s: 0.0,
        ..VirtualCut::new(
            setting.rpm,
            setting.depth_mm,
            (last + 2 * ENTRY_PASSINGS) as f64 * tooth_s,
        )
    };
    let model = cut.model(&changed).map_err(Error::input)?;
    // The orbit's period begins when a tooth enters at the start angle; tooth 1 is at angle 0 at the time 0.
    let entry_s = (changed.cut()?.start_deg / 360.0 * 60.0 / setting.rpm).rem_euclid(tooth_s);
    let (sin, cos) = changed.cut()?.feed_direction_deg.to_radians().sin_cos();
    let mut workspace = Workspace::new(&model);
    let mut displacement_mm = Vec::with_capacity(POINTS);
    let run = model.run((last as f64 + 1.0) * tooth_s, Settings::default(), |step| {
        while displacement_mm.len() < POINTS {
            let passing = FIRST_PASSING + displacement_mm.len();
            let t = passing as f64 * tooth_s + entry_s;
            if t > step.to_s() {
                break;
            }
            let [x, y, z] = step.motion(t, &mut workspace).displacement_m;
            displacement_mm.push([cos * x + sin * y, cos * y - sin * x, z].map(|m| 1e3 * m));
        }
    });
    match run {
        Ok(_) => Ok(StrobeSet {
            value,
            displacement_mm,
        }),
        Err(SimulateError::Diverged { .. }) => Ok(StrobeSet {
            value,
            displacement_mm: Vec::new(),
        }),
        Err(error) => Err(Error::other(error)),
    }
}

/// The case with another feed per tooth, mm, and its cubic stiffness and damping times κ and ν.
fn changed(case: &Case, [feed_mm, kappa, nu]: [f64; 3]) -> Case {
    let mut changed = case.clone();
    if let Some(cut) = &mut changed.cut {
        cut.feed_per_tooth_mm = feed_mm;
    }
    let structure = changed.structure.as_mut();
    if let Some(Form::Matrices(matrices)) = structure.map(|structure| &mut structure.form) {
        matrices.cubic_stiffness = matrices.cubic_stiffness.take().map(|k3| k3 * kappa);
        matrices.cubic_damping = matrices.cubic_damping.take().map(|c3| c3 * nu);
    }
    changed
}
