//! How far a table's answers between its entries are from the method's own.

use quietcut_core::lobes::{Column, InterpolationError, LobeTable};
use quietcut_core::units::{Degrees, Millimeters, Rpm};
use quietcut_core::working_point::WorkingPoint;

use super::entries::surely_stable;
use super::layers::Family;
use crate::stability::StabilityError;

/// Where in a gap it is checked, in turn: refinement has looked at the middle.
const SHARES: [f64; 2] = [0.38, 0.62];

/// What is stated over what is found at the places checked.
const ROOM: f64 = 1.5;

/// Checks every gap between speeds at one speed in every layer.
///
/// Where both sides of a gap have the same limits the largest difference in depth, times 1.5, is stated, with the rounding of the entries.
/// A gap in which that is more than twice the tolerance, since an island begins or a kind changes, is not interpolated: a
/// wrong verdict in it has a limit at the same depth within the gap, and its width is stated.
pub(super) fn interpolation_error(
    table: &LobeTable<'_>,
    families: &[Family],
    speeds: &[f64],
    depth_mm: f64,
    tolerance_mm: f64,
) -> Result<InterpolationError, StabilityError> {
    let between: Vec<f64> = speeds
        .windows(2)
        .zip(SHARES.iter().cycle())
        .map(|(pair, share)| pair[0] + (pair[1] - pair[0]) * share)
        .collect();
    let mut misses = vec![0.0_f64; between.len()];
    for family in families {
        let lines = family.lines(&between, depth_mm)?;
        for (miss, line) in misses.iter_mut().zip(&lines) {
            let found = told(table, family, line.rpm);
            let off = found.map_or(f64::INFINITY, |column| {
                let told: Vec<[f64; 2]> = column
                    .stable()
                    .map(|(from, to)| [f64::from(from.0), f64::from(to.0)])
                    .collect();
                farthest(&surely_stable(line, depth_mm), &told, depth_mm)
            });
            *miss = miss.max(off);
        }
    }
    let (mut depth, mut speed) = (0.0_f64, 0.0_f64);
    for (miss, pair) in misses.iter().zip(speeds.windows(2)) {
        if *miss <= 2.0 * tolerance_mm {
            depth = depth.max(*miss);
        } else {
            speed = speed.max((pair[1] - pair[0]) / pair[0]);
        }
    }
    Ok(InterpolationError {
        depth: Millimeters((ROOM * depth + f64::from(table.depth_step().0)) as f32),
        // A gap as wide as the speed itself bounds nothing; refinement never leaves one.
        speed: speed.min(0.999) as f32,
    })
}

fn told(table: &LobeTable<'_>, family: &Family, rpm: f64) -> Option<Column> {
    let point = WorkingPoint {
        axial_depth: Millimeters(0.0),
        start: family.validity.start,
        exit: family.validity.exit,
        feed_per_tooth: family.validity.feed_from,
        posture: family.validity.posture,
    };
    let cut = match family.direction_deg {
        Some(degrees) => table.cut_towards(&point, Degrees(degrees as f32)),
        None => table.cut(&point),
    };
    cut.and_then(|cut| cut.column(Rpm(rpm as f32))).ok()
}

/// The largest distance, mm, from a depth at which two sets of stable depths disagree to the nearest limit of the first.
pub(super) fn farthest(truth: &[[f64; 2]], told: &[[f64; 2]], depth_mm: f64) -> f64 {
    let ends = |set: &[[f64; 2]]| -> Vec<f64> { set.iter().flatten().copied().collect() };
    let limits: Vec<f64> = ends(truth)
        .into_iter()
        .filter(|&end| end > 0.0 && end < depth_mm)
        .collect();
    let mut all = ends(truth);
    all.extend(ends(told));
    all.extend([0.0, depth_mm]);
    all.sort_by(f64::total_cmp);
    let is_in = |set: &[[f64; 2]], depth: f64| set.iter().any(|&[from, to]| from <= depth && depth <= to);
    let distance = |depth: f64| {
        let distances = limits.iter().map(|limit| (limit - depth).abs());
        distances.fold(f64::INFINITY, f64::min)
    };
    all.windows(2)
        .filter(|pair| pair[1] > pair[0])
        .map(|pair| (pair[0], 0.5 * (pair[0] + pair[1]), pair[1]))
        .filter(|&(_, middle, _)| is_in(truth, middle) != is_in(told, middle))
        .map(|(low, middle, high)| distance(low).max(distance(middle)).max(distance(high)))
        .fold(0.0, f64::max)
}
