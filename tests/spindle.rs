//! Speed ranges, power and torque of the spindle: the cutting torque of a simulated cut, and no proposal beyond them
#![allow(clippy::expect_used, clippy::panic)]

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::path::Path;

use quietcut::device::pseudo_terminal::PseudoTerminal;
use quietcut_tests::command::{alone, binary, cases, done, folder, quietcut, words};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

/// A case of the folder `tests/cases` with a diameter of the tool, other lines and further ones at its end.
fn write(folder: &Path, name: &str, replace: &[(&str, &str)], end: &str) {
    let mut text = std::fs::read_to_string(cases().join(name)).expect("a case");
    if !text.contains("diameter_mm") {
        text = text.replace(
            "edge_angle_deg = 90.0",
            "edge_angle_deg = 90.0\ndiameter_mm = 12.0",
        );
    }
    for (old, new) in replace {
        assert!(text.contains(old), "{name} has no {old}");
        text = text.replace(old, new);
    }
    std::fs::write(folder.join("case.toml"), format!("{text}\n{end}")).expect("written");
}

/// Speeds of the robot's spindle with two gears, rev/min.
const LIMITS: &str =
    "[limits]\nrpm_min = 700.0\nrpm_max = 2000.0\nranges_rpm = [[700.0, 1150.0], [1250.0, 2000.0]]\n";

/// Depth, mm, that 7 W drive at a speed, rev/min, in the cut of `kuka-kr90-acetal`: 2 teeth, 6.35 mm radius, down-milling
/// at half immersion, 119 MPa and 0.15 mm per tooth need 0.0361 N·m/mm. It is 1.85 mm at 1 000 rev/min.
fn driven_mm(rpm: f64) -> f64 {
    let torque_nm_per_mm = 2.0 * 6.35e-3 / TAU * 119.0 * 0.15;
    7.0 / (torque_nm_per_mm * TAU * rpm / 60.0)
}

/// True for a cut within [`LIMITS`] and 7 W.
fn is_possible(rpm: f64, depth_mm: f64) -> bool {
    let allowed = (700.0..=1150.0).contains(&rpm) || (1250.0..=2000.0).contains(&rpm);
    // Depths in a table are rounded to 16 bits.
    allowed && depth_mm <= driven_mm(rpm) * (1.0 + 1e-4)
}

fn json(folder: &Path, line: &str) -> Value {
    quietcut(folder, &words(line)).json()
}

#[test]
fn the_torque_of_a_simulated_cut_is_that_of_the_limit() {
    let folder = folder();
    // 1 N·m of torque: the depth that the spindle can drive is the reciprocal of the torque per mm.
    write(
        folder.path(),
        "insperger-2dof-ad0.5.toml",
        &[("kte_n_per_mm = 0.0", "kte_n_per_mm = 15.0")],
        "[limits]\nrpm_min = 5000.0\nrpm_max = 20000.0\ntorque_nm = 1.0\n",
    );
    let answer = json(
        folder.path(),
        "lobes case.toml --rpm 9000:10000:2 --depth-mm 0:1:40 --no-refine --json",
    );
    let driven = &answer["spindle"]["driven"][1];
    assert_eq!(driven["by"], "torque", "{answer}");
    let torque_nm_per_mm = 1.0 / driven["depth_mm"].as_f64().expect("a depth");
    // The forces of a simulated cut 0.1 mm deep, with the vibration of the tool. One of the two teeth cuts at a time,
    // from 90° to 180°, so that the tangential force follows from the force in feed and normal direction.
    done(
        folder.path(),
        "simulate case.toml --rpm 10000 --depth-mm 0.1 --seconds 1 --sample-rate-hz 50000 --ideal --measure none --out cut.csv",
    );
    let text = std::fs::read_to_string(folder.path().join("cut.csv")).expect("a recording");
    // Within full engagement, over 30 whole revolutions.
    let (mut sum, mut count) = (0.0, 0.0);
    for line in text.lines().skip(1) {
        let row: Vec<f64> = line
            .split(',')
            .map(|cell| cell.parse().expect("a number"))
            .collect();
        if (0.4..0.58).contains(&row[0]) {
            let phi = (TAU * 10_000.0 / 60.0 * row[0]) % PI;
            if phi > FRAC_PI_2 {
                sum += row[2] * phi.sin() - row[1] * phi.cos();
            }
            count += 1.0;
        }
    }
    let simulated = 0.006 * sum / count / 0.1;
    // Ends of the engagement fall between samples: one of 150 samples of a tooth's quarter revolution at each end, where
    // the force is at most a few times its mean, but drawn evenly; and the transient of the entry at 0.23 s.
    assert!(
        (simulated / torque_nm_per_mm - 1.0).abs() < 0.01,
        "{simulated} {torque_nm_per_mm}"
    );
}

#[test]
fn no_cut_beyond_the_spindle_is_proposed() {
    let folder = folder();
    write(
        folder.path(),
        "kuka-kr90-acetal.toml",
        &[],
        &format!("{LIMITS}power_w = 7.0\n"),
    );
    let lobes = json(
        folder.path(),
        "lobes case.toml --rpm 700:2000:14 --depth-mm 0:6:60 --json --out lobes.svg --out lobes.html",
    );
    let proposal = &lobes["spindle"]["proposal"];
    let number = |value: &Value, key: &str| value[key].as_f64().expect("a number");
    assert!(
        is_possible(number(proposal, "rpm"), number(proposal, "depth_mm")),
        "{proposal}"
    );
    assert_eq!(
        lobes["spindle"]["allowed_rpm"],
        serde_json::json!([[700.0, 1150.0], [1250.0, 2000.0]])
    );
    for driven in lobes["spindle"]["driven"].as_array().expect("depths") {
        assert_eq!(driven["by"], "power");
        let expected = driven_mm(number(driven, "rpm"));
        assert!(
            (number(driven, "depth_mm") / expected - 1.0).abs() < 1e-9,
            "{driven}"
        );
    }
    for file in ["lobes.svg", "lobes.html"] {
        let chart = std::fs::read_to_string(folder.path().join(file)).expect("a chart");
        assert!(
            chart.contains("beyond the spindle") && chart.contains("power or torque"),
            "{file}"
        );
    }
    let points = json(
        folder.path(),
        "lobes case.toml --at 1200,1 --at 1380,2 --at 1380,1 --json",
    );
    // Speeds in the gap alone, and no power.
    let said = |line: &str| quietcut(folder.path(), &words(line)).stdout;
    let chart = "--depth-mm 0:6:60 --no-refine --nominal";
    let gap = said(&format!("lobes case.toml --rpm 1160:1240:3 {chart}"));
    assert!(gap.contains("lies no speed of the chart"), "{gap}");
    // Speeds 10 % apart leave out those near the proposed one, speeds 0.5 % apart do not.
    let alone = "not all speeds within ±1 % of it were computed";
    let far = said(&format!("lobes case.toml --rpm 1000:1100:2 {chart}"));
    assert!(far.contains(alone), "{far}");
    let near = said(&format!("lobes case.toml --rpm 1000:1100:21 {chart}"));
    assert!(near.contains("speed times depth is largest"), "{near}");
    let beyond: Vec<_> = points["beyond_spindle"]
        .as_array()
        .expect("points")
        .iter()
        .map(|one| &one["by"])
        .collect();
    assert_eq!(beyond, ["speed", "power"]);
    // plan.
    let plan = json(
        folder.path(),
        "plan case.toml --rpm 700:2000:14 --depth-mm 0:6:60 --width-percent 15 --json",
    );
    let mut cuts = 0;
    for test in plan["tests"].as_array().expect("tests") {
        let depth = ["about_mm", "depth_mm"]
            .iter()
            .find_map(|key| test[*key].as_f64());
        if let (Some(rpm), Some(depth_mm)) = (test["rpm"].as_f64(), depth) {
            cuts += 1;
            assert!(is_possible(rpm, depth_mm), "{test}");
        }
    }
    assert!(cuts > 0, "{plan}");
}

#[test]
fn the_device_advises_no_cut_beyond_the_spindle() {
    let folder = folder();
    write(
        folder.path(),
        "kuka-kr90-acetal.toml",
        &[],
        &format!("{LIMITS}power_w = 7.0\n"),
    );
    let run = |line: &str| {
        let arguments: Vec<&str> = line.split_whitespace().collect();
        quietcut(folder.path(), &arguments)
    };
    run("simulate case.toml --rpm 1045 --depth-mm 2 --seconds 6 --out cut.csv");
    run("table case.toml --depth-mm 5 --speeds 60 --out limited.qct");
    write(folder.path(), "kuka-kr90-acetal.toml", &[], "");
    run("table case.toml --rpm 700:2000 --depth-mm 5 --speeds 60 --out free.qct");
    let advised = |table: &str| -> Vec<(f64, f64)> {
        let answer = json(folder.path(), &format!("replay cut.csv --table {table} --json"));
        let verdicts = answer["verdicts"].as_array().expect("verdicts").clone();
        let advice = verdicts.iter().map(|verdict| &verdict["advice"]);
        advice
            .filter(|advice| advice["action"] != "keep")
            .filter_map(|advice| Some((advice["rpm"].as_f64()?, advice["depth_mm"].as_f64()?)))
            .collect()
    };
    // Without limits 2 mm at 1 024 rev/min are advised.
    let (free, limited) = (advised("free.qct"), advised("limited.qct"));
    assert!(
        free.iter().any(|(rpm, depth)| !is_possible(*rpm, *depth)),
        "{free:?}"
    );
    assert!(
        !limited.is_empty() && limited.iter().all(|(rpm, depth)| is_possible(*rpm, *depth)),
        "{limited:?}"
    );
}

#[test]
fn a_table_of_speeds_that_the_spindle_may_not_run_at_is_said_to_advise_nothing() {
    let folder = folder();
    let limits = "[limits]\nrpm_min = 5000.0\nrpm_max = 20000.0\nranges_rpm = [[5000.0, 9000.0], [12000.0, 20000.0]]\n";
    write(folder.path(), "insperger-1dof-ad1.toml", &[], limits);
    let said = |range: &str| {
        let line = format!("table case.toml --rpm {range} --speeds 5 --depth-mm 1 --out table.qct");
        quietcut(folder.path(), &words(&line)).stderr
    };
    let gap = said("10000:11000");
    assert!(
        gap.contains("no advice") && gap.contains("12000 to 20000"),
        "{gap}"
    );
    assert!(!said("8000:11000").contains("no advice"));
}

#[test]
fn power_of_a_tool_without_diameter_is_not_considered_and_the_key_is_named() {
    let folder = folder();
    write(
        folder.path(),
        "insperger-1dof-ad1.toml",
        &[("diameter_mm = 12.0\n", "")],
        "[limits]\nrpm_min = 5000.0\nrpm_max = 20000.0\npower_w = 100.0\n",
    );
    for line in [
        "lobes case.toml --rpm 9000:10000:2 --depth-mm 0:1:40",
        "table case.toml --speeds 20 --out a.qct",
    ] {
        let output = quietcut(folder.path(), &words(line));
        assert!(output.stderr.contains("diameter_mm"), "{line}: {}", output.stderr);
    }
}

/// Case `name` of a tool with one mode in x of the modal mass 0.04 kg, of the frequency in Hz and the residue −i·`residue`,
/// at a speed, rev/min.
fn write_tool(folder: &Path, name: &str, speed: &str, frequency_hz: f64, residue: f64) {
    let half = residue.sqrt();
    let text = format!(
        "[structure]\nkind = \"modes\"\ndirections = [\"x\"]\n{speed}\n[[structure.mode]]\nfrequency_hz = {frequency_hz:?}\n\
         damping_ratio = 0.02\nleft = [[0.0, {}]]\nright = [[{half}, 0.0]]\n[tool]\nteeth = 2\nedge_angle_deg = 90.0\n[material]\n\
         ktc_mpa = 600.0\nkrc_mpa = 200.0\nkac_mpa = 0.0\n[cut]\nstart_deg = 90.0\nexit_deg = 180.0\nfeed_per_tooth_mm = 0.1\n",
        -half
    );
    std::fs::write(folder.join(name), text).expect("written");
}

/// Residue of a real mode of the modal mass 0.04 kg, to first order in the damping ratio: 1/(2ωm).
fn residue(frequency_hz: f64) -> f64 {
    1.0 / (2.0 * TAU * frequency_hz * 0.04)
}

#[test]
fn limits_follow_the_structure_of_each_speed() {
    let folder = folder();
    let at = folder.path();
    write_tool(at, "still.toml", "rpm = 0", 900.0, residue(900.0));
    write_tool(at, "fast.toml", "rpm = 20000", 700.0, residue(700.0));
    write_tool(at, "unknown.toml", "", 700.0, residue(700.0));
    // The structure half-way, at 10 000 rev/min.
    write_tool(
        at,
        "between.toml",
        "rpm = 10000",
        800.0,
        0.5 * (residue(900.0) + residue(700.0)),
    );
    let limits = |files: &str| -> (Vec<f64>, Value) {
        let answer = json(
            at,
            &format!("lobes {files} --rpm 10000:20000:2 --depth-mm 0:20:60 --no-refine --json"),
        );
        let speeds = answer["speeds"].as_array().expect("speeds").iter();
        let depths = speeds.map(|line| line["first_limit"]["depth_mm"].as_f64().expect("a limit"));
        (depths.collect(), answer["assumed"].clone())
    };
    let (both, assumed) = limits("still.toml --at-speed fast.toml");
    let (between, fast) = (limits("between.toml").0, limits("fast.toml").0);
    // Each limit states an error of 1e-6 mm.
    assert!((both[0] - between[0]).abs() < 2e-6, "{both:?} {between:?}");
    assert!((both[1] - fast[1]).abs() < 2e-6, "{both:?} {fast:?}");
    assert!(
        assumed.to_string().contains("between 0, 20000 rev/min"),
        "{assumed}"
    );
    let (still, assumed) = limits("still.toml");
    assert!((still[1] / fast[1] - 1.0).abs() > 0.1, "{still:?} {fast:?}");
    assert!(assumed.to_string().contains("at standstill"), "{assumed}");
    let refused = |line: &str, expected: &[&str]| quietcut(at, &words(line)).refused(expected);
    refused(
        "lobes still.toml --at-speed unknown.toml --at 9000,1",
        &["unknown.toml", "rpm"],
    );
    refused(
        "lobes still.toml --at-speed fast.toml --method zoa --at 9000,1",
        &["at_speed", "collocation"],
    );
    refused(
        "lobes still.toml --at-speed fast.toml --at-speed fast.toml --at 9000,1",
        &["fast.toml: its structure holds at 20000 rev/min"],
    );
}

/// Frequency, Hz, between two others at which the record of a column from a time on has the largest amplitude.
fn peak_hz(file: &Path, column: usize, from_s: f64, [low, high]: [f64; 2]) -> f64 {
    let text = std::fs::read_to_string(file).expect("a recording");
    let rows = text.lines().skip(1).map(|line| {
        let cells: Vec<f64> = line
            .split(',')
            .map(|cell| cell.parse().expect("a number"))
            .collect();
        (cells[0], cells[column])
    });
    let samples: Vec<(f64, f64)> = rows.filter(|(time_s, _)| *time_s > from_s).collect();
    let mean = samples.iter().map(|(_, value)| value).sum::<f64>() / samples.len() as f64;
    let amplitude = |hertz: f64| {
        let (mut re, mut im) = (0.0, 0.0);
        for (index, (time_s, value)) in samples.iter().enumerate() {
            let window = 0.5 - 0.5 * (TAU * index as f64 / samples.len() as f64).cos();
            re += window * (value - mean) * (TAU * hertz * time_s).cos();
            im += window * (value - mean) * (TAU * hertz * time_s).sin();
        }
        re.hypot(im)
    };
    let steps = ((high - low) / 0.25).floor() as usize;
    let lines = (0..steps).map(|step| low + 0.25 * step as f64);
    let largest = lines.max_by(|a, b| amplitude(*a).total_cmp(&amplitude(*b)));
    largest.expect("a frequency")
}

#[test]
fn a_check_cut_rescales_the_chart_of_taps_at_standstill() {
    let folder = folder();
    let at = folder.path();
    // The mode of the running spindle has 7 % less frequency, at the same modal mass.
    write_tool(at, "still.toml", "# By taps.\nrpm = 0", 900.0, residue(900.0));
    write_tool(at, "true.toml", "rpm = 10500", 837.0, residue(837.0));
    // A cut 8 % deeper than the true limit, 0.924 mm, chatters. Its tooth-passing frequency is 350 Hz.
    done(
        at,
        "simulate true.toml --rpm 10500 --depth-mm 1 --seconds 1 --sample-rate-hz 8192 --ideal --measure displacement --out cut.csv",
    );
    let chatter_hz = peak_hz(&at.join("cut.csv"), 2, 0.4, [750.0, 900.0]);
    std::fs::write(
        at.join("cuts.csv"),
        format!("rpm,depth_mm,chatter_hz,verdict\n10500,1,{chatter_hz},chatter\n"),
    )
    .expect("written");
    let chart = "--rpm 9500:12000:6 --depth-mm 0:8:60 --no-refine --nominal --json";
    let rescaled = json(
        at,
        &format!("lobes still.toml --cuts cuts.csv --rescale {chart} --out running.toml"),
    );
    let mode = &rescaled["rescaling"]["modes"][0];
    let ci90 = [0, 1].map(|end| mode["factor_ci90"][end].as_f64().expect("a number"));
    assert!((ci90[0]..ci90[1]).contains(&0.93), "{mode}");
    assert!(ci90[1] - ci90[0] < 0.03, "{mode}");
    let limits = |answer: &Value| -> Vec<f64> {
        let speeds = answer["speeds"].as_array().expect("speeds").iter();
        let depths = speeds.map(|line| line["first_limit"]["depth_mm"].as_f64().expect("a limit"));
        depths.collect()
    };
    let found = limits(&rescaled);
    let truth = limits(&json(at, &format!("lobes true.toml {chart}")));
    let still = limits(&json(at, &format!("lobes still.toml {chart}")));
    // A limit moves by at most 12 % per percent of the natural frequency, at 9 500 rev/min; the factor is within 0.1 %, as the
    // spectrum of 0.6 s shows its peak within 0.5 Hz.
    let furthest = |depths: &[f64]| {
        let errors = depths
            .iter()
            .zip(&truth)
            .map(|(depth, truth)| (depth / truth - 1.0).abs());
        errors.fold(0.0, f64::max)
    };
    assert!(furthest(&found) < 0.02, "{found:?} {truth:?}");
    assert!(furthest(&still) > 0.5, "{still:?} {truth:?}");
    // The written case has the same limits, its comments, and says what was done instead of standstill.
    let text = std::fs::read_to_string(at.join("running.toml")).expect("a case");
    assert!(
        text.contains("# By taps.") && text.contains("rpm = 10500.0"),
        "{text}"
    );
    let written = json(at, &format!("lobes running.toml {chart}"));
    assert_eq!(limits(&written), found);
    let assumed = written["assumed"].to_string();
    assert!(
        assumed.contains("from the chatter frequency of cuts at 10500 rev/min")
            && !assumed.contains("standstill"),
        "{assumed}"
    );
}

#[test]
fn a_cut_that_tells_no_frequency_rescales_nothing() {
    let folder = folder();
    let at = folder.path();
    write_tool(at, "still.toml", "rpm = 0", 900.0, residue(900.0));
    let rows = [
        ("10500,1,,chatter", "10500 rev/min, 1 mm", "was not measured"),
        ("10500,1,,stable", "10500 rev/min, 1 mm", "did not chatter"),
        ("10500,1,840,marginal", "10500 rev/min, 1 mm", "marginal"),
        // Three halves of the tooth-passing frequency, where no cut is predicted to double its period, and one half where one is.
        ("10500,1,525,chatter", "10500 rev/min, 1 mm", "20 % lower"),
        ("44000,3,733,chatter", "44000 rev/min, 3 mm", "double its period"),
    ];
    for (row, cut, reason) in rows {
        let table = format!("rpm,depth_mm,chatter_hz,verdict\n{row}\n");
        std::fs::write(at.join("cuts.csv"), table).expect("written");
        let line = "lobes still.toml --cuts cuts.csv --rescale --rpm 9500:12000:6 --depth-mm 0:8:60";
        quietcut(at, &words(line)).refused(&["still.toml", cut, reason]);
    }
    let line =
        "lobes still.toml --cuts cuts.csv --chatter-error-percent 1 --rpm 9500:12000:6 --depth-mm 0:8:60";
    quietcut(at, &words(line)).refused(&["--rescale"]);
    let line = "lobes still.toml --rpm 9500:12000:6 --depth-mm 0:8:60 --out other.toml";
    quietcut(at, &words(line)).refused(&["other.toml", "--rescale"]);
}

#[test]
fn a_terminal_is_asked_once_for_the_speeds_of_the_spindle() {
    let folder = folder();
    let at = folder.path();
    write_tool(at, "tool.toml", "rpm = 0 # by taps", 900.0, residue(900.0));
    let line = "lobes tool.toml --rpm 8000:12000:5 --depth-mm 0:8:60 --no-refine";
    // Neither a script nor JSON is asked.
    done(at, line);
    let before = std::fs::read_to_string(at.join("tool.toml")).expect("a case");
    assert!(!before.contains("[limits]"));
    let said = on_terminal(at, line, "9000:11000\n");
    assert!(said.contains("Lowest and highest speed of the spindle"), "{said}");
    let after = std::fs::read_to_string(at.join("tool.toml")).expect("a case");
    assert!(after.starts_with(before.trim_end()), "{after}");
    assert!(
        after.contains("rpm_min = 9000.0") && after.contains("rpm_max = 11000.0"),
        "{after}"
    );
    // The chart of the same command keeps within them, and the second one asks nothing.
    assert!(said.contains("outside the speeds of the spindle"), "{said}");
    let said = on_terminal(at, line, "");
    assert!(!said.contains("Lowest and highest"), "{said}");
}

/// Output of the command on a terminal where the user types `answer`.
fn on_terminal(folder: &Path, line: &str, answer: &str) -> String {
    let guard = alone();
    let mut terminal = PseudoTerminal::new().expect("a pseudo-terminal");
    let open = || {
        let end = std::fs::OpenOptions::new()
            .read(true)
            .write(true)
            .open(terminal.path());
        std::process::Stdio::from(end.expect("the end of the command"))
    };
    let mut child = std::process::Command::new(binary())
        .args(words(line))
        .current_dir(folder)
        .stdin(open())
        .stdout(open())
        .stderr(open())
        .spawn()
        .expect("the command can be started");
    drop(guard);
    let moment = std::time::Duration::from_millis(20);
    terminal
        .send(answer.as_bytes(), moment)
        .expect("the line is there");
    let (mut said, mut bytes) = (Vec::new(), [0; 4096]);
    let began = std::time::Instant::now();
    let mut has_ended = false;
    loop {
        let count = terminal.receive(&mut bytes, moment).unwrap_or(0);
        said.extend_from_slice(&bytes[..count]);
        if has_ended && count == 0 {
            break;
        }
        has_ended = child.try_wait().expect("the command can be waited for").is_some();
        if began.elapsed() > std::time::Duration::from_secs(30) {
            child.kill().expect("the command can be killed");
            panic!("the command did not end: {}", String::from_utf8_lossy(&said));
        }
    }
    String::from_utf8_lossy(&said).into_owned()
}

#[test]
fn taps_at_standstill_are_said_in_the_chart() {
    let folder = folder();
    let at = folder.path();
    write_tool(at, "tool.toml", "", 900.0, residue(900.0));
    done(
        at,
        "simulate tool.toml --experiment hammer --direction x --force-n 50 --pulse-ms 0.2 --impacts 3 --spacing-s 0.5 --sample-rate-hz 8192 --noise-percent 0.1 --out tap.csv",
    );
    let identified = |options: &str| {
        done(
            at,
            &format!("identify tap.csv --method modes --case tool.toml --out found.toml {options}"),
        );
        let chart = json(at, "lobes found.toml --at 9000,1 --json");
        chart["assumed"].to_string()
    };
    assert!(!identified("").contains("standstill"));
    assert!(identified("--rpm 0").contains("at standstill"));
    assert!(!identified("--rpm 9000").contains("standstill"));
    let refused = quietcut(at, &words("identify tap.csv --method force-coefficients --rpm 0"));
    refused.refused(&["--rpm", "force-coefficients"]);
    // A speed that no case can state.
    let refused = quietcut(
        at,
        &words("identify tap.csv --method modes --rpm 1e9 --out found.toml"),
    );
    refused.refused(&["--rpm", "1000000 rev/min"]);
}

#[test]
fn taps_with_a_tachometer_keep_its_speed() {
    let folder = folder();
    let at = folder.path();
    write_tool(at, "tool.toml", "", 900.0, residue(900.0));
    done(
        at,
        "simulate tool.toml --experiment hammer --direction x --force-n 50 --pulse-ms 0.2 --impacts 3 --spacing-s 0.5 --sample-rate-hz 8192 --noise-percent 0.1 --out tap.csv",
    );
    let text = std::fs::read_to_string(at.join("tap.csv")).expect("a recording");
    // A pulse of 10 % of the revolution at 9 000 rev/min, or none.
    let with_tachometer = |rpm: f64| -> String {
        let rows = text.lines().enumerate().map(|(index, line)| {
            let time_s = line.split(',').next().and_then(|cell| cell.parse::<f64>().ok());
            let is_pulse = time_s.is_some_and(|time_s| rpm > 0.0 && (rpm / 60.0 * time_s) % 1.0 < 0.1);
            let cell = match (index, is_pulse) {
                (0, _) => "tacho [V]",
                (_, true) => "5",
                (_, false) => "0",
            };
            format!("{line},{cell}\n")
        });
        rows.collect()
    };
    done(
        at,
        "setup mill --teeth 2 --diameter-mm 12.7 --ktc-mpa 119 --krc-mpa 20.2 --kac-mpa 39.3 --down-milling-mm 6.35 --feed-per-tooth-mm 0.15 --rpm 600:2400",
    );
    for part in ["taps", "frf"] {
        std::fs::create_dir_all(at.join("mill").join(part)).expect("a folder");
    }
    for (rpm, proposed, warned) in [(0.0, "--rpm 0 ", "--rpm 9000"), (9000.0, "--case", "--rpm 0")] {
        std::fs::write(at.join("mill/taps/x.csv"), with_tachometer(rpm)).expect("written");
        let table = "frequency_hz,hxx_re [m/N],hxx_im [m/N]\n890,1e-7,-1e-6\n900,0,-2e-6\n910,-1e-7,-1e-6\n";
        std::fs::write(at.join("mill/frf/tool-tip.csv"), table).expect("written");
        let step = json(at, "next mill --json");
        let command = step["command"].as_str().expect("a command");
        assert!(
            command.starts_with(&format!(
                "quietcut identify mill/taps/x.csv --method modes {proposed}"
            )),
            "{step}"
        );
        let identified = |options: &str| {
            quietcut(
                at,
                &words(&format!(
                    "identify mill/taps/x.csv --method modes --json {options}"
                )),
            )
        };
        let answer = identified("").json();
        let found = answer["structure_rpm"].as_f64().expect("a speed");
        // The tachometer's edges lie between samples, over 1.5 s.
        assert!((found - rpm).abs() <= 1e-3 * rpm, "{found}");
        let says = |options: &str| {
            identified(options).json()["warnings"]
                .to_string()
                .contains("tachometer in the recordings says")
        };
        assert!(says(warned) && !says(&format!("--rpm {}", 1.005 * rpm)), "{rpm}");
    }
}

#[test]
fn charts_and_plans_propose_nothing_beyond_random_limits() {
    let folder = folder();
    let at = folder.path();
    let seed = 20_261_126;
    println!("seed {seed}");
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut proposals = 0;
    for _ in 0..6 {
        // Two ranges of speed with a gap, and a power from a tenth of the one of the stable cuts to all of it.
        let mut ends: Vec<f64> = (0..4).map(|_| random.random_range(700.0..2000.0)).collect();
        ends.sort_by(f64::total_cmp);
        let power_w = random.random_range(1.0..12.0);
        let limits = format!(
            "[limits]\nrpm_min = {:?}\nrpm_max = {:?}\nranges_rpm = [[{:?}, {:?}], [{:?}, {:?}]]\npower_w = {power_w:?}\n",
            ends[0], ends[3], ends[0], ends[1], ends[2], ends[3]
        );
        write(at, "kuka-kr90-acetal.toml", &[], &limits);
        let check = |cut: &Value, depth_mm: &Value| {
            let (rpm, depth_mm) = (cut["rpm"].as_f64()?, depth_mm.as_f64()?);
            let is_allowed = (ends[0]..=ends[1]).contains(&rpm) || (ends[2]..=ends[3]).contains(&rpm);
            // The depth that 7 W drive, in proportion to the power.
            let is_driven = depth_mm <= driven_mm(rpm) * power_w / 7.0 * (1.0 + 1e-9);
            assert!(is_allowed && is_driven, "{limits}: {cut}");
            Some(())
        };
        let lobes = json(
            at,
            "lobes case.toml --rpm 700:2000:27 --depth-mm 0:6:60 --no-refine --json",
        );
        let proposal = &lobes["spindle"]["proposal"];
        proposals += usize::from(check(proposal, &proposal["depth_mm"]).is_some());
        let plan = quietcut(
            at,
            &words("plan case.toml --rpm 700:2000:14 --depth-mm 0:6:60 --width-percent 25 --json"),
        );
        if plan.status == Some(2) {
            // No speed of the plan lies within the limits.
            continue;
        }
        for test in plan.json()["tests"].as_array().expect("tests") {
            for key in ["about_mm", "depth_mm"] {
                proposals += usize::from(check(test, &test[key]).is_some());
            }
        }
    }
    assert!(proposals >= 6, "{proposals}");
}
