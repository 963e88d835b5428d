//! A recording: channels that were sampled together.

use std::ops::Range;
use std::path::PathBuf;

use super::error::RecordingError;
use super::sidecar::Sidecar;
use super::unit::Quantity;

/// A recording: channels sampled simultaneously at one constant sample rate.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// File that the recording was read from or is written to.
    pub path: PathBuf,
    /// Sample rate, samples per second.
    pub sample_rate_hz: f64,
    /// Time of the first sample of the recording, s.
    pub start_s: f64,
    /// Time from the start of the whole recording to the first sample of this segment, s; 0 for a whole recording.
    /// Effects that depend on time, such as drift, count their time from the start of the whole recording.
    pub since_s: f64,
    /// Channels, all with the same number of samples. The time column is not a channel.
    pub channels: Vec<Channel>,
    /// Sidecar file: kind of test, cut, posture and channel descriptions.
    pub sidecar: Sidecar,
}

/// One channel of a recording: name, measured quantity and samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name of the channel: `fx`, `x`, `vx`, `ax`, `tacho` …
    pub name: String,
    /// Measured quantity; it sets the unit of `samples`.
    pub quantity: Quantity,
    /// Samples, in the SI unit of `quantity`; as recorded if the quantity is unknown.
    pub samples: Vec<f64>,
}

impl Recording {
    /// The channel called `name`; `None` if the recording has no such channel.
    pub fn channel(&self, name: &str) -> Option<&Channel> {
        self.channels.iter().find(|channel| channel.name == name)
    }

    /// Number of samples of each channel.
    pub fn len(&self) -> usize {
        self.channels.first().map_or(0, |channel| channel.samples.len())
    }

    /// True if the recording has no samples.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Time of the sample with index `sample`, s: t = `start_s` + sample / `sample_rate_hz`.
    pub fn time_s(&self, sample: usize) -> f64 {
        self.start_s + sample as f64 / self.sample_rate_hz
    }

    /// The segment of the recording with the samples whose indices are in `range`, with the times of its own first
    /// sample in `start_s` and `since_s`.
    ///
    /// # Panics
    /// A channel has fewer samples than `range` requires, or the start of `range` is after the end of `range`.
    #[must_use]
    pub fn part(&self, range: Range<usize>) -> Self {
        let channels = self.channels.iter().map(|channel| Channel {
            samples: channel.samples[range.clone()].to_vec(),
            ..channel.clone()
        });
        Self {
            channels: channels.collect(),
            path: self.path.clone(),
            sidecar: self.sidecar.clone(),
            start_s: self.time_s(range.start),
            since_s: self.since_s + range.start as f64 / self.sample_rate_hz,
            ..*self
        }
    }

    /// The error for a recording that lacks the channel or setting described by `needed`; the message lists the
    /// channels that it has.
    pub fn lacks(&self, needed: impl Into<String>) -> RecordingError {
        RecordingError::NoChannel {
            path: self.path.clone(),
            needed: needed.into(),
            found: self
                .channels
                .iter()
                .map(|channel| format!("{} [{}]", channel.name, channel.quantity.unit()))
                .collect(),
        }
    }
}
