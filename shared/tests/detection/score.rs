//! The figures of a campaign.

use std::fmt::Write;

use quietcut_core::detector::Verdict;

use super::listen::{FACTORS, Heard, allowed, bound};
use super::literature;
use super::session::Phase;

/// Classes of |μ| by their upper ends.
const CLASSES: [(f64, &str); 6] = [
    (1.015, "1.01"),
    (1.025, "1.02"),
    (1.04, "1.03"),
    (1.07, "1.05"),
    (1.3, "1.1 to 1.25"),
    (f64::INFINITY, "1.6 to 3"),
];

/// Rotation of a multiplier nearer to ½ than this is a flip.
const NEAR_HALF: f64 = 0.02;

/// Largest relative error of a chatter frequency that counts as right.
pub const SAME_FREQUENCY: f64 = 0.01;

/// What a growing cut is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Hopf,
    Flip,
}

pub fn kind(heard: &Heard) -> Option<Kind> {
    let multiplier = heard.session.floquet.as_ref()?.multiplier;
    let rotation = multiplier.arg().abs() / std::f64::consts::TAU;
    if multiplier.im == 0.0 {
        Some(Kind::Flip)
    } else {
        (rotation < 0.5 - NEAR_HALF).then_some(Kind::Hopf)
    }
}

/// Share of growing cuts whose alarm came in time.
pub fn in_time(heard: &[Heard]) -> (usize, usize) {
    let scored: Vec<_> = heard.iter().filter_map(|h| Some((h, h.delay()?))).collect();
    let timely = scored.iter().filter(|(h, delay)| is_timely(h, *delay)).count();
    (timely, scored.len())
}

fn is_timely(heard: &Heard, delay: f64) -> bool {
    // A verdict comes with a block: its length is no delay of the detector.
    let block = 64.0 / 26_667.0 / heard.session.machine.tooth_period_s();
    delay <= allowed(heard.multiplier_abs(), heard.session.machine.tooth_period_s()) + block
}

/// Number of false onsets, and the time in which they could come, h.
pub fn false_onsets(heard: &[Heard]) -> (usize, f64) {
    (
        heard.iter().map(|h| h.false_onsets.len()).sum(),
        heard.iter().map(quiet_seconds).sum::<f64>() / 3600.0,
    )
}

fn quiet_seconds(heard: &Heard) -> f64 {
    let growing: f64 = durations(heard)
        .filter(|(phase, _)| *phase == Phase::Growing)
        .map(|(_, seconds)| seconds)
        .sum();
    heard.seconds - growing
}

fn durations(heard: &Heard) -> impl Iterator<Item = (Phase, f64)> {
    let ends = heard
        .phases
        .iter()
        .skip(1)
        .map(|(_, begin)| *begin)
        .chain([heard.seconds]);
    heard
        .phases
        .iter()
        .zip(ends)
        .map(|((phase, begin), end)| (*phase, end - begin))
}

/// Growing cuts with a kind that the truth has, whose alarm named a kind: right ones and all.
pub fn kinds(heard: &[Heard]) -> (usize, usize) {
    let mut counts = (0, 0);
    for h in heard {
        let said = h.verdicts.iter().find(|(phase, _)| *phase == Phase::Growing);
        let (Some(kind), Some((_, verdict)), Some(_)) = (kind(h), said, h.alarm_s) else {
            continue;
        };
        if !verdict.is_chatter() {
            continue;
        }
        counts.1 += 1;
        counts.0 += usize::from((*verdict == Verdict::PeriodDoubling) == (kind == Kind::Flip));
    }
    counts
}

/// The report of a campaign as text.
pub fn report(heard: &[Heard]) -> String {
    let mut text = String::new();
    let seconds: f64 = heard.iter().map(|h| h.seconds).sum();
    let growing = heard.iter().filter(|h| h.session.floquet.is_some()).count();
    let _ = writeln!(
        text,
        "{} sessions, {growing} with a growing cut, {:.2} h",
        heard.len(),
        seconds / 3600.0
    );
    delays(heard, &mut text);
    confusion(heard, &mut text);
    onsets(heard, &mut text);
    endings(heard, &mut text);
    beside(heard, &mut text);
    text
}

/// The detectors of the literature on the same blocks, at several thresholds, beside this one.
fn beside(heard: &[Heard], text: &mut String) {
    let _ = writeln!(
        text,
        "\n| detector | threshold over the stable cut | in time | false onsets | per hour |\n|---|---|---|---|---|"
    );
    let (onsets, hours) = false_onsets(heard);
    let (timely, scored) = in_time(heard);
    let mut line = |name: &str, threshold: &str, timely: usize, onsets: usize| {
        let _ = writeln!(
            text,
            "| {name} | {threshold} | {timely} of {scored} | {onsets} | {:.1} |",
            onsets as f64 / hours
        );
    };
    line("quietcut", "none", timely, onsets);
    for (detector, name) in literature::NAMES.into_iter().enumerate() {
        for (n, factor) in FACTORS.into_iter().enumerate() {
            let alarms = |h: &Heard| h.literature[detector][n];
            let timely = heard
                .iter()
                .filter(|h| h.delay_of(alarms(h).1).is_some_and(|delay| is_timely(h, delay)))
                .count();
            let onsets = heard.iter().map(|h| alarms(h).0).sum();
            line(name, &format!("{factor}"), timely, onsets);
        }
    }
}

fn delays(heard: &[Heard], text: &mut String) {
    let _ = writeln!(
        text,
        "\n| growing cuts | number | bound n* | allowed | in time | median delay | 95 % | worst |\n|---|---|---|---|---|---|---|---|"
    );
    let mut line = |name: &str, part: &[&Heard]| {
        let mut delays: Vec<f64> = part.iter().filter_map(|h| h.delay()).collect();
        delays.sort_by(f64::total_cmp);
        if delays.is_empty() {
            return;
        }
        let timely = part
            .iter()
            .filter(|h| h.delay().is_some_and(|d| is_timely(h, d)))
            .count();
        let at =
            |share: f64| delays[((delays.len() as f64 * share).ceil() as usize).clamp(1, delays.len()) - 1];
        let abs = part[0].multiplier_abs();
        let longest = part
            .iter()
            .map(|h| allowed(h.multiplier_abs(), h.session.machine.tooth_period_s()))
            .fold(0.0, f64::max);
        let _ = writeln!(
            text,
            "| {name} | {} | {:.1} | {:.0} to {longest:.0} | {:.0} % | {:.0} | {:.0} | {:.0} |",
            delays.len(),
            bound(abs),
            6.0 + 1.5 * bound(abs),
            100.0 * timely as f64 / delays.len() as f64,
            at(0.5),
            at(0.95),
            at(1.0)
        );
    };
    let mut from = 0.0;
    for (to, name) in CLASSES {
        let class = |h: &&Heard| h.session.floquet.is_some() && (from..to).contains(&h.multiplier_abs());
        line(
            &format!("\\|μ\\| {name}"),
            &heard.iter().filter(class).collect::<Vec<_>>(),
        );
        from = to;
    }
    for (name, wanted) in [("Hopf", Kind::Hopf), ("flip", Kind::Flip)] {
        for even in [false, true] {
            let part =
                |h: &&Heard| kind(h) == Some(wanted) && h.session.machine.teeth.is_multiple_of(2) == even;
            let parity = if even { "even" } else { "odd" };
            line(
                &format!("{name}, {parity} number of teeth"),
                &heard.iter().filter(part).collect::<Vec<_>>(),
            );
        }
    }
}

fn confusion(heard: &[Heard], text: &mut String) {
    const VERDICTS: [(Verdict, &str); 7] = [
        (Verdict::AirCut, "air"),
        (Verdict::Stable, "stable"),
        (Verdict::Forced, "forced"),
        (Verdict::Runout, "runout"),
        (Verdict::Hopf, "Hopf"),
        (Verdict::PeriodDoubling, "flip"),
        (Verdict::Indeterminate, "indeterminate"),
    ];
    let _ = write!(text, "\n| verdict at the end of |");
    for (_, name) in VERDICTS {
        let _ = write!(text, " {name} |");
    }
    let _ = writeln!(text, "\n|---|---|---|---|---|---|---|---|");
    let row = |text: &mut String, name: &str, wanted: &dyn Fn(&Heard, Phase) -> bool| {
        let said: Vec<Verdict> = heard
            .iter()
            .flat_map(|h| {
                h.verdicts
                    .iter()
                    .filter(move |(phase, _)| wanted(h, *phase))
                    .map(|(_, v)| *v)
            })
            .collect();
        let _ = write!(text, "| {name} |");
        for (verdict, _) in VERDICTS {
            let _ = write!(text, " {} |", said.iter().filter(|v| **v == verdict).count());
        }
        let _ = writeln!(text);
    };
    row(text, "air", &|_, phase| phase == Phase::Air);
    row(text, "stable cut", &|_, phase| phase == Phase::Stable);
    row(text, "disturbed stable cut", &|_, phase| {
        phase == Phase::Disturbed
    });
    let grown = |h: &Heard, phase: Phase| phase == Phase::Growing && h.clock_s.is_some();
    row(text, "growing, Hopf", &|h, phase| {
        grown(h, phase) && kind(h) == Some(Kind::Hopf)
    });
    row(text, "growing, flip", &|h, phase| {
        grown(h, phase) && kind(h) == Some(Kind::Flip)
    });
    row(text, "growing, between", &|h, phase| {
        grown(h, phase) && kind(h).is_none()
    });
    let (right, all) = kinds(heard);
    let _ = writeln!(text, "\nkind right in {right} of {all} alarms");
}

fn onsets(heard: &[Heard], text: &mut String) {
    let _ = writeln!(
        text,
        "\n| phase | false onsets | hours | per hour |\n|---|---|---|---|"
    );
    for phase in Phase::ALL {
        let count = heard
            .iter()
            .flat_map(|h| &h.false_onsets)
            .filter(|(at, ..)| *at == phase)
            .count();
        let hours: f64 = heard
            .iter()
            .flat_map(durations)
            .filter(|(at, _)| *at == phase)
            .map(|(_, seconds)| seconds / 3600.0)
            .sum();
        if phase != Phase::Growing && hours > 0.0 {
            let _ = writeln!(
                text,
                "| {phase:?} | {count} | {hours:.3} | {:.1} |",
                count as f64 / hours
            );
        }
    }
    let (count, hours) = false_onsets(heard);
    let _ = writeln!(
        text,
        "| all | {count} | {hours:.3} | {:.1} |",
        count as f64 / hours
    );
}

fn endings(heard: &[Heard], text: &mut String) {
    let ends: Vec<f64> = heard.iter().filter_map(|h| h.alarm_end_s).collect();
    let late = ends.iter().filter(|end| **end > 1.0).count();
    let worst = ends.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let _ = writeln!(
        text,
        "\n{} alarms at a stop, {late} not gone 1 s after it; the last after {worst:.2} s",
        ends.len()
    );
    let changes: usize = heard.iter().map(|h| h.changes).sum();
    let seconds: f64 = heard.iter().map(|h| h.seconds).sum();
    let most = heard.iter().map(|h| h.most_changes).max().unwrap_or(0);
    let _ = writeln!(
        text,
        "{:.2} changes of the verdict per second, at most {most} within one",
        changes as f64 / seconds
    );
    let errors: Vec<f64> = heard.iter().filter_map(Heard::frequency_error).collect();
    let right = errors.iter().filter(|error| **error < SAME_FREQUENCY).count();
    let _ = writeln!(
        text,
        "chatter frequency within 1 % in {right} of {} alarms",
        errors.len()
    );
}
