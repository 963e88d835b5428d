//! Hides effects in virtual machines, and checks the diagnosis of their records.
//!
//! Equations, integrators and the test oracle are this test's own. They use nothing of the library's simulation or diagnosis, so that a
//! mistake in the library is not repeated in its test.
//!
//! An effect is counted as clear if its root mean square in some channel is larger than three times the noise. Of two effects, each must be
//! clear by the change that it makes in addition to the other.
//!
//! The whole campaign runs a number of seeds of each family (200 take long), or of the families whose names contain a text:
//!
//! ```text
//! QUIETCUT_SEEDS=200 QUIETCUT_FAMILY=shaker cargo test --release -p quietcut-tests --test hidden_effects -- --ignored --nocapture
//! ```

#![allow(clippy::unwrap_used)]

mod agreement;
mod campaign;
mod cause;
mod chip;
mod closed_forms;
mod cut;
mod disturbance;
mod equivalences;
mod job;
mod law;
mod machine;
mod motion;
mod noise;
mod oracle;
mod plainness;
mod process;
mod puzzle;
mod rig;
mod sensor;
mod signal;
mod sliders;
mod uncertainty;
mod workshop;
mod written_case;

use campaign::{Report, Share};
use puzzle::{Family, Puzzle};
use quietcut::diagnose::{Options, diagnose};
use quietcut_testkit::rates::{assert_least_share, assert_pooled_share};
use quietcut_testkit::results::Campaign;
use rayon::prelude::*;
use serde_json::Value;
use written_case::WrittenCase;

/// The answer of the diagnosis; an error is an outcome of its own. Case and recordings are kept if `QUIETCUT_KEEP` names a folder.
fn ask(puzzle: &Puzzle) -> Value {
    if let Some(folder) = std::env::var_os("QUIETCUT_KEEP") {
        puzzle.keep(std::path::Path::new(&folder));
    }
    match diagnose(&puzzle.case, &puzzle.recordings, &Options { seed: puzzle.seed }) {
        Ok(diagnosis) => serde_json::to_value(diagnosis).unwrap(),
        Err(error) => serde_json::json!({ "outcome": format!("error: {error}") }),
    }
}

/// One requirement on a share over several families, with its lower and upper bound.
struct Wanted {
    what: &'static str,
    share: Share,
    least: f64,
    most: f64,
}

/// The requirements of the campaign, with shares over the families that were run.
fn requirements(reports: &[Report]) -> Vec<Wanted> {
    let named = |family: Family| !matches!(family, Family::Nothing | Family::NotInLibrary | Family::Chatter);
    let sum = |of: &dyn Fn(&Report) -> Share, which: &dyn Fn(Family) -> bool| {
        reports
            .iter()
            .filter(|report| which(report.family))
            .map(of)
            .fold(Share { good: 0, all: 0 }, Share::and)
    };
    let any = |_: Family| true;
    // The oracle does not treat chatter: of its answers only those with high confidence are assessed.
    let judged = |family: Family| family != Family::Chatter;
    let line = |what, share, least| Wanted {
        what,
        share,
        least,
        most: 1.0,
    };
    vec![
        line(
            "right cause first, separable and above 3× noise",
            sum(&Report::separable, &named),
            0.95,
        ),
        line(
            "the exact set, equivalent",
            sum(&Report::equivalent, &named),
            0.95,
        ),
        line(
            "none, nothing hidden",
            sum(&Report::invisible, &|family| family == Family::Nothing),
            0.98,
        ),
        line(
            "unexplained, not in the library",
            sum(&Report::separable, &|family| family == Family::NotInLibrary),
            0.9,
        ),
        Wanted {
            what: "truth in the 90 % interval",
            share: sum(&Report::covered, &judged),
            least: 0.85,
            most: 0.95,
        },
        line(
            "right of those with confidence ≥ 0.9",
            sum(&Report::confident, &any),
            0.9,
        ),
        line(
            "residual energy cut by ≥ 80 % where a cause is named",
            sum(&Report::energy, &judged),
            0.95,
        ),
    ]
}

#[test]
fn a_part_of_the_campaign() {
    let part = [
        (Family::Shaker, 0..4),
        (Family::QuadraticDamping, 0..2),
        (Family::QuinticStiffness, 0..2),
        (Family::JointFriction, 0..2),
        (Family::Sweep, 0..2),
        (Family::FreeDecay, 0..2),
        (Family::CuttingWithForce, 0..1),
        (Family::CuttingWithoutForce, 0..1),
        (Family::Nothing, 0..3),
        (Family::NotInLibrary, 0..1),
        // A mass moves a resonance of a cut: without an updated Jacobian a third cause is named.
        (Family::TwoEffects, 4119..4120),
        // Beside hysteresis the search finds the cubic spring only from the fit of a softening-hardening one.
        (Family::TwoEffects, 7009..7010),
        // A delayed sensor.
        (Family::Chatter, 55..56),
        // At a whole number of samples per revolution, orders above half the sample rate turn against those onto which
        // they fold; over 24 revolutions the scatter of tooth forces is a trend, without wear; the orbit of a soft machine
        // is not found from rest.
        (Family::NothingInWorkshop, 9..10),
        (Family::NothingInWorkshop, 11..13),
        (Family::NothingInWorkshop, 6..7),
    ];
    let reports: Vec<Report> = part
        .into_par_iter()
        .map(|(family, seeds)| Report::run(family, seeds, &ask))
        .collect();
    for report in &reports {
        println!("{report}");
        for judged in [report.separable(), report.equivalent(), report.invisible()] {
            assert_eq!(judged.good, judged.all, "{report}");
        }
        // Of these two effects, the diagnosis must find the weaker one as well.
        if report.family == Family::TwoEffects {
            assert_eq!(report.weak().good, report.weak().all, "{report}");
        }
    }
    check_slice(&reports);
}

/// Largest relative difference between the prediction error that is promised of a written case and the one that its diagnosis prints:
/// texts show at most four digits.
const PROMISED: f64 = 1e-4;

#[test]
fn the_written_case_keeps_what_was_promised() {
    let part = [
        (Family::Sweep, 300),
        (Family::FreeDecay, 300),
        (Family::CuttingInWorkshop, 0),
        (Family::NothingInWorkshop, 6),
    ];
    let written: Vec<WrittenCase> = part
        .into_par_iter()
        .filter_map(|(family, seed)| WrittenCase::of(&workshop::draw(family, seed)))
        .collect();
    assert_eq!(written.len(), part.len(), "each of these writes a case");
    for case in &written {
        println!("{case}");
        assert!(case.broken() < PROMISED, "{case}");
        assert!(case.further.is_empty(), "{case}");
    }
}

#[test]
#[ignore = "campaign: QUIETCUT_FAMILY, QUIETCUT_SEEDS, QUIETCUT_FIRST_SEED"]
fn written_cases() {
    let text = std::env::var("QUIETCUT_FAMILY").unwrap_or_default();
    let seeds = std::env::var("QUIETCUT_SEEDS").map_or(20, |text| text.parse().unwrap());
    let first = std::env::var("QUIETCUT_FIRST_SEED").map_or(0, |text| text.parse().unwrap());
    for family in Family::ALL
        .into_iter()
        .filter(|family| family.name().contains(&text))
    {
        let written: Vec<WrittenCase> = (first..first + seeds)
            .into_par_iter()
            .filter_map(|seed| WrittenCase::of(&workshop::draw(family, seed)))
            .inspect(|case| println!("{case}"))
            .collect();
        let kept = written.iter().filter(|case| case.broken() < PROMISED).count();
        let alone = written.iter().filter(|case| case.further.is_empty()).count();
        println!(
            "{}: of {} written cases {kept} keep what was promised, {alone} lack no further cause",
            family.name(),
            written.len()
        );
    }
}

/// Asserts that the shares of a slice of the campaign agree with its requirements: no 99.9 % binomial interval lies outside.
fn check_slice(reports: &[Report]) {
    for wanted in requirements(reports) {
        let share = wanted.share;
        println!("{}: {share}", wanted.what);
        assert_least_share(wanted.what, wanted.least, share.good, share.all);
    }
    // The parameters of one diagnosis are correlated: each diagnosis counts as one draw.
    let judged = || reports.iter().filter(|report| report.family != Family::Chatter);
    let covered = judged()
        .map(Report::covered)
        .fold(Share { good: 0, all: 0 }, Share::and);
    let draws = judged().map(Report::with_intervals).sum();
    assert!(draws >= 8, "{draws} diagnoses with intervals");
    assert_pooled_share("truth in the 90 % interval", 0.9, covered.value(), draws);
}

#[test]
#[ignore = "takes long: see the head of the file"]
fn campaign() {
    let text = std::env::var("QUIETCUT_FAMILY").unwrap_or_default();
    let seeds = std::env::var("QUIETCUT_SEEDS").map_or(200, |text| text.parse().unwrap());
    let first = std::env::var("QUIETCUT_FIRST_SEED").map_or(0, |text| text.parse().unwrap());
    let families = Family::ALL
        .into_iter()
        .filter(|family| family.name().contains(&text));
    let mut reports = Vec::new();
    for family in families {
        let report = Report::run(family, first..first + seeds, &ask);
        println!("{report}");
        reports.push(report);
    }
    let mut failed = Vec::new();
    let mut figures: Vec<(String, String)> = reports.iter().flat_map(Report::figures).collect();
    for report in &reports {
        let seeds = report.naming("quadratic-damping");
        if !seeds.is_empty() {
            let what = format!(
                "{}: seeds whose answer contains quadratic-damping, which is not hidden",
                report.family.name()
            );
            figures.push((what, seeds.join("; ")));
        }
    }
    for Wanted {
        what,
        share,
        least,
        most,
    } in requirements(&reports)
    {
        let holds = (least..=most).contains(&share.value());
        if share.all > 0 {
            figures.push((what.to_string(), share.to_string().trim().to_owned()));
        }
        match (share.all, holds) {
            (0, _) => println!("not judged: {what}"),
            (_, true) => println!("holds: {what}: {share}"),
            (_, false) => println!("FAILS: {what}: {share}"),
        }
        if share.all > 0 && !holds {
            failed.push(what);
        }
    }
    let suffix = if text.is_empty() {
        String::new()
    } else {
        format!("-{text}")
    };
    Campaign {
        name: &format!("hidden-effects{suffix}"),
        title: &match &text[..] {
            "" => "Hidden effects".to_owned(),
            text => format!("Hidden effects, families named {text}"),
        },
        command: &format!(
            "QUIETCUT_FIRST_SEED={first} QUIETCUT_SEEDS={seeds} QUIETCUT_FAMILY='{text}' cargo test --release -p quietcut-tests --test hidden_effects -- \
             --ignored --nocapture campaign"
        ),
        seeds: &format!("{first} to {} for each family", first + seeds - 1),
    }
    .record(&figures);
    assert!(failed.is_empty(), "{failed:?}");
}

/// Seeds of the puzzles in `tests/answers --full`, 40 in all. They have few samples, so that their recordings can be committed: 6 to 8 seeds
/// of a family with one hidden effect, fewer of cuts, which are longer.
const ANSWERED: [(Family, &[u64]); 9] = [
    (Family::Shaker, &[0, 1, 3, 17, 28, 31, 33, 34]),
    (Family::Sweep, &[0, 3, 4, 16, 17, 22]),
    (Family::FreeDecay, &[0, 1, 2, 3, 4, 8, 16, 26]),
    (Family::CuttingWithForce, &[2, 5]),
    (Family::CuttingWithoutForce, &[2, 5, 19]),
    (Family::Nothing, &[0, 1, 14, 17]),
    (Family::NotInLibrary, &[3, 7, 11]),
    (Family::TwoEffects, &[2, 3, 5, 7009]),
    (Family::Chatter, &[54, 55]),
];

/// Writes the cases and recordings of `tests/answers --full` to the folder that `QUIETCUT_KEEP` names.
#[test]
#[ignore = "writes the recordings of seeded diagnoses: see tests/README.md"]
fn recordings_of_the_answers() {
    let folder = std::env::var_os("QUIETCUT_KEEP").unwrap();
    let folder = std::path::Path::new(&folder);
    let text = std::env::var("QUIETCUT_FAMILY").unwrap_or_default();
    for (family, seeds) in ANSWERED {
        if family.name().contains(&text) {
            seeds.par_iter().for_each(|seed| {
                let puzzle = workshop::draw(family, *seed);
                puzzle.keep_short(folder);
                println!("{} {seed}: {} samples", family.name(), puzzle.samples());
            });
        }
    }
}

/// Writes cases, recordings and hidden effects of puzzles to the folder that `QUIETCUT_KEEP` names, without a diagnosis.
#[test]
#[ignore = "writes puzzles for `quietcut diagnose`: QUIETCUT_KEEP, QUIETCUT_FAMILY, QUIETCUT_SEEDS, QUIETCUT_FIRST_SEED"]
fn puzzles_to_look_at() {
    let folder = std::env::var_os("QUIETCUT_KEEP").unwrap();
    let folder = std::path::Path::new(&folder);
    let text = std::env::var("QUIETCUT_FAMILY").unwrap_or_default();
    let seeds = std::env::var("QUIETCUT_SEEDS").map_or(8, |text| text.parse().unwrap());
    let first = std::env::var("QUIETCUT_FIRST_SEED").map_or(0, |text| text.parse().unwrap());
    for family in Family::ALL
        .into_iter()
        .filter(|family| family.name().contains(&text))
    {
        (first..first + seeds).into_par_iter().for_each(|seed| {
            let puzzle = workshop::draw(family, seed);
            puzzle.keep(folder);
            println!(
                "{} {seed}: {:?} {:?}",
                family.name(),
                puzzle.hidden,
                puzzle.verdict
            );
        });
    }
}
