//! Tachometer: level to edges, edges to spindle speed and phase.
//!
//! | part | does |
//! |---|---|
//! | [`LevelDetector`] | rising edges of a level |
//! | `Train` | regular intervals among the newest pulses: starts a lock, and replaces one that the pulses contradict |
//! | `Lock` | position of each edge on the wheel, place of the gap |
//! | `RecentEdges` | pitch, speed and acceleration from whole revolutions |
//! | [`EventClock`] | time and period of the positions at constant speed, with their uncertainty |
//!
//! The work per edge is fixed. An edge before the preceding one (a clock that jumped) starts everything anew.

mod level;
mod lock;
mod recent_edges;
mod train;
mod wheel;

pub use level::{LevelDetector, LevelDetectorState};
pub use wheel::Wheel;

use serde::{Deserialize, Serialize};

use crate::event_clock::EventClock;
use crate::units::{Nanoseconds, Rpm};
use lock::{JITTER_PITCHES, Lock, Outcome};
use train::{FASTER_INTERVALS, Train, agreeing_intervals};

/// A rising edge of the tachometer, on the device's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Edge {
    /// When it came.
    pub time: Nanoseconds,
}

/// An angle of the spindle since the tachometer locked: whole turns above, 2⁻³² turns below.
///
/// Integers, so that the fraction keeps its resolution after days of running.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Turns(pub u64);

impl Turns {
    /// One turn.
    pub const ONE: Self = Self(1 << 32);

    /// The fraction of a turn, in 2⁻³² turns.
    pub fn fraction(self) -> u32 {
        self.0 as u32
    }
}

/// Spindle phase as a straight line about one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phase {
    /// The instant.
    pub time: Nanoseconds,
    /// The angle at that instant.
    pub angle: Turns,
    /// Turns per second.
    pub turns_per_second: f32,
    /// Standard deviation of the angle, in turns: between pulses it is an estimate.
    pub deviation_turns: f32,
}

/// What one edge was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EdgeKind {
    /// Before the tachometer locked.
    Searching,
    /// As expected, possibly after edges that were missing.
    Accepted,
    /// Where none can be: a double edge or a disturbance. It changes nothing.
    Rejected,
}

/// Follows the edges of a wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tachometer {
    wheel: Wheel,
    line: EventClock,
}

/// Where a [`Tachometer`] stands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TachometerState {
    train: Train,
    lock: Option<Lock>,
    /// Spindle speed over the last whole turn.
    turn_speed: Option<Rpm>,
    /// Speed over the turn before that.
    previous_turn_speed: Option<Rpm>,
    /// Whole turns timed since the start.
    turns: u32,
    /// Edges rejected since the start.
    rejected: u32,
    /// Edges missing since the start.
    missed: u32,
    /// Times the lock was lost.
    losses: u32,
}

/// Angle of the edge at which the tachometer locked, in turns: so that angles before it are none below 0.
const FIRST_TURN: u64 = 1024;
/// So many misfits in a row and it is the lock that is wrong.
const MISFITS_AT_MOST: u8 = 4;
/// The tachometer is lost when no edge came for this many times the longest regular interval.
const LOST_INTERVALS: f32 = 2.5;
/// Standard deviation of the pitch at the lock, as a part of it: alike intervals differ by up to a half.
const PITCH_UNCERTAINTY: f32 = 0.25;
/// Turns after which an edge weighs 1/e. Long against jitter, short against changes of speed.
const MEMORY_TURNS: f32 = 4.0;
/// With few positions the memory is at least this many edges.
const MEMORY_EDGES: f32 = 8.0;

impl Tachometer {
    /// A tachometer with this wheel.
    ///
    /// Returns `None` for a wheel without positions, and for one with less than four teeth beside its gap or a gap of 100 positions or
    /// more.
    pub fn new(wheel: Wheel) -> Option<Self> {
        let whole = wheel.missing == 0 && wheel.positions >= 1;
        let gapped =
            wheel.missing > 0 && wheel.positions >= wheel.missing.saturating_add(4) && wheel.missing < 100;
        (whole || gapped).then(|| {
            let edges = MEMORY_TURNS * f32::from(wheel.teeth());
            let memory = if edges > MEMORY_EDGES { edges } else { MEMORY_EDGES };
            Self {
                wheel,
                line: EventClock {
                    memory,
                    period_uncertainty: PITCH_UNCERTAINTY / JITTER_PITCHES,
                },
            }
        })
    }

    /// The wheel.
    pub fn wheel(&self) -> Wheel {
        self.wheel
    }

    /// Takes the next edge. Edges come in the order of their time.
    #[inline(never)]
    pub fn observe(&self, state: &mut TachometerState, edge: Edge) -> EdgeKind {
        if state.train.is_after(edge.time) {
            state.lose();
        }
        self.expire(state, edge.time);
        let is_pulse = state.train.push(edge.time);
        let Some(lock) = &mut state.lock else {
            return self.search(state, edge.time, is_pulse);
        };
        let outcome = if is_pulse {
            lock.observe(self.wheel, &self.line, edge.time)
        } else {
            Outcome::Rejected
        };
        if self.replace(state, edge.time) {
            return EdgeKind::Accepted;
        }
        self.count(state, outcome)
    }

    /// Gives up the lock when no edge came for too long before `now`.
    pub fn expire(&self, state: &mut TachometerState, now: Nanoseconds) {
        let Some(lock) = &state.lock else { return };
        let longest = (f32::from(self.wheel.missing) + 1.0) * LOST_INTERVALS;
        let longest_ns = longest * lock.pitch_ns;
        let is_late = |since: Nanoseconds| now.seconds_since(since) * 1e9 > longest_ns;
        if state.train.newest().is_none_or(is_late) {
            state.lose();
        } else if is_late(lock.edge) {
            // Pulses still come: they are those of another speed.
            state.lose_lock();
        }
    }

    /// Looks for regular intervals.
    fn search(&self, state: &mut TachometerState, time: Nanoseconds, is_pulse: bool) -> EdgeKind {
        state.lock = state
            .train
            .regular(self.wheel)
            .filter(|_| is_pulse)
            .and_then(|intervals| Lock::new(self.wheel, &self.line, time, intervals));
        if state.lock.is_some() {
            EdgeKind::Accepted
        } else {
            EdgeKind::Searching
        }
    }

    /// Counts what became of an edge, and times the turn that it ends.
    fn count(&self, state: &mut TachometerState, outcome: Outcome) -> EdgeKind {
        let steps = match outcome {
            Outcome::Rejected => {
                state.rejected = state.rejected.saturating_add(1);
                return EdgeKind::Rejected;
            }
            Outcome::Accepted(steps) => steps,
            Outcome::Resynchronized(steps) => {
                (state.turn_speed, state.previous_turn_speed) = (None, None);
                state.losses = state.losses.saturating_add(1);
                steps
            }
        };
        state.missed = state.missed.saturating_add(u32::from(steps.missed));
        if let Some((turns, seconds)) = state.lock.as_mut().and_then(|lock| lock.take_turns(self.wheel)) {
            state.previous_turn_speed = state.turn_speed;
            state.turn_speed = Some(Rpm(60.0 * turns as f32 / seconds));
            state.turns = state.turns.saturating_add(turns);
        }
        EdgeKind::Accepted
    }

    /// Replaces or gives up a lock that the newest pulses contradict. True where it is replaced.
    fn replace(&self, state: &mut TachometerState, time: Nanoseconds) -> bool {
        let Some(lock) = &mut state.lock else {
            return false;
        };
        let pitch_ns = 1.0 / lock.speed(self.wheel);
        // One mark that comes twice or half as often: two intervals may also come of one pulse too many, or of two missing ones.
        let doubtful = lock.misfits >= 2 || state.train.is_faster(FASTER_INTERVALS - 1, pitch_ns);
        lock.is_doubtful = self.wheel.positions == 1 && doubtful;
        let unfit = lock.is_unfit(agreeing_intervals(self.wheel));
        let regular = state.train.regular(self.wheel).filter(|_| unfit);
        let other = regular.or_else(|| state.train.contradiction(self.wheel, pitch_ns));
        if let Some(intervals) = other {
            let lock = Lock::new(self.wheel, &self.line, time, intervals);
            state.lose_lock();
            state.lock = lock;
            return true;
        }
        if lock.misfits >= MISFITS_AT_MOST {
            state.lose_lock();
        }
        false
    }
}

impl TachometerState {
    /// Before the first edge.
    pub const fn new() -> Self {
        Self {
            train: Train::new(),
            lock: None,
            turn_speed: None,
            previous_turn_speed: None,
            turns: 0,
            rejected: 0,
            missed: 0,
            losses: 0,
        }
    }

    /// Forgets lock and pulses: those before a stop say nothing of those after it.
    fn lose(&mut self) {
        self.train = Train::new();
        if self.lock.is_some() {
            self.lose_lock();
        }
    }

    fn lose_lock(&mut self) {
        self.lock = None;
        self.turn_speed = None;
        self.previous_turn_speed = None;
        self.losses = self.losses.saturating_add(1);
    }
}

impl Tachometer {
    /// Spindle phase as a line about `time`; `None` while the tachometer searches or is lost, and before the gap of the wheel has passed.
    pub fn phase(&self, state: &TachometerState, time: Nanoseconds) -> Option<Phase> {
        let lock = state.lock.as_ref().filter(|lock| !lock.is_doubtful)?;
        let (turns, positions, positions_per_ns) = lock.angle(self.wheel, time)?;
        let all = f32::from(self.wheel.positions);
        let whole = (turns + FIRST_TURN) << 32;
        let beyond = positions / all * 4_294_967_296.0;
        let angle = if beyond >= 0.0 {
            whole.wrapping_add(beyond as u64)
        } else {
            whole.saturating_sub((-beyond) as u64)
        };
        let turns_per_second = positions_per_ns * 1e9 / all;
        Some(Phase {
            time,
            angle: Turns(angle),
            turns_per_second,
            deviation_turns: lock.deviation_ns(time) * 1e-9 * turns_per_second,
        })
    }

    /// Spindle speed at the newest edge; `None` while the tachometer searches or is lost, and while the newest pulses contradict it.
    pub fn speed(&self, state: &TachometerState) -> Option<Rpm> {
        let lock = state.lock.as_ref().filter(|lock| !lock.is_doubtful)?;
        Some(Rpm(
            60e9 * lock.speed(self.wheel) / f32::from(self.wheel.positions)
        ))
    }
}

impl TachometerState {
    /// Spindle speed over the last whole turn, from mark to mark.
    pub fn turn_speed(&self) -> Option<Rpm> {
        self.turn_speed
    }

    /// Change of speed from the last turn but one to the last, as a fraction of the speed.
    pub fn change_per_turn(&self) -> Option<f32> {
        let (Some(Rpm(new)), Some(Rpm(old))) = (self.turn_speed, self.previous_turn_speed) else {
            return None;
        };
        Some((new - old) / old)
    }

    /// Whole turns timed since the start; [`Self::turn_speed`] is new when this counts up.
    pub fn turns(&self) -> u32 {
        self.turns
    }

    /// Edges rejected since the start.
    pub fn rejected(&self) -> u32 {
        self.rejected
    }

    /// Edges that were missing since the start.
    pub fn missed(&self) -> u32 {
        self.missed
    }

    /// Times the lock was lost since the start.
    pub fn losses(&self) -> u32 {
        self.losses
    }
}
