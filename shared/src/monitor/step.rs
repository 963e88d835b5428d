//! One step of the signal chain: takes a block of samples, returns a report.

use super::angles::{Angles, Place};
use super::pipeline::Monitor;
use super::report::Report;
use super::state::State;
use crate::acceleration::{Block, Continuity, Counts, MAX_BLOCK_SAMPLES};
use crate::criteria::DAMAGE_MEMORY_BLOCKS;
use crate::lobes::LobeTable;
use crate::tachometer::Edge;
use crate::units::{Nanoseconds, Rpm};
use crate::working_point::WorkingPoint;

/// Longest gap that is bridged, in samples: two lost blocks. More would multiply the work of a block.
const BRIDGED_SAMPLES: u32 = 2 * MAX_BLOCK_SAMPLES as u32;
/// Tooth periods after the end of a gap that contain lost samples or their echo in the filters.
const SPOILED_PASSINGS: u8 = 2;
/// A gap of more than this part of a tooth period spoils it: more than two of its eight angles.
const SPOILING_PART: f32 = 0.25;

impl Monitor {
    /// Processes the next block and the new tachometer edges up to the end of the block.
    ///
    /// Edges must be in order of time. An edge may be passed with a later block than the one in which it occurred,
    /// unless the tachometer loses its lock meanwhile: without an edge for 2.5 times the longest regular interval
    /// between edges.
    #[inline(never)]
    pub fn step(
        &self,
        state: &mut State,
        block: &Block,
        edges: &[Edge],
        table: Option<&LobeTable<'_>>,
        working_point: Option<&WorkingPoint>,
    ) -> Report {
        let seconds = block.counts.len() as f32 / self.settings.sensor.nominal_rate.0;
        state.structure.begin_block(seconds);
        state.tool.begin_block(seconds);
        let lost = self.take_block(state, block);
        let last = (block.counts.len() as u32).saturating_sub(1);
        let time = state.sample_clock.time_of(last).unwrap_or(block.time);
        let measured = self.take_edges(state, edges, time);
        let angles = self.angles(state);
        state.strobes.clear();
        self.bridge(state, block, lost, angles.as_ref());
        for (n, &counts) in block.counts.iter().enumerate() {
            self.take_sample(state, counts, Place { n, before: 0 }, angles.as_ref());
        }
        state.last_counts = block.counts.last().copied().unwrap_or(state.last_counts);
        state.structure.loudness.end_block(seconds);
        state.tool.loudness.end_block(seconds);
        let speed = measured
            .or_else(|| state.tone_speed.map(|rotation| rotation.frequency.to_rpm()))
            .or(self.settings.assumed_speed);
        self.take_spectra(state, measured.map(Rpm::to_hertz));
        let judgement = self.judge(state, speed, seconds);
        let advice = speed.and_then(|speed| self.advise(state, &judgement, speed, table, working_point));
        Report {
            sequence: block.sequence,
            time,
            speed,
            judgement,
            alarm: state.detector.is_alarm(),
            advice,
            clipped: state.sample_clock.clipped(),
            lost: state.sample_clock.lost(),
        }
    }

    /// Takes one sample of the sensor.
    #[inline(never)]
    fn take_sample(&self, state: &mut State, counts: Counts, place: Place, angles: Option<&Angles>) {
        let output = self.decimation.step(&mut state.decimation, counts);
        if let Some(sample) = output.tool {
            self.take_tool(state, sample, place, angles);
        }
        if let Some(sample) = output.structure {
            self.take_structure(state, sample, place, angles);
        }
    }

    /// Puts a straight line in the place of `lost` samples before the block, so that filters, spectra and tooth periods go on. The tooth periods
    /// that contain it are marked.
    fn bridge(&self, state: &mut State, block: &Block, lost: u32, angles: Option<&Angles>) {
        let Some(&next) = block.counts.first().filter(|_| lost > 0) else {
            return;
        };
        let last = state.last_counts;
        // A short gap leaves most of a tooth period as it is.
        let spoils = angles.is_none_or(|angles| lost as f32 > SPOILING_PART * angles.samples_per_tooth);
        for before in (1..=lost).rev() {
            if spoils {
                state.structure.spoiled = SPOILED_PASSINGS;
                state.tool.spoiled = SPOILED_PASSINGS;
            }
            let part = before as f32 / (lost + 1) as f32;
            let mut counts = next;
            for (value, last) in counts.iter_mut().zip(last) {
                let from = f32::from(*value);
                *value = (from + part * (f32::from(last) - from)) as i16;
            }
            self.take_sample(state, counts, Place { n: 0, before }, angles);
        }
    }

    /// Updates the sample clock with a block, and the share of clipped or lost samples. Returns the number of lost samples to
    /// bridge. After a longer gap, resets the decimation filters, and discards samples for spectra, tracked tones and
    /// tooth periods; after a restart of the sample clock the history of the chatter detector, too.
    fn take_block(&self, state: &mut State, block: &Block) -> u32 {
        let (lost, restarted) = match self.sample_clock.observe(&mut state.sample_clock, block) {
            Continuity::Contiguous => (0, false),
            Continuity::Gap(samples) => (samples, false),
            Continuity::Restarted => (block.lost.max(1), true),
        };
        let bridged = if restarted || lost > BRIDGED_SAMPLES {
            0
        } else {
            lost
        };
        if bridged < lost {
            state.decimation.reset();
            state.structure.interrupt();
            state.tool.interrupt();
        }
        if restarted {
            state.detector.interrupt();
        }
        let bad = f32::from(block.clipped) + lost as f32;
        let all = block.counts.len() as f32 + lost as f32;
        if all > 0.0 {
            state.damage += (bad / all - state.damage) / DAMAGE_MEMORY_BLOCKS;
        }
        bridged
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
