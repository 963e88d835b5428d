//! Default range of spindle speeds for the lobes of a case.

use std::f64::consts::TAU;

use quietcut_model::case::Case;
use quietcut_model::structure::FirstOrder;

/// Lowest and highest spindle speed, rev/min: the speed limits of the spindle if the case has them, otherwise 1/2 to 5
/// tooth passings per vibration period of the most flexible mode.
pub fn default_speeds(case: &Case, structure: &FirstOrder, teeth: usize) -> (f64, f64) {
    if let Some(limits) = &case.limits {
        // A lowest speed below a hundredth of the highest speed is replaced by that hundredth, since no cut exists at
        // 0.
        return (limits.rpm_min.max(0.01 * limits.rpm_max), limits.rpm_max);
    }
    let rpm = most_flexible_hz(structure) * 60.0 / teeth as f64;
    (0.5 * rpm, 5.0 * rpm)
}

/// Natural frequency |s|/2π, Hz, of the structure's pole s at which the norm of the receptance matrix is largest; 1 Hz
/// if there is no pole.
fn most_flexible_hz(structure: &FirstOrder) -> f64 {
    let size = |omega: f64| structure.receptance(omega).map_or(f64::INFINITY, |h| h.norm());
    structure
        .poles()
        .iter()
        .map(|pole| pole.norm())
        .max_by(|a, b| size(*a).total_cmp(&size(*b)))
        .map_or(1.0, |omega| omega / TAU)
}

/// Spindle speeds with equal ratios from first to last, since lobes become narrower towards low speeds.
pub fn spaced(from_rpm: f64, to_rpm: f64, count: usize) -> Vec<f64> {
    let last = count.saturating_sub(1).max(1) as f64;
    (0..count)
        .map(|index| {
            let share = index as f64 / last;
            from_rpm.powf(1.0 - share) * to_rpm.powf(share)
        })
        .collect()
}
