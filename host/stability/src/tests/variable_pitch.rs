//! Collocation over the revolution against collocation over the tooth period, semi-discretization and full
//! discretization, and against its own result on a finer mesh.

use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rayon::prelude::*;

use crate::methods::discretized;
use crate::problem::revolution::Revolution;
use crate::problem::revolution_mesh::Fineness;
use crate::spectrum::krylov::Dominant;
use crate::spectrum::revolution_map::RevolutionMap;
use crate::tests::random_case;
use crate::*;
use quietcut_testkit::case;

/// Problem of a case with these pitch angles, degrees; their number is the number of teeth.
fn pitched(case_name: &str, pitch_deg: &[f64]) -> Pitched {
    let mut case = case(case_name);
    let tool = case.tool.as_mut().unwrap();
    tool.teeth = pitch_deg.len();
    tool.pitch_deg = pitch_deg.to_vec();
    Pitched::new(&case, CubicTerms::LeaveOut).unwrap()
}

/// Collocation over the revolution of a tool with equal pitch.
fn as_revolution(problem: &Problem) -> RevolutionCollocation {
    RevolutionCollocation {
        pitched: Pitched::from(problem.clone()).over_revolution(),
    }
}

#[test]
fn equal_pitches_over_the_revolution_give_the_power_of_the_multiplier_over_the_tooth_period() {
    let path = format!("{}/../../tests/data/multipliers.csv", env!("CARGO_MANIFEST_DIR"));
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_path(path)
        .unwrap();
    for row in reader.deserialize().step_by(3) {
        let (name, rpm, depth_mm, re, im): (String, f64, f64, f64, f64) = row.unwrap();
        let problem = Problem::new(&case(&name), CubicTerms::Refuse).unwrap();
        let power = num_complex::Complex64::new(re, im).powi(problem.teeth as i32);
        let found = as_revolution(&problem).point(rpm, depth_mm).unwrap();
        // The reference is the upper multiplier of a pair. Tolerance: references are good to 2.1e-8, in each factor of
        // the power.
        let error = (found.multiplier - power)
            .norm()
            .min((found.multiplier.conj() - power).norm());
        let reference = 2.1e-8 * problem.teeth as f64 * power.norm().max(1.0);
        assert!(
            error < found.error + reference,
            "{name} {rpm} {depth_mm}: {error} {found:?}"
        );
        assert!(found.error < 1e-5 * power.norm().max(1.0), "{name} {found:?}");
    }
}

#[test]
fn limits_of_equal_pitches_over_the_revolution_are_those_over_the_tooth_period() {
    let problem = Problem::new(&case("kuka-kr90-acetal"), CubicTerms::Refuse).unwrap();
    for rpm in [1045.0, 1200.0] {
        let exact = line(&problem, rpm, 4.0, 40).unwrap();
        let found = as_revolution(&problem).line(rpm, 4.0, 40).unwrap();
        assert_eq!(found.stable_mm.len(), exact.stable_mm.len());
        let (found, exact) = (found.first_limit.unwrap(), exact.first_limit.unwrap());
        assert!(
            (found.depth_mm / exact.depth_mm - 1.0).abs() < 1e-7,
            "{found:?} {exact:?}"
        );
        assert!((found.chatter_hz.unwrap() / exact.chatter_hz.unwrap() - 1.0).abs() < 1e-6);
        // Over a revolution of two teeth a flip over the tooth period, μ = −1, has the multiplier (−1)² = 1: a fold.
        let expected = if exact.kind == StabilityLoss::Flip {
            StabilityLoss::Fold
        } else {
            exact.kind
        };
        assert_eq!(found.kind, expected);
    }
}

/// Errors of semi-discretization and of full discretization, each with steps of one degree and of a quarter of a
/// degree.
fn step_errors(pitched: &Pitched, rpm: f64, depth_mm: f64, exact: num_complex::Complex64) -> [[f64; 2]; 2] {
    let nearest = |dominant: &Dominant| {
        let distances = dominant.eigenvalues.iter().map(|value| (value - exact).norm());
        distances.min_by(f64::total_cmp)
    };
    // With these steps delays of whole degrees end at the start of a step.
    let degrees = pitched.problem.process.engagement.pitch.to_degrees().round() as usize;
    let steps = [degrees, 4 * degrees];
    let sdm = steps.map(|steps| {
        let method = Sdm {
            pitched: pitched.clone(),
            discretization: SemiDiscretization(SdmOrder::First),
            steps,
        };
        discretized::with_dominant(&method, rpm, depth_mm, steps, |dominant, _| nearest(dominant)).unwrap()
    });
    let fdm = steps.map(|steps| {
        let method = Fdm {
            pitched: pitched.clone(),
            discretization: FullDiscretization,
            steps,
        };
        discretized::with_dominant(&method, rpm, depth_mm, steps, |dominant, _| nearest(dominant)).unwrap()
    });
    [sdm, fdm]
}

#[test]
fn discretizations_converge_to_the_collocation_of_tools_with_variable_pitch() {
    let tools: [(&str, &[f64], f64, f64); 5] = [
        ("insperger-1dof-ad1", &[170.0, 190.0], 5000.0, 0.5),
        ("insperger-2dof-ad0.5", &[70.0, 110.0, 70.0, 110.0], 6200.0, 0.2),
        ("insperger-2dof-ad0.1", &[100.0, 125.0, 135.0], 9000.0, 1.0),
        // A tool with four different delays, of which up to three teeth cut at once.
        ("insperger-2dof-ad1", &[62.0, 71.0, 93.0, 134.0], 7500.0, 0.1),
        ("kuka-kr90-acetal", &[175.0, 185.0], 1200.0, 2.0),
    ];
    for (name, pitch_deg, rpm, depth_mm) in tools {
        let method = RevolutionCollocation {
            pitched: pitched(name, pitch_deg),
        };
        let point = method.point(rpm, depth_mm).unwrap();
        assert!(point.error < 1e-5 * point.multiplier_abs.max(1.0), "{point:?}");
        for errors in step_errors(&method.pitched, rpm, depth_mm, point.multiplier) {
            let slope = 0.5 * (errors[0] / errors[1]).log2();
            // Tolerance: at these steps the second term of the error is a thousandth of the leading one.
            assert!(
                (slope - 2.0).abs() < 0.02,
                "{name} {pitch_deg:?}: {slope} {errors:?} {point:?}"
            );
            assert!(
                errors[1] < 1e-2 * point.multiplier_abs.max(1.0),
                "{name}: {errors:?} {point:?}"
            );
        }
    }
}

/// Random machine whose pitch angles differ from the mean by up to 15 %.
fn random_pitched(rng: &mut impl rand::Rng) -> (Pitched, f64) {
    let case = random_case(rng);
    let problem = Problem::new(&case, CubicTerms::Refuse).unwrap();
    let fastest_hz = problem
        .structure
        .poles()
        .iter()
        .map(|pole| pole.im)
        .fold(0.0, f64::max)
        / std::f64::consts::TAU;
    let vibrations: f64 = rng.random_range(0.3..12.0);
    let rpm = 60.0 * fastest_hz / (vibrations * problem.teeth as f64);
    let raw: Vec<f64> = (0..problem.teeth).map(|_| rng.random_range(0.85..1.15)).collect();
    let whole: f64 = raw.iter().sum();
    let pitch_rad = raw
        .iter()
        .map(|pitch| pitch / whole * std::f64::consts::TAU)
        .collect();
    let pitched = Pitched {
        problem,
        pitch_rad: Some(pitch_rad),
    };
    (pitched, rpm)
}

#[test]
fn stated_errors_of_random_tools_cover_what_a_much_finer_mesh_changes() {
    random_tools(11, 25).check();
}

/// `cargo test --release -p quietcut-stability --lib -- --ignored --nocapture random_tools_by_the_hundred`
#[test]
#[ignore = "a campaign of minutes"]
fn random_tools_by_the_hundred() {
    let found = random_tools(12, 400);
    let of_all = |count: usize| format!("{count} of {}", found.tools);
    quietcut_testkit::results::Campaign {
        name: "random-unequal-pitch",
        title: "Random tools with unequal pitch",
        command: "cargo test --release -p quietcut-stability --lib -- --ignored --nocapture random_tools_by_the_hundred",
        seeds: "12; 400 tools",
    }
    .record(
        &[
            ("verdicts outside of their stated error", of_all(0)),
            ("undecided tools", of_all(found.undecided)),
            ("refused tools", of_all(found.refused)),
            ("tools for which the finest mesh has no verdict", of_all(found.silent)),
            ("largest time of the method for one tool", format!("{:.1?}", found.slowest)),
        ]
        .map(|(figure, value)| (figure.to_owned(), value)),
    );
    found.check();
}

/// Counts over random tools; each error was compared with a much finer mesh.
struct RandomTools {
    tools: usize,
    undecided: usize,
    refused: usize,
    silent: usize,
    slowest: Duration,
}

impl RandomTools {
    fn check(&self) {
        // Stated errors are so small that at most one point in 50 may be undecided or refused; one in 25 may lack a
        // reference.
        assert!((self.undecided + self.refused) * 50 <= self.tools && self.silent * 25 <= self.tools);
    }
}

/// Panics if the error of a tool is larger than stated.
fn random_tools(seed: u64, count: usize) -> RandomTools {
    println!("seed {seed}");
    let tools = (0..count).into_par_iter();
    let found: Vec<RandomTool> = tools.map(|index| RandomTool::check(seed, index)).collect();
    let number = |is: &dyn Fn(&RandomTool) -> bool| found.iter().filter(|tool| is(tool)).count();
    let undecided = number(&|tool| tool.verdict == Some(Verdict::Undecided));
    let refused = number(&|tool| tool.verdict.is_none());
    let silent = number(&|tool| tool.lacks_reference);
    let slowest = found.iter().map(|tool| tool.time).max().unwrap();
    println!(
        "{count} tools: {undecided} undecided, {refused} refused, reference silent at {silent}; slowest {slowest:.1?}"
    );
    RandomTools {
        tools: count,
        undecided,
        refused,
        silent,
        slowest,
    }
}

/// Result for one random tool.
struct RandomTool {
    /// Verdict of the method; `None` if it refuses the point.
    verdict: Option<Verdict>,
    /// True if the reference on the finest mesh has no result.
    lacks_reference: bool,
    /// Computing time of the method, without the reference.
    time: Duration,
}

impl RandomTool {
    /// Computes one random tool; panics if its error is larger than stated.
    fn check(seed: u64, index: usize) -> Self {
        const FINEST: Fineness = Fineness {
            angle: 2.5,
            tolerance: 1e-13,
            generations: 5,
        };
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(index as u64);
        let (pitched, rpm) = random_pitched(&mut rng);
        let depth_m = rng.random_range(0.0..1e-2_f64);
        let method = RevolutionCollocation {
            pitched: pitched.clone(),
        };
        let began = Instant::now();
        let point = method.point(rpm, depth_m * 1e3);
        let time = began.elapsed();
        let exact = || {
            let finest = Revolution::new(&pitched, rpm, depth_m, FINEST)?;
            let map = RevolutionMap::new(std::rc::Rc::new(finest), depth_m)?;
            Some(Dominant::any(&map).ok()?.eigenvalues.first()?.norm())
        };
        let exact = exact();
        if let (Ok(point), Some(exact)) = (&point, exact) {
            let error = (point.multiplier_abs - exact).abs();
            assert!(error < point.error, "tool {index}: {error} {exact} {point:?}");
        }
        Self {
            verdict: point.ok().map(|point| point.verdict),
            lacks_reference: exact.is_none(),
            time,
        }
    }
}

#[test]
fn limits_of_variable_pitch_separate_stable_from_unstable_points() {
    let method = RevolutionCollocation {
        pitched: pitched("insperger-2dof-ad0.5", &[70.0, 110.0, 70.0, 110.0]),
    };
    for rpm in [4000.0, 7000.0] {
        let line = method.line(rpm, 1.0, 40).unwrap();
        assert!(!line.switches.is_empty());
        for switch in &line.switches {
            let at = |factor: f64| method.point(rpm, switch.depth_mm * factor).unwrap();
            let multiplier = at(1.0).multiplier_abs;
            let is_first = line
                .first_limit
                .is_some_and(|limit| limit.depth_mm == switch.depth_mm);
            // At switches after the first limit another multiplier, which lies outside, is the dominant one.
            if is_first {
                assert!((multiplier - 1.0).abs() < 1e-6, "{switch:?} {multiplier}");
                assert_eq!(at(0.999).verdict, Verdict::Stable);
                assert_eq!(at(1.001).verdict, Verdict::Unstable);
                let (found, expected) = (at(1.0).chatter_hz.unwrap(), switch.chatter_hz.unwrap());
                assert!((found / expected - 1.0).abs() < 1e-6);
            }
        }
    }
}
