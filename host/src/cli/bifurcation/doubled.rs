//! Period-doubled orbits in the answer and the text of `quietcut bifurcation`.

use std::fmt::Write;

use serde_json::{Map, Value, json};

use super::computed::{Computed, Doubled};
use super::names::{unit, word};
use super::orbit_entry::point;
use super::request::Request;
use crate::orbit::{Branch, DoubledBranch, Event, Parameter};
use crate::report::digits::significant;
use crate::stability::StabilityLoss;

/// Answers for the doubled orbits from all flips.
pub(super) fn doubled(vary: Parameter, computed: &Computed, directions: usize) -> Vec<Map<String, Value>> {
    let all = computed.doubled.iter();
    all.map(|of_flip| of_one_flip(vary, of_flip, &computed.branch, directions))
        .collect()
}

/// Answer for the doubled orbits from one flip. Multipliers and kinds of bifurcations are those over two tooth periods.
fn of_one_flip(vary: Parameter, of_flip: &Doubled, forced: &Branch, directions: usize) -> Map<String, Value> {
    let mut map = Map::new();
    map.insert("event".into(), json!(of_flip.event));
    if let Some(found) = &of_flip.found {
        let orbits = found
            .branch
            .points
            .iter()
            .zip(&found.points)
            .map(|(at, doubled)| {
                let mut map = point(vary, at, directions);
                let both: Vec<&[f64]> = doubled
                    .displacements_mm
                    .iter()
                    .map(|at| &at[..directions])
                    .collect();
                map.insert("displacement_mm".into(), json!(both));
                map.insert("smallest_chip_mm".into(), json!(doubled.smallest_chip_mm));
                map
            });
        map.insert("branch".into(), json!(orbits.collect::<Vec<_>>()));
        let events = found.branch.events.iter().map(|at| event(vary, at, directions));
        map.insert("events".into(), json!(events.collect::<Vec<_>>()));
        map.insert(format!("stable_{}", unit(vary)), json!(found.branch.stable()));
        map.insert(format!("bistable_{}", unit(vary)), json!(found.bistable(forced)));
        map.insert(
            format!("contact_lost_{}", unit(vary)),
            json!(found.contact_lost()),
        );
        map.insert("rejoins".into(), json!(found.rejoins));
    }
    if let Some(broken) = &of_flip.broken {
        map.insert("incomplete".into(), json!(broken));
    }
    map
}

fn event(vary: Parameter, at: &Event, directions: usize) -> Map<String, Value> {
    let mut map = Map::new();
    map.insert(vary.key().into(), json!(at.value));
    map.insert("kind".into(), json!(word(at.kind)));
    map.insert(format!("error_{}", unit(vary)), json!(at.error));
    map.insert("gain".into(), json!(at.gain));
    map.insert("multiplier".into(), json!([at.multiplier.re, at.multiplier.im]));
    map.insert("amplitude_mm".into(), json!(at.amplitude_mm[..directions]));
    map
}

/// Text about the doubled orbits of all flips; where a flip is subcritical and they were not asked for, how to follow them.
pub(super) fn text(request: &Request, computed: &Computed) -> String {
    let mut text = String::new();
    for of_flip in &computed.doubled {
        let flip = &computed.branch.events[of_flip.event];
        // Writing to a String cannot fail.
        let _ = write!(
            text,
            "\ndoubled orbits from the flip at {} {}",
            request.vary.key(),
            significant(flip.value, 7)
        );
        match &of_flip.found {
            Some(found) => text.push_str(&course(request.vary, found, &computed.branch)),
            None => text.push_str(": none is found"),
        }
        if let Some(broken) = &of_flip.broken {
            let _ = write!(
                text,
                "\n  they end early: {}; {}",
                broken.reason, broken.try_instead
            );
        }
    }
    let is_subcritical =
        computed
            .criticality
            .iter()
            .zip(&computed.branch.events)
            .any(|(criticality, event)| {
                event.kind == StabilityLoss::Flip
                    && criticality.is_some_and(|criticality| !criticality.is_supercritical())
            });
    if is_subcritical && !request.doubled {
        text.push_str(
            "\nBelow the subcritical flip an impact may start a period-doubled vibration that stays; --doubled finds from which depth on.",
        );
    }
    text
}

fn course(vary: Parameter, found: &DoubledBranch, forced: &Branch) -> String {
    let mut text = format!(": {} orbits", found.points.len());
    for event in &found.branch.events {
        let _ = write!(
            text,
            "\n  {} {}, error {}: {} over two tooth periods{}",
            vary.key(),
            significant(event.value, 7),
            significant(event.error, 1),
            word(event.kind),
            if event.gain { ", stability gained" } else { "" }
        );
    }
    for [from, to] in found.bistable(forced) {
        let _ = write!(
            text,
            "\n  bistable ({}): {}–{}; the forced vibration is stable there unless something knocks the tool, then the doubled one may stay",
            vary.key(),
            significant(from, 5),
            significant(to, 5)
        );
    }
    if let Some(value) = found.contact_lost() {
        let _ = write!(
            text,
            "\n  from {} {} on along these orbits a tooth would leave the surface; they are those of a cut without loss of contact",
            vary.key(),
            significant(value, 5)
        );
    }
    text
}
