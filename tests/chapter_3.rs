//! Chapter 3 of the thesis: first limits of the Staubli TX200 from averaged coefficients, from periodic coefficients with eq.
//! 3.7, and from the whole of eq. 3.6 linearized about its forced orbit, compared with the printed limits.
//!
//! To print the table: `cargo test --release -p quietcut-tests --test chapter_3 -- --nocapture`

#![allow(clippy::expect_used)]

use std::path::PathBuf;

use quietcut::case::Case;
use quietcut::orbit::ForcedProblem;
use quietcut::stability::{Collocation, CubicTerms, FrequencyProblem, Method, MultiFrequency, Problem, Zoa};

/// First stability limits at one spindle speed, mm.
struct Limits {
    averaged_bare: f64,
    averaged: f64,
    periodic_bare: f64,
    periodic: f64,
    harmonics: f64,
    whole: f64,
}

fn first_limit_mm(method: &dyn Method, rpm: f64) -> f64 {
    let line = method.line(rpm, 1.5, 40).expect("a line");
    line.first_limit.expect("a limit below 1.5 mm").depth_mm
}

fn limits(rpm: f64) -> Limits {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("cases/staubli-tx200.toml");
    let case = Case::read(path).expect("the case is there");
    let problem = Problem::new(&case, CubicTerms::Refuse).expect("a linear case");
    let mut bare = problem.clone();
    bare.process.axial_depth_modulation = false;
    let receptances = |problem: &Problem| FrequencyProblem::of_model(problem).expect("a damped structure");
    let averaged = |problem: &Problem| {
        let problem = receptances(problem);
        first_limit_mm(&Zoa { problem }, rpm)
    };
    let harmonics = MultiFrequency {
        problem: receptances(&problem),
        harmonics: None,
    };
    Limits {
        averaged_bare: averaged(&bare),
        averaged: averaged(&problem),
        harmonics: first_limit_mm(&harmonics, rpm),
        whole: first_limit_mm(&ForcedProblem::new(&case).expect("a forced problem"), rpm),
        periodic_bare: first_limit_mm(&Collocation { problem: bare }, rpm),
        periodic: first_limit_mm(&Collocation { problem }, rpm),
    }
}

fn percent(from: f64, to: f64) -> f64 {
    100.0 * (to / from - 1.0)
}

#[test]
fn chapter_3_side_by_side() {
    let (fast, slow) = (limits(500.0), limits(280.0));
    let row = |what: &str, value: fn(&Limits) -> f64| {
        println!("{what:<58} {:>10.4} {:>10.4}", value(&fast), value(&slow));
    };
    println!(
        "{:<58} {:>10} {:>10}",
        "Staubli TX200, first limit [mm] at rev/min", 500, 280
    );
    row("averaged coefficients, no edge and feed terms", |l| {
        l.averaged_bare
    });
    row("averaged coefficients, eq. 3.7", |l| l.averaged);
    row("periodic coefficients, no edge and feed terms", |l| {
        l.periodic_bare
    });
    row("periodic coefficients, eq. 3.7, collocation", |l| l.periodic);
    row("periodic coefficients, eq. 3.7, multi-frequency", |l| l.harmonics);
    row("the whole of eq. 3.6 about its forced orbit", |l| l.whole);
    let change = |l: &Limits| (percent(l.averaged, l.periodic), percent(l.periodic, l.whole));
    let ((period_fast, whole_fast), (period_slow, whole_slow)) = (change(&fast), change(&slow));
    let bare = |l: &Limits| percent(l.averaged_bare, l.periodic_bare);
    let (bare_fast, bare_slow) = (bare(&fast), bare(&slow));
    println!(
        "{:<58} {bare_fast:>+9.1}% {bare_slow:>+9.1}%",
        "averaged to periodic, no edge and feed terms"
    );
    println!(
        "{:<58} {period_fast:>+9.1}% {period_slow:>+9.1}%",
        "averaged to periodic, eq. 3.7"
    );
    println!(
        "{:<58} {whole_fast:>+9.1}% {whole_slow:>+9.1}%",
        "eq. 3.7 to eq. 3.6, both periodic"
    );
    println!(
        "{:<58} {:>10} {:>10}",
        "the thesis, averaged eq. 3.7 to simulated eq. 3.6", "+6 %", "-9 %"
    );

    // The tolerance is half a unit of the last printed digit.
    for (found, printed) in [
        (fast.averaged_bare, 0.6527),
        (fast.averaged, 0.6534),
        (fast.periodic_bare, 0.6612),
        (fast.periodic, 0.6615),
    ] {
        assert!((found - printed).abs() <= 6e-5, "{found} {printed}");
    }
    assert!(
        (whole_fast - 0.7).abs() < 0.06 && whole_slow.abs() < 0.06,
        "{whole_fast} {whole_slow}"
    );
    assert!(
        (bare_slow + 9.2).abs() < 0.06 && (period_slow + 9.3).abs() < 0.06,
        "{period_slow}"
    );
    // The multi-frequency solution converges to a relative error of 1e-4.
    assert!(percent(fast.periodic, fast.harmonics).abs() < 1e-2);
    assert!(percent(slow.periodic, slow.harmonics).abs() < 1e-2);
}
