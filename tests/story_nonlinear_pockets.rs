//! Story: the lobes of a linear model are wrong in the pockets, between the lobes at large depths.
//!
//! The campaign of the thesis on a virtual robot with the cubic terms of Table 6.2. A hammer test identifies its linear part,
//! whose lobes are the baseline. Cuts at half immersion have ten speeds from 480 to 620 rev/min and eight depths. Each cut is
//! called stable or unstable from its vibration once per tooth. These calls are compared with the lobes before and after the
//! cubic terms are identified. `diagnose` then gets the baseline, shaker records and the cuts. It names the cubic terms and
//! predicts the calls of the cuts.
//!
//! To see the tables, and pictures in a folder: `QUIETCUT_STORY=DIR cargo test --release -p quietcut-tests --test
//! story_nonlinear_pockets -- --nocapture`

#![allow(clippy::expect_used, clippy::panic)]

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use nalgebra::DVector;
use num_complex::Complex64;
use quietcut::case::Case;
use quietcut::frf::FrfTable;
use quietcut::identify::harmonic_balance::{Grid, Problem as HarmonicProblem};
use quietcut::identify::law::{Law, NonlinearTerm, Role};
use quietcut::orbit::ForcedProblem;
use quietcut::report::lobe_chart::{Column, lobe_chart};
use quietcut::report::marks::Mark;
use quietcut::simulate::{Entry, Settings, SimulateError, VirtualCut, Workspace};
use quietcut::stability::{
    Chart, Collocation, CubicTerms, FrequencyProblem, Method, MultiFrequency, Problem, chart,
};
use quietcut::structure::{Form, Matrices};
use quietcut::trial_cuts::{Calls, Outcome, TrialCut};
use quietcut_testkit::results::Campaign;
use quietcut_tests::command::{cases, folder, quietcut};
use rayon::prelude::*;

/// True case of the robot.
const TRUTH: &str = "kuka-kr90-half-cubic";
/// Baseline case of the robot from a tap test.
const BELIEF: &str = "kuka-kr90-half";

/// Largest depth of the chart, mm.
const DEPTH_MM: f64 = 18.0;

fn case(name: &str) -> Case {
    Case::read(cases().join(format!("{name}.toml"))).expect("the case is there")
}

fn matrices(case: &Case) -> &Matrices {
    match &case.structure().expect("a structure").form {
        Form::Matrices(matrices) => matrices,
        _ => panic!("{}: matrices are needed", case.name),
    }
}

fn believed(case: &Case) -> Collocation {
    Collocation {
        problem: Problem::new(case, CubicTerms::LeaveOut).expect("a linear part"),
    }
}

fn forced(case: &Case) -> ForcedProblem {
    ForcedProblem::new(case).expect("a forced problem")
}

/// The call of a cut from displacements sampled once per tooth. In a stable cut these converge to one point.
#[derive(Clone, Copy, Debug)]
struct Judged {
    /// Root mean square of the steps from tooth to tooth in the last eighth of the cut, divided by the feed per tooth.
    unrest: f64,
    /// Growth of these steps per tooth over the last three eighths of the cut. For small steps it is about the largest Floquet
    /// multiplier.
    growth: f64,
    /// Half the peak-to-peak displacement in x and y in the last eighth of the cut, m.
    swing_m: [f64; 2],
    outcome: Outcome,
}

/// Number of instants per tooth period at which the displacement is sampled.
const INSTANTS: usize = 16;

/// Steps smaller than this share of the feed per tooth count as stable; steps larger than the second one count as chatter.
const QUIET: f64 = 1e-3;
const LOUD: f64 = 0.05;

/// Simulates a cut from rest with full engagement from the start, over `teeth` tooth passings.
fn judged(case: &Case, rpm: f64, depth_mm: f64, teeth: usize) -> Judged {
    let period_s = 60.0 / (rpm * case.tool().expect("a tool").teeth as f64);
    let seconds = period_s * (teeth as f64 + 1.5);
    let cut = VirtualCut {
        entry: Entry::None,
        ..VirtualCut::new(rpm, depth_mm, seconds)
    };
    let model = cut.model(case).expect("a cut");
    let count = INSTANTS * (teeth + 1);
    let mut motion: Vec<[f64; 3]> = Vec::with_capacity(count);
    let mut room = Workspace::new(&model);
    let run = model.run(seconds, Settings::default(), |segment| {
        while motion.len() < count {
            let t = (motion.len() + 1) as f64 * period_s / INSTANTS as f64;
            if t > segment.to_s() {
                break;
            }
            motion.push(segment.motion(t, &mut room).displacement_m);
        }
    });
    match run {
        Ok(_) => {}
        Err(SimulateError::Diverged { .. }) => {
            return Judged {
                unrest: f64::INFINITY,
                growth: f64::INFINITY,
                swing_m: [f64::INFINITY; 2],
                outcome: Outcome::Chatter,
            };
        }
        Err(error) => panic!("{rpm} rev/min, {depth_mm} mm: {error}"),
    }
    let feed_m = 1e-3 * case.cut().expect("a cut").feed_per_tooth_mm;
    let once_per_tooth: Vec<[f64; 3]> = motion.iter().step_by(INSTANTS).copied().collect();
    let steps: Vec<f64> = once_per_tooth
        .windows(2)
        .map(|pair| (0..3).map(|axis| (pair[1][axis] - pair[0][axis]).powi(2)).sum())
        .collect();
    let eighth = steps.len() / 8;
    let size = |from_end: usize| {
        let to = steps.len() - from_end * eighth;
        (steps[to - eighth..to].iter().sum::<f64>() / eighth as f64).sqrt() / feed_m
    };
    let (earlier, unrest) = (size(2), size(0));
    let growth = (unrest / earlier).powf(1.0 / (2 * eighth) as f64);
    // A decaying vibration would become small only later, so that its growth decides. The amplitude of a torus varies, so that a
    // growth near 1 decides little.
    let at_end = unrest * growth.powi(4 * teeth as i32);
    let outcome = if unrest < QUIET || (growth < 0.995 && at_end < QUIET) {
        Outcome::Stable
    } else if unrest > LOUD && growth > 0.998 {
        Outcome::Chatter
    } else {
        Outcome::Marginal
    };
    let last = &motion[motion.len() - INSTANTS * eighth..];
    let swing = |axis: usize| {
        let ends = last
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), point| {
                (low.min(point[axis]), high.max(point[axis]))
            });
        0.5 * (ends.1 - ends.0)
    };
    Judged {
        unrest,
        growth,
        swing_m: [swing(0), swing(1)],
        outcome,
    }
}

/// The cuts of the campaign, at every speed and every depth.
fn campaign(case: &Case, speeds_rpm: &[f64], depths_mm: &[f64], teeth: usize) -> Vec<(TrialCut, Judged)> {
    let points: Vec<(f64, f64)> = depths_mm
        .iter()
        .flat_map(|&depth_mm| speeds_rpm.iter().map(move |&rpm| (rpm, depth_mm)))
        .collect();
    points
        .par_iter()
        .map(|&(rpm, depth_mm)| {
            let judged = judged(case, rpm, depth_mm, teeth);
            let outcome = judged.outcome;
            (
                TrialCut {
                    rpm,
                    depth_mm,
                    outcome,
                    chatter_hz: None,
                },
                judged,
            )
        })
        .collect()
}

/// The ten spindle speeds of the campaign.
fn speeds_rpm() -> Vec<f64> {
    (0..10).map(|i| 480.0 + 140.0 / 9.0 * f64::from(i)).collect()
}

/// The eight depths of the campaign.
fn depths_mm() -> Vec<f64> {
    (0..8).map(|i| 2.0 + 1.5 * f64::from(i)).collect()
}

fn print_table(cuts: &[(TrialCut, Judged)], speeds: usize) {
    print!("{:>8}", "mm");
    for (cut, _) in &cuts[..speeds] {
        print!("{:>6.0}", cut.rpm);
    }
    println!("  rev/min; o stable, x chatter, s marginal");
    for row in cuts.chunks(speeds).rev() {
        print!("{:>8.2}", row[0].0.depth_mm);
        for (cut, _) in row {
            let mark = match cut.outcome {
                Outcome::Stable => 'o',
                Outcome::Chatter => 'x',
                Outcome::Marginal => 's',
            };
            print!("{mark:>6}");
        }
        println!();
    }
}

/// The folder for pictures, if one is set.
fn pictures() -> Option<PathBuf> {
    std::env::var_os("QUIETCUT_STORY").map(PathBuf::from)
}

fn draw(folder: &Path, name: &str, title: &str, chart: &Chart, cuts: &[(TrialCut, Judged)]) {
    let columns: Vec<Column> = chart.speeds.iter().map(Column::from).collect();
    let marks: Vec<Mark> = cuts.iter().map(|(cut, _)| Mark::from(cut)).collect();
    let svg = lobe_chart(title, &columns, DEPTH_MM, &marks).expect("a picture");
    std::fs::write(folder.join(format!("{name}.svg")), svg).expect("the folder is there");
}

/// Runs the command in `folder`. It must end with success.
fn done(folder: &Path, arguments: &str) {
    let arguments: Vec<&str> = arguments.split_whitespace().collect();
    let outcome = quietcut(folder, &arguments);
    assert_eq!(outcome.status, Some(0), "{arguments:?}: {outcome:?}");
}

/// The model from step-sine tests of the robot at three levels: matrices with cubic terms, and tool, material and cut of the
/// true case.
fn identified(folder: &Path) -> Case {
    let truth = cases().join(format!("{TRUTH}.toml"));
    let path = truth.display();
    for (direction, frequencies, forces) in [
        ("x", "19.2:20.6:15", "3,9,15"),
        ("y", "16.6:17.9:14", "1.8,5.8,9.5"),
    ] {
        done(
            folder,
            &format!(
                "simulate {path} --experiment step-sine --direction {direction} --frequency-hz {frequencies} --force-n {forces} \
                 --dwell-s 30 --pause-s 8 --sample-rate-hz 128 --measure displacement --noise-percent 0.5 --out {direction}.csv"
            ),
        );
    }
    done(
        folder,
        "identify x.csv y.csv --method harmonic-balance --out found.toml",
    );
    let read = |path: &Path| std::fs::read_to_string(path).expect("a case");
    let whole = read(&truth);
    let job = &whole[whole.find("[tool]").expect("a tool")..];
    let found = format!("{}\n{job}", read(&folder.join("found.toml")));
    Case::parse(&folder.join("found.toml"), &found).expect("a case")
}

/// The answer of `diagnose` for the baseline, a short step-sine test in each direction, and the cuts.
fn diagnosed(folder: &Path, cuts: &[(TrialCut, Judged)]) -> serde_json::Value {
    let [truth, belief] = [TRUTH, BELIEF].map(|name| cases().join(format!("{name}.toml")));
    for (direction, frequencies, forces, seed) in [
        ("x", "19.2:20.6:3", "3,9,15", 1),
        ("y", "16.6:17.9:3", "1.8,5.8,9.5", 2),
    ] {
        done(
            folder,
            &format!(
                "simulate {} --experiment step-sine --direction {direction} --frequency-hz {frequencies} --force-n {forces} \
                 --dwell-s 4 --pause-s 1 --sample-rate-hz 128 --measure displacement --noise-percent 0.5 --seed {seed} \
                 --out short-{direction}.csv",
                truth.display()
            ),
        );
    }
    let mut table = String::from("rpm [rev/min],depth [mm],outcome\n");
    for (cut, _) in cuts {
        let outcome = serde_json::to_value(cut.outcome).expect("a word");
        let outcome = outcome.as_str().expect("a word");
        table.push_str(&format!("{},{},{outcome}\n", cut.rpm, cut.depth_mm));
    }
    std::fs::write(folder.join("cuts.csv"), table).expect("the folder is there");
    let belief = belief.display().to_string();
    let arguments = [
        "diagnose",
        &belief,
        "short-x.csv",
        "short-y.csv",
        "--cuts",
        "cuts.csv",
        "--out",
        "diagnosis",
        "--json",
    ];
    quietcut(folder, &arguments).json()
}

/// Both cubic terms are found along both directions, each with its value, and all cuts that were called wrong before are called
/// right.
fn check_diagnosis(answer: &serde_json::Value, truth: &Case, wrong_before: usize) {
    assert_eq!(answer["outcome"], "cause", "{answer}");
    let parts = matrices(truth);
    let mut named = Vec::new();
    for cause in answer["causes"].as_array().expect("causes") {
        let [name, direction] = ["name", "direction"].map(|key| cause[key].as_str().expect("a word"));
        let (key, matrix) = match name {
            "cubic-stiffness" => ("k3_n_per_m3", &parts.cubic_stiffness),
            "cubic-damping" => ("c3_ns3_per_m3", &parts.cubic_damping),
            other => panic!("{other} does not act here"),
        };
        let axis = usize::from(direction == "y");
        let there = matrix.as_ref().expect("cubic terms")[(axis, axis)];
        let found = cause["parameters"][key]["value"].as_f64().expect("a number");
        println!(
            "{name} {direction}: {found:.4e}, {:+.2} %",
            100.0 * (found / there - 1.0)
        );
        // The error comes from half a percent of noise, and from cubic coupling between the directions, which no cause contains.
        assert!((found / there - 1.0).abs() < 0.01, "{name} {direction}: {found}");
        named.push((name, direction));
    }
    named.sort_unstable();
    let all = [
        ("cubic-damping", "x"),
        ("cubic-damping", "y"),
        ("cubic-stiffness", "x"),
        ("cubic-stiffness", "y"),
    ];
    assert_eq!(named, all);
    let wrong = |when: &str| {
        answer["lobes"]["calls"][when]["wrong"]
            .as_u64()
            .expect("a number")
    };
    println!(
        "diagnose: {} cuts called wrong before, {} after",
        wrong("before"),
        wrong("after")
    );
    assert_eq!(wrong("before"), wrong_before as u64);
    assert_eq!(wrong("after"), 0);
}

/// Frequency in Hz and damping ratio of a mode with the motion A cos ωt: stiffness k + ¾k₃A², damping c + ¾c₃ω²A².
fn equivalent(case: &Case, amplitude_m: f64) -> (f64, f64) {
    let parts = matrices(case);
    let of = |matrix: &Option<nalgebra::DMatrix<f64>>| matrix.as_ref().expect("cubic terms")[(0, 0)];
    let share = 0.75 * amplitude_m * amplitude_m;
    let mass = parts.mass[(0, 0)];
    let omega = ((parts.stiffness[(0, 0)] + share * of(&parts.cubic_stiffness)) / mass).sqrt();
    let damping = parts.damping[(0, 0)] + share * omega * omega * of(&parts.cubic_damping);
    (omega / TAU, 0.5 * damping / (mass * omega))
}

/// Writes the receptances from a hammer test as a table in `folder`.
fn tapped(folder: &Path) {
    let truth = cases().join(format!("{TRUTH}.toml"));
    for direction in ["x", "y"] {
        done(
            folder,
            &format!(
                "simulate {} --experiment hammer --direction {direction} --force-n 60 --pulse-ms 10 --impacts 4 --spacing-s 16 \
                 --sample-rate-hz 256 --measure displacement --noise-percent 0.1 --out h{direction}.csv",
                truth.display()
            ),
        );
    }
    done(folder, "frf hx.csv hy.csv --band-hz 8:40 --out frf.csv");
}

/// First limits in mm at the speeds of the campaign.
fn limits_mm(method: &dyn Method) -> Vec<f64> {
    let lines = method.lines(&speeds_rpm(), DEPTH_MM, 60).expect("a chart");
    lines
        .iter()
        .map(|line| line.first_limit.expect("a limit within the depths").depth_mm)
        .collect()
}

fn print_limits(what: &str, limits_mm: &[f64]) {
    print!("{what:<42}");
    for limit_mm in limits_mm {
        print!("{limit_mm:>7.2}");
    }
    println!();
}

/// Checks that small vibrations of cuts grow or decay with the largest Floquet multiplier of the forced orbit.
fn check_growth(method: &ForcedProblem, cuts: &[(TrialCut, Judged)]) {
    // The vibration exceeds the integration error and is small enough for the linearization about the orbit.
    let small = cuts
        .iter()
        .filter(|(_, judged)| (1e-6..1e-2).contains(&judged.unrest));
    let (mut count, mut worst) = (0, 0.0_f64);
    for (cut, judged) in small {
        let point = method.point(cut.rpm, cut.depth_mm).expect("a multiplier");
        worst = worst.max((judged.growth - point.multiplier_abs).abs());
        count += 1;
    }
    println!("{count} cuts still decay at the end: growth per tooth is the multiplier within {worst:.4}");
    // Over an eighth of a cut, 50 tooth passings, two motions of nearly the same decay rate beat.
    assert!(count >= 5 && worst < 0.01, "{count} {worst}");
}

/// Records how many cuts each method calls wrong, where `QUIETCUT_WRITE` is set: the test runs in every test run, and its figures do
/// not change.
fn record(methods: &[&str], calls: &[Calls], answer: &serde_json::Value) {
    if std::env::var_os("QUIETCUT_WRITE").is_none() {
        return;
    }
    let of_all = |wrong: &dyn std::fmt::Display, cuts: usize| format!("{wrong} of {cuts}");
    let mut figures: Vec<(String, String)> = methods
        .iter()
        .zip(calls)
        .map(|(what, calls)| {
            (
                format!("cuts called wrong: {what}"),
                of_all(&calls.wrong, calls.cuts),
            )
        })
        .collect();
    for (when, words) in [
        ("before", "the baseline model of the diagnosis"),
        (
            "after",
            "the same after the diagnosis of two shaker tests and the cuts",
        ),
    ] {
        let wrong = &answer["lobes"]["calls"][when]["wrong"];
        figures.push((
            format!("cuts called wrong: {words}"),
            of_all(wrong, calls[0].cuts),
        ));
    }
    Campaign {
        name: "nonlinear-pockets",
        title: "Nonlinear pockets",
        command: "QUIETCUT_WRITE=yes cargo test --release -p quietcut-tests --test story_nonlinear_pockets -- --nocapture pockets_wrong",
        seeds: "1 and 2 of the two shaker tests, 0 of the other records; 80 virtual cuts without noise",
    }
    .record(&figures);
}

#[test]
fn lobes_of_the_linear_part_call_cuts_in_the_pockets_wrong_and_those_with_cubic_terms_do_not() {
    let (truth, belief) = (case(TRUTH), case(BELIEF));
    let folder = folder();
    tapped(folder.path());
    let table = FrfTable::read(folder.path().join("frf.csv")).expect("a table");
    let hammer = MultiFrequency {
        problem: FrequencyProblem::of_table(&belief, &table).expect("receptances"),
        harmonics: None,
    };
    let found = identified(folder.path());
    let methods: [(&str, Box<dyn Method>); 4] = [
        ("receptances by a hammer", Box::new(hammer)),
        ("its linear part", Box::new(believed(&belief))),
        (
            "identified at three levels, cubic terms",
            Box::new(forced(&found)),
        ),
        (
            "the robot itself, about its forced orbit",
            Box::new(forced(&truth)),
        ),
    ];
    print!("{:<42}", "first limits in mm at rev/min");
    for rpm in speeds_rpm() {
        print!("{rpm:>7.0}");
    }
    println!();
    let limits: Vec<Vec<f64>> = methods
        .iter()
        .map(|(_, method)| limits_mm(method.as_ref()))
        .collect();
    for ((what, _), limits_mm) in methods.iter().zip(&limits) {
        print_limits(what, limits_mm);
    }
    let cuts = campaign(&truth, &speeds_rpm(), &depths_mm(), 400);
    print_table(&cuts, speeds_rpm().len());
    let only: Vec<TrialCut> = cuts.iter().map(|(cut, _)| *cut).collect();
    let calls: Vec<Calls> = methods
        .iter()
        .map(|(what, method)| {
            let calls = Calls::new(method.as_ref(), &only).expect("calls");
            println!(
                "{what}: {} of {} cuts called wrong, {} stable ones called unstable, {} chattering ones called stable; {} undecided",
                calls.wrong, calls.cuts, calls.false_alarms, calls.missed_chatter, calls.undecided
            );
            calls
        })
        .collect();
    if let Some(folder) = pictures() {
        let speeds: Vec<f64> = (0..71).map(|i| 480.0 + 2.0 * f64::from(i)).collect();
        for (name, index) in [("believed", 1), ("known", 2)] {
            let (what, method) = &methods[index];
            let chart = chart(method.as_ref(), &speeds, DEPTH_MM, 60).expect("a chart");
            let wrong = calls[index].wrong;
            let title = format!("Lobes by {what}: {wrong} of {} cuts called wrong", only.len());
            draw(&folder, name, &title, &chart, &cuts);
        }
    }
    check_growth(&forced(&truth), &cuts);
    let [by_hammer, by_linear_part, by_found, by_truth] = &limits[..] else {
        panic!("four charts")
    };
    for index in 0..limits[0].len() {
        let off = |of: &[f64], from: &[f64]| (of[index] / from[index] - 1.0).abs();
        // Impacts of 60 N move the tool by 0.03 mm. At this amplitude the cubic terms change the receptances.
        assert!(off(by_hammer, by_linear_part) < 0.03, "{index}");
        // The error comes from half a percent of noise.
        assert!(off(by_found, by_truth) < 0.005, "{index}");
    }
    // The calls of the cuts use no Floquet multipliers, so that their agreement with the limits of the true robot confirms both.
    assert_eq!(calls[3].wrong, 0);
    assert!(calls[0].wrong >= 8 && calls[1].wrong >= 8, "{calls:?}");
    assert_eq!(
        calls[1].missed_chatter, 0,
        "softening and cubic damping quieten here"
    );
    assert_eq!(calls[2].wrong, 0);
    assert!(calls[3].undecided <= 4, "{calls:?}");
    let answer = diagnosed(folder.path(), &cuts);
    record(&methods.each_ref().map(|(what, _)| *what), &calls, &answer);
    check_diagnosis(&answer, &truth, calls[1].wrong);
    if let Some(pictures) = pictures() {
        let report = folder.path().join("diagnosis/report.html");
        std::fs::copy(report, pictures.join("report.html")).expect("the folder is there");
    }
}

#[test]
fn the_pockets_are_where_the_cubic_terms_act() {
    let (before, after) = (believed(&case(BELIEF)), forced(&case(TRUTH)));
    for (rpm, factor) in [(526.0, 1.36), (559.0, 1.78), (1045.0, 1.0)] {
        let first = |method: &dyn Method| {
            let line = method.line(rpm, DEPTH_MM, 60).expect("a line");
            line.first_limit.expect("a limit").depth_mm
        };
        let found = first(&after) / first(&before);
        println!("{rpm} rev/min: times {found:.3}");
        // The factors are stated to a unit of the last digit.
        assert!((found - factor).abs() < 0.006, "{rpm} {found}");
    }
}

/// Amplitude at which a quantity of a mode reaches a value, by bisection up to 0.7 mm.
fn amplitude_m(reached: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, 0.7e-3);
    assert!(!reached(low) && reached(high));
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if reached(middle) {
            high = middle
        } else {
            low = middle
        }
    }
    high
}

/// Equivalent stiffness and damping of the mode in a steady motion of about this amplitude, by harmonic balance, from F/X − (k −
/// mω² + iωc) of the fundamental; and the amplitude.
fn balanced(case: &Case, amplitude_m: f64) -> (f64, f64, f64) {
    let parts = matrices(case);
    let one = |matrix: &nalgebra::DMatrix<f64>| matrix[(0, 0)];
    let cubic = |matrix: &Option<nalgebra::DMatrix<f64>>| one(matrix.as_ref().expect("cubic terms"));
    let law = Law::new(1, &[NonlinearTerm::CubicStiffness, NonlinearTerm::CubicDamping]);
    let mut theta = vec![0.0; law.parameters.len()];
    for (role, value) in [
        (Role::Mass(0, 0), one(&parts.mass)),
        (Role::Damping(0, 0), one(&parts.damping)),
        (Role::Stiffness(0, 0), one(&parts.stiffness)),
        (Role::CubicDamping(0), cubic(&parts.cubic_damping)),
        (Role::CubicStiffness(0), cubic(&parts.cubic_stiffness)),
    ] {
        theta[law.index(role).expect("the law has it")] = value;
    }
    let (hz, ratio) = equivalent(case, amplitude_m);
    let omega = TAU * hz;
    let grid = Grid::new(7, law.degree());
    let mut force = DVector::zeros(grid.width());
    // At its natural frequency the mode needs the force c ω A. The initial guess is this motion, 90° behind the force.
    force[1] = 2.0 * ratio * one(&parts.mass) * omega * omega * amplitude_m;
    let mut start = DVector::zeros(grid.width());
    start[2] = amplitude_m;
    let problem = HarmonicProblem {
        law: &law,
        theta: &theta,
        omega,
        force: &force,
    };
    let x = grid.solve(problem, &start).expect("a steady motion").x;
    let dynamic = force[1] / Complex64::new(x[1], -x[2]);
    let stiffness = dynamic.re + one(&parts.mass) * omega * omega;
    (x[1].hypot(x[2]), stiffness, dynamic.im / omega)
}

/// Chapter 7 finds a mode of 18.48 Hz with a damping ratio of 9.96 % in process (Table 7.1). A hammer test finds one near 20 Hz
/// with 2.2 %. The test checks whether cubic terms (Table 5.2) explain the difference.
#[test]
fn cubic_terms_do_not_explain_the_heavily_damped_mode_of_chapter_7() {
    const IN_PROCESS: (f64, f64) = (18.48, 0.0996);
    let mode = case("kuka-kr90-x20");
    println!("{:>10} {:>10} {:>10}", "A [mm]", "f [Hz]", "damping");
    for amplitude_mm in [0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6] {
        let (hz, ratio) = equivalent(&mode, 1e-3 * amplitude_mm);
        println!("{amplitude_mm:>10.2} {hz:>10.2} {:>9.2}%", 100.0 * ratio);
    }
    let of_frequency = amplitude_m(|a| equivalent(&mode, a).0 <= IN_PROCESS.0);
    let of_damping = amplitude_m(|a| equivalent(&mode, a).1 >= IN_PROCESS.1);
    let (at_frequency, at_damping) = (equivalent(&mode, of_frequency), equivalent(&mode, of_damping));
    println!(
        "18.48 Hz is reached at {:.3} mm, with {:.1} % of damping; 9.96 % of damping at {:.3} mm, at {:.1} Hz",
        1e3 * of_frequency,
        100.0 * at_frequency.1,
        1e3 * of_damping,
        at_damping.0
    );
    // A second computation, by harmonic balance with all harmonics.
    for amplitude in [1e-4, 2e-4, of_frequency] {
        let (found, stiffness, damping) = balanced(&mode, amplitude);
        let parts = matrices(&mode);
        let (hz, ratio) = equivalent(&mode, found);
        let omega = TAU * hz;
        let expected = omega * omega * parts.mass[(0, 0)];
        let expected_damping = 2.0 * ratio * omega * parts.mass[(0, 0)];
        // If the stiffness has fallen by a sixth, the third harmonic is a hundredth of the first.
        assert!(
            (stiffness / expected - 1.0).abs() < 0.02,
            "{stiffness} {expected}"
        );
        assert!(
            (damping / expected_damping - 1.0).abs() < 0.05,
            "{damping} {expected_damping}"
        );
    }
    // Amplitude in x of cuts without chatter in acetal, as in chapter 7, at half the limit and just below it.
    let acetal = case("kuka-kr90-acetal");
    let mut robot = case(TRUTH);
    robot.material = acetal.material;
    let linear = believed(&robot);
    let cuts: Vec<(f64, f64)> = [600.0, 800.0, 1000.0, 1200.0, 1600.0, 2000.0]
        .into_iter()
        .flat_map(|rpm| {
            let line = linear.line(rpm, DEPTH_MM, 60).expect("a line");
            let limit_mm = line.first_limit.map_or(DEPTH_MM, |limit| limit.depth_mm);
            [0.5, 0.95].map(|share| (rpm, share * limit_mm))
        })
        .collect();
    let swings: Vec<f64> = cuts
        .par_iter()
        .map(|&(rpm, depth_mm)| judged(&robot, rpm, depth_mm, 400).swing_m[0])
        .collect();
    let largest = swings.iter().copied().fold(0.0, f64::max);
    let (hz, ratio) = equivalent(&mode, largest);
    println!(
        "cuts in acetal below the limit swing by up to {:.3} mm in x: {hz:.2} Hz, {:.2} % of damping",
        1e3 * largest,
        100.0 * ratio
    );
    // No amplitude explains both. At the amplitude that gives the frequency, half of the damping is missing; at the amplitude
    // that gives the damping, the frequency is far too low. No stable cut reaches this amplitude.
    assert!((at_frequency.1 - 0.051).abs() < 0.001 && (at_damping.0 - 14.2).abs() < 0.1);
    assert!(largest < 0.5 * of_frequency && ratio < 0.04, "{largest} {ratio}");
}
