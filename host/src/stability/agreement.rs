//! Every method against the default on every case, and against what the literature quotes.

use num_complex::Complex64;

use super::discretized::{Discretization, Discretized, with_dominant};
use super::krylov::Dominant;
use super::stepped::Stepped;
use super::*;
use crate::case::tests::case;

fn default_point(name: &str, rpm: f64, depth_mm: f64) -> Point {
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

/// (case, rpm, depth in mm, multiplier) of every reference.
fn references() -> Vec<(String, f64, f64, Complex64)> {
    let path = format!("{}/../tests/data/multipliers.csv", env!("CARGO_MANIFEST_DIR"));
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
    // a/D = 1, 5 000 rev/min: what is quoted as exact, and what converges.
    let method = sdm("insperger-1dof-ad1", SdmOrder::First, 192);
    for (depth_mm, quoted, converged) in [
        (0.2, 0.8192, 0.819_742_78),
        (0.5, 1.0726, 1.073_975_59),
        (1.0, 1.4040, 1.406_473_53),
    ] {
        let point = method.point(5000.0, depth_mm).unwrap();
        // Half a unit of the last quoted digit, and rounding of it.
        assert!((point.multiplier_abs - quoted).abs() < 5.5e-5, "{point:?}");
        let error = (point.multiplier_abs - converged).abs();
        assert!(error > 4e-4 && error < point.error, "{point:?}");
    }
    // Forty steps, as in the published programs: wrong in the second digit, and they say so.
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

/// The error of the multiplier that belongs to the exact one.
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
        // One point of each case. Near a double multiplier convergence is that of a square root.
        if seen.contains(&name) || exact.im.abs() < 0.2 {
            continue;
        }
        let check = |label: &str, order: f64, errors: [f64; 2]| {
            let slope = (errors[0] / errors[1]).log2();
            // The next term is a few percent of the leading one at these steps.
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
    // Every case that has a cut and no cubic terms.
    assert_eq!(seen.len(), 12, "{seen:?}");
}

#[test]
fn stated_errors_cover_the_true_ones_on_all_references() {
    // All with few steps, every fourth with more.
    for (steps, every) in [(40, 1), (100, 4)] {
        for (name, rpm, depth_mm, exact) in references().into_iter().step_by(every) {
            let methods: [&dyn Method; 3] = [
                &sdm(&name, SdmOrder::Zeroth, steps),
                &sdm(&name, SdmOrder::First, steps),
                &fdm(&name, steps),
            ];
            for method in methods {
                let point = method.point(rpm, depth_mm).unwrap();
                // Of the size: where two multipliers are nearly as large, a method may take the other one.
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
    // 1 036: a window that is stable again; 1 045: a flip notch; 1 200: Hopf.
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
                // Errors of order h² of multipliers that change slowly with depth.
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
