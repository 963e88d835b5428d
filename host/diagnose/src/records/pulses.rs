//! Refuses tachometers with missed or additional pulses.
//!
//! The moment of inertia of a spindle lets its speed change little from one pulse to the next. An interval that is about
//! twice its neighbours is two with a pulse missed; two successive ones that are together about as long as their
//! neighbours are one with an additional pulse.

use quietcut_numerics::statistics::median;
use quietcut_recording::{Recording, TachometerEdges};

use crate::error::DiagnoseError;

/// Number of neighbours on either side with which an interval is compared.
const NEIGHBOURS: usize = 4;
/// Largest median deviation of intervals from their neighbours with which a pulse can be said to be missed, and largest
/// distance of an interval from a whole multiple of its neighbours: five times as much.
const STEADY: f64 = 0.05;
const OFF: f64 = 5.0 * STEADY;

/// Faults of the pulses of a tachometer.
#[derive(Debug, Default, PartialEq)]
struct Faults {
    /// Times before which a pulse is missed, s after the first sample, with the interval over its neighbours.
    missed: Vec<(f64, f64)>,
    /// Times of additional pulses, s after the first sample, with the shorter interval over its neighbours.
    additional: Vec<(f64, f64)>,
}

/// Refuses a recording whose tachometer misses pulses or has additional ones. Wheels with missing positions are not
/// checked here: their gap shows every wrong pulse.
pub(crate) fn check(recording: &Recording) -> Result<(), DiagnoseError> {
    let Some(edges) = TachometerEdges::new(recording).filter(|edges| edges.wheel.missing == 0) else {
        return Ok(());
    };
    let found = faults(&edges.times_s);
    let said = |faults: &[(f64, f64)], what: &str| {
        let (time_s, ratio) = faults.first()?;
        Some(format!(
            "{} {what} (the first at {:.4} s, where the interval between two pulses is {ratio:.2} of its neighbours)",
            faults.len(),
            recording.start_s + time_s
        ))
    };
    let words: Vec<String> = [
        said(&found.missed, "missed"),
        said(&found.additional, "additional"),
    ]
    .into_iter()
    .flatten()
    .collect();
    if words.is_empty() {
        return Ok(());
    }
    Err(DiagnoseError::record(
        &recording.path,
        format!(
            "tacho has wrong pulses: {}; the angle of the teeth is not known from there on. Check the distance and the \
             level of the sensor, or use a segment without them (--from-s, --until-s)",
            words.join(" and ")
        ),
    ))
}

fn faults(times_s: &[f64]) -> Faults {
    let mut found = Faults::default();
    let intervals: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let ratios: Vec<f64> = (0..intervals.len())
        .filter_map(|at| Some(intervals[at] / neighbours(&intervals, at)?))
        .collect();
    let mut deviations: Vec<f64> = ratios.iter().map(|ratio| (ratio - 1.0).abs()).collect();
    if ratios.len() <= 2 * NEIGHBOURS || median(&mut deviations).is_none_or(|deviation| deviation > STEADY) {
        return found;
    }
    let mut at = 0;
    while at < ratios.len() {
        // The record may end within the second part of an interval: a short one at its end says nothing.
        let (ratio, next) = (ratios[at], ratios.get(at + 1).copied().unwrap_or(1.0));
        if ratio > 2.0 - OFF && (ratio - ratio.round()).abs() < OFF {
            found.missed.push((times_s[at + 1], ratio));
        } else if ratio.min(next) < 0.5 + OFF && ratio.max(next) < 1.0 && (ratio + next - 1.0).abs() < OFF {
            found.additional.push((times_s[at + 1], ratio.min(next)));
            at += 1;
        }
        at += 1;
    }
    found
}

/// Median of the intervals beside one; `None` without any.
fn neighbours(intervals: &[f64], at: usize) -> Option<f64> {
    let from = at.saturating_sub(NEIGHBOURS);
    let to = (at + NEIGHBOURS + 1).min(intervals.len());
    let mut beside: Vec<f64> = intervals[from..at]
        .iter()
        .chain(&intervals[at + 1..to])
        .copied()
        .collect();
    median(&mut beside)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pulses at 10 rev/s whose speed changes by the share `modulation`, twice per second.
    fn pulses(modulation: f64) -> Vec<f64> {
        let wave = |t: f64| modulation * (4.0 * std::f64::consts::PI * t).sin() / 12.566;
        (0..40).map(|k| 0.1 * f64::from(k)).map(|t| t + wave(t)).collect()
    }

    #[test]
    fn missed_and_additional_pulses_are_found() {
        for modulation in [0.0, 0.03] {
            let mut times = pulses(modulation);
            times.remove(7);
            times.remove(20);
            let found = faults(&times);
            assert_eq!((found.missed.len(), found.additional.len()), (2, 0), "{found:?}");
            // A bounce of the sensor, and a second reflection.
            for late in [0.002, 0.05, 0.08] {
                let mut times = pulses(modulation);
                times.insert(12, times[11] + late);
                let found = faults(&times);
                assert_eq!(
                    (found.missed.len(), found.additional.len()),
                    (0, 1),
                    "{late} {found:?}"
                );
            }
        }
    }

    #[test]
    fn a_speed_that_changes_has_no_wrong_pulses() {
        for modulation in [0.0, 0.05, 0.3, 0.8] {
            assert_eq!(faults(&pulses(modulation)), Faults::default(), "{modulation}");
        }
        // A spindle that starts from rest.
        let starting: Vec<f64> = (1..60).map(|k| f64::from(k).sqrt()).collect();
        assert_eq!(faults(&starting), Faults::default());
        // A record that ends shortly after a pulse.
        let mut times = pulses(0.0);
        times.push(times[39] + 0.01);
        assert_eq!(faults(&times), Faults::default());
    }
}
