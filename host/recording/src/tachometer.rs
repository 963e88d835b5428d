//! Rising edges of a recorded tachometer and the spindle angle at each.

use std::f64::consts::TAU;

use quietcut_core::tachometer::Wheel;

use super::{Recording, blocks};
use crate::criteria::LARGEST_START;

/// Edges of the channel `tacho` of a recording, in order, and its wheel.
///
/// The wheel comes from the sidecar entry of the channel that is read as `tacho`, whatever its name in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct TachometerEdges {
    /// Times of the edges, s after the first sample.
    pub times_s: Vec<f64>,
    /// Positions of the wheel and the missing ones among them.
    pub wheel: Wheel,
}

impl TachometerEdges {
    /// The edges of a recording; `None` without a channel `tacho`.
    ///
    /// The device's detector finds each pulse, whose base line may wander. The edge is where the level crosses the middle between the lowest
    /// level before the pulse and the highest level of the pulse, by linear interpolation.
    pub fn new(recording: &Recording) -> Option<Self> {
        let (wheel, level) = (blocks::wheel(recording)?, recording.channel("tacho")?);
        let level = level.samples.as_slice();
        let found: Vec<usize> = blocks::rises(level).map(|rise| rise.sample).collect();
        let valley = |edge: usize| {
            let from = if edge == 0 { 0 } else { found[edge - 1] };
            lowest(&level[from..=found.get(edge).map_or(level.len() - 1, |sample| *sample)])
        };
        let mut times_s = Vec::with_capacity(found.len());
        for (edge, sample) in found.iter().enumerate() {
            let end = found.get(edge + 1).map_or(level.len(), |next| *next);
            let (low, high) = (valley(edge), highest(&level[*sample..end]));
            let foot = valley(edge + 1);
            if edge == 0 && low > foot + LARGEST_START * (high - foot) {
                continue;
            }
            if let Some(at) = crossing(level, *sample, 0.5 * (low + high)) {
                times_s.push(at / recording.sample_rate_hz);
            }
        }
        Some(Self { times_s, wheel })
    }

    /// Spindle angle of every edge, rad: 0 at the first edge after the gap of the wheel, without a gap at the first edge.
    ///
    /// # Errors
    /// The edges do not match the wheel.
    pub fn angles_rad(&self) -> Result<Vec<f64>, String> {
        angles(&self.times_s, self.wheel)
    }

    /// Times of the edges at which a revolution begins, s after the first sample.
    ///
    /// # Errors
    /// The edges do not match the wheel.
    pub fn revolutions_s(&self) -> Result<Vec<f64>, String> {
        let turns = |rad: f64| rad / TAU;
        let is_start = |rad: f64| (turns(rad) - turns(rad).round()).abs() < 1e-9;
        let angles = self.angles_rad()?;
        let edges = self.times_s.iter().zip(angles);
        Ok(edges
            .filter(|(_, rad)| is_start(*rad))
            .map(|(time_s, _)| *time_s)
            .collect())
    }
}

fn lowest(level: &[f64]) -> f64 {
    level.iter().copied().fold(f64::INFINITY, f64::min)
}

fn highest(level: &[f64]) -> f64 {
    level.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

/// Sample index, with its fraction, at which the level rises through `middle` near sample `near`.
fn crossing(level: &[f64], near: usize, middle: f64) -> Option<f64> {
    let mut after = near;
    while *level.get(after)? < middle {
        after += 1;
    }
    while after > 0 && level[after - 1] >= middle {
        after -= 1;
    }
    let before = after.checked_sub(1)?;
    Some(before as f64 + (middle - level[before]) / (level[after] - level[before]))
}

/// Spindle angle of every tachometer edge, rad, for edge times in s.
fn angles(edges_s: &[f64], wheel: Wheel) -> Result<Vec<f64>, String> {
    let positions = f64::from(wheel.positions);
    if wheel.missing == 0 {
        return Ok((0..edges_s.len())
            .map(|edge| TAU * edge as f64 / positions)
            .collect());
    }
    let missing = f64::from(wheel.missing);
    let intervals: Vec<f64> = edges_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    // The speed changes little between adjacent edges. So an interval is the gap if it exceeds its shorter neighbour by a factor of
    // 1 + missing/2, halfway between the ratio 1 of equal intervals and the ratio 1 + missing of the gap.
    let is_gap = |interval: usize| {
        let neighbours = [
            interval.checked_sub(1),
            Some(interval + 1).filter(|&next| next < intervals.len()),
        ];
        let shortest = neighbours
            .into_iter()
            .flatten()
            .map(|neighbour| intervals[neighbour])
            .fold(f64::INFINITY, f64::min);
        intervals[interval] > (1.0 + 0.5 * missing) * shortest
    };
    // With one edge per revolution every interval contains the gap, and no interval is longer than its neighbours.
    let lone = wheel.positions - wheel.missing == 1;
    let gaps: Vec<usize> = (0..intervals.len())
        .filter(|&interval| lone || is_gap(interval))
        .collect();
    let Some(&first) = gaps.first() else {
        return Err(format!(
            "tacho has no gap, but the sidecar sets missing = {} of {} positions; does the sidecar belong to this wheel?",
            wheel.missing, wheel.positions
        ));
    };
    let expected = usize::from(wheel.positions - wheel.missing);
    if let Some(pair) = gaps.windows(2).find(|pair| pair[1] - pair[0] != expected) {
        return Err(format!(
            "tacho has {} edges in the revolution that begins at {:.4} s; {expected} are expected of a wheel with {} positions of which {} are missing",
            pair[1] - pair[0],
            edges_s[pair[0] + 1],
            wheel.positions,
            wheel.missing
        ));
    }
    // The edge after the first gap has the angle 0; earlier edges have negative angles.
    let mut position = -(first as f64 + 1.0 + missing);
    let mut angles = vec![TAU * position / positions];
    for interval in 0..intervals.len() {
        let is_gap = gaps.binary_search(&interval).is_ok();
        position += if is_gap { 1.0 + missing } else { 1.0 };
        angles.push(TAU * position / positions);
    }
    Ok(angles)
}
