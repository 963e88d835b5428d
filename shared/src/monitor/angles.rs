//! The spindle angle of each sample of a block.

use super::pipeline::Monitor;
use super::state::State;
use crate::tachometer::Turns;

/// The place of a sample in time: `n` samples after the first of the block, and `before` samples before that.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) n: usize,
    pub(super) before: u32,
}

/// Spindle angle at the first sample of a block, and the increment of the angle per sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Angles {
    first: Turns,
    /// Increment of the spindle angle per sensor sample, in 2⁻³² revolutions.
    per_sample: u64,
    /// Standard deviation of the error of the spindle angle as the tachometer gives it, in tooth periods.
    pub(super) deviation: f32,
    /// Sensor samples per tooth period.
    pub(super) samples_per_tooth: f32,
}

impl Angles {
    /// The spindle angle at `delay` samples before a sample. `delay` is the group delay of the filter
    /// through which the sample passed.
    pub(super) fn at(&self, place: Place, delay: u32) -> Turns {
        let forward = self.per_sample.wrapping_mul(place.n as u64);
        let back = self
            .per_sample
            .wrapping_mul(u64::from(delay) + u64::from(place.before));
        Turns(self.first.0.saturating_add(forward).saturating_sub(back))
    }
}

impl Monitor {
    /// The spindle angles of the samples of the newest block; `None` without a tachometer, and while it has no lock.
    pub(super) fn angles(&self, state: &State) -> Option<Angles> {
        let tachometer = self.tachometer.as_ref()?;
        let phase = tachometer.phase(&state.tachometer, state.sample_clock.time_of(0)?)?;
        let rate = state.sample_clock.rate()?;
        let turns = phase.turns_per_second / rate.0;
        let teeth = f32::from(self.settings.tool.teeth);
        Some(Angles {
            first: phase.angle,
            per_sample: (turns * 4_294_967_296.0) as u64,
            deviation: phase.deviation_turns * teeth,
            samples_per_tooth: 1.0 / (turns * teeth),
        })
    }
}
