//! Curves of stability losses against integration in time.

use quietcut_model::case::Case;
use quietcut_model::structure::Form;
use quietcut_simulate::{Entry, Regeneration, Settings, SimulateError, VirtualCut, Workspace};

use super::super::branch::Extent;
use super::super::branches::follow_depth;
use super::super::forced::ForcedProblem;
use super::super::parameter::{Parameter, Setting};
use super::follow::follow_curve;
use super::points::{CurveSeed, NoJournal, Plane};
use super::tests::{W_PER_MM, rpm};

/// The case with the feed and the factors of a setting, made without the code under test.
fn changed(case: &Case, setting: &Setting) -> Case {
    let mut case = case.clone();
    case.cut.as_mut().unwrap().feed_per_tooth_mm = setting.feed_mm;
    let Form::Matrices(matrices) = &mut case.structure.as_mut().unwrap().form else {
        panic!("matrices are needed");
    };
    matrices.cubic_stiffness = matrices.cubic_stiffness.take().map(|k3| k3 * setting.kappa);
    matrices.cubic_damping = matrices.cubic_damping.take().map(|c3| c3 * setting.nu);
    case
}

/// Growth rate, per tooth period, of the difference between successive tooth periods, from integration in time after the
/// depth has grown slowly; negative where the forced vibration settles, infinite where the motion escapes.
fn growth(case: &Case, setting: &Setting) -> f64 {
    let tooth_s = 30.0 / setting.rpm;
    let first = [1700, 2700];
    const WINDOW: usize = 400;
    let last = first[1] + WINDOW;
    let cut = VirtualCut {
        entry: Entry::Ramp {
            seconds: 1500.0 * tooth_s,
        },
        air_s: 0.0,
        ..VirtualCut::new(setting.rpm, setting.depth_mm, (last + 1600) as f64 * tooth_s)
    };
    let mut model = cut.model(&changed(case, setting)).unwrap();
    model.cutting.as_mut().unwrap().regeneration = Regeneration::LastPass;
    let settings = Settings {
        absolute_m: 1e-15,
        relative: 1e-9,
        ..Settings::default()
    };
    let mut room = Workspace::new(&model);
    let mut strobe: Vec<[f64; 3]> = Vec::new();
    let run = model.run(last as f64 * tooth_s, settings, |step| {
        while strobe.len() as f64 * tooth_s < step.to_s() {
            strobe.push(
                step.motion(strobe.len() as f64 * tooth_s, &mut room)
                    .displacement_m,
            );
        }
    });
    if let Err(error) = run {
        // The softening springs let the growing vibration escape.
        assert!(matches!(error, SimulateError::Diverged { .. }), "{error}");
        return f64::INFINITY;
    }
    let size = |from: usize| {
        let moves = strobe[from..].windows(2).take(WINDOW - 1);
        let square: f64 = moves
            .flat_map(|pair| (0..3).map(move |axis| (pair[1][axis] - pair[0][axis]).powi(2)))
            .sum();
        square.sqrt()
    };
    (size(first[1]) / size(first[0])).ln() / (first[1] - first[0]) as f64
}

#[test]
fn losses_over_stiffness_damping_and_feed_are_those_of_integration_in_time() {
    let case = quietcut_testkit::case("kuka-kr90-full-cubic");
    let problem = ForcedProblem::new(&case).unwrap();
    let at_torus = [
        (Parameter::Kappa, 1.3),
        (Parameter::Kappa, 0.5),
        (Parameter::Nu, 0.5),
        (Parameter::Feed, 0.075),
    ];
    let in_pocket = [(Parameter::Kappa, 1.3), (Parameter::Kappa, 0.5)];
    for (tau, changes) in [(4.0, &at_torus[..]), (6.0, &in_pocket[..])] {
        let setting = problem.setting(rpm(tau), 0.0);
        let branch = follow_depth(&problem, setting.rpm, 13.0, Extent::FirstLoss).unwrap();
        let event = branch.events.iter().find(|event| !event.gain).unwrap();
        for &(parameter, to) in changes {
            let from = setting.get(parameter);
            let plane = Plane {
                parameters: [Parameter::Depth, parameter],
                ranges: [[0.0, 16.0], [from.min(to), from.max(to)]],
            };
            let seed = CurveSeed::of_event(event, from);
            let curve = follow_curve(&problem, setting, plane, &seed, &mut NoJournal).unwrap();
            let ends = [curve.points.first().unwrap(), curve.points.last().unwrap()];
            let end = ends
                .into_iter()
                .find(|point| (point.setting.get(parameter) / to - 1.0).abs() < 1e-9)
                .unwrap_or_else(|| panic!("{tau} {parameter:?} {to}: ends {:?}", curve.ends));
            let at = |share: f64| {
                let setting = end.setting.with(Parameter::Depth, end.setting.depth_mm * share);
                growth(&case, &setting)
            };
            let (below, above) = (at(0.995), at(1.005));
            println!(
                "τ {tau}, {} = {to}: w = {:.5}, {} others outside; growth per tooth {below:.2e} and {above:.2e}",
                parameter.name(),
                end.setting.depth_mm * W_PER_MM,
                end.outside,
            );
            assert!(
                below < 0.0 && above > 0.0,
                "{tau} {parameter:?} {to}: {below} {above}"
            );
        }
    }
}
