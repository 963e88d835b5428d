//! A recording: channels that were sampled together.

use std::ops::Range;
use std::path::PathBuf;

use super::error::RecordingError;
use super::sidecar::Sidecar;
use super::unit::Quantity;

/// Channels that were sampled together, evenly.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Where it was read from, or will be written to.
    pub path: PathBuf,
    /// Samples per second.
    pub sample_rate_hz: f64,
    /// Time of the first sample, s.
    pub start_s: f64,
    /// How long after the beginning of the recording of which it is a part it begins, s: what grows or swings with time counts from
    /// there. 0 where it is whole.
    pub since_s: f64,
    /// The channels, all of one length. Time is not among them.
    pub channels: Vec<Channel>,
    /// What the file beside it says.
    pub sidecar: Sidecar,
}

/// One channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Its name: `fx`, `x`, `vx`, `ax`, `tacho` …
    pub name: String,
    /// What it measures; samples are in the SI unit of it.
    pub quantity: Quantity,
    /// The samples.
    pub samples: Vec<f64>,
}

impl Recording {
    /// The channel of a name.
    pub fn channel(&self, name: &str) -> Option<&Channel> {
        self.channels.iter().find(|channel| channel.name == name)
    }

    /// Number of samples of each channel.
    pub fn len(&self) -> usize {
        self.channels.first().map_or(0, |channel| channel.samples.len())
    }

    /// True where there are no samples.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Time of a sample, s.
    pub fn time_s(&self, sample: usize) -> f64 {
        self.start_s + sample as f64 / self.sample_rate_hz
    }

    /// A part of it, of these samples.
    ///
    /// # Panics
    /// Where it has fewer samples.
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

    /// The error that it has no channel that is needed.
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
