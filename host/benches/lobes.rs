//! Computing time of the stability methods: per point of a chart and per chart, at equal accuracy of the Floquet
//! multipliers, and of stability limits.
//!
//! `cargo bench -p quietcut --bench lobes` first prints the times of stability limits of structures with cubic terms.
//! For each of three linear cases it then prints the number of steps with which first-order semi-discretization and
//! full discretization reach a relative error of 1e-4 of the largest |μ| at all points of a coarse chart with |μ| ≤ 2,
//! μ being the Floquet multipliers, the time per point with that number of steps and from it the time per chart, and
//! the ratio of the time per chart to that of the default method, as well as the times of stability limits at 50
//! speeds. Criterion then measures the default method on charts of 200 × 100 cells and at one point of each chart.
//! Charts and limits are computed on one thread.

#![allow(missing_docs, clippy::expect_used, clippy::panic)]

use std::path::Path;
use std::time::Instant;

use criterion::Criterion;
use quietcut::case::Case;
use quietcut::orbit::ForcedProblem;
use quietcut::stability::{
    Collocation, CubicTerms, Fdm, FrequencyProblem, FullDiscretization, Method, MultiFrequency, Nyquist,
    Pitched, Problem, Sdm, SdmOrder, SemiDiscretization, Zoa, cell_chart,
};

/// Largest relative error of |μ| that a stability method may have, μ being the largest Floquet multiplier.
const ACCURACY: f64 = 1e-4;

/// Largest |μ| of a Floquet multiplier whose value must be accurate. Of a larger multiplier, only |μ| > 1 (unstable)
/// must be right.
const LARGE: f64 = 2.0;

/// Largest number of steps per period with which a stability method is tried.
const STEPS_MAX: usize = 3000;

struct Setting {
    file: &'static str,
    rpm: (f64, f64),
    depth_mm: f64,
}

const SETTINGS: [Setting; 3] = [
    Setting {
        file: "insperger-2dof-ad0.05.toml",
        rpm: (5_000.0, 25_000.0),
        depth_mm: 10.0,
    },
    Setting {
        file: "insperger-2dof-ad0.5.toml",
        rpm: (5_000.0, 25_000.0),
        depth_mm: 10.0,
    },
    Setting {
        file: "kuka-kr90-acetal.toml",
        rpm: (600.0, 2_400.0),
        depth_mm: 5.0,
    },
];

impl Setting {
    fn case(&self) -> Case {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../tests/cases")
            .join(self.file);
        Case::read(&path).expect("the case is in the project")
    }

    fn speeds_rpm(&self, count: usize) -> Vec<f64> {
        spaced(self.rpm.0, self.rpm.1, count)
    }

    fn depths_mm(&self, count: usize) -> Vec<f64> {
        spaced(0.0, self.depth_mm, count)
    }
}

fn spaced(from: f64, to: f64, count: usize) -> Vec<f64> {
    (0..count)
        .map(|i| from + (to - from) * i as f64 / (count - 1) as f64)
        .collect()
}

/// The points ((spindle speed in rev/min, axial depth in mm), |μ|) of a chart, μ being the largest Floquet multiplier.
type Grid = Vec<((f64, f64), f64)>;

/// A chart of 5 speeds × 5 depths with |μ| of the largest Floquet multiplier by `method`, whose error estimate must be
/// below 1e-6 · max(1, |μ|).
fn reference(method: &dyn Method, setting: &Setting) -> Grid {
    let mut grid = Grid::new();
    for rpm in setting.speeds_rpm(5) {
        for depth_mm in setting.depths_mm(5) {
            let point = method.point(rpm, depth_mm).expect("a point of the chart");
            assert!(point.error < 0.01 * ACCURACY * point.multiplier_abs.max(1.0));
            grid.push(((rpm, depth_mm), point.multiplier_abs));
        }
    }
    grid
}

/// The largest relative error of |μ| over the chart points with |μ| ≤ [`LARGE`]. It is infinite if a point with larger
/// |μ| is found stable, or if a point has no result.
fn worst_error(grid: &Grid, size: impl Fn(f64, f64) -> Option<f64>) -> f64 {
    grid.iter()
        .map(|&((rpm, depth_mm), expected)| match size(rpm, depth_mm) {
            Some(found) if expected <= LARGE => (found - expected).abs() / expected,
            Some(found) if found > 1.0 => 0.0,
            _ => f64::INFINITY,
        })
        .fold(0.0, f64::max)
}

/// Number of steps per period with which [`worst_error`] is at most [`ACCURACY`]: 50 or more, but not always the
/// smallest such number; `None` if no tried number up to [`STEPS_MAX`] suffices. `size` computes |μ| from the number
/// of steps, the speed in rev/min and the depth in mm, with an error of second order in the step.
fn steps_needed(grid: &Grid, size: impl Fn(usize, f64, f64) -> Option<f64>) -> Option<usize> {
    let mut steps = 50;
    while steps <= STEPS_MAX {
        let error = worst_error(grid, |rpm, depth_mm| size(steps, rpm, depth_mm));
        if error <= ACCURACY {
            return Some(steps);
        }
        let more = (1.05 * (error / ACCURACY).sqrt()).clamp(1.05, 4.0);
        steps = (steps as f64 * more).ceil() as usize;
    }
    None
}

/// Mean computing time per chart point, s. The points are computed in turn, each at least once and all for at least
/// 0.2 s, unless 20 s have passed.
fn seconds_per_point(grid: &Grid, mut run: impl FnMut(f64, f64)) -> f64 {
    let began = Instant::now();
    let mut count = 0;
    while count < grid.len() || began.elapsed().as_secs_f64() < 0.2 {
        let ((rpm, depth_mm), _) = grid[count % grid.len()];
        run(rpm, depth_mm);
        count += 1;
        if began.elapsed().as_secs_f64() > 20.0 {
            break;
        }
    }
    began.elapsed().as_secs_f64() / count as f64
}

/// Number of spindle speeds and number of axial depths of the chart whose computing time is measured.
const CELLS: (usize, usize) = (200, 100);

fn print_row(name: &str, fineness: &str, per_point_s: f64, chart_s: f64, default_s: f64) {
    println!(
        "  {name:<18} {fineness:<24} {:>10.3} ms {chart_s:>10.3} s {:>9.1}",
        per_point_s * 1e3,
        chart_s / default_s
    );
}

fn compare(setting: &Setting) {
    let case = setting.case();
    let problem = Problem::new(&case, CubicTerms::Refuse).expect("a linear case");
    let pitched = Pitched::new(&case, CubicTerms::Refuse).expect("a linear case");
    let receptances = FrequencyProblem::new(&case, CubicTerms::Refuse).expect("a linear case");
    let default = Collocation { problem };
    let grid = reference(&default, setting);
    let cells = (CELLS.0 * CELLS.1) as f64;
    let began = Instant::now();
    let (speeds_rpm, depths_mm) = (setting.speeds_rpm(CELLS.0), setting.depths_mm(CELLS.1));
    cell_chart(&default, &speeds_rpm, &depths_mm).expect("a chart");
    let default_s = began.elapsed().as_secs_f64();
    println!("{}: {} x {} cells", setting.file, CELLS.0, CELLS.1);
    println!("  method             fineness                      point        chart   ratio");
    let point_s = seconds_per_point(&grid, |rpm, depth_mm| {
        let _ = default.point(rpm, depth_mm);
    });
    print_row(
        "collocation",
        "with errors, below 1e-4",
        point_s,
        default_s,
        default_s,
    );
    let print_stepped =
        |name: &str, size: &dyn Fn(usize, f64, f64) -> Option<f64>| match steps_needed(&grid, size) {
            Some(steps) => {
                let point_s = seconds_per_point(&grid, |rpm, depth_mm| {
                    let _ = size(steps, rpm, depth_mm);
                });
                let fineness = format!("{steps} steps, no errors");
                print_row(name, &fineness, point_s, point_s * cells, default_s);
            }
            None => println!("  {name:<18} not reached with {STEPS_MAX} steps"),
        };
    print_stepped("sdm, order 1", &|steps, rpm, depth_mm| {
        let discretization = SemiDiscretization(SdmOrder::First);
        let method = Sdm {
            pitched: pitched.clone(),
            discretization,
            steps,
        };
        Some(method.multiplier(rpm, depth_mm).ok()?.norm())
    });
    print_stepped("fdm", &|steps, rpm, depth_mm| {
        let discretization = FullDiscretization;
        let method = Fdm {
            pitched: pitched.clone(),
            discretization,
            steps,
        };
        Some(method.multiplier(rpm, depth_mm).ok()?.norm())
    });
    compare_limits(setting, &default, &receptances);
}

/// Prints the computing times of stability limits at 50 spindle speeds, by the default method and by the methods that
/// use receptances.
fn compare_limits(setting: &Setting, default: &Collocation, receptances: &FrequencyProblem) {
    println!("  limits at 50 speeds up to {} mm", setting.depth_mm);
    let speeds_rpm = setting.speeds_rpm(50);
    let time = |method: &dyn Method| {
        let began = Instant::now();
        let lines = method.lines(&speeds_rpm, setting.depth_mm, 40);
        (began.elapsed().as_secs_f64(), lines.err())
    };
    let (default_s, _) = time(default);
    let zoa = Zoa {
        problem: receptances.clone(),
    };
    let nyquist = Nyquist {
        problem: receptances.clone(),
        harmonics: 0,
    };
    let multi_frequency = MultiFrequency {
        problem: receptances.clone(),
        harmonics: None,
    };
    let methods: [(&dyn Method, &str); 4] = [
        (default, ""),
        (&zoa, "averaged: blind to flips"),
        (&nyquist, "averaged: blind to flips"),
        (&multi_frequency, "harmonics as needed"),
    ];
    for (method, remark) in methods {
        let (seconds, refusal) = time(method);
        match refusal {
            None => println!(
                "  {:<18} {remark:<24} {:>10.3} ms {seconds:>10.3} s {:>9.2}",
                method.name(),
                seconds * 1e3 / speeds_rpm.len() as f64,
                seconds / default_s
            ),
            Some(refusal) => println!("  {:<18} {refusal}", method.name()),
        }
    }
}

/// Prints the computing times of stability limits about the forced orbits of two structures with cubic terms, in three
/// speed ranges.
fn limits_with_cubic_terms() {
    for (file, rpm) in [
        ("kuka-kr90-full-cubic.toml", (480.0, 1_060.0)),
        ("kuka-kr90-full-cubic.toml", (495.0, 525.0)),
        ("kuka-kr90-half-cubic.toml", (480.0, 620.0)),
    ] {
        let setting = Setting {
            file,
            rpm,
            depth_mm: 16.0,
        };
        let problem = ForcedProblem::new(&setting.case()).expect("a case with cubic terms");
        let speeds_rpm = setting.speeds_rpm(30);
        let (mut limits, mut all_s, mut slowest) = (0, 0.0, (0.0, 0.0));
        for rpm in &speeds_rpm {
            let began = Instant::now();
            let lines = problem.lines(&[*rpm], setting.depth_mm, 40).expect("limits");
            let taken_s = began.elapsed().as_secs_f64();
            limits += lines.iter().map(|line| line.switches.len()).sum::<usize>();
            all_s += taken_s;
            if taken_s > slowest.0 {
                slowest = (taken_s, *rpm);
            }
        }
        println!(
            "{file}, {} to {} rev/min, cubic terms: {:.1} ms a speed with all its limits, {:.1} ms a limit; the slowest speed, \
             {:.0} rev/min, {:.1} ms",
            rpm.0,
            rpm.1,
            all_s * 1e3 / speeds_rpm.len() as f64,
            all_s * 1e3 / limits as f64,
            slowest.1,
            slowest.0 * 1e3
        );
    }
}

fn main() {
    let one_thread = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("one thread");
    one_thread.install(|| {
        limits_with_cubic_terms();
        for setting in &SETTINGS {
            compare(setting);
        }
    });
    let mut criterion = Criterion::default().configure_from_args().sample_size(10);
    for setting in &SETTINGS {
        let problem = Problem::new(&setting.case(), CubicTerms::Refuse).expect("a linear case");
        let method = Collocation { problem };
        let (speeds_rpm, depths_mm) = (setting.speeds_rpm(CELLS.0), setting.depths_mm(CELLS.1));
        criterion.bench_function(&format!("cells 200 x 100, {}", setting.file), |bencher| {
            one_thread
                .install(|| bencher.iter(|| cell_chart(&method, &speeds_rpm, &depths_mm).expect("a chart")));
        });
        let (rpm, depth_mm) = (setting.speeds_rpm(3)[1], 0.3 * setting.depth_mm);
        criterion.bench_function(&format!("point, {}", setting.file), |bencher| {
            bencher.iter(|| method.point(rpm, depth_mm).expect("a point"));
        });
    }
    criterion.final_summary();
}
