//! Spindle angle at the samples from the first to the last tachometer edge, interpolated between the edges.

use super::{Recording, RecordingError, TachometerEdges};

/// Spindle angle φ, rad, of all samples between the first and the last tachometer edge.
///
/// φ = 0 at immersion angle 0 of tooth 1. φ grows by 2π per revolution and is linear in time between edges.
#[derive(Clone, Debug, PartialEq)]
pub struct SpindleAngle {
    /// Index in the recording of the first sample whose spindle angle is known.
    pub first: usize,
    /// Spindle angle, rad, of the sample with index `first` and of each sample after it, up to the last tachometer
    /// edge.
    pub rad: Vec<f64>,
}

impl SpindleAngle {
    /// Computes the spindle angle from the channel `tacho`; `teeth` is the number of evenly spaced teeth.
    ///
    /// # Errors
    /// There is no tachometer; there are fewer than two edges; the edges do not match the wheel described in the
    /// sidecar; or the wheel has no gap and its number of positions does not divide the number of teeth, so that the
    /// edges do not define the tooth angle.
    pub fn new(recording: &Recording, teeth: u32) -> Result<Self, RecordingError> {
        let Some(edges) = TachometerEdges::new(recording) else {
            return Err(recording.lacks("tacho channel, which defines the angle of the teeth"));
        };
        let (edges_s, wheel) = (&edges.times_s, edges.wheel);
        let content = |what: String| RecordingError::Content {
            path: recording.path.clone(),
            what,
        };
        if edges_s.len() < 2 {
            return Err(content(format!(
                "tacho has {} rising edges; at least two are needed",
                edges_s.len()
            )));
        }
        if wheel.missing == 0 && !teeth.is_multiple_of(u32::from(wheel.positions)) {
            return Err(content(format!(
                "a tachometer with {} pulses per revolution and no gap does not define the angle of {teeth} teeth; one pulse per revolution, a wheel with a gap (missing), or one pulse per tooth is needed",
                wheel.positions
            )));
        }
        let edges_rad = edges.angles_rad().map_err(content)?;
        let rate_hz = recording.sample_rate_hz;
        let first = (edges_s[0] * rate_hz).ceil() as usize;
        let mut edge = 0;
        let rad = (first..recording.len())
            .map_while(|sample| {
                let t = sample as f64 / rate_hz;
                while edge + 2 < edges_s.len() && edges_s[edge + 1] <= t {
                    edge += 1;
                }
                let share = (t - edges_s[edge]) / (edges_s[edge + 1] - edges_s[edge]);
                (share <= 1.0).then(|| edges_rad[edge] + share * (edges_rad[edge + 1] - edges_rad[edge]))
            })
            .collect();
        Ok(Self { first, rad })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::super::{Channel, Quantity, RecordedChannel, Sidecar};
    use super::*;

    /// Tachometer level of a spindle at 7 rev/s, sampled at 10 kHz; the first edge of position 0 comes at 0.05 s.
    fn recording(positions: u16, missing: u16) -> Recording {
        let there = positions - missing;
        let level = |sample: usize| {
            let turns = 7.0 * (sample as f64 * 1e-4 - 0.05) + 10.0;
            let place = turns.fract() * f64::from(positions);
            f64::from(u8::from(place.fract() < 0.5 && (place as u16) < there))
        };
        let mut sidecar = Sidecar::default();
        let channel = RecordedChannel {
            pulses_per_rev: Some(positions),
            missing: Some(missing),
            ..RecordedChannel::default()
        };
        sidecar.channels.insert("tacho".into(), channel);
        Recording {
            path: "cut.csv".into(),
            sample_rate_hz: 1e4,
            start_s: 0.0,
            since_s: 0.0,
            channels: vec![Channel {
                name: "tacho".into(),
                quantity: Quantity::Level,
                samples: (0..20_000).map(level).collect(),
            }],
            sidecar,
        }
    }

    #[test]
    fn the_angle_equals_that_of_the_spindle_for_every_wheel() {
        for (positions, missing) in [(1, 0), (4, 3), (12, 2), (36, 1)] {
            let recording = recording(positions, missing);
            let angle = SpindleAngle::new(&recording, 3).unwrap();
            assert!(angle.rad.len() > 17_000, "{positions} {missing}");
            for (index, rad) in angle.rad.iter().enumerate() {
                let turns = 7.0 * ((index + angle.first) as f64 * 1e-4 - 0.05);
                let off = (rad / TAU - turns + 0.5).rem_euclid(1.0) - 0.5;
                // An edge is located to one sample: 7e-4 of a revolution.
                assert!(off.abs() < 1e-3, "{positions} {missing} {index}: {off}");
            }
        }
    }

    #[test]
    fn wheels_that_do_not_define_the_tooth_angle_are_refused() {
        let error = SpindleAngle::new(&recording(4, 0), 3).unwrap_err().to_string();
        assert!(error.contains("4 pulses per revolution and no gap"), "{error}");
        assert!(SpindleAngle::new(&recording(3, 0), 3).is_ok());
        let mut other = recording(12, 2);
        if let Some(tacho) = other.sidecar.channels.get_mut("tacho") {
            tacho.pulses_per_rev = Some(14);
        }
        let error = SpindleAngle::new(&other, 3).unwrap_err().to_string();
        assert!(error.contains("12 are expected"), "{error}");
    }
}
