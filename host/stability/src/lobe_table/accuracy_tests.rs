//! The error that a table states between its entries, against the method itself at random speeds.

use quietcut_core::lobes::LobeTable;
use quietcut_core::units::{Degrees, Millimeters, Rpm};
use quietcut_core::working_point::WorkingPoint;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;

use super::accuracy::Disagreement;
use super::build::build_table;
use super::entries::surely_stable;
use super::request::TableRequest;
use crate::limits::speed_line::SpeedLine;
use crate::orbit::collocation_of;
use quietcut_model::case::Case;
use quietcut_testkit::case;

/// Number of random speeds per table, at each of which all depths are compared.
const SPEEDS: usize = 1000;

/// Allowed number of speeds at which the table is wrong: the stated error is an estimate from samples, not a bound.
const WRONG_MAX: usize = SPEEDS / 1000;

fn at_no_depth(case: &Case) -> WorkingPoint {
    let cut = case.cut().unwrap();
    WorkingPoint {
        axial_depth: Millimeters(0.0),
        start: Degrees(cut.start_deg as f32),
        exit: Degrees(cut.exit_deg as f32),
        feed_per_tooth: Millimeters(cut.feed_per_tooth_mm as f32),
        posture: case.posture.index,
    }
}

/// Numbers of random speeds at which a table differs from the method by more than its stated error.
struct Trial {
    /// Number of speeds at which some depth that is stable in the table is further than the stated depth from the
    /// stable depths of the method.
    unsafe_speeds: usize,
    /// Number of speeds at which some depth is unstable in the table, although it is stable by the method at all speeds
    /// within the stated speed error and further than the stated depth from every limit.
    cautious_speeds: usize,
}

fn trial(
    name: &str,
    rpm: Option<(f64, f64)>,
    depth_mm: Option<f64>,
    speeds: Option<usize>,
    seed: u64,
) -> Trial {
    let case = case(name);
    let request = TableRequest {
        rpm,
        depth_mm,
        speeds,
        ..TableRequest::default()
    };
    let began = std::time::Instant::now();
    let bytes = build_table(std::slice::from_ref(&case), &request).unwrap().bytes;
    let seconds = began.elapsed().as_secs_f64();
    let table = LobeTable::parse(&bytes).unwrap();
    let error = table.interpolation_error().unwrap();
    let (stated_mm, depth_mm) = (f64::from(error.depth.0), f64::from(table.depths().1.0));
    let ends = [0, table.speeds().len() - 1].map(|index| f64::from(table.speed(index).unwrap().0));
    let method = collocation_of(&case).unwrap();
    let stable = |rpm: f64| {
        let line = method.line(rpm, depth_mm, 40).unwrap();
        (surely_stable(&line, depth_mm), line)
    };
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let speeds: Vec<f64> = (0..SPEEDS).map(|_| rng.random_range(ends[0]..ends[1])).collect();
    let lines: Vec<(Vec<[f64; 2]>, SpeedLine)> = speeds.par_iter().map(|&rpm| stable(rpm)).collect();
    let wrong: Vec<[f64; 2]> = lines
        .par_iter()
        .map(|(truth, direct)| {
            let rpm = direct.rpm;
            let column = table.column(Rpm(rpm as f32), &at_no_depth(&case)).unwrap();
            let tabulated: Vec<[f64; 2]> = column
                .stable()
                .map(|(from, to)| [f64::from(from.0), f64::from(to.0)])
                .collect();
            let miss = Disagreement::between(truth, &tabulated, depth_mm);
            let is_in =
                |set: &[[f64; 2]], depth: f64| set.iter().any(|&[from, to]| from <= depth && depth <= to);
            let mut given_up: Vec<f64> = (0..400)
                .map(|index| depth_mm * (f64::from(index) + 0.5) / 400.0)
                .filter(|&depth| is_in(truth, depth) && !is_in(&tabulated, depth))
                .filter(|&depth| {
                    direct
                        .switches
                        .iter()
                        .all(|switch| (switch.depth_mm - depth).abs() > stated_mm)
                })
                .collect();
            let reach = f64::from(error.speed) * rpm;
            for (beside, line) in &lines {
                if (line.rpm - rpm).abs() <= reach {
                    given_up.retain(|&depth| is_in(beside, depth));
                }
            }
            for share in [1.0, -1.0, 0.5, -0.5, 0.25, -0.25, 0.75, -0.75, 0.1, -0.1] {
                if given_up.is_empty() {
                    break;
                }
                let beside = stable((rpm + share * reach).clamp(ends[0], ends[1])).0;
                given_up.retain(|&depth| is_in(&beside, depth));
            }
            [
                miss.unsafe_mm,
                if given_up.is_empty() {
                    0.0
                } else {
                    miss.cautious_mm
                },
            ]
        })
        .collect();
    let worst = |side: usize| wrong.iter().map(|wrong| wrong[side]).fold(0.0, f64::max);
    let trial = Trial {
        unsafe_speeds: wrong.iter().filter(|wrong| wrong[0] > stated_mm).count(),
        cautious_speeds: wrong.iter().filter(|wrong| wrong[1] > 0.0).count(),
    };
    println!(
        "{name}, seed {seed}: {:.0} to {:.0} rev/min, {depth_mm:.3} mm, {} speeds in {seconds:.2} s; stated {stated_mm:.4} mm and {:.2} % of the speed; \
         of {SPEEDS} speeds {} too deep (worst {:.4} mm), {} too cautious (worst {:.4} mm)",
        ends[0],
        ends[1],
        table.speeds().len(),
        100.0 * error.speed,
        trial.unsafe_speeds,
        worst(0),
        trial.cautious_speeds,
        worst(1)
    );
    trial
}

fn check(name: &str, rpm: Option<(f64, f64)>, depth_mm: Option<f64>, speeds: Option<usize>, seed: u64) {
    let trial = trial(name, rpm, depth_mm, speeds, seed);
    assert!(
        trial.unsafe_speeds <= WRONG_MAX,
        "{name}: {} too deep",
        trial.unsafe_speeds
    );
    assert!(
        trial.cautious_speeds <= WRONG_MAX,
        "{name}: {} too cautious",
        trial.cautious_speeds
    );
}

/// Tables with default settings of linear structures, at low and full immersion, with and without flip islands.
#[test]
fn the_stated_error_holds_at_999_of_1000_speeds_of_whole_tables() {
    for (seed, name) in (20_261_123..).zip([
        "kuka-kr90-acetal",
        "kuka-kr90-full",
        "insperger-1dof-ad0.05",
        "insperger-2dof-ad0.5",
    ]) {
        check(name, None, None, None, seed);
    }
}

/// Tables with few initial speeds: over a wide range, where refinement misses whole lobes, and over a narrow range with
/// flip islands.
#[test]
fn the_stated_error_holds_at_999_of_1000_speeds_of_coarse_tables() {
    for (seed, (name, rpm, depth_mm, speeds)) in (20_261_133..).zip([
        ("kuka-kr90-acetal", (609.42, 2008.77), 8.0, 4),
        ("kuka-kr90-acetal", (628.6, 2226.63), 8.0, 2),
        ("kuka-kr90-acetal", (1037.21, 1051.4), 5.0, 4),
        ("kuka-kr90-acetal", (1037.63, 1058.64), 5.0, 3),
    ]) {
        check(name, Some(rpm), Some(depth_mm), Some(speeds), seed);
    }
}

/// A table of few entries over a factor of two in speed. Only the unsafe side is checked, since full columns call
/// narrow stable gaps unstable.
#[test]
fn a_table_of_three_speeds_calls_nothing_stable_beyond_the_stated_depth() {
    let rpm = Some((5182.07, 11_876.75));
    let trial = trial("insperger-1dof-ad0.05", rpm, Some(10.0), Some(2), 20_261_137);
    assert!(trial.unsafe_speeds <= WRONG_MAX, "{}", trial.unsafe_speeds);
}

#[test]
fn the_stated_error_holds_at_999_of_1000_speeds_of_a_structure_with_cubic_terms() {
    check(
        "kuka-kr90-half-cubic",
        Some((526.0, 559.0)),
        Some(16.0),
        Some(12),
        20_261_143,
    );
}
