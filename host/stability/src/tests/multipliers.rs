//! Multipliers and limits of the default method against references and against Runge–Kutta integration, and lines
//! against single depths on random machines.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::{problem, random_case, rpm_of};
use crate::problem::period::{Period, Resolution};
use crate::spectrum::characteristic::Characteristic;
use crate::spectrum::crossing::Crossing;
use crate::spectrum::period_map;
use crate::*;
use quietcut_model::case::Case;
use quietcut_testkit::case;

const W_PER_MM: f64 = 0.033628;

#[test]
fn every_reference_multiplier_is_met_and_its_error_is_below_the_one_stated() {
    let path = format!("{}/../../tests/data/multipliers.csv", env!("CARGO_MANIFEST_DIR"));
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_path(path)
        .unwrap();
    let mut count = 0;
    let mut worst = 0.0_f64;
    for row in reader.deserialize() {
        let (name, rpm, depth_mm, re, im): (String, f64, f64, f64, f64) = row.unwrap();
        let found = point(&problem(&name), rpm, depth_mm).unwrap();
        let error = (found.multiplier - Complex64::new(re, im)).norm();
        assert!(error < found.error, "{name} {rpm} {depth_mm}: {error} {found:?}");
        worst = worst.max(error / found.multiplier_abs.max(1.0));
        count += 1;
    }
    assert_eq!(count, 113);
    // Tolerance: the references are good to 2.1e-8, better than the 1e-6 that is required.
    assert!(worst < 2.1e-8, "{worst}");
}

#[test]
fn limits_of_chapter_7_are_met_to_four_digits() {
    let problem = problem("kuka-kr90-acetal");
    let limits = [
        (600.0, 3.174, StabilityLoss::Hopf),
        (800.0, 1.664, StabilityLoss::Hopf),
        (900.0, 1.723, StabilityLoss::Hopf),
        (1050.0, 1.356, StabilityLoss::Flip),
        (1100.0, 2.223, StabilityLoss::Hopf),
        (1200.0, 2.041, StabilityLoss::Hopf),
        (1600.0, 2.953, StabilityLoss::Hopf),
        (2000.0, 4.105, StabilityLoss::Hopf),
        (2400.0, 5.443, StabilityLoss::Hopf),
    ];
    for (rpm, depth_mm, kind) in limits {
        let limit = line(&problem, rpm, 6.0, 40).unwrap().first_limit.unwrap();
        // Tolerance: half a unit of the last printed digit.
        assert!((limit.depth_mm - depth_mm).abs() <= 0.0006, "{rpm}: {limit:?}");
        assert_eq!(limit.kind, kind);
    }
}

#[test]
fn notch_window_and_upper_flip_of_chapter_7_are_found() {
    let problem = problem("kuka-kr90-acetal");
    let notch = line(&problem, 1045.0, 6.0, 40).unwrap();
    let depths: Vec<f64> = notch.switches.iter().map(|switch| switch.depth_mm).collect();
    assert!(
        (depths[0] - 1.327).abs() < 0.0006 && (depths[1] - 3.344).abs() < 0.0006,
        "{depths:?}"
    );
    assert!(
        notch
            .switches
            .iter()
            .all(|switch| switch.kind == StabilityLoss::Flip && !switch.gain)
    );
    assert_eq!(notch.stable_mm.len(), 1);

    // Even five samples in depth must find the stable window above the notch.
    for samples in [5, 40, 200] {
        let window = line(&problem, 1036.0, 6.0, samples).unwrap();
        let expected = [[0.0, 1.575], [2.334, 2.712]];
        assert_eq!(window.stable_mm.len(), 2, "{samples}: {window:?}");
        for (found, expected) in window.stable_mm.iter().flatten().zip(expected.iter().flatten()) {
            assert!((found - expected).abs() < 0.0006, "{window:?}");
        }
    }
    let top = line(&problem, 1064.0, 6.0, 40).unwrap();
    assert!((top.switches[1].depth_mm - 4.023).abs() < 0.0006, "{top:?}");
}

#[test]
fn limits_of_chapter_6_are_met_to_four_digits() {
    let full = problem("kuka-kr90-full");
    let limits = [
        (1.34, 0.18291, StabilityLoss::Hopf),
        (2.0, 0.13573, StabilityLoss::Hopf),
        (2.7, 0.06241, StabilityLoss::Flip),
        (2.9, 0.04519, StabilityLoss::Hopf),
        (3.13, 0.03136, StabilityLoss::Flip),
        (4.0, 0.05901, StabilityLoss::Hopf),
        (6.0, 0.34715, StabilityLoss::Hopf),
        (6.4, 0.24992, StabilityLoss::Hopf),
    ];
    for (tau, w, kind) in limits {
        let limit = line(&full, rpm_of(tau), 12.0, 40).unwrap().first_limit.unwrap();
        // Tolerance: half a unit of the last printed digit of w, and 3e-5 for the five digits of W_PER_MM.
        assert!(
            (limit.depth_mm * W_PER_MM - w).abs() < 1e-5 + 3e-5 * w,
            "{tau}: {limit:?}"
        );
        assert_eq!(limit.kind, kind);
    }
    let half = line(&problem("kuka-kr90-half"), rpm_of(8.7), 12.0, 40).unwrap();
    let limit = half.first_limit.unwrap();
    assert!((limit.depth_mm * W_PER_MM - 0.14861).abs() < 1.5e-5, "{limit:?}");
    assert_eq!(limit.kind, StabilityLoss::Flip);
}

#[test]
fn limits_of_chapter_3_are_met_with_and_without_edge_and_feed_terms() {
    let mut problem = problem("staubli-tx200");
    let limit = |problem: &Problem| {
        line(problem, 500.0, 1.0, 40)
            .unwrap()
            .first_limit
            .unwrap()
            .depth_mm
    };
    assert!((limit(&problem) - 0.6615).abs() < 6e-5);
    problem.process.axial_depth_modulation = false;
    assert!((limit(&problem) - 0.6612).abs() < 6e-5);
}

#[test]
fn chatter_of_the_acetal_robot_is_near_17_4_hz() {
    let problem = problem("kuka-kr90-acetal");
    let hopf = point(&problem, 900.0, 2.0).unwrap();
    assert_eq!(
        (hopf.kind, hopf.verdict),
        (StabilityLoss::Hopf, Verdict::Unstable)
    );
    assert!((hopf.chatter_hz.unwrap() - 17.4).abs() < 0.1, "{hopf:?}");
    // A flip vibrates at half the tooth-passing frequency, 1045·2/60/2 Hz, or an odd multiple of it.
    let flip = point(&problem, 1045.0, 2.0).unwrap();
    assert_eq!(
        (flip.kind, flip.verdict),
        (StabilityLoss::Flip, Verdict::Unstable)
    );
    assert!((flip.chatter_hz.unwrap() - 1045.0 / 60.0).abs() < 1e-9);
}

/// Transition matrix over a period from classical Runge–Kutta steps on ẋ = (A + B[κKα − β]C) x, which share no code
/// with collocation.
fn transition_by_runge_kutta(problem: &Problem, rpm: f64, kappa: Complex64) -> DMatrix<Complex64> {
    const STEPS: usize = 4000;
    let structure = &problem.structure;
    let process = &problem.process;
    let period_s = problem.tooth_period_s(rpm);
    let a = structure.a.map(Complex64::from);
    let b = DMatrix::from_fn(structure.order(), 3, |i, j| Complex64::from(structure.b[(i, j)]));
    let c = DMatrix::from_fn(3, structure.order(), |i, j| Complex64::from(structure.c[(i, j)]));
    let field = |phase: f64, teeth: usize| {
        let mut force = nalgebra::Matrix3::<Complex64>::zeros();
        for tooth in 0..teeth {
            let angle = process.engagement.angle(tooth, phase);
            force += process.force.directional(angle).map(Complex64::from) * kappa;
            if process.axial_depth_modulation {
                let forced = process.force.forced(angle, process.feed_per_tooth_m);
                for i in 0..3 {
                    force[(i, 2)] -= forced[i];
                }
            }
        }
        let force = DMatrix::from_fn(3, 3, |i, j| force[(i, j)]);
        &a + &b * force * &c
    };
    let mut x = DMatrix::<Complex64>::identity(structure.order(), structure.order());
    let half = Complex64::from(0.5);
    for interval in process.engagement.subintervals() {
        let turn = (interval.to - interval.from) / STEPS as f64;
        let h = Complex64::from(turn * period_s / process.engagement.pitch);
        for step in 0..STEPS {
            let phase = interval.from + turn * step as f64;
            let (first, middle, last) = (
                field(phase, interval.teeth),
                field(phase + 0.5 * turn, interval.teeth),
                field(phase + turn, interval.teeth),
            );
            let k1 = &first * &x;
            let k2 = &middle * (&x + &k1 * (h * half));
            let k3 = &middle * (&x + &k2 * (h * half));
            let k4 = &last * (&x + &k3 * h);
            x += (k1 + (k2 + k3) * Complex64::from(2.0) + k4) * (h / 6.0);
        }
    }
    x
}

#[test]
fn the_transition_matrix_is_that_of_plain_integration() {
    let cases = [
        ("insperger-2dof-ad0.5", 6200.0, 1e-3),
        ("kuka-kr90-acetal", 1045.0, 2e-3),
        ("staubli-tx200", 280.0, 0.67e-3),
    ];
    for (name, rpm, depth_m) in cases {
        let mut problem = problem(name);
        // With twelve teeth at this immersion three and four teeth cut at once.
        for teeth in [problem.teeth, 12] {
            problem.teeth = teeth;
            problem.process.engagement.pitch = std::f64::consts::TAU / teeth as f64;
            for kappa in [Complex64::new(1.0, 0.0), Complex64::new(0.7, -1.2)] {
                let kappa = kappa * depth_m;
                let period = Period::new(&problem, rpm, 2.0 * depth_m, Resolution::WORKING);
                let ours = Characteristic::new(&period, 2.0 * depth_m).transition(kappa);
                let plain = transition_by_runge_kutta(&problem, rpm, kappa);
                let n = plain.nrows();
                let error = (DMatrix::from_row_slice(n, n, &ours) - &plain).norm() / plain.norm();
                // Tolerance: the Runge–Kutta error (ωh)⁴/120 per radian, with ωh below 0.02.
                assert!(error < 1e-7, "{name}, {teeth} teeth: {error}");
            }
        }
    }
}

#[test]
fn the_collocated_map_and_the_characteristic_matrix_have_the_same_multipliers() {
    let problem = problem("insperger-2dof-ad0.5");
    for (rpm, depth_m) in [(5000.0, 0.5e-3), (9000.0, 3.5e-3), (21_000.0, 2e-3)] {
        let period = Period::new(&problem, rpm, 2.0 * depth_m, Resolution::WORKING);
        let characteristic = Characteristic::new(&period, 2.0 * depth_m);
        let mut work = characteristic.workspace();
        let all = period_map::multipliers(&period, depth_m).unwrap();
        for multiplier in all.iter().take_while(|multiplier| multiplier.norm() > 0.5) {
            let polished = characteristic
                .multiplier_near(*multiplier, depth_m, 0.1, &mut work)
                .unwrap();
            // Tolerance: rounding of the eigenvalues of a dense matrix with entries up to about ten.
            assert!((polished - multiplier).norm() < 1e-9 * multiplier.norm().max(1.0));
        }
    }
}

/// A crossing of the unit circle is returned only if the iteration has converged to one, from any guess.
#[test]
fn every_crossing_found_has_a_multiplier_on_the_unit_circle() {
    let problem = problem("kuka-kr90-acetal");
    let deepest_m = 6e-3;
    let period = Period::new(&problem, 1200.0, 2.0 * deepest_m, Resolution::WORKING);
    let characteristic = Characteristic::new(&period, 2.0 * deepest_m);
    let mut work = characteristic.workspace();
    let crossing_near = |depth_m, angle, most_m, work: &mut _| {
        let multiplier = Complex64::cis(angle);
        let guess = Crossing { depth_m, multiplier };
        characteristic.crossing_near(guess, 0.0, most_m, work)
    };
    // The transition matrix leaves the range of numbers there.
    assert!(crossing_near(1e200, 1.0, 2e200, &mut work).is_none());
    let mut count = 0;
    for index in 0..400 {
        let share = |factor: f64| (0.5 + f64::from(index) * factor).fract();
        let (depth_m, angle) = (deepest_m * share(0.618_033_988_7), PI * share(0.414_213_562_4));
        let Some(found) = crossing_near(depth_m, angle, deepest_m, &mut work) else {
            continue;
        };
        count += 1;
        let there = characteristic
            .multiplier_near(found.multiplier, found.depth_m, 1e-6, &mut work)
            .unwrap();
        assert!((there - found.multiplier).norm() < 1e-9, "{found:?} {there}");
    }
    println!("{count} crossings of 400 guesses");
    assert!(count > 20);
}

#[test]
fn with_no_depth_multipliers_are_those_of_the_free_structure() {
    let problem = problem("kuka-kr90-acetal");
    let found = point(&problem, 900.0, 0.0).unwrap();
    let slowest = problem
        .structure
        .poles()
        .into_iter()
        .max_by(|a, b| a.re.total_cmp(&b.re))
        .unwrap();
    let expected = (slowest.re * problem.tooth_period_s(900.0)).exp();
    assert!((found.multiplier_abs - expected).abs() < 1e-12, "{found:?}");
}

#[test]
fn turning_structure_and_feed_together_changes_nothing() {
    let original = case("kuka-kr90-half");
    let structure = original.structure().unwrap();
    let quietcut_model::structure::Form::Matrices(matrices) = &structure.form else {
        panic!("no matrices")
    };
    let angle_deg = -33.0_f64;
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    // The machine's axes are rotated by R, q_new = R q. The feed direction moves to the same angle in the new axes.
    let turn = DMatrix::from_row_slice(2, 2, &[cos, -sin, sin, cos]);
    let mut turned = original.clone();
    let apply = |matrix: &DMatrix<f64>| &turn * matrix * turn.transpose();
    turned.structure.as_mut().unwrap().form =
        quietcut_model::structure::Form::Matrices(quietcut_model::structure::Matrices {
            mass: apply(&matrices.mass),
            damping: apply(&matrices.damping),
            stiffness: apply(&matrices.stiffness),
            cubic_damping: None,
            cubic_stiffness: None,
        });
    turned.cut.as_mut().unwrap().feed_direction_deg = angle_deg;
    let limit = |case: &Case| {
        let problem = Problem::new(case, CubicTerms::Refuse).unwrap();
        line(&problem, 900.0, 6.0, 40)
            .unwrap()
            .first_limit
            .unwrap()
            .depth_mm
    };
    let (a, b) = (limit(&original), limit(&turned));
    // Tolerance: limits are solved for to 1e-9 relative.
    assert!((a - b).abs() < 1e-8 * a, "{a} {b}");
    let mut unturned = turned;
    unturned.cut.as_mut().unwrap().feed_direction_deg = 0.0;
    assert!((limit(&unturned) - a).abs() > 0.01 * a);
}

#[test]
fn features_that_are_not_covered_are_refused_with_the_reason() {
    let refused = |case: &Case| Problem::new(case, CubicTerms::Refuse).unwrap_err().to_string();
    let cubic = refused(&case("kuka-kr90-full-cubic"));
    assert!(cubic.contains("cubic") && cubic.contains("--linear"), "{cubic}");
    assert!(Problem::new(&case("kuka-kr90-full-cubic"), CubicTerms::LeaveOut).is_ok());
    let printed = refused(&case("staubli-tx200-as-printed"));
    assert!(
        printed.contains("(1,6)") && printed.contains("indefinite"),
        "{printed}"
    );
    let mut uneven = case("kuka-kr90-acetal");
    uneven.tool.as_mut().unwrap().pitch_deg = vec![170.0, 190.0];
    assert!(refused(&uneven).contains("pitch"));
    let no_tool = refused(&case("kuka-kr90-x20"));
    assert!(no_tool.contains("[tool]"), "{no_tool}");
    let problem = problem("kuka-kr90-acetal");
    assert!(point(&problem, 0.0, 1.0).is_err());
    assert!(
        point(&problem, 900.0, -1.0)
            .unwrap_err()
            .to_string()
            .contains("-1")
    );
    assert!(line(&problem, f64::NAN, 1.0, 40).is_err());
}

#[test]
fn a_chart_is_the_same_for_any_number_of_threads_and_refinement_finds_the_notch() {
    let method = Collocation {
        problem: problem("kuka-kr90-acetal"),
    };
    let speeds: Vec<f64> = (0..16).map(|i| 900.0 + 20.0 * f64::from(i)).collect();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| chart(&method, &speeds, 5.0, 40).unwrap())
    };
    assert_eq!(with(1), with(3));
    let refinement = Refinement {
        tolerance: 0.003,
        least_step: 1e-4,
        most_speeds: 500,
    };
    let refined = with(2).refined(&method, 5.0, refinement).unwrap();
    let lowest = refined
        .speeds
        .iter()
        .filter_map(|line| Some((line.first_limit?.depth_mm, line.rpm)))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap();
    // Reference: the lowest limit is 1.327 mm at 1045 rev/min. Tolerance: that of the refinement, 0.3 % of 5 mm.
    assert!(
        (lowest.0 - 1.327).abs() < 0.015 && (lowest.1 - 1045.0).abs() < 5.0,
        "{lowest:?}"
    );
    assert!(refined.speeds.windows(2).all(|pair| pair[0].rpm < pair[1].rpm));
}

#[test]
fn the_lobe_table_agrees_with_the_direct_solution() {
    use crate::lobe_table::TableRequest;
    use crate::lobe_table::build_table;
    use quietcut_core::lobes::{LobeTable, TabulatedStability};
    use quietcut_core::units::{Degrees, Millimeters, Rpm};
    use quietcut_core::working_point::WorkingPoint;

    let case = case("kuka-kr90-acetal");
    let request = TableRequest {
        rpm: Some((600.0, 2400.0)),
        depth_mm: Some(5.0),
        ..TableRequest::default()
    };
    let bytes = build_table(std::slice::from_ref(&case), &request).unwrap().bytes;
    let table = LobeTable::parse(&bytes).unwrap();
    let problem = Problem::new(&case, CubicTerms::Refuse).unwrap();
    let working_point = |depth_mm: f64| WorkingPoint {
        axial_depth: Millimeters(depth_mm as f32),
        start: Degrees(90.0),
        exit: Degrees(180.0),
        feed_per_tooth: Millimeters(0.15),
        posture: 0,
    };
    for rpm in [612.3, 901.7, 1036.0, 1045.5, 1060.1, 1101.0, 1733.3, 2399.0] {
        let direct = line(&problem, rpm, 5.0, 40).unwrap();
        let column = table.column(Rpm(rpm as f32), &working_point(1.0)).unwrap();
        match (direct.first_limit, column.first_limit()) {
            (Some(limit), Some(interval)) => {
                let error = f64::from(interval.from.0) - limit.depth_mm;
                // Tolerance: twice that of the refinement, 0.3 % of 5 mm, which holds at the middle of a gap only.
                assert!(error.abs() < 0.03, "{rpm}: {interval:?} {limit:?}");
                assert!(interval.chatter.0 > 15.0 && interval.chatter.0 < 20.0);
            }
            (None, None) => {}
            other => panic!("{rpm}: {other:?}"),
        }
    }
    let at = |rpm: f32, depth_mm: f64| table.lookup(Rpm(rpm), &working_point(depth_mm));
    assert!(
        matches!(at(1045.0, 2.0), TabulatedStability::Unstable { .. }),
        "{:?}",
        at(1045.0, 2.0)
    );
    assert!(
        matches!(at(1480.0, 2.0), TabulatedStability::Stable { .. }),
        "{:?}",
        at(1480.0, 2.0)
    );
}

/// The growth rate of power iteration is that of the dominant multiplier: a larger eigenvalue that the dense eigenvalue
/// routine had missed would show.
#[test]
fn the_dominant_multiplier_is_the_growth_rate_of_the_map() {
    let problem = problem("insperger-2dof-ad0.5");
    for (rpm, depth_m) in [(5000.0, 0.5e-3), (7500.0, 2e-3), (12_345.0, 4e-3)] {
        let period = Period::new(&problem, rpm, depth_m, Resolution::WORKING);
        let map = period_map::monodromy(&period, depth_m).unwrap();
        let mut vector = DVector::from_fn(map.nrows(), |i, _| 1.0 + (i as f64 * 0.37).sin());
        let mut growth = 0.0;
        const TURNS: i32 = 400;
        for _ in 0..TURNS {
            vector = &map * vector;
            let norm = vector.norm();
            growth += norm.ln();
            vector /= norm;
        }
        let dominant = period_map::multipliers(&period, depth_m).unwrap()[0].norm();
        // Tolerance: the start vector and the rotation of a complex pair change the logarithm of the growth over all
        // iterations by a few units.
        assert!(
            (growth / f64::from(TURNS) - dominant.ln()).abs() < 0.02,
            "{rpm}: {growth} {dominant}"
        );
    }
}

#[test]
fn lines_of_random_machines_agree_with_multipliers_at_single_depths() {
    use rand::{RngExt, SeedableRng};

    let seed = 20_261_121;
    println!("seed {seed}");
    let cases: usize = std::env::var("QUIETCUT_RANDOM_CASES")
        .ok()
        .and_then(|count| count.parse().ok())
        .unwrap_or(40);
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let mut switches = 0;
    for index in 0..cases {
        let case = random_case(&mut rng);
        let problem = Problem::new(&case, CubicTerms::Refuse).unwrap();
        let fastest = problem
            .structure
            .poles()
            .iter()
            .map(|pole| pole.im)
            .fold(0.0, f64::max);
        // Number of vibrations of the fastest mode in a tooth period: 0.3 to 4.
        let vibrations = 10.0_f64.powf(rng.random_range(-0.5..0.6));
        let rpm = 60.0 / problem.teeth as f64 * fastest / std::f64::consts::TAU / vibrations;
        let depth_mm = 10.0_f64.powf(rng.random_range(-1.5..0.5));
        let line = line(&problem, rpm, depth_mm, 40).unwrap();
        switches += line.switches.len();
        for _ in 0..8 {
            let depth = rng.random_range(0.0..depth_mm);
            let period = Period::new(&problem, rpm, depth * 2e-3, Resolution::WORKING);
            let dominant = period_map::multipliers(&period, depth * 1e-3).unwrap()[0].norm();
            let stable = line
                .stable_mm
                .iter()
                .any(|[from, to]| (*from..=*to).contains(&depth));
            // Limits are accurate to 1e-9. If |μ| is closer to 1 than 1e-6, rounding decides the side.
            assert!(
                (dominant - 1.0).abs() < 1e-6 || stable == (dominant < 1.0),
                "case {index}: {rpm} rev/min, {depth} mm: |μ| = {dominant}, {line:?}"
            );
        }
    }
    println!("{cases} cases, {switches} switches");
}
