//! Charts between their requested speeds: at random points the drawn verdict is that of the method.

use rand::{RngExt, SeedableRng};
use rayon::prelude::*;

use quietcut_model::structure::Form;
use quietcut_testkit::results::Campaign;

use crate::tests::{problem, random_case};
use crate::*;

/// Numbers of random points in a chart, by the comparison of drawn and computed verdict.
#[derive(Debug, Default)]
struct Drawn {
    points: usize,
    /// Points within 1 % in depth or 0.1 % in speed of a true limit.
    near: usize,
    undecided: usize,
    wrong: Vec<(f64, f64)>,
}

/// Compares the drawn verdict with the computed one at random points that are farther than 1 % in depth and 0.1 % in speed from
/// every true limit.
fn compare(chart: &Chart, method: &dyn Method, depth_mm: f64, points: usize, seed: u64) -> Drawn {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let lines = chart.lines();
    let (first, last) = (lines[0].rpm, lines[lines.len() - 1].rpm);
    let at: Vec<(f64, f64)> = (0..points)
        .map(|_| (rng.random_range(first..last), rng.random_range(0.0..depth_mm)))
        .collect();
    let found: Vec<(Option<Verdict>, Option<Verdict>)> = at
        .par_iter()
        .map(|&(rpm, depth_mm)| {
            let truth = |rpm: f64, depth_mm: f64| method.point(rpm, depth_mm).unwrap().verdict;
            let center = truth(rpm, depth_mm);
            let is_far = [-1.0, -0.5, 0.5, 1.0].into_iter().all(|share| {
                truth(rpm * (1.0 + 1e-3 * share), depth_mm) == center
                    && truth(rpm, depth_mm * (1.0 + 1e-2 * share)) == center
            });
            (is_far.then_some(center), chart.verdict(rpm, depth_mm))
        })
        .collect();
    let mut drawn = Drawn::default();
    for (at, (truth, verdict)) in at.into_iter().zip(found) {
        drawn.points += 1;
        drawn.undecided += usize::from(verdict == Some(Verdict::Undecided));
        match truth {
            None => drawn.near += 1,
            Some(truth) if verdict != Some(Verdict::Undecided) && verdict != Some(truth) => {
                drawn.wrong.push(at)
            }
            Some(_) => {}
        }
    }
    drawn
}

#[test]
fn charts_of_the_literature_draw_the_verdict_of_every_point() {
    for (name, rpm, depth_mm, count) in [
        ("insperger-2dof-ad0.05", (5000.0, 25_000.0), 10.0, 40),
        ("insperger-2dof-ad0.5", (5000.0, 25_000.0), 10.0, 40),
        ("insperger-1dof-ad0.1", (5000.0, 25_000.0), 10.0, 12),
        ("kuka-kr90-acetal", (600.0, 2400.0), 5.0, 7),
        ("staubli-tx200", (500.0, 3000.0), 4.0, 20),
    ] {
        let problem = problem(name);
        let teeth = quietcut_testkit::case(name).tool.unwrap().teeth;
        let method = Collocation { problem };
        let speeds = spaced(rpm.0, rpm.1, count);
        let begun = std::time::Instant::now();
        let chart = chart(&method, &speeds, depth_mm, 40).unwrap();
        let base = begun.elapsed();
        let chart = chart.with_lines_between(&method, depth_mm, 40, teeth).unwrap();
        let drawn = compare(&chart, &method, depth_mm, 400, 7);
        println!(
            "{name}: {count} + {} lines, {base:?} of {:?}, {:?}, {drawn:?}",
            chart.refined.len(),
            begun.elapsed(),
            chart.resolution
        );
        drawn.check();
    }
}

/// Where the lobes of two modes of nearly equal frequency meet, the limit has a kink, but the chatter frequency hardly jumps.
#[test]
fn charts_of_close_modes_draw_the_verdict_of_every_point() {
    for (name, apart, count) in [
        ("insperger-2dof-ad0.5", 1.02, 15),
        ("insperger-2dof-ad0.5", 1.05, 25),
        ("insperger-2dof-ad0.5", 1.1, 40),
        ("insperger-2dof-ad0.1", 1.05, 60),
        ("insperger-2dof-ad1", 1.03, 20),
    ] {
        let mut case = quietcut_testkit::case(name);
        let Form::Matrices(matrices) = &mut case.structure.as_mut().unwrap().form else {
            panic!("{name} has matrices");
        };
        matrices.stiffness[(1, 1)] *= apart;
        let problem = Problem::new(&case, CubicTerms::Refuse).unwrap();
        let method = Collocation { problem };
        let chart = chart(&method, &spaced(5000.0, 25_000.0, count), 10.0, 40).unwrap();
        let chart = chart.with_lines_between(&method, 10.0, 40, 2).unwrap();
        let drawn = compare(&chart, &method, 10.0, 400, 11);
        println!(
            "{name}, {apart}: {count} + {} lines, {drawn:?}",
            chart.refined.len()
        );
        drawn.check();
    }
}

/// Compares drawn and computed verdicts at 100 random points in the chart of one random machine per seed. The number of
/// requested speeds is random too.
fn charts_of_random_machines(seeds: std::ops::Range<u64>) -> Drawn {
    let mut total = Drawn::default();
    for seed in seeds {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let case = random_case(&mut rng);
        let problem = Problem::new(&case, CubicTerms::Refuse).unwrap();
        let teeth = case.tool.as_ref().unwrap().teeth;
        let (from, to) = default_speeds(&case, &problem.structure, teeth);
        let method = Collocation { problem };
        let coarse = spaced(from, to, 12);
        let mut depth_mm = 0.01;
        let lowest = loop {
            let lines = chart(&method, &coarse, depth_mm, 40).unwrap().speeds;
            let limits = lines.iter().filter_map(|line| line.first_limit);
            let lowest = limits.map(|limit| limit.depth_mm).fold(f64::INFINITY, f64::min);
            if lowest.is_finite() || depth_mm > 100.0 {
                break lowest;
            }
            depth_mm *= 2.0;
        };
        if !lowest.is_finite() {
            continue;
        }
        let depth_mm = 4.0 * lowest;
        let count = rng.random_range(2..40);
        let begun = std::time::Instant::now();
        let chart = chart(&method, &spaced(from, to, count), depth_mm, 40).unwrap();
        let chart = chart.with_lines_between(&method, depth_mm, 40, teeth).unwrap();
        let took = begun.elapsed();
        let drawn = compare(&chart, &method, depth_mm, 100, seed);
        println!(
            "seed {seed}: {count} + {} lines, {took:?}, {:?}, {drawn:?}",
            chart.refined.len(),
            chart
                .resolution
                .as_ref()
                .map(|r| (r.narrowest_island_rpm, r.unresolved_rpm.len()))
        );
        total.points += drawn.points;
        total.near += drawn.near;
        total.undecided += drawn.undecided;
        total.wrong.extend(drawn.wrong);
    }
    println!("{total:?}");
    total
}

impl Drawn {
    /// No drawn verdict is wrong, and at most 1 % of the points are drawn as undecided.
    fn check(&self) {
        assert!(self.wrong.is_empty(), "{self:?}");
        assert!(self.undecided * 100 <= self.points, "{self:?}");
    }
}

#[test]
fn charts_of_random_machines_draw_the_verdict_of_every_point() {
    charts_of_random_machines(1..14).check();
}

/// `QUIETCUT_SEEDS` sets another number of machines.
#[test]
#[ignore = "two minutes; the command stands in host/VALIDATION.md"]
fn charts_of_random_machines_by_the_dozen() {
    let count = std::env::var("QUIETCUT_SEEDS").map_or(31, |count| count.parse().unwrap());
    let drawn = charts_of_random_machines(0..count);
    let figures = [
        ("random points", drawn.points),
        (
            "of these within 1 % in depth or 0.1 % in speed of a true limit",
            drawn.near,
        ),
        ("drawn as undecided", drawn.undecided),
        ("drawn wrong", drawn.wrong.len()),
    ];
    Campaign {
        name: "chart-points",
        title: "Charts between the requested speeds",
        command: "cargo test --release -p quietcut-stability --lib charts_of_random_machines_by_the_dozen -- --ignored --nocapture",
        seeds: &format!("machines 0 to {}", count - 1),
    }
    .record(&figures.map(|(figure, value)| (figure.to_owned(), value.to_string())));
    drawn.check();
}
