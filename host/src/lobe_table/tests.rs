use quietcut_core::lobes::{Answer, LobeTable};
use quietcut_core::units::{Degrees, Millimeters, Rpm};
use quietcut_core::working_point::WorkingPoint;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;

use super::accuracy::farthest;
use super::*;
use crate::case::tests::case;
use crate::case::{Deviation, Parameter};
use crate::continuation;
use crate::stability::{CubicTerms, Method, Problem, SpeedLine, line};

fn problem(case: &Case) -> Problem {
    Problem::new(case, CubicTerms::Refuse).unwrap()
}

fn point(case: &Case, depth_mm: f64, feed_mm: f64) -> WorkingPoint {
    let cut = case.cut().unwrap();
    WorkingPoint {
        axial_depth: Millimeters(depth_mm as f32),
        start: Degrees(cut.start_deg as f32),
        exit: Degrees(cut.exit_deg as f32),
        feed_per_tooth: Millimeters(feed_mm as f32),
        posture: case.posture.index,
    }
}

fn request(rpm: (f64, f64), depth_mm: f64) -> TableRequest {
    TableRequest {
        rpm: Some(rpm),
        depth_mm: Some(depth_mm),
        ..TableRequest::default()
    }
}

/// The first limit that a table tells; the last depth where nothing is lost.
fn told_limit(table: &LobeTable, point: &WorkingPoint, direction_deg: Option<f64>, rpm: f64) -> f64 {
    let cut = match direction_deg {
        Some(degrees) => table.cut_towards(point, Degrees(degrees as f32)),
        None => table.cut(point),
    };
    let column = cut.unwrap().column(Rpm(rpm as f32)).unwrap();
    let depths = table.depths();
    f64::from(column.first_limit().map_or(depths.1, |interval| interval.from).0)
}

fn limit(line: &SpeedLine, depth_mm: f64) -> f64 {
    line.first_limit.map_or(depth_mm, |limit| limit.depth_mm)
}

#[test]
fn verdicts_between_the_entries_differ_only_within_the_stated_error() {
    let case = case("kuka-kr90-acetal");
    let (from, to, depth_mm) = (600.0, 2400.0, 5.0);
    let bytes = build_table(std::slice::from_ref(&case), &request((from, to), depth_mm)).unwrap();
    let table = LobeTable::parse(&bytes).unwrap();
    let error = table.interpolation_error().unwrap();
    println!(
        "{} bytes, {} speeds, stated error {} and {} of the speed",
        bytes.len(),
        table.speeds().len(),
        error.depth,
        error.speed
    );
    // 0.3 % of the depth is the aim; half more is stated, and a step of the entries. Islands begin within half a percent.
    assert!(error.depth.0 < 0.05 && error.speed < 0.005);
    let problem = problem(&case);
    let seed = 20_261_121;
    println!("seed {seed}");
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    // Half of the speeds around the notch and its islands.
    let speeds: Vec<f64> = (0..600)
        .map(|index| {
            if index % 2 == 0 {
                rng.random_range(from..to)
            } else {
                rng.random_range(1025.0..1085.0)
            }
        })
        .collect();
    let outside: Vec<(f64, f64)> = speeds
        .par_iter()
        .map(|&rpm| {
            let direct = line(&problem, rpm, depth_mm, 40).unwrap();
            let told = table.column(Rpm(rpm as f32), &point(&case, 1.0, 0.15)).unwrap();
            let told: Vec<[f64; 2]> = told
                .stable()
                .map(|(from, to)| [f64::from(from.0), f64::from(to.0)])
                .collect();
            (rpm, farthest(&direct.stable_mm, &told, depth_mm))
        })
        .filter(|(_, off)| *off > f64::from(error.depth.0))
        .collect();
    println!(
        "{} of {} speeds are off by more than the depth error",
        outside.len(),
        speeds.len()
    );
    for (rpm, _) in outside {
        // There the limit must lie within the speed error: the verdict at every depth is that of one of both ends of this range.
        let reach = f64::from(error.speed) * rpm;
        let lines = [rpm - reach, rpm, rpm + reach].map(|rpm| line(&problem, rpm, depth_mm, 40).unwrap());
        for _ in 0..50 {
            let depth: f64 = rng.random_range(0.0..depth_mm);
            let stable = lines.each_ref().map(|line| {
                line.stable_mm
                    .iter()
                    .any(|&[from, to]| from <= depth && depth <= to)
            });
            let told = table.lookup(Rpm(rpm as f32), &point(&case, depth, 0.15));
            let told = matches!(told, Answer::Stable { .. });
            let near = farthest(&lines[1].stable_mm, &[[0.0, depth]], depth_mm);
            assert!(
                stable.contains(&told) || near <= f64::from(error.depth.0),
                "{rpm} rev/min, {depth} mm: {told}, {stable:?}"
            );
        }
    }
}

#[test]
fn derivatives_of_entries_are_those_of_limits_of_another_machine() {
    let case = case("kuka-kr90-acetal");
    let request = TableRequest {
        derivatives: true,
        ..request((1090.0, 1250.0), 4.0)
    };
    let bytes = build_table(std::slice::from_ref(&case), &request).unwrap();
    let table = LobeTable::parse(&bytes).unwrap();
    let modes: Vec<_> = table.modes(0).collect();
    assert_eq!(modes.len(), 2);
    assert!((modes[0].frequency.0 - 16.99).abs() < 1e-3 && (modes[1].damping_ratio - 0.0996).abs() < 1e-5);
    // A machine whose first mode is 0.2 % faster, its second damped 2 % more, in a material 3 % harder.
    let mut other = case.clone();
    assert!(Parameter::Frequency(0).shift(&mut other, 0.002 * 16.99));
    assert!(Parameter::DampingRatio(1).shift(&mut other, 0.02 * 0.0996));
    for coefficient in [Parameter::Ktc, Parameter::Krc, Parameter::Kac] {
        let value = coefficient.value(&other).unwrap();
        assert!(coefficient.shift(&mut other, 0.03 * value));
    }
    let mut learned = quietcut_core::lobes::Learned {
        cutting_force: 0.03,
        ..Default::default()
    };
    learned.frequency[0] = 0.002;
    learned.damping_ratio[1] = 0.02;
    let (was, is) = (problem(&case), problem(&other));
    let mut moved_mm = 0.0_f64;
    for (index, speed) in table.speeds().enumerate() {
        let rpm = f64::from(speed.0);
        let [before, after] = [&was, &is].map(|problem| limit(&line(problem, rpm, 4.0, 40).unwrap(), 4.0));
        let corrected = table.corrected_entry(0, index, &learned).unwrap();
        let corrected = f64::from(corrected.first_limit().unwrap().from.0);
        // What is left is of second order: a tenth of the change, and an entry's step.
        assert!(
            (corrected - after).abs() < 0.1 * (after - before).abs() + 1e-3,
            "{rpm}: {before} {after} {corrected}"
        );
        moved_mm = moved_mm.max((after - before).abs());
    }
    assert!(moved_mm > 0.05, "{moved_mm}");
}

#[test]
fn feed_layers_agree_with_the_direct_solution_between_them() {
    let mut case = case("staubli-tx200");
    let request = TableRequest {
        feeds_per_tooth_mm: vec![0.02, 0.4],
        ..request((400.0, 600.0), 2.0)
    };
    let bytes = build_table(std::slice::from_ref(&case), &request).unwrap();
    let table = LobeTable::parse(&bytes).unwrap();
    let error = table.interpolation_error().unwrap();
    println!("{} layers, stated error {}", table.layers().len(), error.depth);
    // Both feeds asked for, and whatever limits need between them; the error is no excuse for any difference.
    assert!(
        table.layers().len() >= 2 && error.depth.0 < 0.02,
        "{}",
        error.depth
    );
    let grid: Vec<f64> = [10, 40, 80]
        .iter()
        .map(|&index| f64::from(table.speed(index).unwrap().0))
        .collect();
    let mut change_mm = 0.0_f64;
    for feed_mm in [0.03, 0.11, 0.21, 0.33] {
        let at_least = point(&case, 1.0, 0.02);
        case.cut.as_mut().unwrap().feed_per_tooth_mm = feed_mm;
        let direct = problem(&case);
        for (rpm, allowed_mm) in [
            (407.0, f64::from(error.depth.0)),
            (561.3, f64::from(error.depth.0)),
            // At a speed of the grid only the feed is between entries: what is left is a tenth of what the feed changes.
            (grid[0], 7e-4),
            (grid[1], 7e-4),
            (grid[2], 7e-4),
        ] {
            let limit_mm = limit(&line(&direct, rpm, 2.0, 40).unwrap(), 2.0);
            let told_mm = told_limit(&table, &point(&case, 1.0, feed_mm), None, rpm);
            assert!(
                (told_mm - limit_mm).abs() <= allowed_mm,
                "{feed_mm} mm, {rpm}: {told_mm} {limit_mm}"
            );
            change_mm = change_mm.max((told_mm - told_limit(&table, &at_least, None, rpm)).abs());
        }
    }
    assert!(change_mm > 7e-3, "{change_mm}");
}

#[test]
fn direction_layers_agree_with_the_direct_solution_between_them() {
    let mut case = case("kuka-kr90-acetal");
    let request = TableRequest {
        feed_directions_deg: vec![0.0, 50.0],
        ..request((1250.0, 1400.0), 8.0)
    };
    let bytes = build_table(std::slice::from_ref(&case), &request).unwrap();
    let table = LobeTable::parse(&bytes).unwrap();
    let error = table.interpolation_error().unwrap();
    println!("{} layers, stated error {}", table.layers().len(), error.depth);
    // More than 45 degrees apart: at least one was added.
    assert!(table.layers().len() > 2);
    for degrees in [5.0, 22.0, 48.0] {
        case.cut.as_mut().unwrap().feed_direction_deg = degrees;
        let direct = problem(&case);
        for rpm in [1261.0, 1333.0] {
            let limit_mm = limit(&line(&direct, rpm, 8.0, 40).unwrap(), 8.0);
            let told_mm = told_limit(&table, &point(&case, 1.0, 0.15), Some(degrees), rpm);
            assert!(
                (told_mm - limit_mm).abs() <= f64::from(error.depth.0),
                "{degrees}, {rpm}: {told_mm} {limit_mm}, error {}",
                error.depth
            );
        }
    }
}

#[test]
fn postures_are_layers_and_a_percentile_is_that_of_the_machines() {
    let mut stretched = case("kuka-kr90-acetal");
    stretched.posture.index = 3;
    assert!(Parameter::Frequency(0).shift(&mut stretched, -2.0));
    let mut case = case("kuka-kr90-acetal");
    let bytes = build_table(
        &[case.clone(), stretched.clone()],
        &request((1200.0, 1400.0), 5.0),
    )
    .unwrap();
    let table = LobeTable::parse(&bytes).unwrap();
    for case in [&case, &stretched] {
        let limit_mm = limit(&line(&problem(case), 1300.0, 5.0, 40).unwrap(), 5.0);
        let told_mm = told_limit(&table, &point(case, 1.0, 0.15), None, 1300.0);
        assert!((told_mm - limit_mm).abs() < 0.03, "{told_mm} {limit_mm}");
    }
    assert!(build_table(&[case.clone(), case.clone()], &request((1200.0, 1400.0), 5.0)).is_err());

    case.deviations = vec![Deviation {
        parameter: Parameter::Ktc,
        std: 12.0,
    }];
    let request = TableRequest {
        percentile: Some(5.0),
        ..request((1290.0, 1310.0), 5.0)
    };
    let families = layers::families(std::slice::from_ref(&case), &request).unwrap();
    let told = families[0].lines(&[1300.0], 5.0).unwrap();
    // One parameter, and the limit falls with it: the machine at its 95 % is that of the 5 % limit.
    let mut hard = case.clone();
    assert!(Parameter::Ktc.shift(&mut hard, 1.644_853_6 * 12.0));
    let expected_mm = limit(&line(&problem(&hard), 1300.0, 5.0, 40).unwrap(), 5.0);
    let told_mm = limit(&told[0], 5.0);
    // Slices of 1/256 of the machines, 0.04 deviations wide there.
    assert!(
        (told_mm - expected_mm).abs() < 2e-3 * expected_mm,
        "{told_mm} {expected_mm}"
    );
    assert_eq!(told[0].stable_mm, [[0.0, told_mm]]);
    case.deviations.clear();
    assert!(matches!(
        build_table(&[case], &request),
        Err(BuildError::NotPossible { .. })
    ));
}

#[test]
fn a_structure_with_cubic_terms_has_layers_over_feed() {
    let case = case("kuka-kr90-half-cubic");
    let (rpm, depth_mm) = (526.0, 8.0);
    let families = layers::families(
        std::slice::from_ref(&case),
        &TableRequest {
            feeds_per_tooth_mm: vec![0.05, 0.15],
            ..TableRequest::default()
        },
    )
    .unwrap();
    assert_eq!(families.len(), 2);
    assert!(
        families
            .iter()
            .all(|family| family.validity.feed_from == family.validity.feed_to)
    );
    let forced = continuation::ForcedProblem::new(&case).unwrap();
    let direct = forced.line(rpm, depth_mm, 40).unwrap();
    assert_eq!(families[1].lines(&[rpm], depth_mm).unwrap()[0], direct);
    // What is not surely stable is an entry.
    let entries = entries::unstable(&direct, depth_mm);
    let stable = entries::surely_stable(&direct, depth_mm);
    let length = |intervals: &[[f64; 2]]| intervals.iter().map(|[from, to]| to - from).sum::<f64>();
    let unstable: f64 = entries.iter().map(|entry| entry.to_mm - entry.from_mm).sum();
    assert!((unstable + length(&stable) - depth_mm).abs() < 1e-9);
    let derivatives = TableRequest {
        derivatives: true,
        ..request((500.0, 560.0), 8.0)
    };
    let error = build_table(&[case], &derivatives).unwrap_err();
    assert!(error.to_string().contains("cubic"), "{error}");
}

#[test]
fn two_stable_orbits_are_not_surely_stable() {
    let line = SpeedLine {
        rpm: 500.0,
        stable_mm: vec![[0.0, 4.0]],
        bistable_mm: vec![[2.0, 3.0]],
        first_limit: None,
        switches: Vec::new(),
        spread: None,
    };
    assert_eq!(entries::surely_stable(&line, 4.0), [[0.0, 2.0], [3.0, 4.0]]);
    let entries = entries::unstable(&line, 4.0);
    assert_eq!(entries.len(), 1);
    assert_eq!((entries[0].from_mm, entries[0].to_mm), (2.0, 3.0));
    assert_eq!(entries[0].interval.kind, quietcut_core::lobes::Kind::Fold);
}
