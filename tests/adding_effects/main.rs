//! Adds two effects to a copy of the tree by the guide of ARCHITECTURE, and has them work in simulation, case, diagnosis, lobes and help.
//!
//! The effects are a first-order lag of a sensor and a tangential cutting coefficient that depends on the cutting speed. Each is one new
//! file and one entry in `model`, and one new file and one entry in `diagnose`; nothing else is touched.
//!
//! It takes about ten minutes on two cores, most of them for building the copy.

#![allow(clippy::unwrap_used, clippy::panic, clippy::expect_used)]

mod copy_of_the_tree;
mod effect;

use copy_of_the_tree::CopyOfTheTree;
use effect::NewEffect;
use serde_json::Value;

const SENSOR_LAG: NewEffect = NewEffect {
    name: "sensor-lag",
    module: "sensor_lag",
    next_module: "sensor_offset_from_tool_tip",
    entry: "    SensorLag => sensor_lag::SENSOR_LAG,",
    arm: "        EffectName::SensorLag => vec![Box::new(sensor_lag::SensorLagCause)],",
};

const CUTTING_SPEED_EXPONENT: NewEffect = NewEffect {
    name: "cutting-speed-exponent",
    module: "cutting_speed_exponent",
    next_module: "damping",
    entry: "    CuttingSpeedExponent => cutting_speed_exponent::CUTTING_SPEED_EXPONENT,",
    arm: "        EffectName::CuttingSpeedExponent => vec![Box::new(cutting_speed_exponent::CuttingSpeedExponentCause)],",
};

/// The parts of the workspace that the test uses. One selection for all calls, so that dependencies have the same features in each.
const BUILT: &[&str] = &[
    "--locked",
    "--release",
    "--workspace",
    "--bin",
    "quietcut",
    "--test",
    "structure",
    "--example",
    "effects_table",
];

#[test]
#[ignore = "takes minutes: it builds a copy of the tree"]
fn two_effects_are_added_by_the_guide() {
    let copy = CopyOfTheTree::new();
    let effects = [SENSOR_LAG, CUTTING_SPEED_EXPONENT];
    for effect in &effects {
        effect.add_to_model(&copy);
        effect.add_to_diagnose_without_arm(&copy);
    }
    a_missing_arm_does_not_compile(&copy, &effects);
    for effect in &effects {
        effect.add_arm(&copy);
    }
    only_files_and_lists_changed(&copy, &effects);
    copy.succeeds("cargo", &["fmt", "--all", "--check"]);
    copy.succeeds("cargo", &[&["build"], BUILT].concat());

    the_words_name_both(&copy, &effects);
    a_lag_is_simulated_and_found(&copy);
    a_speed_exponent_is_simulated_and_found(&copy);
    lobes_treat_both_as_declared(&copy);
    copy.succeeds(
        "cargo",
        &[
            "test",
            "--locked",
            "--release",
            "--workspace",
            "--test",
            "structure",
        ],
    );
}

fn a_missing_arm_does_not_compile(copy: &CopyOfTheTree, effects: &[NewEffect]) {
    let build = copy.run("cargo", &[&["build"], BUILT].concat());
    let message = String::from_utf8_lossy(&build.stderr);
    assert!(!build.status.success(), "diagnose compiles without the arms");
    assert!(message.contains("non-exhaustive patterns"), "{message}");
    for effect in effects {
        let variant = effect.entry.trim().split(' ').next().unwrap();
        assert!(message.contains(&format!("EffectName::{variant}")), "{message}");
    }
}

fn only_files_and_lists_changed(copy: &CopyOfTheTree, effects: &[NewEffect]) {
    // Two lines of each list for each effect: module and entry.
    let lists = [
        "host/diagnose/src/candidates/mod.rs",
        "host/model/src/effects/mod.rs",
    ];
    let lists = lists.map(|list| format!("{} 0 {list}", 2 * effects.len()));
    let mut expected: Vec<String> = effects.iter().flat_map(NewEffect::files).chain(lists).collect();
    let mut found = copy.changes();
    expected.sort();
    found.sort();
    assert_eq!(found, expected);
}

/// Help, table of effects and messages follow from the list.
fn the_words_name_both(copy: &CopyOfTheTree, effects: &[NewEffect]) {
    let help = copy.succeeds(copy.binary(), &["help", "simulate"]);
    let table = copy.succeeds(copy.path().join("target/release/examples/effects_table"), &[]);
    for effect in effects {
        assert!(help.contains(&format!("\n  {}", effect.name)), "{help}");
        assert!(table.contains(&format!("\n| `{}` |", effect.name)), "{table}");
    }
    // A case is checked against keys and bounds of the effect.
    let case = with_extension(
        copy,
        "wrong.toml",
        "[extension.sensor-lag]\ntime_constant_s = -0.002\n",
    );
    let refused = copy.run(copy.binary(), &["lobes", &case, "--at", "1000,1"]);
    let message = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "{message}");
    assert!(
        message.contains("sensor-lag")
            && message.contains("time_constant_s")
            && message.contains("greater than 0"),
        "{message}"
    );
}

const CASE: &str = "tests/cases/kuka-kr90-half.toml";

/// Writes the case with an extension, and returns the path of the new file.
fn with_extension(copy: &CopyOfTheTree, name: &str, extension: &str) -> String {
    let text = std::fs::read_to_string(copy.path().join(CASE)).unwrap();
    std::fs::write(copy.path().join(name), format!("{text}\n{extension}")).unwrap();
    name.into()
}

/// Value and 90 % interval of a parameter of the only cause, which must have this name.
#[track_caller]
fn found(answer: &Value, name: &str, key: &str) -> (f64, [f64; 2]) {
    assert_eq!(answer["outcome"], "cause", "{answer:#}");
    let causes = answer["causes"].as_array().unwrap();
    let names: Vec<&Value> = causes.iter().map(|cause| &cause["name"]).collect();
    assert_eq!(names, [name], "{answer:#}");
    let parameter = &causes[0]["parameters"][key];
    let interval = &parameter["ci90"];
    let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("{answer:#}"));
    (
        number(&parameter["value"]),
        [number(&interval[0]), number(&interval[1])],
    )
}

/// A sweep of a structure whose channel x lags: effect and case give the same recording, diagnosis finds the lag, and the extended case is
/// free of causes.
fn a_lag_is_simulated_and_found(copy: &CopyOfTheTree) {
    const TRUTH_S: f64 = 4e-3;
    let sweep = |case: &str, more: &[&str], out: &str| {
        let rig = [
            "simulate",
            case,
            "--experiment",
            "sweep",
            "--direction",
            "x",
            "--frequency-hz",
            "10:25:2",
            "--force-n",
            "20",
            "--measure",
            "displacement",
            "--sample-rate-hz",
            "256",
            "--noise-percent",
            "0.5",
            "--out",
            out,
        ];
        copy.succeeds(copy.binary(), &[&rig[..], more].concat());
        std::fs::read_to_string(copy.path().join(out)).unwrap()
    };
    let effect = format!("sensor-lag={TRUTH_S}");
    let by_effect = sweep(
        CASE,
        &["--effect", &effect, "--effect", "sensor-lag.channel=x"],
        "lag.csv",
    );
    let extension = format!("[extension.sensor-lag]\ntime_constant_s = {TRUTH_S}\nchannel = \"x\"\n");
    let case = with_extension(copy, "lagging.toml", &extension);
    assert!(
        sweep(&case, &[], "lag-by-case.csv") == by_effect,
        "case and effect differ"
    );

    let answer = copy.answers(&["diagnose", CASE, "lag.csv", "--out", "lag"]);
    let (value, [low, high]) = found(&answer, SENSOR_LAG.name, "time_constant_s");
    println!("time constant {value:.3e} s, 90 % from {low:.3e} to {high:.3e} s, truth {TRUTH_S:.3e} s");
    assert!((value / TRUTH_S - 1.0).abs() < 0.05, "{answer:#}");
    assert!(low < TRUTH_S && TRUTH_S < high, "{answer:#}");
    let answer = copy.answers(&["diagnose", "lag/extended.toml", "lag.csv"]);
    assert_eq!(answer["outcome"], "none", "{answer:#}");
}

/// Exponent and reference speed of the hidden effect.
const EXPONENT: f64 = -0.4;
const REFERENCE_M_PER_MIN: f64 = 40.0;

/// Cuts at three spindle speeds under a tangential coefficient that depends on the cutting speed.
fn a_speed_exponent_is_simulated_and_found(copy: &CopyOfTheTree) {
    let name = CUTTING_SPEED_EXPONENT.name;
    let exponent = format!("{name}={EXPONENT}");
    let reference = format!("{name}.reference_m_per_min={REFERENCE_M_PER_MIN}");
    for rpm in ["700", "1000", "1400"] {
        let out = format!("cut-{rpm}.csv");
        copy.succeeds(
            copy.binary(),
            &[
                "simulate",
                CASE,
                "--rpm",
                rpm,
                "--depth-mm",
                "0.5",
                "--seconds",
                "3",
                "--entry",
                "none",
                "--ideal",
                "--measure",
                "displacement",
                "--sample-rate-hz",
                "2048",
                "--noise-percent",
                "1",
                "--effect",
                &exponent,
                "--effect",
                &reference,
                "--out",
                &out,
            ],
        );
    }
    let answer = copy.answers(&["diagnose", CASE, "cut-700.csv", "cut-1000.csv", "cut-1400.csv"]);
    let (value, [low, high]) = found(&answer, name, "exponent");
    println!("exponent {value:.4}, 90 % from {low:.4} to {high:.4}, truth {EXPONENT}");
    assert!((value / EXPONENT - 1.0).abs() < 0.1, "{answer:#}");
    assert!(low < EXPONENT && EXPONENT < high, "{answer:#}");
}

/// First limit, mm, of a case at a spindle speed, rev/min.
fn limit_mm(copy: &CopyOfTheTree, case: &str, rpm: f64) -> f64 {
    let rpm = format!("{rpm}:{rpm}:1");
    let answer = copy.answers(&[
        "lobes",
        case,
        "--rpm",
        &rpm,
        "--depth-mm",
        "0.1:20:80",
        "--no-refine",
    ]);
    let limit = &answer["speeds"][0]["first_limit"]["depth_mm"];
    limit.as_f64().unwrap_or_else(|| panic!("{answer:#}"))
}

/// A sensor changes no limit. The coefficient that depends on speed gives the limit of a case with the coefficient of that speed; a method
/// that takes one coefficient for all speeds refuses it.
fn lobes_treat_both_as_declared(copy: &CopyOfTheTree) {
    let name = CUTTING_SPEED_EXPONENT.name;
    let extension = format!(
        "[extension.{name}]\nexponent = {EXPONENT}\nreference_m_per_min = {REFERENCE_M_PER_MIN}\n\n\
         [extension.sensor-lag]\ntime_constant_s = 0.004\n"
    );
    let extended = with_extension(copy, "speed.toml", &extension);
    let text = std::fs::read_to_string(copy.path().join(CASE)).unwrap();
    for rpm in [700.0, 1400.0] {
        let speed_m_per_min = std::f64::consts::PI * 12.7e-3 * rpm;
        let factor = (speed_m_per_min / REFERENCE_M_PER_MIN).powf(EXPONENT);
        let ktc = format!("ktc_mpa = {}", 76.0 * factor);
        let same = text.replace("ktc_mpa = 76.0", &ktc);
        assert_ne!(same, text);
        std::fs::write(copy.path().join("same.toml"), same).unwrap();
        let (limit, expected) = (limit_mm(copy, &extended, rpm), limit_mm(copy, "same.toml", rpm));
        assert!((limit / expected - 1.0).abs() < 1e-9, "{rpm}: {limit} {expected}");
        let without = limit_mm(copy, CASE, rpm);
        println!("{rpm} rev/min: limit {limit:.3} mm, without the effects {without:.3} mm");
        assert!((limit / without - 1.0).abs() > 0.02, "{rpm}: {limit} {without}");
    }
    let refused = copy.run(
        copy.binary(),
        &[
            "lobes",
            &extended,
            "--rpm",
            "700:1400:3",
            "--depth-mm",
            "0.1:20:80",
            "--method",
            "zoa",
        ],
    );
    let message = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "{message}");
    assert!(
        message.contains(name) && message.contains("--method collocation"),
        "{message}"
    );
}
