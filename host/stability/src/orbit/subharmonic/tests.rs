//! Period-doubled orbits of a hardening structure: near the flip, at their fold, and between two flips.

use super::{DoubledBranch, follow_doubled};
use crate::orbit::branch::{Branch, Event, Extent};
use crate::orbit::branch_record::Unrecorded;
use crate::orbit::branches::follow;
use crate::orbit::criticality::criticality;
use crate::orbit::forced::ForcedProblem;
use crate::orbit::parameter::{Parameter, Setting};
use crate::orbit::periodic_orbit::OrbitError;
use crate::spectrum::stability_loss::StabilityLoss;

fn hardening() -> ForcedProblem {
    ForcedProblem::new(&quietcut_testkit::case("hardening-flip")).unwrap()
}

fn doubled_of(
    problem: &ForcedProblem,
    setting: Setting,
    parameter: Parameter,
    range: [f64; 2],
) -> (Branch, DoubledBranch) {
    let branch = follow(problem, setting, parameter, range, Extent::Whole).unwrap();
    let flip = branch
        .events
        .iter()
        .find(|event| event.kind == StabilityLoss::Flip);
    let doubled = follow_doubled(problem, setting, parameter, range, flip.unwrap(), &mut Unrecorded);
    (branch, doubled.unwrap())
}

/// Half the difference between the displacements in feed direction at the starts of both tooth periods, mm.
fn doubling_mm(doubled: &DoubledBranch, index: usize) -> f64 {
    let both = &doubled.points[index].displacements_mm;
    0.5 * (both[1][0] - both[0][0]).abs()
}

#[test]
fn near_the_flip_the_doubling_has_the_size_of_the_normal_form() {
    let problem = hardening();
    let range = [0.0, 3.0];
    // At the lower speed the flip is supercritical, at the upper one subcritical.
    for (rpm, is_supercritical) in [(1980.0, true), (2010.0, false)] {
        let setting = problem.setting(rpm, 0.0);
        let (branch, doubled) = doubled_of(&problem, setting, Parameter::Depth, range);
        let flip = &branch.events[0];
        let found = criticality(&problem, setting, Parameter::Depth, range, flip).unwrap();
        assert_eq!(found.is_supercritical(), is_supercritical);
        let near = doubled.branch.points.iter().enumerate();
        let (index, at) = near
            .take_while(|(_, at)| (at.value / flip.value - 1.0).abs() < 3e-4)
            .last()
            .unwrap();
        assert!((at.value > flip.value) == is_supercritical, "{}", at.value);
        let up_to = [0.0, at.value];
        let forced = follow(&problem, setting, Parameter::Depth, up_to, Extent::Whole).unwrap();
        let excess = forced.points.last().unwrap().multiplier_abs - 1.0;
        let predicted_mm = found.spread_mm(excess).unwrap()[0];
        let followed_mm = doubling_mm(&doubled, index);
        println!(
            "{rpm} rev/min, {} mm: {followed_mm} mm, normal form {predicted_mm} mm",
            at.value
        );
        // Both differ in proportion to the distance from the flip: by 2 % at 2010 rev/min, and by 0.1 % at 1980 rev/min.
        let room = if is_supercritical { 0.005 } else { 0.03 };
        assert!((followed_mm / predicted_mm - 1.0).abs() < room);
    }
}

#[test]
fn the_doubled_orbits_turn_back_in_a_fold_and_gain_stability_there() {
    let problem = hardening();
    let (branch, doubled) = doubled_of(
        &problem,
        problem.setting(2010.0, 0.0),
        Parameter::Depth,
        [0.0, 3.0],
    );
    let fold = doubled.fold().unwrap();
    assert!(fold.gain && fold.error < 1e-4, "{fold:?}");
    // The fold is the smallest depth of the branch: a parabola through its three lowest orbits has its top there.
    let values: Vec<f64> = doubled.branch.points.iter().map(|at| at.value).collect();
    let lowest = (1..values.len() - 1)
        .min_by(|&a, &b| values[a].total_cmp(&values[b]))
        .unwrap();
    let [a, b, c] =
        [lowest - 1, lowest, lowest + 1].map(|index| [doubling_mm(&doubled, index), values[index]]);
    let slope = |p: [f64; 2], q: [f64; 2]| (q[1] - p[1]) / (q[0] - p[0]);
    let bend = (slope(b, c) - slope(a, b)) / (c[0] - a[0]);
    let at_b = slope(a, b) + bend * (b[0] - a[0]);
    let top_mm = b[1] - at_b * at_b / (4.0 * bend);
    println!("fold {} mm, parabola {top_mm} mm", fold.value);
    assert!((top_mm / fold.value - 1.0).abs() < 1e-4);
    let zone = doubled.bistable(&branch);
    assert_eq!(zone, [[fold.value, branch.events[0].value]]);
    // On each orbit of the upper part all teeth cut.
    assert_eq!(doubled.contact_lost(), None);
}

#[test]
fn over_the_speed_the_doubled_orbits_lead_from_one_flip_to_the_next() {
    let problem = hardening();
    let setting = problem.setting(0.0, 1.36);
    let (branch, doubled) = doubled_of(&problem, setting, Parameter::Rpm, [1950.0, 2100.0]);
    let flips: Vec<&Event> = branch.events.iter().collect();
    assert!(flips.len() == 2 && flips.iter().all(|event| event.kind == StabilityLoss::Flip));
    // They pass the second flip, which is subcritical, return in a fold and end there.
    assert!(doubled.rejoins);
    let fold = doubled.fold().unwrap();
    assert!(fold.value > flips[1].value + 10.0, "{fold:?}");
    let [before, last] = doubled.branch.points.last_chunk::<2>().unwrap();
    println!(
        "second flip at {} rev/min, ends at {} and {}",
        flips[1].value, before.value, last.value
    );
    assert!(
        [before, last]
            .iter()
            .all(|at| (at.value / flips[1].value - 1.0).abs() < 1e-4)
    );
    let zone = doubled.bistable(&branch);
    assert_eq!(zone, [[flips[1].value, fold.value]]);
}

#[test]
fn other_events_are_refused() {
    let problem = ForcedProblem::new(&quietcut_testkit::case("kuka-kr90-full-cubic")).unwrap();
    let setting = problem.setting(822.3, 0.0);
    let range = [0.0, 5.0];
    let branch = follow(&problem, setting, Parameter::Depth, range, Extent::FirstLoss).unwrap();
    let torus = &branch.events[0];
    assert_eq!(torus.kind, StabilityLoss::Hopf);
    let refused = follow_doubled(&problem, setting, Parameter::Depth, range, torus, &mut Unrecorded);
    assert!(matches!(
        refused.unwrap_err().cause,
        OrbitError::NotCovered { .. }
    ));
}
