//! Computing time of torus curves over modes and teeth, of robots with cubic joints.

use std::path::Path;
use std::time::Instant;

use super::super::branch::Extent;
use super::super::branches::follow_depth;
use super::super::forced::ForcedProblem;
use super::super::parameter::Parameter;
use super::follow::follow_curve;
use super::points::{CurveSeed, NoJournal, Plane};
use crate::spectrum::stability_loss::StabilityLoss;
use quietcut_model::case::Case;

/// A robot with one mode in each of its directions, near 17, 20 and 24 Hz, with cubic stiffness and damping.
fn robot(modes: usize, teeth: usize) -> Case {
    let diagonal = |entries: [f64; 3]| {
        let rows: Vec<String> = (0..modes)
            .map(|i| {
                let row: Vec<String> = (0..modes)
                    .map(|j| {
                        if i == j {
                            format!("{:e}", entries[i])
                        } else {
                            "0.0".into()
                        }
                    })
                    .collect();
                format!("[{}]", row.join(", "))
            })
            .collect();
        format!("[{}]", rows.join(", "))
    };
    let directions = &["\"y\"", "\"x\"", "\"z\""][..modes];
    let text = format!(
        "[structure]\nkind = \"matrices\"\ndirections = [{}]\nmass = {}\ndamping = {}\nstiffness = {}\ncubic_damping = {}\ncubic_stiffness = {}\n\
         [tool]\nteeth = {teeth}\nedge_angle_deg = 60.0\ndiameter_mm = 12.7\n\
         [material]\nktc_mpa = 76.0\nkrc_mpa = 12.0\nkac_mpa = 10.0\nkte_n_per_mm = 0.0\nkre_n_per_mm = 0.0\nkae_n_per_mm = 0.0\n\
         [cut]\nstart_deg = 90.0\nexit_deg = 180.0\nfeed_per_tooth_mm = 0.15\n",
        directions.join(", "),
        diagonal([188.0, 97.0, 150.0]),
        diagonal([306.0, 548.0, 600.0]),
        diagonal([2.26e6, 1.54e6, 3.4e6]),
        diagonal([2.5e6, 4.6e5, 1.0e6]),
        diagonal([-5.0e12, -2.4e12, -3.0e12]),
    );
    Case::parse(Path::new("robot.toml"), &text).unwrap()
}

/// Seconds for 100 points of the torus curve from the first speed at which a torus comes first.
fn seconds(modes: usize, teeth: usize) -> f64 {
    let problem = ForcedProblem::new(&robot(modes, teeth)).unwrap();
    // Tooth passing frequencies from half the lowest natural frequency on.
    for hz in [11.0, 12.5, 14.0, 20.0, 23.0, 26.0] {
        let rpm = 60.0 * hz / teeth as f64;
        let Ok(branch) = follow_depth(&problem, rpm, 15.0, Extent::FirstLoss) else {
            continue;
        };
        let first = branch.events.iter().find(|event| !event.gain);
        let Some(event) = first.filter(|event| event.kind == StabilityLoss::Hopf) else {
            continue;
        };
        let plane = Plane {
            parameters: [Parameter::Depth, Parameter::Rpm],
            ranges: [[0.0, 30.0], [0.8 * rpm, 1.3 * rpm]],
        };
        let seed = CurveSeed::of_event(event, rpm);
        let started = Instant::now();
        let curve = follow_curve(&problem, problem.setting(rpm, 0.0), plane, &seed, &mut NoJournal).unwrap();
        let seconds = started.elapsed().as_secs_f64() * 100.0 / curve.points.len() as f64;
        println!(
            "{modes} modes, {teeth} teeth, {rpm:.0} rev/min: {} points, {seconds:.3} s for 100",
            curve.points.len()
        );
        return seconds;
    }
    panic!("{modes} modes, {teeth} teeth: no torus comes first");
}

/// Points cost alike; the exponents over modes and teeth are those of straight lines in logarithms.
#[test]
#[ignore = "cost: time of torus curves over modes and teeth on one core, for the release profile"]
fn cost_of_torus_curves_over_modes_and_teeth() {
    let of_modes = [1, 2, 3].map(|modes| seconds(modes, 2));
    let of_teeth = [1, 2, 4].map(|teeth| seconds(3, teeth));
    let exponent = |from: f64, to: f64, ratio: f64| (to / from).ln() / ratio.ln();
    println!(
        "exponents of the time: {:.2} over modes (1 to 3), {:.2} over teeth (1 to 4), 1 over points",
        exponent(of_modes[0], of_modes[2], 3.0),
        exponent(of_teeth[0], of_teeth[2], 4.0)
    );
    // Goal: 5 s for 100 points of a robot with three modes and four teeth.
    assert!(of_teeth[2] < 5.0, "{of_teeth:?}");
}
