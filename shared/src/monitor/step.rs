//! One step of the signal chain: takes a block of samples, returns a report.

use super::pipeline::Monitor;
use super::report::Report;
use super::state::State;
use crate::acceleration::{Block, Continuity};
use crate::criteria::DAMAGE_MEMORY_BLOCKS;
use crate::lobes::LobeTable;
use crate::tachometer::Edge;
use crate::units::{Hertz, Nanoseconds, Rpm};
use crate::working_point::WorkingPoint;

impl Monitor {
    /// Processes the next block and the new tachometer edges up to the end of the block.
    ///
    /// Edges must be in order of time. An edge may be passed with a later block than the one in which it occurred,
    /// unless the tachometer loses its lock meanwhile: without an edge for 2.5 times the longest regular interval
    /// between edges.
    pub fn step(
        &self,
        state: &mut State,
        block: &Block,
        edges: &[Edge],
        table: Option<&LobeTable<'_>>,
        working_point: Option<&WorkingPoint>,
    ) -> Report {
        self.take_block(state, block);
        let last = (block.counts.len() as u32).saturating_sub(1);
        let time = state.sample_clock.time_of(last).unwrap_or(block.time);
        let measured = self.take_edges(state, edges, time);
        let angles = self.angles(state);
        state.strobes.clear();
        (state.structure.passed, state.structure.fresh) = (false, false);
        (state.tool.passed, state.tool.fresh) = (false, false);
        for (n, &counts) in block.counts.iter().enumerate() {
            let output = self.decimation.step(&mut state.decimation, counts);
            if let Some(sample) = output.tool {
                self.take_tool(state, sample, n, angles.as_ref());
            }
            if let Some(sample) = output.structure {
                self.take_structure(state, sample, n, angles.as_ref());
            }
        }
        let speed = measured
            .or_else(|| state.tone_speed.map(Hertz::to_rpm))
            .or(self.settings.assumed_speed);
        self.take_spectra(state, measured.map(Rpm::to_hertz));
        let judgement = self.judge(state, speed);
        let advice = speed.and_then(|speed| self.advise(state, &judgement, speed, table, working_point));
        Report {
            sequence: block.sequence,
            time,
            speed,
            judgement,
            advice,
            clipped: state.sample_clock.clipped(),
            lost: state.sample_clock.lost(),
        }
    }

    /// Updates the sample clock with a block, and the share of clipped or lost samples. After lost samples or a
    /// restart of the sample clock, resets the decimation filters, and discards samples for spectra, tracked tones,
    /// tooth periods and the history of the chatter detector.
    fn take_block(&self, state: &mut State, block: &Block) {
        let lost = match self.sample_clock.observe(&mut state.sample_clock, block) {
            Continuity::Contiguous => 0,
            Continuity::Gap(samples) => samples,
            Continuity::Restarted => block.lost.max(1),
        };
        if lost > 0 {
            state.decimation.reset();
            state.structure.interrupt();
            state.tool.interrupt();
            state.detector.interrupt();
        }
        let bad = f32::from(block.clipped) + lost as f32;
        let all = block.counts.len() as f32 + lost as f32;
        if all > 0.0 {
            state.damage += (bad / all - state.damage) / DAMAGE_MEMORY_BLOCKS;
        }
    }

    /// Processes the new tachometer edges. The lock is lost if no edge came for too long before `now`, the time of
    /// the last sample of the block. Returns the measured spindle speed, if there is one.
    fn take_edges(&self, state: &mut State, edges: &[Edge], now: Nanoseconds) -> Option<Rpm> {
        let tachometer = self.tachometer.as_ref()?;
        for &edge in edges {
            tachometer.observe(&mut state.tachometer, edge);
        }
        tachometer.expire(&mut state.tachometer, now);
        if state.tachometer.losses() != state.losses {
            state.losses = state.tachometer.losses();
            state.structure.interrupt_angles();
            state.tool.interrupt_angles();
        }
        tachometer.speed(&state.tachometer)
    }
}
