//! Tests of the simulation: closed forms, a brute-force integration, facts of chapter 6.

mod brute_force;
mod closed_form;
mod facts;
mod milling_rigs;
mod sensors;

use super::*;
use quietcut_model::case::Case;
pub(crate) use quietcut_testkit::case;

/// The tool of thesis chapter 6 in a slot, 1 mm deep.
pub(super) fn slot_cutter() -> Cutter {
    cutter(&case("kuka-kr90-full"), 1.0)
}

/// The tool of thesis chapter 7 at half immersion in acetal, 1 mm deep.
pub(super) fn acetal_cutter() -> Cutter {
    cutter(&case("kuka-kr90-acetal"), 1.0)
}

fn cutter(case: &Case, depth_mm: f64) -> Cutter {
    let (tool, material, cut) = (
        case.tool().unwrap(),
        case.material().unwrap(),
        case.cut().unwrap(),
    );
    let mut cutter = Cutter::new(tool, material, cut, 1e-3 * depth_mm).unwrap();
    cutter.axial_depth_modulation = case.axial_depth_modulation();
    cutter
}

/// Model of a cut of `case` with full engagement from the start.
fn steady(case: &Case, spindle_rpm: f64, depth_mm: f64) -> Model {
    Model {
        dynamics: Dynamics::new(case.structure().unwrap()).unwrap(),
        cutting: Some(Cutting {
            cutter: cutter(case, depth_mm),
            spindle: Spindle::new(spindle_rpm),
            traverse: WorkpieceTraverse::Steady,
            regeneration: Regeneration::AllPasses,
            pores: None,
        }),
        drive: None,
        restoring_forces: Vec::new(),
    }
}

/// The motion at the times `first_s + k·every_s` up to `end_s`, s, from rest.
fn motions(model: &Model, settings: Settings, first_s: f64, every_s: f64, end_s: f64) -> Vec<Motion> {
    let at_rest = vec![0.0; model.dynamics.order()];
    motions_from(model, at_rest, settings, first_s, every_s, end_s)
}

fn motions_from(
    model: &Model,
    states: Vec<f64>,
    settings: Settings,
    first_s: f64,
    every_s: f64,
    end_s: f64,
) -> Vec<Motion> {
    model
        .motions_from(states, settings, [first_s, every_s, end_s])
        .unwrap()
}

fn exact(relative: f64) -> Settings {
    Settings {
        absolute_m: 1e-4 * relative,
        relative,
        largest_m: f64::INFINITY,
        ..Settings::default()
    }
}
