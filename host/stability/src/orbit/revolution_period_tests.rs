//! Orbits and Floquet multipliers of unequal teeth against equal teeth, time integration and the linear problem.

use nalgebra::DVector;

use super::branch::Extent;
use super::branches::{follow_depth, orbit_at};
use super::forced::{ForcedProblem, Uneven};
use super::periodic_orbit::{Orbit, PeriodMap};
use super::revolution_period::*;
use crate::limits::method::Method;
use crate::limits::speed_line::SpeedLine;
use crate::methods::revolution_collocation::RevolutionCollocation;
use crate::problem::linear::CubicTerms;
use crate::problem::pitched::Pitched;
use crate::spectrum::stability_loss::StabilityLoss;
use quietcut_model::case::Case;
use quietcut_simulate::{Regeneration, Settings, VirtualCut};
use quietcut_testkit::case;

/// The same problem with the revolution in place of the tooth period as its period.
fn over_revolution(mut problem: ForcedProblem) -> ForcedProblem {
    problem.uneven = Some(Uneven {
        pitched: Pitched::from(problem.linear.clone()).over_revolution(),
        runout_m: vec![0.0; problem.linear.teeth],
    });
    problem
}

/// Robot of chapter 6 with cubic terms and two teeth at these pitch angles, degrees.
fn uneven_robot(pitch_deg: [f64; 2]) -> Case {
    let mut case = case("kuka-kr90-half-cubic");
    case.tool.as_mut().unwrap().pitch_deg = pitch_deg.to_vec();
    case
}

fn first_limit(line: &SpeedLine) -> crate::Limit {
    line.first_limit.unwrap()
}

#[test]
fn limits_of_equal_teeth_over_the_revolution_are_those_over_the_tooth_period() {
    // The third case has a fold of the orbit.
    for (name, rpm, depth_mm) in [
        ("kuka-kr90-half-cubic", 526.0, 16.0),
        ("kuka-kr90-half-cubic", 800.0, 8.0),
        ("kuka-kr90-full-cubic", 536.1, 12.0),
        ("kuka-kr90-half-cubic", 559.0, 16.0),
    ] {
        let per_tooth = ForcedProblem::new(&case(name)).unwrap();
        let per_turn = over_revolution(per_tooth.clone());
        let limit = |problem: &ForcedProblem| {
            let branch = follow_depth(problem, rpm, depth_mm, Extent::FirstLoss).unwrap();
            first_limit(&branch.speed_line())
        };
        let (tooth, turn) = (limit(&per_tooth), limit(&per_turn));
        println!("{rpm} rev/min: {tooth:?} {turn:?}");
        let both_mm = tooth.error_mm.unwrap() + turn.error_mm.unwrap();
        assert!((tooth.depth_mm - turn.depth_mm).abs() < both_mm, "{rpm}");
        // The sum of both stated errors is small enough for a comparison to more than four digits.
        assert!(both_mm < 1e-5 * tooth.depth_mm, "{rpm}: {both_mm}");
        assert_eq!(tooth.kind, turn.kind);
        match (tooth.chatter_hz, turn.chatter_hz) {
            (Some(tooth_hz), Some(turn_hz)) => assert!((tooth_hz / turn_hz - 1.0).abs() < 1e-6),
            (tooth_hz, turn_hz) => {
                assert_eq!((tooth_hz, turn_hz, tooth.kind), (None, None, StabilityLoss::Fold))
            }
        }
    }
    let per_tooth = ForcedProblem::new(&case("kuka-kr90-half-cubic")).unwrap();
    let per_turn = over_revolution(per_tooth.clone());
    let [tooth, turn] = [&per_tooth, &per_turn].map(|problem| problem.point(559.0, 9.0).unwrap());
    let difference = tooth.multiplier_abs.powi(2) - turn.multiplier_abs;
    assert!(difference.abs() < 2.0 * tooth.error + turn.error, "{difference}");
}

#[test]
fn where_the_orbit_is_small_unequal_teeth_have_the_limits_of_the_linear_problem() {
    // At a ten-thousandth of the feed the orbit is so small that cubic terms, which scale with its square, vanish.
    let mut small = uneven_robot([170.0, 190.0]);
    small.cut.as_mut().unwrap().feed_per_tooth_mm *= 1e-4;
    let linear = RevolutionCollocation {
        pitched: Pitched::new(&small, CubicTerms::LeaveOut).unwrap(),
    };
    let forced = ForcedProblem::new(&small).unwrap();
    for rpm in [700.0, 900.0] {
        let expected = first_limit(&linear.line(rpm, 12.0, 40).unwrap());
        let branch = follow_depth(&forced, rpm, 12.0, Extent::FirstLoss).unwrap();
        let found = first_limit(&branch.speed_line());
        println!("{rpm} rev/min: {expected:?} {found:?}");
        assert_eq!(found.kind, expected.kind);
        assert!((found.depth_mm / expected.depth_mm - 1.0).abs() < 1e-6, "{rpm}");
    }
}

/// Displacement, m, at the entry of tooth 0 after `turns` revolutions of time integration from rest.
fn settled(case: &Case, rpm: f64, depth_mm: f64, turns: usize, regeneration: Regeneration) -> [f64; 3] {
    let cut = VirtualCut {
        entry: quietcut_simulate::Entry::None,
        ..VirtualCut::new(rpm, depth_mm, 1.0)
    };
    let mut model = cut.model(case).unwrap();
    model.cutting.as_mut().unwrap().regeneration = regeneration;
    let turn_s = 60.0 / rpm;
    let at_s = turn_s * (turns as f64 + case.cut().unwrap().start_deg / 360.0);
    let mut found = [0.0; 3];
    let mut room = quietcut_simulate::Workspace::new(&model);
    let settings = Settings {
        absolute_m: 1e-14,
        relative: 1e-10,
        largest_m: 0.1,
        ..Settings::default()
    };
    model
        .run(at_s + 0.1 * turn_s, settings, |segment| {
            if segment.to_s() >= at_s && found == [0.0; 3] {
                found = segment.motion(at_s, &mut room).displacement_m;
            }
        })
        .unwrap();
    found
}

/// Displacement of the orbit at the start of the revolution, m.
fn at_start(case: &Case, rpm: f64, depth_mm: f64) -> [f64; 3] {
    let problem = ForcedProblem::new(case).unwrap();
    let orbit = orbit_at(&problem, rpm, depth_mm).unwrap();
    let order = problem.order();
    (&problem.linear.structure.c * orbit.start.rows(0, order)).into()
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let square: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
    square.sqrt()
}

#[test]
fn the_orbits_of_unequal_pitch_and_of_runout_are_what_integration_in_time_settles_to() {
    let mut runs_out = case("kuka-kr90-half-cubic");
    runs_out.tool.as_mut().unwrap().runout = Some(quietcut_model::milling::Runout {
        offset_um: 40.0,
        angle_deg: 30.0,
    });
    let equal = case("kuka-kr90-half-cubic");
    for (name, case) in [("pitch", uneven_robot([165.0, 195.0])), ("runout", runs_out)] {
        let (rpm, depth_mm) = (550.0, 5.0);
        let orbit = at_start(&case, rpm, depth_mm);
        let time = settled(&case, rpm, depth_mm, 400, Regeneration::LastPass);
        let surface = settled(&case, rpm, depth_mm, 400, Regeneration::AllPasses);
        let size = distance(orbit, [0.0; 3]);
        let unlike = distance(orbit, at_start(&equal, rpm, depth_mm)) / size;
        println!(
            "{name}: {orbit:?}, in time {time:?}, with loss of contact {surface:?}; from equal teeth {unlike:.3}"
        );
        // Tolerance: the remaining transient, and time steps accurate to 1e-10.
        assert!(distance(orbit, time) < 1e-6 * size, "{name}");
        assert!(unlike > 0.01, "{name}");
    }
}

#[test]
fn linear_structures_with_unequal_pitch_and_chip_laws_with_runout_are_refused() {
    let read = |name: &str, from: &str, to: &str, extension: &str| {
        let path = format!("{}/../../tests/cases/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(&path).unwrap().replace(from, to);
        Case::parse(path.as_ref(), &format!("{text}\n{extension}")).unwrap()
    };
    let flank = read(
        "kuka-kr90-half",
        "teeth = 2",
        "teeth = 2\npitch_deg = [170.0, 190.0]",
        "[extension.process-damping]\nprocess_damping_n_per_m = 3e4\n",
    );
    let chip = read(
        "kuka-kr90-half-cubic",
        "teeth = 2",
        "teeth = 2",
        "[extension.runout]\nrunout_um = 10.0\n[extension.force-exponent]\nexponent = 0.7\nreference_chip_mm = 0.05\n",
    );
    for (case, reason) in [(flank, "tool.pitch_deg"), (chip, "force-exponent")] {
        let error = ForcedProblem::new(&case).unwrap_err().to_string();
        assert!(error.contains(reason), "{error}");
    }
}

/// Image of a start under the map over the revolution, from Newton steps until the states at the nodes settle.
fn image(map: &RevolutionPeriod<'_>, start: &DVector<f64>, depth_m: f64, orbit: &Orbit) -> DVector<f64> {
    let mut states = orbit.states.clone();
    loop {
        let integration = map.integrate(start, depth_m, &states).unwrap();
        if integration.moved < 1e-13 {
            return integration.end;
        }
        states = integration.states;
    }
}

#[test]
fn derivatives_of_the_map_are_those_of_differences() {
    let case = uneven_robot([165.0, 195.0]);
    let problem = ForcedProblem::new(&case).unwrap();
    let uneven = problem.uneven.as_ref().unwrap();
    let depth_m = 6e-3;
    let map = RevolutionPeriod::new(&problem, uneven, 550.0, depth_m).unwrap();
    let orbit = orbit_at(&problem, 550.0, 6.0).unwrap();
    let at = map.integrate(&orbit.start, depth_m, &orbit.states).unwrap();
    let size = orbit.start.amax();
    for column in [0, 1, 3, map.size() / 2, map.size() - 1] {
        let step = 1e-5 * size;
        let moved = |step: f64| {
            let mut start = orbit.start.clone();
            start[column] += step;
            image(&map, &start, depth_m, &orbit)
        };
        let difference = (moved(step) - moved(-step)) / (2.0 * step);
        let error = (difference - at.by.column(column)).norm();
        // Tolerance: square of the relative difference step, and rounding divided by that step.
        assert!(error < 1e-7 * at.by.norm(), "{column}: {error}");
    }
    let step_m = 1e-5 * depth_m;
    let moved = |step_m: f64| image(&map, &orbit.start, depth_m + step_m, &orbit);
    let by_depth = at.by.column(map.size());
    let difference = (moved(step_m) - moved(-step_m)) / (2.0 * step_m);
    assert!((difference - by_depth).norm() < 1e-7 * by_depth.norm());
}
