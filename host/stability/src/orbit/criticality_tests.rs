//! Criticality of losses of the robot of chapter 6 against integration in time.

use quietcut_model::case::Case;
use quietcut_model::structure::Form;
use quietcut_simulate::{Entry, Regeneration, Settings, SimulateError, VirtualCut, Workspace};

use super::branch::{Event, Extent};
use super::branches::{follow, multiplier_at};
use super::criticality::{Criticality, criticality};
use super::forced::ForcedProblem;
use super::parameter::Parameter;

/// Spindle speed, rev/min, of a tooth period τ in the dimensionless units of chapter 6.
fn rpm(tau: f64) -> f64 {
    30.0 * 109.641_6 / tau
}

/// The robot of chapter 6 with cubic stiffness times κ.
fn robot(kappa: f64) -> Case {
    let mut case = quietcut_testkit::case("kuka-kr90-full-cubic");
    let Form::Matrices(matrices) = &mut case.structure.as_mut().unwrap().form else {
        panic!("matrices are needed");
    };
    matrices.cubic_stiffness = matrices.cubic_stiffness.take().map(|k3| k3 * kappa);
    case
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
/// passings, by integration in time without loss of contact, after the depth has grown over `ramp` passings; fewer windows if
/// the motion escapes.
fn spreads(case: &Case, rpm: f64, depth_mm: f64, [ramp, windows]: [usize; 2]) -> Vec<[f64; 2]> {
    const WINDOW: usize = 200;
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
fn look_at_losses() {
    for kappa in [1.0, -1.0] {
        let case = robot(kappa);
        let problem = ForcedProblem::new(&case).unwrap();
        for tau in [1.34, 2.0, 2.7, 2.9, 3.13, 4.0, 5.0, 6.0, 6.4, 6.6] {
            let (event, found) = first_loss(&problem, rpm(tau));
            println!(
                "{kappa} τ {tau}: {:?} at {} mm, {found:?}",
                event.kind, event.value
            );
        }
    }
    for (kappa, tau) in [
        (1.0, 4.0),
        (-1.0, 4.0),
        (1.0, 3.13),
        (-1.0, 3.13),
        (1.0, 6.4),
        (1.0, 2.9),
    ] {
        let case = robot(kappa);
        let problem = ForcedProblem::new(&case).unwrap();
        let (event, found) = first_loss(&problem, rpm(tau));
        for share in [0.98, 1.01, 1.02] {
            let depth_mm = event.value * share;
            let [_, fine] = multiplier_at(&problem, rpm(tau), depth_mm).unwrap();
            let excess = fine.multiplier.norm() - 1.0;
            let wanted = found.spread_mm(excess);
            let simulated = spreads(&case, rpm(tau), depth_mm, [20, 15]);
            println!(
                "{kappa} τ {tau} {share}: excess {excess:.2e} predicted {wanted:?}, simulated {:?} … {:?}",
                simulated.first(),
                simulated.last()
            );
        }
    }
}
