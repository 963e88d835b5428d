//! A segment of a recording, which the options `--from-s` and `--until-s` select by start and end time.

use std::ops::Range;

use super::criteria::SAME_SAMPLE;
use super::{Recording, RecordingError};

/// A segment of a recording: all samples with `from_s` ≤ t < `until_s`, apart from a tolerance for rounded times.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Segment {
    /// Start time of the segment, s, on the time axis of the file; `None` for the start of the recording.
    pub from_s: Option<f64>,
    /// End time of the segment, s, on the time axis of the file, itself excluded; `None` for the end of the recording.
    pub until_s: Option<f64>,
}

impl Segment {
    /// True if neither start nor end is given.
    pub fn is_whole(self) -> bool {
        self.from_s.is_none() && self.until_s.is_none()
    }

    /// Range of the samples with these time stamps, s, that lie in the segment: from the first in it to the last. All of
    /// them if fewer than two do, for which [`Segment::of`] has the message.
    pub(super) fn of_stamps(self, time_s: &[f64]) -> Range<usize> {
        let whole = 0..time_s.len();
        let mut steps: Vec<f64> = time_s
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .filter(|step| *step > 0.0)
            .collect();
        steps.sort_by(f64::total_cmp);
        let usual = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
        let same = |stamp: f64| SAME_SAMPLE * usual + 4.0 * f64::EPSILON * stamp.abs();
        let is_in = |stamp: &f64| {
            self.from_s.is_none_or(|from| *stamp >= from - same(from))
                && self.until_s.is_none_or(|until| *stamp < until - same(until))
        };
        match (time_s.iter().position(is_in), time_s.iter().rposition(is_in)) {
            (Some(first), Some(last)) if last > first => first..last + 1,
            _ => whole,
        }
    }

    /// Cuts the segment out of `recording`.
    ///
    /// # Errors
    /// A given start or end leaves fewer than two samples; a channel has another number of samples than the first one; or
    /// the segment has a NaN or infinite sample.
    pub(super) fn of(self, recording: Recording) -> Result<Recording, RecordingError> {
        let (count, rate) = (recording.len(), recording.sample_rate_hz);
        let content = |what: String| RecordingError::Content {
            path: recording.path.clone(),
            what,
        };
        let sample = |time_s: f64| {
            ((time_s - recording.start_s) * rate - SAME_SAMPLE)
                .ceil()
                .max(0.0) as usize
        };
        let first = self.from_s.map_or(0, sample).min(count);
        let end = self.until_s.map_or(count, sample).min(count);
        if !self.is_whole() && end < first + 2 {
            let option = |name: &str, time_s: Option<f64>| {
                time_s.map_or_else(String::new, |time_s| format!("--{name} {time_s} "))
            };
            return Err(content(format!(
                "{}{}leaves {} samples; it has {count}, from {} to {} s",
                option("from-s", self.from_s),
                option("until-s", self.until_s),
                end.saturating_sub(first),
                recording.start_s,
                recording.time_s(count.saturating_sub(1))
            )));
        }
        for channel in &recording.channels {
            let Some(samples) = channel
                .samples
                .get(first..end)
                .filter(|_| channel.samples.len() == count)
            else {
                return Err(content(format!(
                    "channel \"{}\" has {} samples, and the first one {count}; all must have been sampled together",
                    channel.name,
                    channel.samples.len()
                )));
            };
            let wrong = |sample: &f64| !sample.is_finite();
            if let (Some(at), Some(last)) = (samples.iter().position(wrong), samples.iter().rposition(wrong))
            {
                let count = samples.iter().filter(|sample| wrong(sample)).count();
                return Err(RecordingError::NotFinite {
                    path: recording.path.clone(),
                    channel: channel.name.clone(),
                    sample: first + at + 1,
                    time_s: recording.time_s(first + at),
                    value: samples[at],
                    count,
                    last_s: recording.time_s(first + last),
                });
            }
        }
        Ok(if self.is_whole() {
            recording
        } else {
            recording.part(first..end)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Channel, Quantity, Sidecar};
    use super::*;

    /// A recording of ten samples at 10 Hz that starts at 2 s; its third sample is NaN, its fifth is −∞.
    fn recording() -> Recording {
        let mut samples: Vec<f64> = (0..10).map(f64::from).collect();
        samples[2] = f64::NAN;
        samples[4] = f64::NEG_INFINITY;
        Recording {
            path: "a.mat".into(),
            sample_rate_hz: 10.0,
            start_s: 2.0,
            since_s: 0.0,
            channels: vec![Channel {
                name: "ax".into(),
                quantity: Quantity::Acceleration,
                samples,
            }],
            sidecar: Sidecar::default(),
        }
    }

    #[test]
    fn channels_of_unequal_length_are_refused() {
        for length in [9, 11] {
            let mut recording = recording();
            recording.channels[0].samples.fill(1.0);
            recording.channels.push(Channel {
                name: "ay".into(),
                quantity: Quantity::Acceleration,
                samples: vec![0.0; length],
            });
            let said = Segment::default().of(recording).unwrap_err().to_string();
            assert!(said.contains(&format!("\"ay\" has {length} samples")), "{said}");
        }
    }

    fn segment(from_s: Option<f64>, until_s: Option<f64>) -> Result<Recording, String> {
        Segment { from_s, until_s }
            .of(recording())
            .map_err(|error| error.to_string())
    }

    #[test]
    fn a_nan_sample_is_reported_with_channel_and_time() {
        let said = segment(None, None).unwrap_err();
        for words in [
            "a.mat",
            "\"ax\"",
            "sample 3",
            "2.2 s",
            "NaN",
            "2 such",
            "2.4 s",
            "--from-s",
            "--until-s",
        ] {
            assert!(said.contains(words), "{words}: {said}");
        }
        assert!(
            segment(Some(2.3), None)
                .unwrap_err()
                .contains("sample 5 at 2.4 s is -inf")
        );
    }

    #[test]
    fn a_segment_without_nan_keeps_its_times() {
        let after = segment(Some(2.5), None).unwrap();
        assert_eq!(after.channels[0].samples, [5.0, 6.0, 7.0, 8.0, 9.0]);
        assert_eq!((after.start_s, after.since_s), (2.5, 0.5));
        let before = segment(None, Some(2.2)).unwrap();
        assert_eq!(before.channels[0].samples, [0.0, 1.0]);
        let both = segment(Some(2.5), Some(2.8)).unwrap();
        assert_eq!(both.channels[0].samples, [5.0, 6.0, 7.0]);
    }

    #[test]
    fn a_segment_outside_the_recording_is_refused_with_the_recorded_times() {
        for (from_s, until_s) in [(Some(5.0), None), (None, Some(1.0)), (Some(2.7), Some(2.6))] {
            let said = segment(from_s, until_s).unwrap_err();
            assert!(said.contains("from 2 to 2.9 s"), "{said}");
        }
    }
}
