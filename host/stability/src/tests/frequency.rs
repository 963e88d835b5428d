use crate::frequency::averaged::AveragedLoop;
use crate::frequency::harmonic::HarmonicLoop;
use crate::frequency::limits::limits;
use crate::*;
use nalgebra::DMatrix;
use num_complex::Complex64;
use quietcut_testkit::case;

fn problem(name: &str) -> FrequencyProblem {
    FrequencyProblem::new(&case(name), CubicTerms::LeaveOut).unwrap()
}

fn first(method: &impl Method, rpm: f64, depth_mm: f64) -> (f64, StabilityLoss) {
    let limit = method.line(rpm, depth_mm, 40).unwrap().first_limit.unwrap();
    (limit.depth_mm, limit.kind)
}

/// Spindle speed, rev/min, and limit with averaged coefficients, mm, of chapter 7 with four digits.
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
        // Tolerance: half a unit of the last printed digit, and its rounding.
        assert!((depth_mm - expected).abs() <= 0.0006, "{rpm}: {depth_mm}");
        assert_eq!(kind, StabilityLoss::Hopf);
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
    // Tolerance: half a unit of the last printed digit.
    assert!(
        (with.0 - 0.6534).abs() <= 6e-5 && (without.0 - 0.6527).abs() <= 6e-5,
        "{with:?} {without:?}"
    );
    assert!((with.0 - with.1).abs() < 1e-9 && (without.0 - without.1).abs() < 1e-9);
}

/// Every case with a cut: name, two spindle speeds (rev/min), and largest depth of the lines (mm), beyond the limits.
const CASES: [(&str, [f64; 2], f64); 14] = [
    ("insperger-1dof-ad0.05", [6100.0, 15_000.0], 8.0),
    ("insperger-1dof-ad0.1", [6100.0, 15_000.0], 5.0),
    ("insperger-1dof-ad0.5", [6100.0, 15_000.0], 3.0),
    ("insperger-1dof-ad1", [6100.0, 15_000.0], 3.0),
    ("insperger-2dof-ad0.05", [6100.0, 15_000.0], 8.0),
    ("insperger-2dof-ad0.1", [6100.0, 15_000.0], 5.0),
    ("insperger-2dof-ad0.5", [6100.0, 15_000.0], 3.0),
    ("insperger-2dof-ad1", [6100.0, 15_000.0], 3.0),
    ("kuka-kr90-acetal", [800.0, 1045.0], 6.0),
    ("kuka-kr90-full", [822.0, 1050.9], 8.0),
    ("kuka-kr90-half", [378.1, 900.0], 8.0),
    ("kuka-kr90-full-cubic", [526.0, 1200.0], 14.0),
    ("kuka-kr90-half-cubic", [559.0, 1134.3], 8.0),
    ("staubli-tx200", [280.0, 500.0], 1.5),
];

fn model(name: &str) -> Problem {
    Problem::new(&case(name), CubicTerms::LeaveOut).unwrap()
}

fn switches(method: &impl Method, rpm: f64, depth_mm: f64) -> Vec<Switch> {
    method.line(rpm, depth_mm, 40).unwrap().switches
}

/// Largest relative difference of depths between two lists of switches, which must have the same kinds and directions
/// in the same order.
fn difference(a: &[Switch], b: &[Switch]) -> f64 {
    assert_eq!(a.len(), b.len(), "{a:?}\n{b:?}");
    a.iter()
        .zip(b)
        .map(|(a, b)| {
            assert_eq!((a.kind, a.gain), (b.kind, b.gain), "{a:?} {b:?}");
            (a.depth_mm / b.depth_mm - 1.0).abs()
        })
        .fold(0.0, f64::max)
}

#[test]
fn the_closed_form_and_the_confirmed_loci_have_the_same_averaged_limits_on_all_cases() {
    let mut count = 0;
    for (name, speeds, depth_mm) in CASES {
        let problem = problem(name);
        let zoa = Zoa {
            problem: problem.clone(),
        };
        let nyquist = Nyquist {
            problem,
            harmonics: 0,
        };
        for rpm in speeds {
            let (a, b) = (switches(&zoa, rpm, depth_mm), switches(&nyquist, rpm, depth_mm));
            count += a.len();
            // Tolerance: both methods solve for their limits to 1e-11.
            assert!(difference(&a, &b) < 1e-9, "{name} {rpm}");
        }
    }
    assert!(count > 2 * CASES.len(), "{count}");
}

#[test]
fn limits_with_rising_harmonics_converge_to_those_of_the_one_period_map_on_all_cases() {
    for (name, speeds, depth_mm) in CASES {
        let (problem, model) = (problem(name), model(name));
        for rpm in speeds {
            let exact = line(&model, rpm, depth_mm, 40).unwrap().switches;
            let least = HarmonicLoop::least_harmonics(&problem, rpm);
            let error = |harmonics: usize| {
                let method = MultiFrequency {
                    problem: problem.clone(),
                    harmonics: Some(harmonics),
                };
                difference(&switches(&method, rpm, depth_mm), &exact)
            };
            let (coarse, fine) = (error(least), error(2 * least));
            println!("{name} {rpm}: {least} {coarse:.1e} {fine:.1e}");
            // The truncation error falls with the second or third power of the harmonics: by four or more with twice
            // their number, unless it has reached rounding.
            assert!(
                fine < 0.3 * coarse || fine < 1e-8,
                "{name} {rpm}: {coarse} {fine}"
            );
        }
        // By default harmonics are doubled until limits change by less than 1e-4, so that their error is a third of
        // that.
        let rpm = speeds[0];
        let exact = line(&model, rpm, depth_mm, 40).unwrap().switches;
        let method = MultiFrequency {
            problem,
            harmonics: None,
        };
        assert!(
            difference(&switches(&method, rpm, depth_mm), &exact) < 4e-5,
            "{name} {rpm}"
        );
    }
}

#[test]
fn the_number_of_unstable_roots_is_that_of_multipliers_outside() {
    for (name, speeds, depth_mm) in [
        ("kuka-kr90-acetal", [1036.0, 1045.0], 4.0),
        ("insperger-2dof-ad0.5", [6100.0, 21_000.0], 4.0),
        ("insperger-1dof-ad0.1", [5200.0, 15_000.0], 5.0),
        ("staubli-tx200", [280.0, 500.0], 1.5),
    ] {
        let model = model(name);
        for rpm in speeds {
            let nyquist = Nyquist {
                problem: problem(name),
                harmonics: 24,
            };
            let exact = line(&model, rpm, depth_mm, 40).unwrap();
            for i in 1..=5 {
                let depth = depth_mm * f64::from(i) / 5.0 - 0.013;
                let outside: i32 = exact
                    .switches
                    .iter()
                    .filter(|switch| switch.depth_mm < depth)
                    .map(|switch| {
                        if switch.gain {
                            -switch.kind.count()
                        } else {
                            switch.kind.count()
                        }
                    })
                    .sum();
                assert_eq!(
                    nyquist.unstable_roots(rpm, depth).unwrap(),
                    outside,
                    "{name} {rpm} {depth}"
                );
            }
        }
    }
}

#[test]
fn the_flip_notch_its_upper_branch_and_the_window_are_found_by_harmonics() {
    let method = MultiFrequency {
        problem: problem("kuka-kr90-acetal"),
        harmonics: None,
    };
    let near = |found: &[Switch], expected: &[(f64, StabilityLoss, bool)]| {
        assert_eq!(found.len(), expected.len(), "{found:?}");
        for (found, (depth_mm, kind, gain)) in found.iter().zip(expected) {
            // Tolerance: half a unit of the last printed digit, and the 4e-5 of the truncated harmonics.
            assert!((found.depth_mm - depth_mm).abs() < 0.0007, "{found:?}");
            assert_eq!((found.kind, found.gain), (*kind, *gain), "{found:?}");
        }
    };
    let at = |rpm| switches(&method, rpm, 4.5);
    near(
        &at(1045.0),
        &[
            (1.327, StabilityLoss::Flip, false),
            (3.344, StabilityLoss::Flip, false),
        ],
    );
    let window = [
        (1.575, StabilityLoss::Flip, false),
        (2.334, StabilityLoss::Flip, true),
        (2.712, StabilityLoss::Hopf, false),
    ];
    near(&at(1036.0), &window);
    assert!((at(1064.0)[1].depth_mm - 4.023).abs() < 0.0007);
    let nyquist = Nyquist {
        problem: problem("kuka-kr90-acetal"),
        harmonics: 12,
    };
    near(&switches(&nyquist, 1036.0, 4.5), &window);
}

#[test]
fn multipliers_are_those_of_the_one_period_map_within_the_error_stated() {
    for (name, rpm, depth_mm) in [
        ("kuka-kr90-acetal", 1045.0, 2.0),
        ("kuka-kr90-acetal", 900.0, 0.1),
        ("kuka-kr90-full", 822.0, 12.0),
        ("insperger-1dof-ad1", 5000.0, 1.0),
        ("insperger-2dof-ad0.5", 6200.0, 1.0),
        ("staubli-tx200", 280.0, 1.0),
        ("staubli-tx200", 280.0, 0.0),
    ] {
        let exact = point(&model(name), rpm, depth_mm).unwrap();
        let method = MultiFrequency {
            problem: problem(name),
            harmonics: None,
        };
        let found = method.point(rpm, depth_mm).unwrap();
        let error = (found.multiplier - exact.multiplier).norm();
        assert!(
            error < found.error && found.error < 1e-5,
            "{name} {rpm} {depth_mm}: {error} {found:?}"
        );
        assert_eq!((found.kind, found.verdict), (exact.kind, exact.verdict));
    }
}

/// With four teeth at full immersion the sum of the directional coefficients does not depend on the rotation angle, so
/// that methods with averaged coefficients are exact.
#[test]
fn where_coefficients_are_constant_averaged_methods_are_exact() {
    let mut case = case("insperger-2dof-ad1");
    let tool = case.tool.as_mut().unwrap();
    tool.teeth = 4;
    tool.pitch_deg = vec![90.0; 4];
    let model = Problem::new(&case, CubicTerms::Refuse).unwrap();
    let zoa = Zoa {
        problem: FrequencyProblem::of_model(&model).unwrap(),
    };
    for rpm in [4000.0, 9000.0, 14_000.0] {
        let exact = line(&model, rpm, 1.0, 60).unwrap().switches;
        assert!(!exact.is_empty());
        // Tolerance: the default method solves for limits to 1e-9.
        assert!(difference(&switches(&zoa, rpm, 1.0), &exact) < 1e-8, "{rpm}");
        let at = |method: &dyn Method| method.point(rpm, 0.3).unwrap().multiplier;
        let exact = point(&model, rpm, 0.3).unwrap().multiplier;
        assert!((at(&zoa) - exact).norm() < 1e-8, "{rpm}");
    }
}

#[test]
fn averaged_coefficients_miss_a_flip_and_give_three_times_its_limit() {
    let rpm = 30.0 * 109.6416 / 3.13;
    let problem = problem("kuka-kr90-full");
    let exact = line(&model("kuka-kr90-full"), rpm, 8.0, 40)
        .unwrap()
        .first_limit
        .unwrap();
    let (depth_mm, kind) = first(&Zoa { problem }, rpm, 8.0);
    assert_eq!((exact.kind, kind), (StabilityLoss::Flip, StabilityLoss::Hopf));
    assert!(
        (2.5..3.5).contains(&(depth_mm / exact.depth_mm)),
        "{depth_mm} {exact:?}"
    );
}

/// The limit of mode coupling is the depth at which an eigenvalue of the equations of motion, with the cut as a
/// constant stiffness, crosses the imaginary axis.
#[test]
fn mode_coupling_limits_are_where_an_eigenvalue_of_the_equations_of_motion_crosses() {
    let name = "kuka-kr90-full";
    let model = model(name);
    let process = &model.process;
    let averaged = process
        .force
        .averaged(&process.engagement, process.feed_per_tooth_m);
    let growth = |depth_mm: f64| {
        let structure = &model.structure;
        let cut = &structure.b * (averaged.directional * (depth_mm * 1e-3)) * &structure.c;
        let matrix: DMatrix<f64> = &structure.a + cut;
        let eigenvalues = matrix.complex_eigenvalues();
        eigenvalues
            .iter()
            .map(|value| value.re)
            .fold(f64::NEG_INFINITY, f64::max)
    };
    let method = ModeCoupling::new(problem(name)).unwrap();
    let slow = switches(&method, 500.0, 60.0);
    assert!(!slow.is_empty());
    let limit = slow[0].depth_mm;
    let decay = -growth(0.0);
    assert!(growth(limit).abs() < 1e-8 * decay, "{limit}");
    assert!(growth(0.99 * limit) < 0.0 && growth(1.01 * limit) > 0.0);
    assert_eq!(switches(&method, 2000.0, 60.0)[0].depth_mm, limit);
    // In this cut regeneration limits the depth to less than half of the mode-coupling limit.
    assert!(
        limit
            > 2.0
                * line(&model, 822.0, 8.0, 40)
                    .unwrap()
                    .first_limit
                    .unwrap()
                    .depth_mm
    );
    let point = method.point(500.0, 1.05 * limit).unwrap();
    assert!(
        (point.multiplier_abs.ln() / model.tooth_period_s(500.0) - growth(1.05 * limit)).abs() < 1e-6 * decay
    );
}

#[test]
fn mode_coupling_is_refused_for_a_single_mode() {
    let error = ModeCoupling::new(problem("insperger-1dof-ad1"))
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("mode coupling") && error.contains("two modes"),
        "{error}"
    );
}

#[test]
fn structures_without_damping_are_refused() {
    let mut case = case("insperger-1dof-ad1");
    let Some(quietcut_model::structure::Structure {
        form: quietcut_model::structure::Form::Matrices(matrices),
        ..
    }) = &mut case.structure
    else {
        panic!("no matrices")
    };
    matrices.damping.fill(0.0);
    let error = FrequencyProblem::new(&case, CubicTerms::Refuse)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("922.0000 Hz") && error.contains("damping"),
        "{error}"
    );
}

#[test]
fn the_closed_form_is_found_on_a_single_degree_of_freedom() {
    // With one direction the limit is w = 1/(2 K α_xx Re H) at every chatter frequency (Altintas & Budak).
    let model = model("insperger-1dof-ad1");
    let problem = problem("insperger-1dof-ad1");
    let process = &model.process;
    let averaged = process
        .force
        .averaged(&process.engagement, process.feed_per_tooth_m);
    let open_loop = AveragedLoop::new(&problem, Some(7000.0));
    for limit in limits(&open_loop, 3e-3).unwrap() {
        let h = model.structure.receptance(limit.omega).unwrap()[(0, 0)];
        let closed = 1.0 / (2.0 * averaged.directional[(0, 0)] * h.re);
        assert!((limit.depth_m / closed - 1.0).abs() < 1e-9, "{limit:?} {closed}");
        let phase = Complex64::cis(-limit.omega * model.tooth_period_s(7000.0));
        let one = (Complex64::ONE - phase) * averaged.directional[(0, 0)] * h * limit.depth_m;
        assert!((one - 1.0).norm() < 1e-9);
    }
}
