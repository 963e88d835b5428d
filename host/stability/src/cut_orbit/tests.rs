//! Orbits against simulation in time, and derivatives against differences.

use std::time::Instant;

use super::{CutModel, CutOrbit};
use quietcut_model::case::Case;
use quietcut_model::{Cutter, Effects};
use quietcut_simulate::{Entry, Settings, VirtualCut};

/// A case of the folder `tests/cases` with replaced lines.
fn case(name: &str, replaced: &[(&str, &str)], more: &str) -> Case {
    let path = format!("{}/../../tests/cases/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let mut text = std::fs::read_to_string(&path).unwrap();
    for (from, to) in replaced {
        assert!(text.contains(from), "{from} is not in {name}");
        text = text.replace(from, to);
    }
    Case::parse(std::path::Path::new(&path), &format!("{text}\n{more}")).unwrap()
}

fn model(case: &Case, rpm: f64, depth_mm: f64, effects: &Effects) -> CutModel {
    let effects = Effects::of_case(case).unwrap().and(effects);
    let cutter = Cutter::new(
        case.tool().unwrap(),
        case.material().unwrap(),
        case.cut().unwrap(),
        1e-3 * depth_mm,
    )
    .unwrap();
    let (dynamics, restoring_forces) = effects.dynamics(case.structure().unwrap()).unwrap();
    CutModel {
        structure: dynamics.first_order(),
        restoring_forces,
        cutter: effects.cutter(cutter.at_speed(rpm)).unwrap(),
        rad_per_s: rpm * std::f64::consts::TAU / 60.0,
        time_s: 0.0,
    }
}

/// Largest distance between the orbit and a simulation in time that has run for `seconds`, over the largest
/// displacement, in its last revolution; and the number of events of the orbit.
fn distance(case: &Case, (rpm, depth_mm): (f64, f64), effects: &[&str], seconds: f64) -> (f64, usize) {
    let effects = Effects::parse(effects.iter().copied()).unwrap();
    let cut = VirtualCut {
        effects: effects.clone(),
        entry: Entry::None,
        ..VirtualCut::new(rpm, depth_mm, seconds)
    };
    let simulated = cut.model(case).unwrap();
    let revolution_s = 60.0 / rpm;
    let turns = (seconds / revolution_s).floor() - 1.0;
    let first_s = turns * revolution_s;
    let settings = Settings {
        absolute_m: 1e-15,
        relative: 1e-11,
        ..Settings::default()
    };
    let step_s = revolution_s / 97.0;
    let end_s = first_s + 0.999 * revolution_s;
    let motions = simulated
        .motions_from(vec![0.0; simulated.order()], settings, [first_s, step_s, end_s])
        .unwrap();
    let orbit = CutOrbit::new(&model(case, rpm, depth_mm, &effects)).unwrap();
    let events = orbit.size()[1];
    let mut size: f64 = 0.0;
    let mut apart: f64 = 0.0;
    for (index, motion) in motions.iter().enumerate() {
        let found = orbit.displacement_m(step_s * index as f64);
        for (found, simulated) in found.iter().zip(motion.displacement_m) {
            size = size.max(simulated.abs());
            apart = apart.max((found - simulated).abs());
        }
    }
    (apart / size, events)
}

#[test]
fn orbits_equal_simulations_in_time() {
    let equal = case("kuka-kr90-half", &[("teeth = 2", "teeth = 4")], "");
    let unequal = case(
        "kuka-kr90-half",
        &[("teeth = 2", "teeth = 4\npitch_deg = [80.0, 100.0, 85.0, 95.0]")],
        "",
    );
    // Case, effects, and whether contact or a regime changes on the orbit.
    let cuts: [(&Case, &[&str], bool); 9] = [
        (&equal, &[], false),
        (&equal, &["runout=10", "runout.angle_deg=30"], true),
        (&unequal, &["runout=10", "runout.angle_deg=30"], true),
        (&equal, &["runout=60", "runout.angle_deg=30"], true),
        (
            &equal,
            &["cubic-stiffness=-5e11", "cubic-stiffness.direction=x"],
            false,
        ),
        (
            &equal,
            &[
                "backlash=0.004",
                "backlash.direction=y",
                "backlash.stiffness_fraction=0.3",
            ],
            true,
        ),
        (
            &equal,
            &[
                "hysteresis=2e5",
                "hysteresis.yield_m=1e-5",
                "hysteresis.direction=y",
            ],
            true,
        ),
        // The tool slips all the time, and sticks for a part of each tooth passing.
        (
            &equal,
            &["coulomb-friction=0.3", "coulomb-friction.direction=y"],
            true,
        ),
        (
            &equal,
            &["coulomb-friction=0.8", "coulomb-friction.direction=y"],
            true,
        ),
    ];
    for (case, effects, changes) in cuts {
        let (apart, events) = distance(case, (900.0, 0.5), effects, 20.0);
        println!("{effects:?}: {apart:.2e}, {events} events");
        // The local tolerance of the simulation is 1e-11, and the slowest mode has decayed to 1e-25 after 20 s.
        assert!(apart < 1e-8, "{effects:?}: {apart}");
        assert_eq!(events > 0, changes, "{effects:?}");
    }
}

#[test]
fn a_surface_that_another_tooth_leaves_at_its_exit_is_met_half_a_revolution_later() {
    // One of two teeth in a slot leaves the workpiece early because of runout. The other meets its own surface at the
    // same angle, half a revolution later: the motion there must be resolved on both sides.
    let text = r#"
[structure]
kind = "matrices"
directions = ["x", "y"]
mass = [[0.346, 0.0119], [0.0119, 0.152]]
damping = [[140.0, -0.36], [-0.36, 104.0]]
stiffness = [[7.75e6, 1.72e5], [1.72e5, 1.563e6]]
[tool]
teeth = 2
edge_angle_deg = 90.0
runout_um = 6.2
runout_angle_deg = 113.0
[material]
ktc_mpa = 175.3
krc_mpa = 65.7
kac_mpa = 0.0
kte_n_per_mm = 0.0
kre_n_per_mm = 0.0
kae_n_per_mm = 0.0
[cut]
start_deg = 0.0
exit_deg = 180.0
feed_per_tooth_mm = 0.0836
"#;
    let case = Case::parse("slot.toml".as_ref(), text).unwrap();
    for (rpm, depth_mm) in [(6472.4, 0.1387), (8868.2, 0.1248), (5178.2, 0.08)] {
        let (apart, events) = distance(&case, (rpm, depth_mm), &[], 0.6);
        println!("{rpm}: {apart:.2e}, {events} events");
        // The force of a subinterval is resolved to 1e-5, and its error is smoothed by the structure.
        assert!(apart < 1e-6, "{rpm}: {apart}");
        assert!(events >= 4, "{rpm}: {events}");
    }
}

#[test]
fn a_continued_orbit_is_that_from_rest() {
    let case = case("kuka-kr90-half", &[("teeth = 2", "teeth = 4")], "");
    // From friction that slips all the time to one that holds the tool for a part of each tooth passing.
    let at = |share: f64| {
        let friction = format!("coulomb-friction={}", 0.1 + 0.7 * share);
        let effects = Effects::parse([friction.as_str(), "coulomb-friction.direction=y"]).unwrap();
        model(&case, 900.0, 0.5, &effects)
    };
    let (continued, from_rest) = (
        CutOrbit::continued(&at).unwrap(),
        CutOrbit::new(&at(1.0)).unwrap(),
    );
    assert_eq!(continued.size()[1], from_rest.size()[1]);
    let [ranges_m, _] = from_rest.half_ranges();
    let size_m = ranges_m.into_iter().fold(0.0, f64::max);
    for index in 0..50 {
        let time_s = 60.0 / 900.0 * f64::from(index) / 50.0;
        let pairs = continued
            .displacement_m(time_s)
            .into_iter()
            .zip(from_rest.displacement_m(time_s));
        for (one, other) in pairs {
            // Twice the distance of either from a simulation.
            assert!((one - other).abs() < 2e-8 * size_m, "{time_s}: {one} {other}");
        }
    }
}

/// Largest relative error of a derivative: that of the central differences, with steps of 1e-3 and less of what changes
/// the orbit by its own size.
const TOLERANCE: f64 = 1e-5;

#[test]
fn derivatives_equal_differences_of_orbits() {
    let four = [("teeth = 2", "teeth = 4\npitch_deg = [80.0, 100.0, 85.0, 95.0]")];
    let case = case("kuka-kr90-half", &four, "");
    let runout = |um: f64| vec![format!("runout={um}"), "runout.angle_deg=30".to_owned()];
    let with = move |more: &[String]| -> Vec<String> {
        runout(60.0).into_iter().chain(more.iter().cloned()).collect()
    };
    let friction = |n: f64| {
        vec![
            format!("coulomb-friction={n}"),
            "coulomb-friction.direction=y".to_owned(),
        ]
    };
    // Name, value, difference, and effects at a value.
    type Effect<'a> = Box<dyn Fn(f64) -> Vec<String> + 'a>;
    let parameters: Vec<(&str, f64, f64, Effect<'_>)> = vec![
        ("runout", 60.0, 0.02, Box::new(runout)),
        (
            "force-coefficients",
            0.0,
            1e-4,
            Box::new(move |share| with(&[format!("force-coefficients={share}")])),
        ),
        (
            "stiffness",
            0.0,
            1e-4,
            Box::new(move |share| with(&[format!("stiffness={share}")])),
        ),
        (
            "mass",
            0.0,
            1e-4,
            Box::new(move |share| with(&[format!("mass={share}")])),
        ),
        (
            "force-exponent",
            0.9,
            1e-4,
            Box::new(move |exponent| {
                with(&[
                    format!("force-exponent={exponent}"),
                    "force-exponent.reference_chip_mm=0.1".into(),
                ])
            }),
        ),
        (
            "cubic-stiffness",
            0.0,
            1e11,
            Box::new(move |k3| {
                with(&[
                    format!("cubic-stiffness={k3}"),
                    "cubic-stiffness.direction=y".into(),
                ])
            }),
        ),
        ("coulomb-friction", 0.5, 1e-4, Box::new(friction)),
        (
            "backlash",
            0.004,
            1e-6,
            Box::new(move |mm| {
                with(&[
                    format!("backlash={mm}"),
                    "backlash.direction=y".into(),
                    "backlash.stiffness_fraction=0.3".into(),
                ])
            }),
        ),
        (
            "hysteresis",
            1e-5,
            1e-9,
            Box::new(move |m| {
                with(&[
                    "hysteresis=2e5".into(),
                    format!("hysteresis.yield_m={m}"),
                    "hysteresis.direction=y".into(),
                ])
            }),
        ),
    ];
    for (name, value, difference, effects) in parameters {
        let at = |value: f64| {
            let texts = effects(value);
            model(
                &case,
                559.0,
                0.5,
                &Effects::parse(texts.iter().map(String::as_str)).unwrap(),
            )
        };
        let orbit = CutOrbit::new(&at(value)).unwrap();
        let (plus, minus) = (at(value + 0.5 * difference), at(value - 0.5 * difference));
        let sensitivity = orbit.derivative(&plus, &minus, difference).unwrap();
        let (plus, minus) = (
            CutOrbit::near(&plus, &orbit).unwrap(),
            CutOrbit::near(&minus, &orbit).unwrap(),
        );
        let (mut size, mut apart): (f64, f64) = (0.0, 0.0);
        for index in 0..50 {
            let t = 60.0 / 559.0 * f64::from(index) / 50.0;
            let (found, plus, minus) = (
                sensitivity.displacement(&orbit, t),
                plus.displacement_m(t),
                minus.displacement_m(t),
            );
            for axis in 0..3 {
                let expected = (plus[axis] - minus[axis]) / difference;
                size = size.max(expected.abs());
                apart = apart.max((expected - found[axis]).abs());
            }
        }
        println!("{name}: {:.2e}", apart / size);
        assert!(apart < TOLERANCE * size, "{name}: {apart} of {size}");
        let weights = orbit.order_weights(40);
        let slopes = orbit.force_order_slopes(&weights, &sensitivity);
        let [of_plus, of_minus] = [&plus, &minus].map(|orbit| orbit.force_orders(&orbit.order_weights(40)));
        // Forces that hardly change are as exact as those that do.
        let largest = slopes.structure_n.norm();
        for (kind, slope, plus, minus) in [
            (
                "cutting",
                &slopes.cutting_n,
                &of_plus.cutting_n,
                &of_minus.cutting_n,
            ),
            (
                "structure",
                &slopes.structure_n,
                &of_plus.structure_n,
                &of_minus.structure_n,
            ),
        ] {
            let expected = (plus - minus) / num_complex::Complex64::from(difference);
            let apart = (slope - &expected).norm() / expected.norm().max(largest);
            println!("    {kind}: {apart:.2e}");
            assert!(apart < TOLERANCE, "{name}, {kind}: {apart}");
        }
    }
}

#[test]
fn forces_that_an_orbit_lacks_act_in_air_as_well() {
    let case = case("kuka-kr90-half", &[], "");
    let at = |effects: &[String]| {
        let effects = Effects::parse(effects.iter().map(String::as_str)).unwrap();
        model(&case, 559.0, 0.5, &effects)
    };
    let cubic = |share: f64| {
        vec![
            format!("cubic-stiffness={}", 1e11 * share),
            "cubic-stiffness.direction=y".into(),
        ]
    };
    let loops = |share: f64| {
        vec![
            format!("hysteresis={}", 2e4 * share),
            "hysteresis.yield_m=1e-5".into(),
            "hysteresis.direction=y".into(),
        ]
    };
    // Without the force of a spring the orbit is not split where the loop has its kinks.
    type Texts<'a> = &'a dyn Fn(f64) -> Vec<String>;
    let forces: [(&str, f64, Texts<'_>); 2] =
        [("cubic-stiffness", 1e-5, &cubic), ("hysteresis", 0.01, &loops)];
    for (name, tolerance, effect) in forces {
        let orbit = CutOrbit::new(&at(&[])).unwrap();
        let (whole, half) = (at(&effect(1.0)), at(&effect(0.5)));
        let found = orbit.derivative(&whole, &half, 0.5).unwrap();
        // The difference of orbits, to second order in the size of the force.
        let along = [0.02, 0.01].map(|share| CutOrbit::near(&at(&effect(share)), &orbit).unwrap());
        let (mut size, mut apart): (f64, f64) = (0.0, 0.0);
        for index in 0..50 {
            let t = 60.0 / 559.0 * f64::from(index) / 50.0;
            let [moved, less] = along.each_ref().map(|orbit| orbit.displacement_m(t));
            let (rest, slope) = (orbit.displacement_m(t), found.displacement(&orbit, t));
            for axis in 0..3 {
                let expected = (4.0 * less[axis] - moved[axis] - 3.0 * rest[axis]) / 0.02;
                size = size.max(expected.abs());
                apart = apart.max((expected - slope[axis]).abs());
            }
        }
        println!("{name}: {:.1e}", apart / size);
        assert!(apart < tolerance * size, "{name}: {apart} of {size}");
    }
}

#[test]
#[ignore = "cost: the times of an orbit with forty derivatives, for the release profile"]
fn cost_of_an_orbit_with_forty_derivatives() {
    let pitch = [("teeth = 2", "teeth = 4\npitch_deg = [80.0, 100.0, 85.0, 95.0]")];
    let case = case("kuka-kr90-half", &pitch, "");
    let cuts: [(&str, Vec<String>); 2] = [
        ("linear", Vec::new()),
        (
            "cubic, with loss of contact",
            [
                "runout=60",
                "cubic-stiffness=-5e11",
                "cubic-stiffness.direction=x",
            ]
            .map(String::from)
            .to_vec(),
        ),
    ];
    for (name, effects) in cuts {
        let at = |more: &str| {
            let all = effects
                .iter()
                .map(String::as_str)
                .chain([more])
                .filter(|text| !text.is_empty());
            model(&case, 559.0, 0.5, &Effects::parse(all).unwrap())
        };
        let own = at("");
        let pairs = ["force-coefficients", "stiffness", "mass", "damping"]
            .map(|effect| [at(&format!("{effect}=1e-4")), at(&format!("{effect}=-1e-4"))]);
        let known = CutOrbit::new(&at("force-coefficients=0.01")).unwrap();
        let mut times = [f64::INFINITY; 3];
        for _ in 0..5 {
            let start = Instant::now();
            let orbit = CutOrbit::new(&own).unwrap();
            times[0] = times[0].min(start.elapsed().as_secs_f64());
            let start = Instant::now();
            let near = CutOrbit::near(&own, &known).unwrap();
            times[1] = times[1].min(start.elapsed().as_secs_f64());
            let start = Instant::now();
            // Of the derivatives a quarter is of the process, the rest of the structure.
            for _ in 0..10 {
                for [plus, minus] in &pairs {
                    assert!(near.derivative(plus, minus, 2e-4).is_some());
                }
            }
            times[2] = times[2].min(start.elapsed().as_secs_f64());
            assert_eq!(orbit.size(), near.size(), "{name}");
        }
        let [from_rest, from_near, derivatives] = times.map(|seconds| 1e3 * seconds);
        println!(
            "{name}: {from_rest:.1} ms from rest, {from_near:.1} ms from a near orbit, {derivatives:.1} ms for 40 derivatives"
        );
    }
}
