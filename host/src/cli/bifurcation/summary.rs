//! Text of `quietcut bifurcation` for people.

use std::fmt::Write;

use super::answer::{end, first_loss, rotation};
use super::computed::Computed;
use super::doubled;
use super::names::{criticality_word, word};
use super::request::Request;
use crate::orbit::curve::Curve;
use crate::orbit::{Event, Parameter};
use crate::report::digits::significant;
use crate::stability::StabilityLoss;

/// The text of a computation.
pub(super) fn text(request: &Request, teeth: usize, computed: &Computed) -> String {
    let branch = &computed.branch;
    let mut text = format!(
        "forced orbits over {} {}, {}: {} orbits, {} {}",
        request.vary.name(),
        range(request.vary, request.range),
        fixed(request),
        branch.points.len(),
        branch.events.len(),
        if branch.events.len() == 1 {
            "bifurcation"
        } else {
            "bifurcations"
        }
    );
    if !branch.events.is_empty() {
        // Writing to a String cannot fail.
        let _ = write!(
            text,
            "\n{:>12}  kind   rotation per revolution  per tooth  chatter [Hz]  {:>12}",
            request.vary.key(),
            "error"
        );
    }
    let first = first_loss(computed);
    for (index, event) in branch.events.iter().enumerate() {
        text.push_str(&row(event, teeth, meaning(computed, first, index)));
        if let Some(Some(criticality)) = computed.criticality.get(index) {
            let _ = write!(text, ", {}", criticality_word(*criticality));
        }
    }
    text.push_str(&stability(request, computed));
    if let Some(broken) = &computed.broken {
        let _ = write!(
            text,
            "\nthe branch ends early: {}; {}",
            broken.reason, broken.try_instead
        );
    }
    text.push_str(&doubled::text(request, computed));
    for curve in &computed.curves {
        text.push_str(&curve_text(curve));
    }
    text.push_str(&notes(computed, teeth));
    text
}

/// Value of a parameter with its unit.
fn with_unit(parameter: Parameter, value: f64) -> String {
    match parameter {
        Parameter::Depth => format!("{value} mm"),
        Parameter::Rpm => format!("{value} rev/min"),
        Parameter::Feed => format!("{value} mm per tooth"),
        Parameter::Kappa | Parameter::Nu => format!("{value}"),
    }
}

fn range(parameter: Parameter, [first, last]: [f64; 2]) -> String {
    format!("{first} to {}", with_unit(parameter, last))
}

/// The parameters that do not vary.
pub(super) fn fixed(request: &Request) -> String {
    let others = Parameter::ALL.into_iter().filter(|other| *other != request.vary);
    let words: Vec<String> = others
        .map(|parameter| {
            let value = with_unit(parameter, request.setting.get(parameter));
            format!("{} {value}", parameter.name())
        })
        .collect();
    words.join(", ")
}

fn row(event: &Event, teeth: usize, meaning: &str) -> String {
    let [per_tooth, per_revolution] = rotation(event, teeth);
    let chatter = event.chatter_hz.map_or_else(String::new, |hz| format!("{hz:.2}"));
    format!(
        "\n{:>12}  {:<5}  {per_revolution:>23.4}  {per_tooth:>9.4}  {chatter:>12}  {:>12}  {meaning}",
        significant(event.value, 7),
        word(event.kind),
        significant(event.error, 1),
    )
}

/// Meaning of a bifurcation for the stability of the orbits on the branch.
fn meaning(computed: &Computed, first: Option<usize>, index: usize) -> &'static str {
    let branch = &computed.branch;
    let mut outside = branch.points.first().map_or(0, |point| point.outside);
    for event in &branch.events[..=index] {
        let count = event.kind.count();
        outside += if event.gain { -count } else { count };
    }
    let event = &branch.events[index];
    if first == Some(index) {
        "first loss of stability"
    } else if event.gain && outside <= 0 {
        "stable again"
    } else if event.gain {
        "still unstable"
    } else if branch.events[..index].iter().any(|event| event.gain) && outside <= event.kind.count() {
        "lost again"
    } else {
        "unstable already"
    }
}

/// Stable and bistable intervals, and where the branch ends.
fn stability(request: &Request, computed: &Computed) -> String {
    let branch = &computed.branch;
    let unit = request.vary.key();
    let listed = |intervals: Vec<[f64; 2]>| {
        let ends = intervals
            .iter()
            .map(|[from, to]| format!("{}–{}", significant(*from, 5), significant(*to, 5)));
        ends.collect::<Vec<_>>().join(", ")
    };
    let stable = branch.stable();
    let mut text = if stable.is_empty() {
        "\nno stable orbit on this branch".to_owned()
    } else {
        format!("\nstable orbits ({unit}): {}", listed(stable))
    };
    let bistable = branch.bistable();
    if !bistable.is_empty() {
        let _ = write!(
            text,
            "\ntwo stable orbits ({unit}): {}; which one the cut takes depends on how it got there",
            listed(bistable)
        );
    }
    let last = branch.points.last().map_or(request.range[0], |point| point.value);
    let [first, to] = request.range;
    if computed.broken.is_none() && (last - first).abs() < (last - to).abs() {
        let _ = write!(
            text,
            "\nthe branch turns back in a fold and returns to {}",
            with_unit(request.vary, first)
        );
    }
    text
}

fn curve_text(curve: &Curve) -> String {
    let [first, second] = curve.parameters;
    let span = |parameter: Parameter| {
        let values = || curve.points.iter().map(|point| point.setting.get(parameter));
        let (low, high) = (
            values().fold(f64::INFINITY, f64::min),
            values().fold(f64::NEG_INFINITY, f64::max),
        );
        format!(
            "{} {}–{}",
            parameter.key(),
            significant(low, 5),
            significant(high, 5)
        )
    };
    let bounds = curve.points.iter().filter(|point| point.outside == 0).count();
    let mut text = format!(
        "\n{} curve: {} orbits, {}, {}; errors {} and {}; {bounds} of the orbits are stable on one side\n  ends: {} and {}",
        word(curve.kind),
        curve.points.len(),
        span(first),
        span(second),
        significant(curve.error[0], 1),
        significant(curve.error[1], 1),
        end(curve.ends[0]),
        end(curve.ends[1])
    );
    for resonance in &curve.resonances {
        let setting = &resonance.point.setting;
        let _ = write!(
            text,
            "\n  strong resonance 1:{} at {} = {}, {} = {}",
            resonance.q,
            first.key(),
            significant(setting.get(first), 5),
            second.key(),
            significant(setting.get(second), 5)
        );
    }
    text
}

/// What a reader has to know about the numbers.
fn notes(computed: &Computed, teeth: usize) -> String {
    let events = &computed.branch.events;
    let mut text = String::new();
    if events.len() > 1 && first_loss(computed).is_some() {
        text.push_str("\nThe stability limit is the first loss; the branch goes on beyond it along orbits that no cut keeps.");
    }
    let has_flip = events.iter().any(|event| event.kind == StabilityLoss::Flip);
    let multiplier = if teeth.is_multiple_of(2) { "+1" } else { "−1" };
    if has_flip && teeth > 1 {
        let _ = write!(
            text,
            "\nMultipliers are those of one tooth period: a flip is −1 there, and {multiplier} over the revolution of {teeth} teeth."
        );
    }
    text
}
