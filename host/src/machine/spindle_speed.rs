//! Spindle speed at which the structure in recordings was measured.

use crate::criteria::{SAME_SPINDLE_SPEED, STANDSTILL_S};
use crate::recording::{Recording, TachometerEdges, TestKind};

/// Spindle speed that all recordings state, rev/min, 0 at standstill; `None` if one of them states none, if they differ, or if one is a
/// cut, whose modes hold in process.
pub fn spindle_rpm(recordings: &[Recording]) -> Option<f64> {
    let speeds: Option<Vec<f64>> = recordings.iter().map(stated).collect();
    let speeds = speeds.filter(|speeds| !speeds.is_empty())?;
    let mean = speeds.iter().sum::<f64>() / speeds.len() as f64;
    let is_same = |rpm: &f64| (rpm - mean).abs() <= SAME_SPINDLE_SPEED * mean;
    speeds.iter().all(is_same).then_some(mean)
}

/// True if the tachometer in one of the recordings has a pulse, so that the spindle was not at standstill.
pub(super) fn has_turned(recordings: &[Recording]) -> bool {
    let mut edges = recordings.iter().filter_map(TachometerEdges::new);
    edges.any(|edges| !edges.times_s.is_empty())
}

/// Spindle speed of one recording: that of its tachometer, which without pulses means standstill.
fn stated(recording: &Recording) -> Option<f64> {
    let sidecar = &recording.sidecar;
    if sidecar.cut.is_some() || sidecar.kind == Some(TestKind::Cutting) {
        return None;
    }
    let edges = TachometerEdges::new(recording)?;
    if edges.times_s.is_empty() {
        let seconds = recording.len() as f64 / recording.sample_rate_hz;
        return (seconds >= STANDSTILL_S).then_some(0.0);
    }
    let begins_s = edges.revolutions_s().ok()?;
    let periods_s: Vec<f64> = begins_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mean_s = periods_s.iter().sum::<f64>() / periods_s.len() as f64;
    let is_even = |period_s: &f64| (period_s / mean_s - 1.0).abs() <= SAME_SPINDLE_SPEED;
    (!periods_s.is_empty() && periods_s.iter().all(is_even)).then(|| 60.0 / mean_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{Channel, Quantity, Sidecar};

    /// A record of 2 s at 1 kHz with a tachometer level.
    fn recording(level: impl Fn(f64) -> f64) -> Recording {
        let samples = (0..2000).map(|index| level(1e-3 * f64::from(index))).collect();
        Recording {
            path: "tap.csv".into(),
            sample_rate_hz: 1000.0,
            start_s: 0.0,
            since_s: 0.0,
            channels: vec![Channel {
                name: "tacho".into(),
                quantity: Quantity::Level,
                samples,
            }],
            sidecar: Sidecar::default(),
        }
    }

    #[test]
    fn a_tachometer_states_the_speed() {
        let still = recording(|_| 0.0);
        assert_eq!(spindle_rpm(std::slice::from_ref(&still)), Some(0.0));
        // A pulse of 10 ms once in 0.1 s: 600 rev/min.
        let running = recording(|time_s| f64::from(u8::from(time_s % 0.1 < 0.01)));
        let found = spindle_rpm(std::slice::from_ref(&running)).unwrap();
        // Edges lie between samples of 1 ms, over 1.9 s.
        assert!((found / 600.0 - 1.0).abs() < 2e-3, "{found}");
        assert!(has_turned(&[still.clone(), running.clone()]));
        assert_eq!(spindle_rpm(&[still.clone(), running]), None);
        let without = Recording {
            channels: Vec::new(),
            ..still.clone()
        };
        assert!(!has_turned(&[still.clone(), without.clone()]));
        assert_eq!(spindle_rpm(&[still, without]), None);
        assert_eq!(spindle_rpm(&[]), None);
    }
}
