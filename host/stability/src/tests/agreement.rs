//! Every method against the default method on every case, and against multipliers quoted in the literature.

use num_complex::Complex64;

use crate::methods::discretized::{Discretization, Discretized, with_dominant};
use crate::methods::stepped::Stepped;
use crate::spectrum::krylov::Dominant;
use crate::*;
use quietcut_testkit::case;

fn default_point(name: &str, rpm: f64, depth_mm: f64) -> CutStability {
    let problem = Problem::new(&case(name), CubicTerms::Refuse).unwrap();
    point(&problem, rpm, depth_mm).unwrap()
}

fn sdm(name: &str, order: SdmOrder, steps: usize) -> Sdm {
    Sdm {
        pitched: Pitched::new(&case(name), CubicTerms::LeaveOut).unwrap(),
        discretization: SemiDiscretization(order),
        steps,
    }
}

fn fdm(name: &str, steps: usize) -> Fdm {
    Fdm {
        pitched: Pitched::new(&case(name), CubicTerms::LeaveOut).unwrap(),
        discretization: FullDiscretization,
        steps,
    }
}

/// Case, spindle speed in rev/min, depth in mm and multiplier of every reference.
fn references() -> Vec<(String, f64, f64, Complex64)> {
    let path = format!("{}/../../tests/data/multipliers.csv", env!("CARGO_MANIFEST_DIR"));
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_path(path)
        .unwrap();
    reader
        .deserialize()
        .map(|row| {
            let (name, rpm, depth_mm, re, im): (String, f64, f64, f64, f64) = row.unwrap();
            (name, rpm, depth_mm, Complex64::new(re, im))
        })
        .collect()
}

#[test]
fn the_quoted_multipliers_are_those_of_first_order_semi_discretization_with_192_steps() {
    // Immersion a/D = 1 at 5000 rev/min: |μ| as quoted, which is that of 192 steps, and the value to which it
    // converges.
    let method = sdm("insperger-1dof-ad1", SdmOrder::First, 192);
    for (depth_mm, quoted, converged) in [
        (0.2, 0.8192, 0.819_742_78),
        (0.5, 1.0726, 1.073_975_59),
        (1.0, 1.4040, 1.406_473_53),
    ] {
        let point = method.point(5000.0, depth_mm).unwrap();
        // Tolerance: half a unit of the last quoted digit, and its rounding.
        assert!((point.multiplier_abs - quoted).abs() < 5.5e-5, "{point:?}");
        let error = (point.multiplier_abs - converged).abs();
        assert!(error > 4e-4 && error < point.error, "{point:?}");
    }
    // With forty steps, as in published programs, |μ| errs by one to four percent; the stated error covers that.
    for (depth_mm, off) in [(0.2, 0.0134), (0.5, 0.0282), (1.0, 0.0400)] {
        let coarse = sdm("insperger-1dof-ad1", SdmOrder::First, 40);
        let point = coarse.point(5000.0, depth_mm).unwrap();
        let converged = default_point("insperger-1dof-ad1", 5000.0, depth_mm).multiplier_abs;
        let error = (point.multiplier_abs - converged).abs();
        assert!(
            (error / converged - off).abs() < 2e-4 && error < point.error,
            "{point:?}"
        );
    }
}

/// Error of the multiplier of a discretization that lies nearest to the exact one.
fn error_of<D: Discretization>(method: &Discretized<D>, rpm: f64, depth_mm: f64, exact: Complex64) -> f64 {
    let nearest = |dominant: &Dominant, _: &Stepped| {
        let distances = dominant.eigenvalues.iter().map(|value| (value - exact).norm());
        distances.min_by(f64::total_cmp)
    };
    with_dominant(method, rpm, depth_mm, method.steps, nearest).unwrap()
}

#[test]
fn multipliers_converge_on_every_case_with_the_order_of_the_method() {
    let mut seen = Vec::new();
    for (name, rpm, depth_mm, exact) in references() {
        // One point of each case. Points with a multiplier near the real axis are left out, since near a double
        // multiplier convergence is that of a square root.
        if seen.contains(&name) || exact.im.abs() < 0.2 {
            continue;
        }
        let check = |label: &str, order: f64, errors: [f64; 2]| {
            let slope = (errors[0] / errors[1]).log2();
            // Tolerance: the second term of the error is a few percent of the leading one at these steps.
            assert!((slope - order).abs() < 0.15, "{label} {name}: {slope} {errors:?}");
        };
        let steps = [320, 640];
        let zeroth = steps.map(|steps| error_of(&sdm(&name, SdmOrder::Zeroth, steps), rpm, depth_mm, exact));
        check("sdm 0", 1.0, zeroth);
        let first = steps.map(|steps| error_of(&sdm(&name, SdmOrder::First, steps), rpm, depth_mm, exact));
        check("sdm 1", 2.0, first);
        let full = steps.map(|steps| error_of(&fdm(&name, steps), rpm, depth_mm, exact));
        check("fdm", 2.0, full);
        seen.push(name);
    }
    // All cases that have a cut and no cubic terms are covered.
    assert_eq!(seen.len(), 12, "{seen:?}");
}

#[test]
fn stated_errors_cover_the_true_ones_on_all_references() {
    // All references with 40 steps, every fourth with 100.
    for (steps, every) in [(40, 1), (100, 4)] {
        for (name, rpm, depth_mm, exact) in references().into_iter().step_by(every) {
            let methods: [&dyn Method; 3] = [
                &sdm(&name, SdmOrder::Zeroth, steps),
                &sdm(&name, SdmOrder::First, steps),
                &fdm(&name, steps),
            ];
            for method in methods {
                let point = method.point(rpm, depth_mm).unwrap();
                // Error of |μ| and not of μ: if two multipliers have nearly one size, the method may take the other
                // one.
                let error = (point.multiplier_abs - exact.norm()).abs();
                assert!(
                    error < point.error,
                    "{steps} {name} {rpm} {depth_mm}: {error} {point:?}"
                );
                let wrong = match point.verdict {
                    Verdict::Stable => exact.norm() > 1.0,
                    Verdict::Unstable => exact.norm() < 1.0,
                    Verdict::Undecided => false,
                };
                assert!(!wrong, "{point:?}");
            }
        }
    }
}

#[test]
fn limits_windows_kinds_and_chatter_are_those_of_the_default() {
    let default = Collocation {
        problem: Problem::new(&case("kuka-kr90-acetal"), CubicTerms::Refuse).unwrap(),
    };
    // At 1036 rev/min there is a stable window above the limit, at 1045 a flip notch, at 1200 a Hopf limit.
    let speeds = [1036.0, 1045.0, 1200.0];
    let exact = chart(&default, &speeds, 4.0, 40).unwrap();
    let methods: [&dyn Method; 2] = [
        &sdm("kuka-kr90-acetal", SdmOrder::First, 100),
        &fdm("kuka-kr90-acetal", 100),
    ];
    for method in methods {
        let found = chart(method, &speeds, 4.0, 40).unwrap();
        assert!(found.label.settings.is_some());
        for (found, exact) in found.speeds.iter().zip(&exact.speeds) {
            assert_eq!(found.switches.len(), exact.switches.len(), "{found:?} {exact:?}");
            for (found, exact) in found.switches.iter().zip(&exact.switches) {
                // Tolerance: multipliers err by h² and change slowly with the depth.
                assert!(
                    (found.depth_mm / exact.depth_mm - 1.0).abs() < 0.01,
                    "{found:?} {exact:?}"
                );
                assert_eq!((found.kind, found.gain), (exact.kind, exact.gain));
                let (found, exact) = (found.chatter_hz.unwrap(), exact.chatter_hz.unwrap());
                assert!((found / exact - 1.0).abs() < 1e-3, "{found} {exact}");
            }
        }
    }
}

#[test]
fn chatter_is_named_after_the_largest_harmonic_by_every_method() {
    // Case in which four pairs leave the unit circle. The motion of the fourth pair has many harmonics, and within a
    // period another motion grows a million times faster.
    let name = "insperger-2dof-ad1";
    let default = Collocation {
        problem: Problem::new(&case(name), CubicTerms::Refuse).unwrap(),
    };
    let receptances = MultiFrequency {
        problem: FrequencyProblem::new(&case(name), CubicTerms::Refuse).unwrap(),
        harmonics: None,
    };
    let chatter_hz = |method: &dyn Method| {
        let switches = method.line(5000.0, 6.0, 40).unwrap().switches;
        assert_eq!(switches.len(), 4);
        switches[3].chatter_hz.unwrap()
    };
    let (by_default, by_receptances) = (chatter_hz(&default), chatter_hz(&receptances));
    assert!((by_default - 1391.286).abs() < 1e-3, "{by_default}");
    assert!(
        (by_default - by_receptances).abs() < 1e-6,
        "{by_default} {by_receptances}"
    );
    // Tolerance: limits with 300 steps err by 2e-3.
    let by_steps = chatter_hz(&sdm(name, SdmOrder::First, 300));
    assert!(
        (by_steps / by_default - 1.0).abs() < 2e-3,
        "{by_steps} {by_default}"
    );
}

#[test]
fn without_depth_the_frequency_is_that_of_a_mode() {
    for (name, rpm) in [
        ("kuka-kr90-acetal", 600.0),
        ("kuka-kr90-acetal", 1200.0),
        ("insperger-2dof-ad0.05", 5000.0),
    ] {
        let point = default_point(name, rpm, 0.0);
        let problem = Problem::new(&case(name), CubicTerms::Refuse).unwrap();
        let period_s = problem.tooth_period_s(rpm);
        let slowest = problem
            .structure
            .poles()
            .into_iter()
            .max_by(|p, q| p.re.total_cmp(&q.re))
            .unwrap();
        let mode_hz = slowest.im.abs() / std::f64::consts::TAU;
        assert!((point.multiplier_abs - (slowest.re * period_s).exp()).abs() < point.error);
        let found = point.chatter_hz.unwrap();
        assert!(
            (found / mode_hz - 1.0).abs() < 1e-9,
            "{name} {rpm}: {found} {mode_hz}"
        );
        let by_steps = sdm(name, SdmOrder::First, 100).point(rpm, 0.0).unwrap();
        assert!(
            (by_steps.chatter_hz.unwrap() / mode_hz - 1.0).abs() < 1e-6,
            "{by_steps:?} {mode_hz}"
        );
    }
}
