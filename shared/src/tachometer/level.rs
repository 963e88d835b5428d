//! The level of a tachometer to its rising edges.

use serde::{Deserialize, Serialize};

/// Finds the rising edges of a level whose base line wanders: a switch, a light barrier, a variable-reluctance sensor.
///
/// A rising edge is where the level has climbed from its last valley by half the usual swing, a fall where it has
/// come down from its last crest by as much; in both cases by the least swing at least. Both references move with the signal, so a base line that
/// swings, even by more than a pulse, moves no threshold.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LevelDetector {
    /// Swings below this, in the unit of the level, are noise. Above 0.
    pub least_swing: f32,
}

/// Where a [`LevelDetector`] stands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LevelDetectorState {
    /// The level before; `None` at the start.
    level: Option<f32>,
    /// True while the level is above the last rising edge.
    high: bool,
    /// Lowest level since the last fall, highest since the last rise.
    extreme: f32,
    /// The last valley, from which the level rose to an edge.
    valley: f32,
    /// The last crest, from which the level fell; `None` before the first fall: the record may begin anywhere on a pulse.
    crest: Option<f32>,
    /// The usual swing from crest to valley, and whether a whole one was seen; before that what is known of it.
    swing: f32,
    is_learned: bool,
    /// Samples since the last rising edge, and between the last two; 0 before the second.
    since_edge: u32,
    between_edges: u32,
}

/// Edges are taken at this part of the usual swing above the valley or below the crest. A half is the
/// steepest place of a sine; noise then has to be half the swing to make an edge.
const EDGE_LEVEL: f32 = 0.5;
/// The usual swing follows each swing by this part,
const SWING_FOLLOWS: f32 = 0.25;
/// and one swing moves it by this part at most: the gap of a variable-reluctance wheel swings three times as far.
const SWING_MOVES: f32 = 0.25;
/// Without an edge for this many usual intervals the usual swing is halved: the signal has become smaller.
const SILENT_INTERVALS: u32 = 8;

impl LevelDetector {
    /// Takes the next sample of the level, at a constant sample rate.
    ///
    /// Returns `Some(part)` at a rising edge: it came this part of a sample interval (0 to 1) *before* this sample,
    /// by linear interpolation. Levels that are not numbers are passed over.
    pub fn step(&self, state: &mut LevelDetectorState, level: f32) -> Option<f32> {
        if !level.is_finite() {
            return None;
        }
        let Some(before) = state.level.replace(level) else {
            state.extreme = level;
            return None;
        };
        state.since_edge = state.since_edge.saturating_add(1);
        if state.between_edges > 0 && state.since_edge / SILENT_INTERVALS > state.between_edges {
            state.swing *= 0.5;
            state.is_learned = state.swing > self.least_swing;
            state.since_edge = 0;
        }
        let half = EDGE_LEVEL * state.swing;
        let step = if half > self.least_swing {
            half
        } else {
            self.least_swing
        };
        if state.high {
            if level > state.extreme {
                state.extreme = level;
            }
            if level < state.extreme - step {
                state.high = false;
                state.crest = Some(state.extreme);
                if !state.is_learned {
                    // The first climb may have begun before the record.
                    state.swing = state.extreme - state.valley;
                }
                state.extreme = level;
            }
            return None;
        }
        if level < state.extreme {
            state.extreme = level;
        }
        let threshold = state.extreme + step;
        if level < threshold {
            return None;
        }
        if let Some(crest) = state.crest {
            state.learn(crest - state.extreme);
            state.between_edges = state.since_edge;
        }
        state.high = true;
        state.valley = state.extreme;
        state.extreme = level;
        state.since_edge = 0;
        // The valley itself may be the sample before; the level then rises from it to here.
        let part = (level - threshold) / (level - before);
        Some(part.clamp(0.0, 1.0))
    }
}

impl LevelDetectorState {
    /// Lets the usual swing follow a fall from crest to valley.
    fn learn(&mut self, swing: f32) {
        if self.is_learned {
            let bound = SWING_MOVES * self.swing;
            self.swing += (SWING_FOLLOWS * (swing - self.swing)).clamp(-bound, bound);
        } else {
            self.swing = swing;
            self.is_learned = true;
        }
    }
}
