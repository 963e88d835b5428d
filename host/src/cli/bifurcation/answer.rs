//! Answer of `quietcut bifurcation --json`.

use serde::Serialize;
use serde_json::{Map, Value, json};

use super::computed::{Broken, Computed};
use super::doubled::doubled;
use super::names::{criticality_word, unit, word};
use super::orbit_entry::point;
use super::request::Request;
use super::strobe::StrobeSet;
use crate::orbit::curve::{Curve, CurveEnd, CurvePoint, Resonance};
use crate::orbit::{Event, Parameter, Setting};

/// The answer.
#[derive(Serialize)]
pub(super) struct BifurcationOutput<'a> {
    /// Parameter that varies along the branch.
    varied: &'static str,
    /// Parameters that do not.
    fixed: Map<String, Value>,
    /// Number of teeth; multipliers are those of one tooth period.
    teeth: usize,
    branch: Vec<Map<String, Value>>,
    events: Vec<Map<String, Value>>,
    /// Intervals of the varied parameter with a stable orbit on the branch, and with two stable vibrations.
    #[serde(flatten)]
    intervals: Map<String, Value>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    doubled: Vec<Map<String, Value>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    curves: Vec<Value>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    strobe: Vec<Map<String, Value>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    incomplete: Option<&'a Broken>,
}

/// Index of the event at which a branch that begins stable loses stability first.
pub(super) fn first_loss(computed: &Computed) -> Option<usize> {
    let branch = &computed.branch;
    let begins_stable = branch.points.first().is_some_and(|point| point.outside == 0);
    let lost = branch.events.iter().position(|event| !event.gain);
    lost.filter(|_| begins_stable)
}

/// Rotation of the vibration at an event per tooth and per revolution of the spindle.
pub(super) fn rotation(event: &Event, teeth: usize) -> [f64; 2] {
    let per_tooth = event.multiplier.arg().abs() / std::f64::consts::TAU;
    [per_tooth, (per_tooth * teeth as f64).fract()]
}

/// True if the tool moves in the axial direction on some orbit.
fn moves_axially(computed: &Computed) -> bool {
    computed
        .branch
        .points
        .iter()
        .any(|point| point.amplitude_mm[2] > 0.0)
}

impl<'a> BifurcationOutput<'a> {
    /// The answer of a computation.
    pub(super) fn new(request: &Request, teeth: usize, computed: &'a Computed) -> Self {
        let branch = &computed.branch;
        let directions = if moves_axially(computed) { 3 } else { 2 };
        let first = first_loss(computed);
        let unit = unit(request.vary);
        let fixed = Parameter::ALL.into_iter().filter(|other| *other != request.vary);
        let intervals = [("stable", branch.stable()), ("bistable", computed.bistable())];
        Self {
            varied: request.vary.name(),
            fixed: fixed
                .map(|parameter| (parameter.key().to_owned(), json!(request.setting.get(parameter))))
                .collect(),
            teeth,
            branch: branch
                .points
                .iter()
                .map(|at| point(request.vary, at, directions))
                .collect(),
            events: branch
                .events
                .iter()
                .enumerate()
                .map(|(index, at)| {
                    let mut map = event(request, at, teeth, directions, first == Some(index));
                    if let Some(Some(criticality)) = computed.criticality.get(index) {
                        map.insert("criticality".into(), json!(criticality_word(*criticality)));
                    }
                    map
                })
                .collect(),
            intervals: intervals
                .into_iter()
                .map(|(name, intervals)| (format!("{name}_{unit}"), json!(intervals)))
                .collect(),
            doubled: doubled(request.vary, computed, directions),
            curves: computed
                .curves
                .iter()
                .map(|found| curve(found, directions))
                .collect(),
            strobe: computed
                .strobe
                .iter()
                .map(|set| strobe(request.vary, set, directions))
                .collect(),
            incomplete: computed.broken.as_ref(),
        }
    }
}

fn event(
    request: &Request,
    at: &Event,
    teeth: usize,
    directions: usize,
    is_first_loss: bool,
) -> Map<String, Value> {
    let setting = request.setting.with(request.vary, at.value);
    let [per_tooth, per_revolution] = rotation(at, teeth);
    let mut map = Map::new();
    for parameter in [Parameter::Depth, Parameter::Rpm, request.vary] {
        map.insert(parameter.key().into(), json!(setting.get(parameter)));
    }
    map.insert("kind".into(), json!(word(at.kind)));
    map.insert("rotation".into(), json!(per_revolution));
    map.insert("rotation_per_tooth".into(), json!(per_tooth));
    map.insert(format!("error_{}", unit(request.vary)), json!(at.error));
    map.insert("first_loss".into(), json!(is_first_loss));
    map.insert("gain".into(), json!(at.gain));
    map.insert("multiplier".into(), json!([at.multiplier.re, at.multiplier.im]));
    map.insert("amplitude_mm".into(), json!(at.amplitude_mm[..directions]));
    if let Some(hz) = at.chatter_hz {
        map.insert("chatter_hz".into(), json!(hz));
    }
    map
}

fn strobe(vary: Parameter, set: &StrobeSet, directions: usize) -> Map<String, Value> {
    let mut map = Map::new();
    let points: Vec<&[f64]> = set.displacement_mm.iter().map(|at| &at[..directions]).collect();
    map.insert(vary.key().into(), json!(set.value));
    map.insert("displacement_mm".into(), json!(points));
    map
}

fn curve(curve: &Curve, directions: usize) -> Value {
    let error: Map<String, Value> = curve
        .parameters
        .iter()
        .zip(curve.error)
        .map(|(parameter, error)| (parameter.key().to_owned(), json!(error)))
        .collect();
    let resonance = |at: &Resonance| {
        let mut map = curve_point(&at.point, directions);
        map.insert("q".into(), json!(at.q));
        map
    };
    json!({
        "kind": word(curve.kind),
        "parameters": curve.parameters.map(Parameter::name),
        "points": curve.points.iter().map(|at| curve_point(at, directions)).collect::<Vec<_>>(),
        "resonances": curve.resonances.iter().map(resonance).collect::<Vec<_>>(),
        "ends": curve.ends.map(end),
        "error": error,
    })
}

fn curve_point(at: &CurvePoint, directions: usize) -> Map<String, Value> {
    let mut map = Map::new();
    insert_setting(&mut map, &at.setting);
    map.insert("rotation".into(), json!(at.rotation));
    map.insert("rotation_per_tooth".into(), json!(at.rotation_per_tooth));
    map.insert("amplitude_mm".into(), json!(at.amplitude_mm[..directions]));
    map.insert("other_unstable_multipliers".into(), json!(at.outside));
    map
}

fn insert_setting(map: &mut Map<String, Value>, setting: &Setting) {
    for parameter in Parameter::ALL {
        map.insert(parameter.key().into(), json!(setting.get(parameter)));
    }
}

/// Reason why a curve ends, in words.
pub(super) fn end(end: CurveEnd) -> String {
    match end {
        CurveEnd::Range(parameter) => format!("range of {}", parameter.name()),
        CurveEnd::Resonance(q) => format!("resonance 1:{q}"),
        CurveEnd::Closed => "closed".into(),
        CurveEnd::Lost => "lost".into(),
    }
}
