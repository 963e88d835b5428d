//! Criticality of losses of the robot of chapter 6, from the normal form, against integration in time.

#![allow(clippy::unwrap_used)]

use quietcut::case::Case;
use quietcut::orbit::{Criticality, Event, Extent, ForcedProblem, Parameter, criticality, follow};
use quietcut::simulate::{Entry, Regeneration, Settings, SimulateError, VirtualCut, Workspace};
use quietcut::stability::StabilityLoss;
use quietcut_tests::command::cases;

/// Spindle speed, rev/min, of a tooth period τ in the dimensionless units of chapter 6.
fn rpm(tau: f64) -> f64 {
    30.0 * 109.641_6 / tau
}

fn case(name: &str) -> Case {
    Case::read(cases().join(format!("{name}.toml"))).unwrap()
}

fn robot() -> Case {
    case("kuka-kr90-full-cubic")
}

/// Largest Floquet multiplier of the forced orbit at a depth, less 1.
fn excess(problem: &ForcedProblem, rpm: f64, depth_mm: f64) -> f64 {
    let setting = problem.setting(rpm, 0.0);
    let branch = follow(problem, setting, Parameter::Depth, [0.0, depth_mm], Extent::Whole).unwrap();
    let last = branch.points.last().unwrap();
    assert!((last.value / depth_mm - 1.0).abs() < 1e-12);
    last.multiplier_abs - 1.0
}

fn first_loss(problem: &ForcedProblem, rpm: f64) -> (Event, Criticality) {
    let setting = problem.setting(rpm, 0.0);
    let range = [0.0, 15.0];
    let branch = follow(problem, setting, Parameter::Depth, range, Extent::FirstLoss).unwrap();
    let event = branch.events.into_iter().find(|event| !event.gain).unwrap();
    let found = criticality(problem, setting, Parameter::Depth, range, &event).unwrap();
    (event, found)
}

/// Half the range of the displacements in feed and normal direction, mm, when a tooth enters, over windows of 200 tooth
/// passings, by integration in time without loss of contact, after the depth has grown over one passing; fewer windows if the
/// motion escapes.
fn spreads(case: &Case, rpm: f64, depth_mm: f64, windows: usize) -> Vec<[f64; 2]> {
    const WINDOW: usize = 200;
    let ramp = 1;
    let tooth_s = 30.0 / rpm;
    let last = ramp + windows * WINDOW;
    let cut = VirtualCut {
        entry: Entry::Ramp {
            seconds: ramp as f64 * tooth_s,
        },
        air_s: 0.0,
        ..VirtualCut::new(rpm, depth_mm, (last + 2 * ramp + 2) as f64 * tooth_s)
    };
    let mut model = cut.model(case).unwrap();
    model.cutting.as_mut().unwrap().regeneration = Regeneration::LastPass;
    let mut workspace = Workspace::new(&model);
    let mut strobe: Vec<[f64; 3]> = Vec::new();
    let run = model.run(last as f64 * tooth_s, Settings::default(), |step| {
        while (strobe.len() + ramp) as f64 * tooth_s <= step.to_s() {
            let t = (strobe.len() + ramp) as f64 * tooth_s;
            strobe.push(step.motion(t, &mut workspace).displacement_m);
        }
    });
    assert!(
        matches!(run, Ok(_) | Err(SimulateError::Diverged { .. })),
        "{run:?}"
    );
    let of_window = |window: &[[f64; 3]]| {
        [0, 1].map(|axis| {
            let values = || window.iter().map(|at| at[axis]);
            let high = values().fold(f64::NEG_INFINITY, f64::max);
            500.0 * (high - values().fold(f64::INFINITY, f64::min))
        })
    };
    strobe.chunks_exact(WINDOW).map(of_window).collect()
}

#[test]
fn the_vibration_beyond_a_supercritical_torus_has_the_size_of_the_normal_form() {
    let robot = robot();
    let problem = ForcedProblem::new(&robot).unwrap();
    let speed = rpm(4.0);
    let (event, found) = first_loss(&problem, speed);
    assert!(found.is_supercritical(), "{found:?}");
    let depth_mm = 1.02 * event.value;
    let predicted = found.spread_mm(excess(&problem, speed, depth_mm)).unwrap();
    let simulated = spreads(&robot, speed, depth_mm, 25);
    let last = simulated.last().unwrap();
    println!("predicted {predicted:?} mm, simulated {last:?} mm");
    assert_eq!(simulated.len(), 25);
    for axis in 0..2 {
        // The normal form holds for small vibrations; the next order changes them by a few percent 2 % beyond the loss.
        assert!(
            (last[axis] / predicted[axis] - 1.0).abs() < 0.1,
            "{last:?} {predicted:?}"
        );
    }
    // Before the loss there is no vibration.
    assert_eq!(found.spread_mm(-1e-3), None);
}

#[test]
fn beyond_a_subcritical_torus_the_motion_escapes() {
    let robot = robot();
    let problem = ForcedProblem::new(&robot).unwrap();
    let speed = rpm(6.0);
    let (event, found) = first_loss(&problem, speed);
    assert!(
        !found.is_supercritical() && found.spread_mm(-1e-3).is_some(),
        "{found:?}"
    );
    let beyond = spreads(&robot, speed, 1.005 * event.value, 20);
    assert!(beyond.len() < 20, "{beyond:?}");
}

#[test]
fn the_flip_of_the_robot_is_supercritical_and_a_linear_structure_has_no_criticality() {
    let problem = ForcedProblem::new(&robot()).unwrap();
    let (event, found) = first_loss(&problem, rpm(3.13));
    assert_eq!(event.kind, StabilityLoss::Flip);
    assert!(found.is_supercritical(), "{found:?}");
    let linear = ForcedProblem::new(&case("kuka-kr90-full")).unwrap();
    let setting = linear.setting(rpm(4.0), 0.0);
    let range = [0.0, 15.0];
    let branch = follow(&linear, setting, Parameter::Depth, range, Extent::FirstLoss).unwrap();
    let none = criticality(&linear, setting, Parameter::Depth, range, &branch.events[0]);
    assert_eq!(none, None);
}
