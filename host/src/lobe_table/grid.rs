//! Which speeds and depths a table covers.

use std::f64::consts::TAU;

use super::layers::Family;
use crate::case::Case;
use crate::stability::{Refinement, StabilityError, chart};
use crate::structure::FirstOrder;

/// The machine's limits, else 1/2 to 5 teeth per vibration of the most flexible mode of the first layer.
pub(super) fn default_speeds(first: &Case, families: &[Family]) -> (f64, f64) {
    if let Some(limits) = first.limits {
        // A spindle at rest cuts nothing; a hundredth of the fastest speed stands for a slowest speed of 0.
        return (limits.rpm_min.max(0.01 * limits.rpm_max), limits.rpm_max);
    }
    let rpm = families.first().map_or(1.0, |family| {
        most_flexible_hz(&family.linear.structure) * 60.0 / family.teeth as f64
    });
    (0.5 * rpm, 5.0 * rpm)
}

/// The frequency, Hz, of the pole at which the receptance is largest.
fn most_flexible_hz(structure: &FirstOrder) -> f64 {
    let size = |omega: f64| structure.receptance(omega).map_or(f64::INFINITY, |h| h.norm());
    structure
        .poles()
        .iter()
        .map(|pole| pole.norm())
        .max_by(|a, b| size(*a).total_cmp(&size(*b)))
        .map_or(1.0, |omega| omega / TAU)
}

/// Four times the lowest limit, found by doubling: deep enough for every pocket that is worth while.
pub(super) fn default_depth(families: &[Family], from_rpm: f64, to_rpm: f64) -> Result<f64, StabilityError> {
    const SHALLOWEST_MM: f64 = 0.01;
    const DEEPEST_MM: f64 = 500.0;
    let speeds = spaced(from_rpm, to_rpm, 24);
    let mut depth_mm = SHALLOWEST_MM;
    while depth_mm < DEEPEST_MM {
        let mut lowest_mm = f64::INFINITY;
        for family in families {
            for line in family.lines(&speeds, depth_mm)? {
                lowest_mm = line
                    .first_limit
                    .map_or(lowest_mm, |limit| lowest_mm.min(limit.depth_mm));
            }
        }
        if lowest_mm.is_finite() {
            return Ok(4.0 * lowest_mm);
        }
        depth_mm *= 2.0;
    }
    Ok(DEEPEST_MM)
}

/// Speeds from first to last with equal ratios: lobes get narrower towards low speeds.
pub(super) fn spaced(from_rpm: f64, to_rpm: f64, count: usize) -> Vec<f64> {
    let last = count.saturating_sub(1).max(1) as f64;
    (0..count)
        .map(|index| {
            let share = index as f64 / last;
            from_rpm.powf(1.0 - share) * to_rpm.powf(share)
        })
        .collect()
}

/// The speeds that any of the layers needs, ascending.
pub(super) fn speeds_of_all(
    families: &[Family],
    coarse: &[f64],
    depth_mm: f64,
    refinement: Refinement,
) -> Result<Vec<f64>, StabilityError> {
    let mut speeds = Vec::new();
    for family in families {
        let method = family.method.as_ref();
        let refined = chart(method, coarse, depth_mm, 0)?.refined(method, depth_mm, refinement)?;
        speeds.extend(refined.speeds.iter().map(|line| line.rpm));
    }
    speeds.sort_by(f64::total_cmp);
    // The table holds single precision: speeds that it cannot tell apart are one.
    speeds.dedup_by_key(|rpm| *rpm as f32);
    Ok(speeds)
}
