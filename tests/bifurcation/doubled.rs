//! Period-doubled orbits from a flip, against simulated cuts whose depth grows and decreases again.

use std::fs;

use quietcut::case::Case;
use quietcut::simulate::{Drive, Entry, Regeneration, Settings, VirtualCut, WorkpieceTraverse, Workspace};
use quietcut_tests::command::{cases, folder};
use serde_json::Value;

use super::records::largest_difference;
use super::{first_loss, list, number, read, run};

const CASE: &str = "hardening-flip";

/// Spindle speed, rev/min, above that of the deepest flip, so that a hardening spring makes the flip subcritical.
const RPM: f64 = 2010.0;

/// Tooth passings over which the depth of a simulated cut grows, and over which it decreases. A choice: the passage of the
/// fold is then delayed by less than one percent of the depth. The delay grows with the rate to the power 2/3.
const PASSINGS: usize = 8_000;

fn answer() -> Value {
    let options = format!("--vary depth --range 0:3 --fix rpm={RPM} --doubled --json");
    run(folder().path(), CASE, &options).json()
}

/// A force of 1 mN with twice the tooth period, from which the doubling grows where the forced vibration is unstable: the
/// cutting force is some 100 N. Without it the doubling would have to grow from rounding errors.
struct Disturbance {
    tooth_s: f64,
}

impl Drive for Disturbance {
    fn force_n(&self, t: f64) -> [f64; 3] {
        [1e-3 * (std::f64::consts::PI * t / self.tooth_s).cos(), 0.0, 0.0]
    }
}

/// Depth, mm, at each tooth passing, with half the difference between the displacements of the tool in feed direction at
/// this passing and the one before, mm, which is 0 for a vibration of the tooth period. The depth grows from the first value
/// of `depths_mm` to the second and decreases again.
fn sweep(case: &Case, depths_mm: [f64; 2], regeneration: Regeneration) -> Vec<[f64; 2]> {
    let tooth_s = 60.0 / RPM;
    let half_s = PASSINGS as f64 * tooth_s;
    let cut = VirtualCut {
        entry: Entry::None,
        air_s: 0.0,
        ..VirtualCut::new(RPM, depths_mm[1], 2.0 * half_s)
    };
    let mut model = cut.model(case).expect("a model");
    model.drive = Some(Box::new(Disturbance { tooth_s }));
    let cutting = model.cutting.as_mut().expect("a cut");
    // The ramp has begun before the start of the integration, which is at the first depth.
    let ramp_s = half_s / (1.0 - depths_mm[0] / depths_mm[1]);
    let traverse = WorkpieceTraverse::Ramp {
        start_s: half_s - ramp_s,
        ramp_s,
        end_s: half_s + ramp_s,
    };
    (cutting.traverse, cutting.regeneration) = (traverse, regeneration);
    // The period of an orbit begins when a tooth enters; tooth 1 is at angle 0 at the time 0.
    let entry_s = case.cut().expect("a cut").start_deg / 360.0 * tooth_s;
    let mut workspace = Workspace::new(&model);
    let mut strobe: Vec<[f64; 2]> = Vec::new();
    let ran = model.run(2.0 * half_s, Settings::default(), |step| {
        loop {
            let t = strobe.len() as f64 * tooth_s + entry_s;
            if t > step.to_s() {
                break;
            }
            let displacement_m = step.motion(t, &mut workspace).displacement_m;
            strobe.push([depths_mm[1] * traverse.depth_share(t), 1e3 * displacement_m[0]]);
        }
    });
    ran.expect("a simulated cut");
    let pairs = strobe.windows(2);
    pairs
        .map(|pair| [pair[1][0], 0.5 * (pair[1][1] - pair[0][1]).abs()])
        .collect()
}

/// Depths, mm, at which the doubled vibration appears while the depth grows and vanishes while it decreases: where the
/// difference passes `threshold_mm`.
fn jumps(sweep: &[[f64; 2]], threshold_mm: f64) -> [f64; 2] {
    let (up, down) = sweep.split_at(sweep.len() / 2);
    // The first passings hold the transient of the start.
    let appears = up
        .iter()
        .skip(up.len() / 8)
        .find(|at| at[1] > threshold_mm)
        .expect("the forced vibration is left");
    let vanishes = down
        .iter()
        .rev()
        .find(|at| at[1] > threshold_mm)
        .expect("the doubled vibration is left");
    [appears[0], vanishes[0]]
}

/// Largest deviation of the doubling of a cut whose depth decreases from that of the stable doubled orbits, relative to it,
/// at depths from `from_mm` on.
fn largest_miss(sweep: &[[f64; 2]], branch: &[Value], from_mm: f64) -> f64 {
    let stable: Vec<[f64; 2]> = branch
        .iter()
        .filter(|orbit| orbit["unstable_multipliers"] == 0)
        .map(|orbit| {
            let both = list(&orbit["displacement_mm"]);
            let doubling_mm = 0.5 * (number(&both[1][0]) - number(&both[0][0])).abs();
            [number(&orbit["depth_mm"]), doubling_mm]
        })
        .collect();
    // The first quarter of the way down still holds the transient of the jump.
    let down = sweep[5 * sweep.len() / 8..].iter().filter(|at| at[0] > from_mm);
    let misses = down.map(|at| {
        let after = stable
            .iter()
            .position(|orbit| orbit[0] > at[0])
            .expect("orbits up to the largest depth");
        let [low, high] = [stable[after - 1], stable[after]];
        let share = (at[0] - low[0]) / (high[0] - low[0]);
        (at[1] / (low[1] + share * (high[1] - low[1])) - 1.0).abs()
    });
    misses.fold(0.0, f64::max)
}

#[test]
fn the_bistable_zone_below_a_subcritical_flip_is_that_of_cuts_swept_up_and_down() {
    let answer = answer();
    let loss = first_loss(&answer);
    assert_eq!(loss["kind"], "flip");
    assert_eq!(loss["criticality"], "subcritical");
    let zones = list(&answer["bistable_mm"]);
    assert_eq!(zones.len(), 1, "{zones:?}");
    let zone_mm = [number(&zones[0][0]), number(&zones[0][1])];
    assert!((zone_mm[1] / number(&loss["depth_mm"]) - 1.0).abs() < 1e-12);
    let doubled = &list(&answer["doubled"])[0];
    let fold = list(&doubled["events"])
        .iter()
        .find(|event| event["kind"] == "fold")
        .expect("a fold");
    assert_eq!(number(&fold["depth_mm"]), zone_mm[0]);
    assert!(number(&fold["error_mm"]) < 1e-4, "{fold}");
    // All teeth stay in contact, so that loss of contact in the simulated cut changes nothing.
    assert_eq!(doubled["contact_lost_mm"], Value::Null);
    let case = Case::read(cases().join(format!("{CASE}.toml"))).expect("a case");
    let depths_mm = [0.85 * zone_mm[0], 1.1 * zone_mm[1]];
    for regeneration in [Regeneration::LastPass, Regeneration::AllPasses] {
        let swept = sweep(&case, depths_mm, regeneration);
        let threshold_mm = 0.25 * number(&fold["amplitude_mm"][0]);
        let [appears_mm, vanishes_mm] = jumps(&swept, threshold_mm);
        println!(
            "{regeneration:?}: fold {:.4} mm, left at {vanishes_mm:.4} mm on the way down; flip {:.4} mm, left at \
             {appears_mm:.4} mm on the way up",
            zone_mm[0], zone_mm[1]
        );
        assert!((vanishes_mm / zone_mm[0] - 1.0).abs() < 0.01, "{vanishes_mm}");
        // The doubling takes its time to grow beyond the flip.
        assert!(
            appears_mm > zone_mm[1] && appears_mm < 1.06 * zone_mm[1],
            "{appears_mm}"
        );
        let miss = largest_miss(&swept, list(&doubled["branch"]), 1.05 * zone_mm[0]);
        println!("doubling up to {miss:.1e} from that of the branch");
        assert!(miss < 0.01, "{miss}");
    }
}

#[test]
fn text_and_charts_show_the_bistable_zone_and_a_killed_run_goes_on() {
    let folder = folder();
    let at = folder.path();
    let options = format!("--vary depth --range 0:3 --fix rpm={RPM}");
    let hint = run(at, CASE, &options);
    assert!(hint.stdout.contains("--doubled finds from which"), "{hint:?}");
    let whole = run(
        at,
        CASE,
        &format!("{options} --doubled --out a.json --out a.html"),
    );
    for said in [
        "doubled orbits from the flip",
        "bistable (depth_mm)",
        "fold over two tooth periods",
    ] {
        assert!(whole.stdout.contains(said), "{said}: {whole:?}");
    }
    let page = fs::read_to_string(at.join("a.html")).expect("the page");
    for said in ["stable doubled orbit", "bistable", "Shaded"] {
        assert!(page.contains(said), "{said}");
    }
    let records = fs::read_to_string(at.join("a.jsonl")).expect("the records");
    let lines: Vec<&str> = records.lines().collect();
    for kept in [lines.len() / 2, lines.len() - 10] {
        fs::write(at.join("b.part.jsonl"), format!("{}\n", lines[..kept].join("\n"))).expect("written");
        let resumed = format!("{options} --doubled --resume b.part.jsonl --out b.json");
        assert_eq!(run(at, CASE, &resumed).status, Some(0));
        let difference = largest_difference(&read(at, "a.json"), &read(at, "b.json"));
        assert!(difference < 1e-12, "{kept}: {difference}");
    }
}

#[test]
fn doubled_orbits_of_a_linear_structure_are_refused() {
    let linear = "--vary depth --range 0:5 --fix rpm=1050.9 --doubled";
    run(folder().path(), "kuka-kr90-full", linear).refused(&["linear structure", "grow without bounds"]);
}
