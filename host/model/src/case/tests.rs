use std::path::Path;

use super::*;
use crate::effects::Treatment;
use crate::structure::{Direction, Form};

const GOOD: &str = r#"name = "good"
[structure]
kind = "matrices"
directions = ["x", "y"]
mass = [[1.0, 0.0], [0.0, 1.0]]
damping = [[1.0, 0.0], [0.0, 1.0]]
stiffness = [[1.0, 0.0], [0.0, 1.0]]
stiffness_std = [[0.1, 0.0], [0.0, 0.2]]
[tool]
teeth = 2
edge_angle_deg = 90
[material]
ktc_mpa = 600.0
ktc_mpa_std = 20.0
krc_mpa = 200.0
kac_mpa = 0.0
[cut]
start_deg = 90
exit_deg = 180
feed_per_tooth_mm = 0.1
[extension.axial-depth-modulation]
on = true
"#;

/// The case `tests/cases/NAME.toml` of the project.
pub(crate) fn case(name: &str) -> Case {
    let path = format!("{}/../../tests/cases/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    Case::read(path).unwrap()
}

fn parse(text: &str) -> Result<Case, CaseError> {
    Case::parse(Path::new("machine.toml"), text)
}

#[test]
fn every_section_arrives() {
    let case = parse(GOOD).unwrap();
    assert_eq!(case.name, "good");
    assert_eq!(case.structure().unwrap().directions, [Direction::X, Direction::Y]);
    assert!(matches!(case.structure().unwrap().form, Form::Matrices(_)));
    assert_eq!(case.tool().unwrap().pitch_deg, [180.0, 180.0]);
    assert_eq!(case.material().unwrap().kte_n_per_mm, 0.0);
    assert!(case.axial_depth_modulation());
    let expected = [
        Deviation {
            parameter: Parameter::Stiffness(0, 0),
            std: 0.1,
        },
        Deviation {
            parameter: Parameter::Stiffness(1, 1),
            std: 0.2,
        },
        Deviation {
            parameter: Parameter::Ktc,
            std: 20.0,
        },
    ];
    assert_eq!(case.deviations, expected);
}

#[test]
fn a_case_without_a_tool_says_so_when_asked() {
    let text = GOOD.split("[tool]").next().unwrap();
    let message = parse(text).unwrap().tool().unwrap_err().to_string();
    assert!(
        message.contains("machine.toml") && message.contains("[tool]"),
        "{message}"
    );
}

/// Faults of a case file: text that is replaced, its replacement, line of the fault, and words that the message must contain.
const WRONG: [(&str, &str, usize, &[&str]); 18] = [
    ("teeth = 2", "teeth = 0", 10, &["tool.teeth", "found 0", "from 1"]),
    ("teeth = 2", "teeth = \"two\"", 10, &["\"two\"", "teeth"]),
    (
        "teeth = 2",
        "teeth = 2\nteehts = 3",
        11,
        &["teehts", "expected one of"],
    ),
    (
        "edge_angle_deg = 90",
        "edge_angle_deg = 91",
        11,
        &["found 91", "up to 90"],
    ),
    (
        "ktc_mpa = 600.0",
        "ktc_mpa = -600.0",
        13,
        &["material.ktc_mpa", "-600"],
    ),
    (
        "ktc_mpa = 600.0",
        "ktc_mpa = nan",
        13,
        &["material.ktc_mpa", "NaN"],
    ),
    (
        "ktc_mpa_std = 20.0",
        "ktc_mpa_std = -1.0",
        14,
        &["material.ktc_mpa_std", "-1"],
    ),
    (
        "exit_deg = 180",
        "exit_deg = 80",
        19,
        &["cut.exit_deg", "found 80", "(90)"],
    ),
    (
        "exit_deg = 180",
        "exit_deg = 90",
        19,
        &["cut.exit_deg", "found 90"],
    ),
    (
        "feed_per_tooth_mm = 0.1",
        "feed_per_tooth_mm = -0.1",
        20,
        &["feed_per_tooth_mm", "-0.1"],
    ),
    (
        "feed_per_tooth_mm = 0.1",
        "",
        17,
        &["[cut] lacks feed_per_tooth_mm (mm)", "\n  feed_per_tooth_mm = "],
    ),
    (
        "mass = [[1.0, 0.0], [0.0, 1.0]]",
        "mass = [[1.0, 0.0]]",
        5,
        &["structure.mass", "1 rows", "2 rows"],
    ),
    (
        "mass = [[1.0, 0.0], [0.0, 1.0]]",
        "mass = [[1.0], [0.0, 1.0]]",
        5,
        &["1 entries in row 1"],
    ),
    (
        "mass = [[1.0, 0.0], [0.0, 1.0]]",
        "",
        2,
        &["structure.mass", "nothing"],
    ),
    (
        "[\"x\", \"y\"]",
        "[\"x\", \"w\"]",
        4,
        &["structure.directions", "\"w\""],
    ),
    (
        "kind = \"matrices\"",
        "kind = \"matrix\"",
        3,
        &["structure.kind", "\"matrix\"", "\"modes\""],
    ),
    (
        "on = true",
        "on = 1",
        22,
        &["axial-depth-modulation.on", "found 1", "on = true"],
    ),
    (
        "extension.axial-depth-modulation",
        "extension.axial-depth",
        21,
        &[
            "axial-depth",
            "axial-depth-modulation (the closest)",
            "one of mass",
        ],
    ),
];

#[test]
fn every_wrong_value_is_named_with_its_line_and_what_would_be_right() {
    for (from, to, line, words) in WRONG {
        assert!(GOOD.contains(from), "{from}");
        let message = parse(&GOOD.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(
            message.starts_with(&format!("machine.toml: line {line},")),
            "{to}: {message}"
        );
        for word in words {
            assert!(message.contains(word), "{to}: {word} is not in: {message}");
        }
    }
}

#[test]
fn pitches_must_be_one_per_tooth_and_close_the_turn() {
    for (pitch, word) in [
        ("[180, 170]", "350"),
        ("[360]", "1 angles"),
        ("[-10, 370]", "-10"),
    ] {
        let text = GOOD.replacen("teeth = 2", &format!("teeth = 2\npitch_deg = {pitch}"), 1);
        let message = parse(&text).unwrap_err().to_string();
        assert!(message.contains(word), "{message}");
    }
    let text = GOOD.replacen("teeth = 2", "teeth = 2\npitch_deg = [170, 190]", 1);
    assert!(parse(&text).unwrap().tool().unwrap().has_variable_pitch());
    assert!(!parse(GOOD).unwrap().tool().unwrap().has_variable_pitch());
}

#[test]
fn an_extension_that_is_not_treated_is_refused_and_one_of_the_sensors_is_not() {
    let text = format!("{GOOD}[extension.sensor-gain]\ngain = 1.1\n");
    let reason = |spec: &EffectSpec| match spec.treatment {
        Treatment::LinearProcess | Treatment::Sensor => None,
        _ => Some("no"),
    };
    assert!(parse(&text).unwrap().refuse_extensions(reason).is_ok());
    let text = format!("{GOOD}[extension.backlash]\ngap_mm = 0.1\n");
    let error = parse(&text).unwrap().refuse_extensions(reason).unwrap_err();
    assert!(error.to_string().contains("[extension.backlash]"), "{error}");
}

#[test]
fn modes_arrive_and_shapes_must_fit() {
    let modes = r#"
[structure]
kind = "modes"
directions = ["x", "y"]
[[structure.mode]]
frequency_hz = 10.0
damping_ratio = 0.02
left = [[1.0, 0.0], [0.0, 1.0]]
right = [[1.0, 0.0], [0.0, 1.0]]
"#;
    let case = parse(modes).unwrap();
    assert_eq!(case.name, "machine");
    let Form::Modes(modes_read) = &case.structure().unwrap().form else {
        panic!("no modes")
    };
    assert_eq!(modes_read[0].right[1], num_complex::Complex64::new(0.0, 1.0));
    let short = modes.replacen("left = [[1.0, 0.0], [0.0, 1.0]]", "left = [[1.0, 0.0]]", 1);
    let message = parse(&short).unwrap_err().to_string();
    assert!(message.contains("structure.mode[1].left"), "{message}");
    let damped = modes.replacen("0.02", "1.0", 1);
    assert!(parse(&damped).unwrap_err().to_string().contains("below 1"));
}

#[test]
fn the_cases_of_the_project_are_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/cases");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let case = Case::read(entry.unwrap().path()).unwrap();
        case.structure().unwrap();
        count += 1;
    }
    assert!(count >= 20, "{count}");
}

/// Faults of extensions: text of the table, line of the fault, and words that the message must contain.
const WRONG_EXTENSIONS: &[(&str, usize, &[&str])] = &[
    (
        "[extension.cubic-stifness]\nk3_n_per_m3 = 1.0\n",
        23,
        &["cubic-stiffness (the closest)"],
    ),
    // A key that no effect has, and one that is misspelt.
    (
        "[extension.backlash]\ngap_mm = 0.1\nspring = 2.0\n",
        25,
        &["backlash.spring", "an unknown key", "gap_mm"],
    ),
    (
        "[extension.hysteresis]\nhysteretic_stiffness_n_per_m = 1.0\nyeild_m = 1e-5\n",
        25,
        &["yield_m (the closest)"],
    ),
    // A key with the right name but another unit.
    (
        "[extension.backlash]\ngap_um = 50.0\n",
        24,
        &["backlash.gap_um", "another unit", "gap_mm, in mm"],
    ),
    (
        "[extension.sensor-delay]\ndelay_ms = 0.1\n",
        24,
        &["another unit", "delay_s, in s"],
    ),
    (
        "[extension.cubic-stiffness]\nk3 = 1e12\n",
        24,
        &["k3_n_per_m3, in N/m³"],
    ),
    // The wrong type.
    (
        "[extension.coulomb-friction]\nfc_n = \"3\"\n",
        24,
        &["fc_n", "a force of 0 or more, in N"],
    ),
    (
        "[extension.coulomb-friction]\nfc_n = 3\ndirection = 1\n",
        25,
        &["direction", "\"x\", \"y\" or \"z\""],
    ),
    (
        "[extension.coulomb-friction]\nfc_n = 3\ndirection = \"rx\"\n",
        25,
        &[
            "extension.coulomb-friction.direction",
            "rx",
            "\"x\", \"y\" or \"z\"",
        ],
    ),
    (
        "[extension.mode-coupling]\nkxyy_n_per_m3 = 1e12\ndirections = \"x\"\n",
        25,
        &["a list of two"],
    ),
    ("[extension.runout]\nrunout_um = true\n", 24, &["a number, in µm"]),
    // Out of bounds.
    (
        "[extension.backlash]\ngap_mm = -0.1\n",
        24,
        &["found -0.1", "a gap of 0 or more"],
    ),
    (
        "[extension.backlash]\ngap_mm = 0.1\nstiffness_fraction = 1.2\n",
        25,
        &["a share above 0 and up to 1"],
    ),
    (
        "[extension.force-exponent]\nexponent = 0.0\n",
        24,
        &["a number greater than 0"],
    ),
    (
        "[extension.hysteresis]\nhysteretic_stiffness_n_per_m = 1.0\nyield_m = 1e-5\nexponent = 0.5\n",
        26,
        &["a number of 1 or more"],
    ),
    (
        "[extension.speed-fluctuation]\ndelta = 1.0\nfrequency_hz = 1.0\n",
        24,
        &["between -1 and 1"],
    ),
    ("[extension.mass]\nrelative_change = -1.5\n", 24, &["above −1"]),
    (
        "[extension.wear]\nrelative_rate_per_s = inf\n",
        24,
        &["found inf", "a number"],
    ),
    (
        "[extension.cubic-stiffness]\nk3_n_per_m3 = [1.0, nan]\ndirection = [\"x\", \"y\"]\n",
        24,
        &["a number"],
    ),
    (
        "[extension.wear]\nrelative_rate_per_s = 0.1\nrelative_rate_per_s_std = -0.1\n",
        25,
        &["a standard deviation of 0 or more"],
    ),
    // A missing key, and values that are not possible together.
    ("[extension.backlash]\ndirection = \"x\"\n", 23, &["needs gap_mm"]),
    (
        "[extension.backlash]\ngap_mm = 0.1\nbefore = \"coulomb-friction\"\n",
        25,
        &["and that effect too"],
    ),
    (
        "[extension.coulomb-friction]\nfc_n = 3\ncontact_mm = 0.1\n",
        25,
        &["play_mm above 0"],
    ),
    (
        "[extension.cubic-stiffness]\nk3_n_per_m3 = [1.0]\ndirection = [\"x\", \"y\"]\n",
        24,
        &["one for each location"],
    ),
];

#[test]
fn a_wrong_value_of_an_extension_is_named_with_its_line_and_the_right_word() {
    for (table, line, words) in WRONG_EXTENSIONS {
        let message = parse(&format!("{GOOD}{table}")).expect_err(table).to_string();
        let place = format!("machine.toml: line {line}");
        assert!(message.starts_with(&place), "{table}: {message}");
        for word in *words {
            assert!(message.contains(word), "{table}: {word} is not in: {message}");
        }
    }
}

#[test]
fn a_deviation_stands_beside_the_number_that_it_belongs_to() {
    let table =
        "[extension.coulomb-friction]\nfc_n = [3, 4.5]\nfc_n_std = [0.1, 0.2]\ndirection = [\"x\", \"y\"]\n";
    let case = parse(&format!("{GOOD}{table}")).unwrap();
    assert!(case.has(EffectName::CoulombFriction) && !case.has(EffectName::Backlash));
    let stray = "[extension.coulomb-friction]\nfc_n = 3\nfriction_std = 0.1\n";
    assert!(parse(&format!("{GOOD}{stray}")).is_err());
}
