//! Clipped samples of a test, and the parts of its record that hold them.

use std::ops::Range;

use quietcut_recording::clipping_levels;

use super::criteria::CLIPPED_PARTS;
use super::test_channels::TestChannels;

/// Clipped samples of the forces and responses of a recording.
#[derive(Clone, Debug)]
pub(super) struct Clipping {
    /// One value per sample of the recording: true if at least one channel is clipped there. Empty if no channel is
    /// clipped.
    pub(super) is_clipped: Vec<bool>,
    /// Names of the clipped channels, each with the number of its clipped samples; forces first.
    channels: Vec<(String, usize)>,
}

impl Clipping {
    /// Finds the clipped samples of the selected forces and responses: all that equal one of the [`clipping_levels`] of
    /// their channel, also single ones.
    pub(super) fn of(channels: &TestChannels<'_>) -> Self {
        let forces = channels.forces.iter().map(|(_, channel)| *channel);
        let responses = channels.responses.iter().map(|response| response.channel);
        let mut found = Self {
            is_clipped: Vec::new(),
            channels: Vec::new(),
        };
        for channel in forces.chain(responses) {
            let levels = clipping_levels(channel);
            if levels.is_empty() {
                continue;
            }
            found.is_clipped.resize(channels.recording.len(), false);
            let mut count = 0;
            for (is_clipped, sample) in found.is_clipped.iter_mut().zip(&channel.samples) {
                if levels.contains(sample) {
                    *is_clipped = true;
                    count += 1;
                }
            }
            found.channels.push((channel.name.clone(), count));
        }
        found
    }

    /// Clipped channels with their numbers of clipped samples, as a text for messages.
    pub(super) fn names(&self) -> String {
        let names = self.channels.iter();
        let names: Vec<String> = names
            .map(|(name, count)| format!("{name} is clipped at {count} samples"))
            .collect();
        names.join(", ")
    }

    /// True if at least one of the samples with the indices `samples` is clipped.
    pub(super) fn holds(&self, samples: Range<usize>) -> bool {
        let end = samples.end.min(self.is_clipped.len());
        self.is_clipped
            .get(samples.start.min(end)..end)
            .is_some_and(|samples| samples.contains(&true))
    }

    /// Warning that `clipped` of the `parts` parts of a record, named by `noun` ("segments"), are left out; `None` if
    /// `clipped` is 0.
    ///
    /// # Errors
    /// More than the share [`CLIPPED_PARTS`] of the parts is clipped.
    pub(super) fn warning(&self, clipped: usize, parts: usize, noun: &str) -> Result<Option<String>, String> {
        if clipped == 0 {
            return Ok(None);
        }
        let names = self.names();
        if clipped as f64 > CLIPPED_PARTS * parts as f64 {
            return Err(format!(
                "{names}, in {clipped} of {parts} {noun}; what remains does not represent the test: record again with a larger range of the \
                 sensor or a smaller force, or leave the part out with --from-s or --until-s"
            ));
        }
        Ok(Some(format!(
            "{names}: {clipped} of {parts} {noun} are left out; a larger range of the sensor keeps them"
        )))
    }
}
