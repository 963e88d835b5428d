//! An orbit of a branch in the answer of `quietcut bifurcation`.

use serde_json::{Map, Value, json};

use crate::orbit::{BranchPoint, Parameter};

/// Value of the varied parameter, size and stability of an orbit.
pub(super) fn point(vary: Parameter, at: &BranchPoint, directions: usize) -> Map<String, Value> {
    let mut map = Map::new();
    map.insert(vary.key().into(), json!(at.value));
    map.insert("amplitude_mm".into(), json!(at.amplitude_mm[..directions]));
    map.insert("displacement_mm".into(), json!(at.displacement_mm[..directions]));
    map.insert("multiplier_abs".into(), json!(at.multiplier_abs));
    map.insert("unstable_multipliers".into(), json!(at.outside));
    map
}
