use crate::tests::problem;
use crate::*;
use rand::{RngExt, SeedableRng};

fn grid(first: f64, last: f64, count: usize) -> Vec<f64> {
    (0..count)
        .map(|i| first + (last - first) * i as f64 / (count - 1) as f64)
        .collect()
}

/// Charts that are compared: case, lowest and highest spindle speed (rev/min), largest depth (mm).
const CHARTS: [(&str, f64, f64, f64); 3] = [
    ("insperger-2dof-ad0.05", 5000.0, 25_000.0, 10.0),
    ("insperger-2dof-ad0.5", 5000.0, 25_000.0, 10.0),
    ("kuka-kr90-acetal", 600.0, 2400.0, 5.0),
];

#[test]
fn cells_of_whole_charts_are_those_of_single_points() {
    let seed = 20_261_122;
    println!("seed {seed}");
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    for (name, slowest, fastest, depth_mm) in CHARTS {
        let method = Collocation {
            problem: problem(name),
        };
        let (speeds, depths) = (grid(slowest, fastest, 200), grid(0.0, depth_mm, 100));
        let chart = cell_chart(&method, &speeds, &depths).unwrap();
        let (mut worst, mut ratio) = (0.0_f64, 0.0_f64);
        for _ in 0..400 {
            let (i, j) = (rng.random_range(0..200), rng.random_range(0..100));
            let point = method.point(speeds[i], depths[j]).unwrap();
            let line = &chart.speeds[i];
            let off = (line.multiplier_abs[j] - point.multiplier_abs).abs();
            ratio = ratio.max(off / (line.error[j] + point.error));
            if point.multiplier_abs <= 2.0 {
                worst = worst.max(off / point.multiplier_abs);
            }
            assert_eq!(
                line.verdict[j], point.verdict,
                "{name} {} {}",
                speeds[i], depths[j]
            );
        }
        println!("{name}: worst {worst:.1e}, over its error {ratio:.2}");
        // Tolerance: a fifth of the 1e-4 that cells may have, since each cubic is corrected by its error at the middle.
        assert!(worst < 2e-5, "{name}: {worst}");
        assert!(ratio <= 1.0, "{name}: {ratio}");
    }
}

#[test]
fn verdicts_of_whole_charts_are_those_of_semi_discretization() {
    let seed = 20_261_123;
    println!("seed {seed}");
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    for (name, slowest, fastest, depth_mm) in CHARTS {
        let method = Collocation {
            problem: problem(name),
        };
        let stepped = Sdm {
            pitched: method.problem.clone().into(),
            discretization: SemiDiscretization(SdmOrder::First),
            steps: 60,
        };
        let (speeds, depths) = (grid(slowest, fastest, 200), grid(0.0, depth_mm, 100));
        let (mut decided, mut large) = (0, 0);
        for _ in 0..60 {
            let (speed, depth) = (rng.random_range(0..200), rng.random_range(0..100));
            // One cell of a whole column, since a column is computed from few of its depths.
            let cell = method.cells(speeds[speed], &depths).unwrap()[depth];
            let point = stepped.point(speeds[speed], depths[depth]).unwrap();
            let place = format!("{name} {} {}", speeds[speed], depths[depth]);
            let off = (cell.multiplier_abs - point.multiplier_abs).abs();
            assert!(off <= cell.error + point.error, "{place}: {cell:?} {point:?}");
            if point.verdict != Verdict::Undecided {
                assert_eq!(cell.verdict, point.verdict, "{place}: {cell:?} {point:?}");
                decided += 1;
                large += usize::from(point.multiplier_abs > 2.0);
            }
        }
        println!("{name}: {decided} of 60 decided, {large} of them beyond 2");
        // With sixty steps semi-discretization decides most cells. Multipliers above 2 occur in the case with an
        // immersion of half the diameter only.
        assert!(decided >= 45, "{name}: {decided}");
        assert_eq!(large > 0, name == "insperger-2dof-ad0.5", "{name}: {large}");
    }
}

#[test]
fn cells_are_the_same_for_any_number_of_threads_and_any_order_of_depths() {
    let method = Collocation {
        problem: problem("kuka-kr90-acetal"),
    };
    let (speeds, depths) = (grid(1000.0, 1100.0, 11), grid(0.05, 4.0, 80));
    let with = |threads: usize, depths: &[f64]| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| cell_chart(&method, &speeds, depths).unwrap())
    };
    let one = with(1, &depths);
    assert_eq!(one, with(3, &depths));
    let backwards: Vec<f64> = depths.iter().rev().copied().collect();
    for (line, reversed) in one.speeds.iter().zip(with(2, &backwards).speeds) {
        assert!(
            line.multiplier_abs
                .iter()
                .eq(reversed.multiplier_abs.iter().rev())
        );
    }
    // A cell is stable if and only if its depth lies in a stable interval of the line at its speed.
    for (line, cells) in chart(&method, &speeds, 4.0, 40)
        .unwrap()
        .speeds
        .iter()
        .zip(&one.speeds)
    {
        for (depth, verdict) in depths.iter().zip(&cells.verdict) {
            let stable = line
                .stable_mm
                .iter()
                .any(|[from, to]| (from..=to).contains(&depth));
            assert_eq!(stable, *verdict == Verdict::Stable, "{} {depth}", line.rpm);
        }
    }
}

#[test]
fn invalid_cells_are_refused_and_no_depths_give_no_cells() {
    let method = Collocation {
        problem: problem("kuka-kr90-acetal"),
    };
    assert!(method.cells(900.0, &[1.0, -1.0]).is_err());
    assert!(method.cells(0.0, &[1.0]).is_err());
    assert!(method.cells(900.0, &[]).unwrap().is_empty());
    let lone = method.cells(900.0, &[0.0]).unwrap();
    assert_eq!((lone.len(), lone[0].verdict), (1, Verdict::Stable));
}
