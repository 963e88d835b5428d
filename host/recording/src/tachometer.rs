//! Rising edges of a recorded tachometer and the spindle angle at each.

use std::f64::consts::TAU;

use quietcut_core::tachometer::Wheel;
use quietcut_numerics::statistics::median;

use super::{Recording, blocks};
use crate::criteria::STEADY_MIDDLE;

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
    /// The device's detector finds each pulse, whose base line may wander. The edge is where the level crosses, by
    /// linear interpolation, the middle of its range; where the base line wanders, or the pulse stays below, the middle between the
    /// level before the pulse and that of the pulse, each a median.
    pub fn new(recording: &Recording) -> Option<Self> {
        let (wheel, level) = (blocks::wheel(recording)?, recording.channel("tacho")?);
        let level = level.samples.as_slice();
        let found: Vec<usize> = blocks::rises(level).map(|rise| rise.sample).collect();
        let valley = |edge: usize| {
            let from = if edge == 0 { 0 } else { found[edge - 1] };
            lower_plateau(&level[from..=found.get(edge).map_or(level.len() - 1, |sample| *sample)])
        };
        // One middle for all edges where the base line is steady: a middle of each pulse would depend on how few samples show it.
        let (least, largest) = range_of(level.iter().copied());
        let (lowest, highest) = range_of((1..found.len()).map(valley));
        let is_steady = highest - lowest <= STEADY_MIDDLE * (largest - least);
        let mut times_s = Vec::with_capacity(found.len());
        for (edge, sample) in found.iter().enumerate() {
            let end = found.get(edge + 1).map_or(level.len(), |next| *next);
            let to_end = &level[..end];
            let pulse = &level[*sample..end];
            // A record may begin within the first rise: its foot is the valley after the pulse then. It may end within the last rise,
            // whose top it does not show.
            let own = || 0.5 * (valley(edge.max(1)) + upper_plateau(pulse));
            let shows_top = end < level.len() || pulse.last() < pulse.iter().max_by(|a, b| a.total_cmp(b));
            let common = is_steady
                .then(|| crossing(to_end, *sample, 0.5 * (least + largest)))
                .flatten();
            // A pulse that few samples show may stay below the common middle.
            let at = common.or_else(|| shows_top.then(|| crossing(to_end, *sample, own())).flatten());
            if let Some(at) = at {
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

/// Median of the samples below the middle of their range: the level between two pulses. Extremes of a noisy level would move
/// the middle from pulse to pulse, and by more samples on the longer side.
fn lower_plateau(level: &[f64]) -> f64 {
    plateau(level, |value, middle| value <= middle)
}

/// Median of the samples above the middle of their range: the level of a pulse.
fn upper_plateau(level: &[f64]) -> f64 {
    plateau(level, |value, middle| value >= middle)
}

/// Median of the samples on one side of the middle of their range. There is at least one sample.
fn plateau(level: &[f64], is_of: fn(f64, f64) -> bool) -> f64 {
    let (least, largest) = range_of(level.iter().copied());
    let middle = 0.5 * (least + largest);
    let mut side: Vec<f64> = level
        .iter()
        .copied()
        .filter(|value| is_of(*value, middle))
        .collect();
    median(&mut side).unwrap_or(middle)
}

/// Least and largest of the values; (∞, −∞) without values.
fn range_of(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, largest), value| {
        (least.min(value), largest.max(value))
    })
}

/// Sample index, with its fraction, at which the level rises through `middle` near sample `near`; `None` if it does not reach it.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channel, Quantity, Sidecar};

    /// A recording of a tachometer alone, 1000 samples per second.
    fn recording(level: impl Fn(f64) -> f64) -> Recording {
        Recording {
            path: "cut.csv".into(),
            sample_rate_hz: 1000.0,
            start_s: 0.0,
            since_s: 0.0,
            channels: vec![Channel {
                name: "tacho".into(),
                quantity: Quantity::Level,
                samples: (0..2000).map(|sample| level(f64::from(sample) * 1e-3)).collect(),
            }],
            sidecar: Sidecar::default(),
        }
    }

    #[test]
    fn every_pulse_has_an_edge_of_its_own_even_if_few_samples_show_it() {
        // Triangles 1.7 samples wide at 41 rev/s: their largest sample lies between 0.41 and 1.
        let level = |t: f64| {
            let from_middle_s = ((41.0 * t + 0.5).fract() - 0.5).abs() / 41.0;
            (1.0 - from_middle_s / 0.85e-3).max(0.0)
        };
        let edges = TachometerEdges::new(&recording(level)).unwrap();
        assert!(
            (80..=82).contains(&edges.times_s.len()),
            "{}",
            edges.times_s.len()
        );
        for pair in edges.times_s.windows(2) {
            // The rise takes a sample.
            assert!((pair[1] - pair[0] - 1.0 / 41.0).abs() < 1e-3, "{pair:?}");
        }
    }

    #[test]
    fn a_level_of_constant_pulses_has_edges_at_its_middle() {
        // A ramp of two samples, as of a slow photocell, with 10 rev/s; the first sample lies within a rise.
        let level = |t: f64| {
            let since_s = (10.0 * t + 0.01).fract() / 10.0 - 1e-3;
            if since_s < 0.03 {
                (0.5 + since_s / 2e-3).clamp(0.0, 1.0)
            } else {
                0.0
            }
        };
        let edges = TachometerEdges::new(&recording(level)).unwrap();
        for (turn, time_s) in edges.times_s.iter().skip(1).enumerate() {
            assert!(
                (time_s - edges.times_s[1] - 0.1 * turn as f64).abs() < 1e-9,
                "{turn} {time_s}"
            );
        }
        assert!(edges.times_s.len() >= 19, "{}", edges.times_s.len());
    }

    #[test]
    fn a_pulse_whose_top_the_record_does_not_show_has_no_edge() {
        // The rise takes two samples. The last sample of the record, at 1.999 s, lies within it.
        let level = |t: f64| match (t * 1e3 + 1.0).round() as u64 % 100 {
            0 => 0.5 - 1e-9,
            1..30 => 1.0,
            _ => 0.0,
        };
        let edges = TachometerEdges::new(&recording(level)).unwrap();
        assert!(
            edges.times_s.iter().all(|time_s| *time_s < 1.95),
            "{:?}",
            edges.times_s
        );
        assert!(edges.times_s.len() >= 18, "{}", edges.times_s.len());
    }
}
