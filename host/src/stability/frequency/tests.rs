use super::*;
use crate::case::Case;
use crate::stability::{CubicTerms, Kind, Method, Problem, Verdict, line, point};

fn case(name: &str) -> Case {
    Case::read(format!(
        "{}/../tests/cases/{name}.toml",
        env!("CARGO_MANIFEST_DIR")
    ))
    .unwrap()
}

fn problem(name: &str) -> FrequencyProblem {
    FrequencyProblem::new(&case(name), CubicTerms::LeaveOut).unwrap()
}

fn first(method: &impl Method, rpm: f64, depth_mm: f64) -> (f64, Kind) {
    let limit = method.line(rpm, depth_mm, 40).unwrap().first_limit.unwrap();
    (limit.depth_mm, limit.kind)
}

/// Averaged limits of chapter 7, mm, with four digits as PHYSICS has them.
const CHAPTER_7: [(f64, f64); 9] = [
    (600.0, 3.349),
    (800.0, 1.643),
    (900.0, 1.622),
    (1050.0, 1.780),
    (1100.0, 1.860),
    (1200.0, 2.046),
    (1600.0, 2.986),
    (2000.0, 4.138),
    (2400.0, 5.483),
];

#[test]
fn averaged_limits_of_chapter_7() {
    let problem = problem("kuka-kr90-acetal");
    let (zoa, nyquist) = (
        Zoa {
            problem: problem.clone(),
        },
        Nyquist {
            problem,
            harmonics: 0,
        },
    );
    for (rpm, expected) in CHAPTER_7 {
        let (depth_mm, kind) = first(&zoa, rpm, 6.0);
        let other = first(&nyquist, rpm, 6.0).0;
        println!("{rpm} {depth_mm} {other}");
        // Half a unit of the last printed digit, and what that digit was rounded from.
        assert!((depth_mm - expected).abs() <= 0.0006, "{rpm}: {depth_mm}");
        assert_eq!(kind, Kind::Hopf);
        assert!(
            (other - depth_mm).abs() < 1e-9 * depth_mm,
            "{rpm}: {other} {depth_mm}"
        );
    }
}

#[test]
fn averaged_limits_of_chapter_3_with_and_without_edge_and_feed_terms() {
    let mut problem = problem("staubli-tx200");
    let limits = |problem: &FrequencyProblem| {
        let (zoa, nyquist) = (
            Zoa {
                problem: problem.clone(),
            },
            Nyquist {
                problem: problem.clone(),
                harmonics: 0,
            },
        );
        (first(&zoa, 500.0, 1.0).0, first(&nyquist, 500.0, 1.0).0)
    };
    let with = limits(&problem);
    problem.process.axial_depth_modulation = false;
    let without = limits(&problem);
    // Half a unit of the last printed digit.
    assert!(
        (with.0 - 0.6534).abs() <= 6e-5 && (without.0 - 0.6527).abs() <= 6e-5,
        "{with:?} {without:?}"
    );
    assert!((with.0 - with.1).abs() < 1e-9 && (without.0 - without.1).abs() < 1e-9);
}

#[test]
fn debug_points() {
    for (name, rpm, depth) in [
        ("kuka-kr90-acetal", 1045.0, 2.0),
        ("kuka-kr90-acetal", 1045.0, 0.1),
        ("kuka-kr90-acetal", 900.0, 1.0),
        ("kuka-kr90-acetal", 900.0, 2.0),
        ("kuka-kr90-acetal", 900.0, 0.0),
        ("kuka-kr90-full", 822.0, 12.0),
        ("insperger-2dof-ad0.05", 5000.0, 1.0),
        ("insperger-2dof-ad1", 5000.0, 5.0),
        ("insperger-1dof-ad1", 5000.0, 0.2),
        ("insperger-1dof-ad1", 5000.0, 1.0),
        ("staubli-tx200", 500.0, 0.5),
        ("staubli-tx200", 280.0, 1.0),
        ("staubli-tx200", 280.0, 0.0),
    ] {
        let t = std::time::Instant::now();
        let exact = point(
            &Problem::new(&case(name), CubicTerms::Refuse).unwrap(),
            rpm,
            depth,
        )
        .unwrap();
        println!(
            "{name} {rpm} {depth}: default {:?} {} {:?} {:?} {:?}",
            t.elapsed(),
            exact.multiplier,
            exact.multiplier_abs,
            exact.kind,
            exact.chatter_hz
        );
        let m = MultiFrequency {
            problem: problem(name),
            harmonics: None,
        };
        let z = Zoa {
            problem: problem(name),
        };
        for m in [&m as &dyn Method, &z] {
            let t = std::time::Instant::now();
            match m.point(rpm, depth) {
                Ok(p) => println!(
                    "  {:?} {} {} err {:e} true {:e} {:?} {:?}",
                    t.elapsed(),
                    p.multiplier,
                    p.multiplier_abs,
                    p.error,
                    (p.multiplier - exact.multiplier).norm(),
                    p.kind,
                    p.chatter_hz
                ),
                Err(e) => println!("  {e}"),
            }
        }
    }
}
