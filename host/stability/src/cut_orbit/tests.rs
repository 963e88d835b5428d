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
/// displacement, in its last revolution.
fn distance(case: &Case, (rpm, depth_mm): (f64, f64), effects: &[&str], seconds: f64) -> f64 {
    let text = effects;
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
    let start = Instant::now();
    let own = model(case, rpm, depth_mm, &effects);
    let orbit = CutOrbit::new(&own).unwrap_or_else(|_| {
        let friction_n: f64 = text[0].split('=').nth(1).unwrap().parse().unwrap();
        CutOrbit::continued(&|share| {
            let mut changed = vec![format!("coulomb-friction={}", share.max(0.02) * friction_n)];
            changed.extend(text[1..].iter().map(|text| (*text).to_owned()));
            model(
                case,
                rpm,
                depth_mm,
                &Effects::parse(changed.iter().map(String::as_str)).unwrap(),
            )
        })
        .unwrap()
    });
    println!("{:?} steps {} {:?}", orbit.size(), orbit.steps, start.elapsed());
    let mut size: f64 = 0.0;
    let mut apart: f64 = 0.0;
    for (index, motion) in motions.iter().enumerate() {
        let found = orbit.displacement_m(step_s * index as f64);
        for axis in 0..3 {
            size = size.max(motion.displacement_m[axis].abs());
            apart = apart.max((found[axis] - motion.displacement_m[axis]).abs());
        }
    }
    apart / size
}

#[test]
fn orbits_equal_simulations_in_time() {
    let four = [("teeth = 2", "teeth = 4")];
    let robot = case("kuka-kr90-half", &four, "");
    let unequal = case(
        "kuka-kr90-half",
        &[("teeth = 2", "teeth = 4\npitch_deg = [80.0, 100.0, 85.0, 95.0]")],
        "",
    );
    let linear: [(&Case, &[&str]); 3] = [
        (&robot, &[]),
        (&robot, &["runout=10", "runout.angle_deg=30"]),
        (&unequal, &["runout=10", "runout.angle_deg=30"]),
    ];
    let slow = case("kuka-kr90-half", &four, "");
    let nonlinear: [(&Case, &[&str]); 6] = [
        (&slow, &["cubic-stiffness=-5e11", "cubic-stiffness.direction=x"]),
        (&slow, &["runout=60", "runout.angle_deg=30"]),
        (
            &slow,
            &[
                "backlash=0.004",
                "backlash.direction=y",
                "backlash.stiffness_fraction=0.3",
            ],
        ),
        (
            &slow,
            &[
                "hysteresis=2e5",
                "hysteresis.yield_m=1e-5",
                "hysteresis.direction=y",
            ],
        ),
        (&slow, &["coulomb-friction=0.3", "coulomb-friction.direction=y"]),
        (&slow, &["coulomb-friction=0.8", "coulomb-friction.direction=y"]),
    ];
    for (case, effects) in nonlinear {
        let apart = distance(case, (900.0, 0.5), effects, 20.0);
        println!("{effects:?}: {apart:.2e}");
    }
    for (case, effects) in linear {
        let apart = distance(case, (900.0, 0.5), effects, 20.0);
        println!("{effects:?}: {apart:.2e}");
        assert!(apart < 1e-6, "{effects:?}: {apart}");
    }
}

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
        ("runout", 60.0, 0.02, Box::new(move |um| runout(um))),
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
            1e10,
            Box::new(move |k3| {
                with(&[
                    format!("cubic-stiffness={k3}"),
                    "cubic-stiffness.direction=y".into(),
                ])
            }),
        ),
        ("coulomb-friction", 0.5, 1e-4, Box::new(move |n| friction(n))),
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
        let start = Instant::now();
        let sensitivity = orbit.derivative(&plus, &minus, difference).unwrap();
        let elapsed = start.elapsed();
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
        println!("{name}: {:.2e}, {elapsed:?}, {:?}", apart / size, orbit.size());
        let weights = orbit.order_weights(40);
        let slopes = orbit.force_order_slopes(&weights, &sensitivity);
        let [of_plus, of_minus] = [&plus, &minus].map(|orbit| orbit.force_orders(&orbit.order_weights(40)));
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
            let apart = (slope - &expected).norm() / expected.norm();
            println!("    {kind}: {apart:.2e}");
        }
    }
}
