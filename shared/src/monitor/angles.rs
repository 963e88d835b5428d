//! The spindle angle of each sample of a block.

use super::pipeline::Monitor;
use super::state::State;
use crate::tachometer::Turns;

/// The angle at the first sample of a block, and how it goes on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Angles {
    first: Turns,
    /// 2⁻³² turns per sample of the sensor.
    per_sample: u64,
    /// Standard deviation, in tooth periods.
    pub(super) deviation: f32,
    /// Samples of the sensor per tooth period.
    pub(super) samples_per_tooth: f32,
}

impl Angles {
    /// The angle at sample `n` of the block, less a group delay in samples.
    pub(super) fn at(&self, n: usize, delay: u32) -> Turns {
        let forward = self.per_sample.wrapping_mul(n as u64);
        let back = self.per_sample.wrapping_mul(u64::from(delay));
        Turns(self.first.0.saturating_add(forward).saturating_sub(back))
    }
}

impl Monitor {
    /// The angles of the samples of the newest block.
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
