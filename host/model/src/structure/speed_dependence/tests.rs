use std::path::Path;

use super::*;
use crate::case::Case;
use crate::structure::Form;

const JOB: &str = "[tool]\nteeth = 2\nedge_angle_deg = 90.0\n[material]\nktc_mpa = 600.0\nkrc_mpa = 200.0\nkac_mpa = 0.0\n\
    [cut]\nstart_deg = 90.0\nexit_deg = 180.0\nfeed_per_tooth_mm = 0.1\n";

fn complex(re: f64, im: f64) -> Complex64 {
    Complex64::new(re, im)
}

fn mode(frequency_hz: f64, damping_ratio: f64, x: f64, y: f64) -> Mode {
    let shape = vec![complex(x, -0.1 * x), complex(y, 0.05)];
    Mode {
        frequency_hz,
        damping_ratio,
        left: shape.clone(),
        right: shape,
    }
}

fn node(rpm: f64, modes: Vec<Mode>) -> ModesAtSpeed {
    ModesAtSpeed { rpm, modes }
}

/// Residue right·leftᵀ.
fn residue(mode: &Mode) -> Vec<Complex64> {
    let left = &mode.left;
    mode.right
        .iter()
        .flat_map(|right| left.iter().map(move |left| right * left))
        .collect()
}

#[test]
fn each_structure_is_found_again_at_its_speed_and_halves_between() {
    let base = node(
        0.0,
        vec![mode(800.0, 0.02, 1.0, 0.1), mode(900.0, 0.03, 0.1, 1.0)],
    );
    // At 12 000 rev/min in another order and with another scale of the shapes, which the residue does not show.
    let scale = complex(-0.3, 2.0);
    let mut fast = vec![mode(850.0, 0.05, 0.15, 1.1), mode(760.0, 0.03, 0.9, 0.12)];
    for mode in &mut fast {
        mode.right.iter_mut().for_each(|entry| *entry *= scale);
        mode.left.iter_mut().for_each(|entry| *entry /= scale);
    }
    let dependence = SpeedDependence::new(base.clone(), vec![node(12_000.0, fast.clone())]).unwrap();
    assert_eq!(dependence.speeds_rpm(), [0.0, 12_000.0]);
    let [slow, end, beyond] = [0.0, 12_000.0, 15_000.0].map(|rpm| dependence.at(&base.modes, rpm));
    for (found, expected) in [
        (&slow, &base.modes),
        (&end, &vec![fast[1].clone(), fast[0].clone()]),
    ] {
        for (found, expected) in found.iter().zip(expected) {
            // Rounding.
            assert!((found.frequency_hz - expected.frequency_hz).abs() < 1e-9);
            assert!((found.damping_ratio - expected.damping_ratio).abs() < 1e-12);
            for (a, b) in residue(found).iter().zip(residue(expected)) {
                assert!((a - b).norm() < 1e-12, "{a} {b}");
            }
        }
    }
    assert_eq!(end, beyond);
    let middle = dependence.at(&base.modes, 6000.0);
    assert!((middle[0].frequency_hz - 780.0).abs() < 1e-9 && (middle[1].damping_ratio - 0.04).abs() < 1e-12);
    // A machine whose first structure is 1 % off has that error at all speeds.
    let mut off = base.modes.clone();
    off[0].frequency_hz *= 1.01;
    let fast_off = dependence.at(&off, 12_000.0);
    assert!((fast_off[0].frequency_hz - 1.01 * 760.0).abs() < 1e-9);
}

#[test]
fn modes_that_do_not_pair_are_refused_with_what_was_found() {
    let base = || {
        node(
            0.0,
            vec![mode(800.0, 0.02, 1.0, 0.1), mode(900.0, 0.03, 0.1, 1.0)],
        )
    };
    // Another shape, too far in frequency, fewer modes, the same speed.
    let other = |modes| SpeedDependence::new(base(), vec![node(9000.0, modes)]).unwrap_err();
    let skew = other(vec![mode(800.0, 0.02, 1.0, 1.0), mode(900.0, 0.03, 0.1, 1.0)]);
    assert!(
        matches!(skew, PairingError::Unpaired { frequency_hz: 800.0, nearest_hz: 800.0, mac, .. } if mac < 0.8),
        "{skew}"
    );
    let far = other(vec![mode(400.0, 0.02, 1.0, 0.1), mode(900.0, 0.03, 0.1, 1.0)]);
    assert!(
        matches!(
            far,
            PairingError::Unpaired {
                nearest_hz: 400.0,
                ..
            }
        ),
        "{far}"
    );
    let fewer = other(vec![mode(800.0, 0.02, 1.0, 0.1)]);
    assert!(
        matches!(
            fewer,
            PairingError::Count {
                found: 1,
                expected: 2,
                ..
            }
        ),
        "{fewer}"
    );
    let twice = SpeedDependence::new(base(), vec![base()]).unwrap_err();
    assert_eq!(twice, PairingError::SameSpeed { rpm: 0.0 });
}

fn text(rpm: &str, frequency_hz: f64, more: &str) -> String {
    format!(
        "[structure]\nkind = \"modes\"\ndirections = [\"x\"]\n{rpm}\n[[structure.mode]]\nfrequency_hz = {frequency_hz}\ndamping_ratio = 0.02\n\
         left = [[0.01, -0.01]]\nright = [[0.01, -0.01]]\n{more}{JOB}"
    )
}

const FAST: &str = "[[structure.at_speed]]\nrpm = 10000.0\n[[structure.at_speed.mode]]\nfrequency_hz = 700.0\ndamping_ratio = 0.04\n\
    left = [[0.012, -0.012]]\nright = [[0.01, -0.01]]\n";

#[test]
fn a_case_states_its_structure_at_each_speed() {
    let case = Case::parse(Path::new("a.toml"), &text("rpm = 0.0", 800.0, FAST)).unwrap();
    let frequency = |rpm: f64| match &case.at_speed(rpm).structure.unwrap().form {
        Form::Modes(modes) => modes[0].frequency_hz,
        _ => 0.0,
    };
    assert!((frequency(2500.0) - 775.0).abs() < 1e-9 && (frequency(1e5) - 700.0).abs() < 1e-9);
    assert!(case.at_speed(2500.0).speed_dependence.is_none());
    // The same from two files.
    let fast = text("rpm = 10000.0", 700.0, "").replace("0.02", "0.04");
    let fast = fast.replacen("left = [[0.01, -0.01]]", "left = [[0.012, -0.012]]", 1);
    let parse = |name: &str, text: &str| Case::parse(Path::new(name), text).unwrap();
    let joined = parse("b.toml", &text("rpm = 0.0", 800.0, ""))
        .with_structures_of(&[parse("c.toml", &fast)])
        .unwrap();
    assert_eq!(joined.speed_dependence, case.speed_dependence);
    // A case that has further speeds of its own keeps them, whether it is the first or another one.
    let slow = parse("g.toml", &text("rpm = 2000.0", 790.0, ""));
    let (a, b) = (
        case.clone()
            .with_structures_of(std::slice::from_ref(&slow))
            .unwrap(),
        slow.with_structures_of(std::slice::from_ref(&case)).unwrap(),
    );
    for joined in [a, b] {
        let dependence = joined.speed_dependence.as_ref().unwrap();
        assert_eq!(dependence.speeds_rpm(), [0.0, 2000.0, 10_000.0]);
        for (rpm, expected_hz) in [(1000.0, 795.0), (6000.0, 745.0)] {
            let Form::Modes(modes) = joined.at_speed(rpm).structure.unwrap().form else {
                panic!("no modes")
            };
            // Rounding.
            assert!((modes[0].frequency_hz - expected_hz).abs() < 1e-9, "{modes:?}");
        }
    }
    let without_speed = parse("d.toml", &text("", 800.0, ""));
    let error = without_speed
        .clone()
        .with_structures_of(&[joined])
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("d.toml") && error.contains("rpm is missing"),
        "{error}"
    );
    // Standstill is said, another speed is not.
    let says = |case: &Case| {
        case.assumptions()
            .iter()
            .any(|sentence| sentence.contains("standstill"))
    };
    assert!(says(&parse("e.toml", &text("rpm = 0.0", 800.0, ""))));
    assert!(!says(&parse("f.toml", &text("rpm = 9000.0", 800.0, ""))) && !says(&without_speed));
    assert!(
        case.assumptions()
            .iter()
            .any(|sentence| sentence.contains("between 0, 10000 rev/min"))
    );
}

#[test]
fn a_case_without_speed_or_with_strange_modes_is_refused() {
    for (text, words) in [
        (text("", 800.0, FAST), ["structure.at_speed", "rpm = 0.0"]),
        (text("rpm = -1.0", 800.0, FAST), ["structure.rpm", "standstill"]),
        (text("rpm = 0.0", 300.0, FAST), ["300.00 Hz", "no partner"]),
        (text("rpm = 10000.0", 800.0, FAST), ["two structures", "10000"]),
        (
            text(
                "rpm = 0.0",
                800.0,
                &FAST.replace("damping_ratio = 0.04", "damping_ratio = 4.0"),
            ),
            ["structure.at_speed[1].mode[1].damping_ratio", "0.04"],
        ),
    ] {
        let error = Case::parse(Path::new("a.toml"), &text).unwrap_err().to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    }
}
