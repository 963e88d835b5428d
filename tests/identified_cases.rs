//! Cases that `identify` writes are valid input of `lobes` and `table`.

#![allow(clippy::expect_used, clippy::panic)]

use std::fs;
use std::path::Path;

use quietcut_tests::command::{cases, folder, quietcut};
use serde_json::Value;

/// Writes the robot of the cases to `path`, with these joint angles and with each text of `change` replaced.
fn write_robot(path: &Path, joints_deg: &str, change: &[(&str, &str)]) {
    let mut text = fs::read_to_string(cases().join("six-joint-robot.toml")).expect("the case is there");
    for (from, to) in [&[("[0.0, -70.0, 100.0, 0.0, 20.0, 0.0]", joints_deg)], change].concat() {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    fs::write(path, text).expect("a file can be written");
}

const POSTURES: [&str; 3] = [
    "[0.0, -70.0, 100.0, 0.0, 20.0, 0.0]",
    "[25.0, -85.0, 90.0, 35.0, 45.0, -20.0]",
    "[-15.0, -55.0, 110.0, -40.0, 60.0, 30.0]",
];

fn limit_mm(folder: &Path, case: &str, rpm: &str) -> f64 {
    let range = format!("{rpm}:{rpm}:1");
    let answer = quietcut(
        folder,
        &[
            "lobes",
            case,
            "--rpm",
            &range,
            "--depth-mm",
            "0.5:60:40",
            "--json",
        ],
    )
    .json();
    answer["speeds"][0]["first_limit"]["depth_mm"]
        .as_f64()
        .unwrap_or_else(|| panic!("{answer}"))
}

/// Value and 90 % interval of a parameter. Asserts that the interval contains the value and has a positive width.
#[track_caller]
fn figure(figure: &Value) -> (f64, [f64; 2]) {
    let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("{figure}"));
    let (value, low, high) = (
        number(&figure["value"]),
        number(&figure["ci90"][0]),
        number(&figure["ci90"][1]),
    );
    assert!(low < value && value < high, "{figure}");
    (value, [low, high])
}

#[test]
fn a_robot_goes_from_blows_to_lobes_and_a_table() {
    let folder = folder();
    let path = folder.path();
    let mut records = Vec::new();
    for (index, posture) in POSTURES.iter().enumerate() {
        let case = format!("posture-{index}.toml");
        write_robot(&path.join(&case), posture, &[]);
        for axis in ["x", "y", "z"] {
            let record = format!("blows-{index}-{axis}.csv");
            let seed = (3 * index).to_string();
            quietcut(
                path,
                &[
                    "simulate",
                    &case,
                    "--experiment",
                    "hammer",
                    "--direction",
                    axis,
                    "--force-n",
                    "800",
                    "--impacts",
                    "3",
                    "--spacing-s",
                    "8",
                    "--noise-percent",
                    "1",
                    "--sample-rate-hz",
                    "1024",
                    "--seed",
                    &seed,
                    "--out",
                    &record,
                    "--json",
                ],
            )
            .json();
            records.push(record);
        }
    }
    // The initial guess of a stiffness is 25 % too high.
    let guess = [("stiffness_nm_per_rad = 6.0e6", "stiffness_nm_per_rad = 7.5e6")];
    write_robot(&path.join("guess.toml"), POSTURES[0], &guess);
    let mut arguments = vec!["identify"];
    arguments.extend(records.iter().map(String::as_str));
    arguments.extend([
        "--method",
        "joints",
        "--start",
        "guess.toml",
        "--band-hz",
        "2,60",
        "--out",
        "robot.toml",
        "--json",
    ]);
    let answer = quietcut(path, &arguments).json();
    let joints = answer["joints"].as_array().expect("joints");
    assert_eq!(joints.len(), 6);
    let (second, _) = figure(&joints[1]["parameters"]["stiffness_nm_per_rad"]);
    assert!((second / 6.0e6 - 1.0).abs() < 0.02, "{second}");
    for joint in joints {
        figure(&joint["parameters"]["stiffness_nm_per_rad"]);
        figure(&joint["parameters"]["damping_nms_per_rad"]);
    }
    // The written case has tool, material and cut of the initial case, so that it has lobes. They must be near those of the
    // robot.
    for rpm in ["600", "900"] {
        let (found, truth) = (
            limit_mm(path, "robot.toml", rpm),
            limit_mm(path, "posture-0.toml", rpm),
        );
        println!("{rpm} rev/min: {found:.3} mm, the robot {truth:.3} mm");
        assert!((found / truth - 1.0).abs() < 0.03, "{found} {truth}");
    }
    let table = [
        "table",
        "robot.toml",
        "--rpm",
        "600:900:3",
        "--out",
        "robot.qct",
        "--json",
    ];
    quietcut(path, &table).json();
    let shown = quietcut(path, &["table", "--show", "robot.qct", "--json"]).json();
    assert_eq!(shown["layers"].as_array().map(Vec::len), Some(1), "{shown}");
}

#[test]
fn cubic_joints_are_identified_from_step_sine_tests_at_two_forces() {
    let folder = folder();
    let path = folder.path();
    let cubic = [(
        "damping_nms_per_rad = 3000.0",
        "damping_nms_per_rad = 3000.0\ncubic_stiffness_nm_per_rad3 = -1.0e12",
    )];
    let mut records = Vec::new();
    for (index, posture) in POSTURES[..2].iter().enumerate() {
        let case = format!("posture-{index}.toml");
        write_robot(&path.join(&case), posture, &cubic);
        for axis in ["x", "y", "z"] {
            let record = format!("steps-{index}-{axis}.csv");
            quietcut(
                path,
                &[
                    "simulate",
                    &case,
                    "--experiment",
                    "step-sine",
                    "--direction",
                    axis,
                    "--force-n",
                    "4,16",
                    "--frequency-hz",
                    "3:30:28",
                    "--dwell-s",
                    "14",
                    "--pause-s",
                    "0.5",
                    "--sample-rate-hz",
                    "256",
                    "--measure",
                    "displacement",
                    "--noise-percent",
                    "1",
                    "--out",
                    &record,
                    "--json",
                ],
            )
            .json();
            records.push(record);
        }
    }
    let mut arguments = vec!["identify"];
    arguments.extend(records.iter().map(String::as_str));
    arguments.extend([
        "--method",
        "joints",
        "--start",
        "posture-0.toml",
        "--terms",
        "cubic-stiffness",
        "--harmonics",
        "3",
        "--out",
        "robot.toml",
        "--json",
    ]);
    let answer = quietcut(path, &arguments).json();
    let key = "cubic_stiffness_nm_per_rad3";
    for joint in answer["joints"].as_array().expect("joints") {
        let (value, [low, high]) = figure(&joint["parameters"][key]);
        println!("{}: {value:.3e}, {low:.3e} to {high:.3e}", joint["joint"]);
    }
    let written = fs::read_to_string(path.join("robot.toml")).expect("a case was written");
    assert!(
        written.contains("cubic_stiffness_nm_per_rad3_std") && written.contains("[tool]"),
        "{written}"
    );
    let at = quietcut(path, &["lobes", "robot.toml", "--at", "900,1", "--json"]).json();
    assert_eq!(at["points"][0]["verdict"], "stable", "{at}");
    let other: Vec<&str> = arguments
        .iter()
        .map(|word| {
            if *word == "cubic-stiffness" {
                "mode-coupling"
            } else {
                word
            }
        })
        .collect();
    quietcut(path, &other).refused(&["--terms mode-coupling", "cubic-stiffness"]);
}

#[test]
fn modes_from_chatter_become_a_case_with_lobes() {
    let folder = folder();
    let path = folder.path();
    let case = |name: &str, stiffness: f64| {
        let mass = stiffness / (std::f64::consts::TAU * 922.0).powi(2);
        let text = format!(
            "[structure]\nkind = \"matrices\"\ndirections = [\"x\"]\nmass = [[{mass:e}]]\ndamping = [[{:e}]]\nstiffness = [[{stiffness:e}]]\n\
             [tool]\nteeth = 2\nedge_angle_deg = 90.0\n[material]\nktc_mpa = 600.0\nkrc_mpa = 200.0\nkac_mpa = 0.0\n\
             [cut]\nstart_deg = 90.0\nexit_deg = 180.0\nfeed_per_tooth_mm = 0.1\n",
            0.03 * (stiffness * mass).sqrt()
        );
        fs::write(path.join(name), text).expect("a file can be written");
    };
    case("machine.toml", 1.34e6);
    case("guess.toml", 1.7e6);
    let mut cuts = String::from("rpm,depth_mm,chatter_hz,verdict\n");
    for rpm in ["11000", "17000"] {
        let limit = limit_mm(path, "machine.toml", rpm);
        cuts += &format!("{rpm},{},,stable\n", 0.95 * limit);
        let point = format!("{rpm},{}", 1.08 * limit);
        let at = quietcut(path, &["lobes", "machine.toml", "--at", &point, "--json"]).json();
        let hz = at["points"][0]["chatter_hz"].as_f64().expect("it chatters");
        cuts += &format!("{rpm},{},{hz},chatter\n", 1.08 * limit);
    }
    fs::write(path.join("cuts.csv"), cuts).expect("a file can be written");
    let answer = quietcut(
        path,
        &[
            "identify",
            "cuts.csv",
            "--method",
            "inverse-stability",
            "--start",
            "guess.toml",
            "--out",
            "found.toml",
            "--json",
        ],
    )
    .json();
    let mode = &answer["modes"][0];
    let (hz, _) = figure(&mode["frequency_hz"]);
    figure(&mode["damping_ratio"]);
    figure(&mode["stiffness_n_per_m"]);
    assert!((hz / 922.0 - 1.0).abs() < 0.02, "{hz}");
    for rpm in ["11000", "17000"] {
        let (found, truth) = (
            limit_mm(path, "found.toml", rpm),
            limit_mm(path, "machine.toml", rpm),
        );
        println!("{rpm} rev/min: {found:.3} mm, the machine {truth:.3} mm");
        // The trial cuts bracket the limit to 13 % of the depth.
        assert!((found / truth - 1.0).abs() < 0.13, "{found} {truth}");
    }
    let written = fs::read_to_string(path.join("found.toml")).expect("a case was written");
    assert!(written.contains("damping_ratio_std"), "{written}");
}
