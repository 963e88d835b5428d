//! Tachometer: level to edges, edges to spindle speed and phase.

mod level;

pub use level::{LevelDetector, LevelDetectorState};

use serde::{Deserialize, Serialize};

use crate::event_clock::{EventClock, EventClockState};
use crate::units::{Nanoseconds, Rpm};

/// A rising edge of the tachometer, on the device's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Edge {
    /// When it came.
    pub time: Nanoseconds,
}

/// The wheel that makes the pulses: one mark, or a toothed wheel with a gap such as 60−2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Wheel {
    /// Positions on the wheel, at least 1.
    pub positions: u16,
    /// This many positions in a row are missing; the first edge after them is immersion angle 0 of tooth 1.
    pub missing: u16,
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

/// Edges remembered while the tachometer searches: enough for a median that one gap cannot move.
const REMEMBERED: usize = 5;

/// Where a [`Tachometer`] stands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TachometerState {
    /// Time of the newest edge, whatever it was.
    newest: Option<Nanoseconds>,
    /// The last intervals between edges, while searching.
    intervals_ns: [f32; REMEMBERED],
    /// How many of them are there.
    remembered: u8,
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

/// A wheel whose position is known.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Lock {
    /// Events are the positions of the wheel, the missing ones included.
    line: EventClockState,
    /// Position of the newest accepted edge, 0 for the first after the gap.
    position: u16,
    /// Time of the newest accepted edge.
    edge: Nanoseconds,
    /// Usual time from one position to the next, in ns. Slower than the line, so that no few edges mislead it.
    pitch_ns: f32,
    /// Length of the gap in pitches, as this sensor sees it.
    gap_pitches: f32,
    /// Time of the newest edge at position 0.
    mark: Option<Nanoseconds>,
    /// Edges or gaps in a row that did not fit.
    misfits: u8,
}

/// Angle of the edge at which the tachometer locked, in turns: so that angles before it are none below 0.
const FIRST_TURN: u64 = 1024;
/// Accepted edges lie within this many pitches of where they are expected. A wheel's teeth are off by
/// much less; the teeth beside the gap of a variable-reluctance sensor by 0.4.
const TOLERANCE_PITCHES: f32 = 0.45;
/// So many misfits in a row and it is the lock that is wrong.
const MISFITS_AT_MOST: u8 = 4;
/// Intervals agree when they differ by less than this fraction.
const AGREEMENT: f32 = 0.25;
/// The tachometer is lost when no edge came for this many times the longest regular interval.
const LOST_INTERVALS: f32 = 2.5;
/// The usual pitch follows each interval by this part,
const PITCH_FOLLOWS: f32 = 0.25;
/// and believes a change of this fraction at most: beside a gap an interval is off by a quarter.
const PITCH_MOVES: f32 = 0.2;
/// The learnt length of the gap follows each gap by this part.
const GAP_FOLLOWS: f32 = 0.25;
/// Standard deviation of an edge expected before any was seen, in pitches.
const JITTER_PITCHES: f32 = 0.001;
/// Turns after which an edge weighs 1/e. Long against jitter, short against changes of speed.
const MEMORY_TURNS: f32 = 4.0;
/// With few positions the memory is at least this many edges.
const MEMORY_EDGES: f32 = 8.0;

impl Tachometer {
    /// A tachometer with this wheel.
    ///
    /// Returns `None` for a wheel without positions, and for one with less than two teeth beside its gap.
    pub fn new(wheel: Wheel) -> Option<Self> {
        let whole = wheel.missing == 0 && wheel.positions >= 1;
        let gapped =
            wheel.missing > 0 && wheel.positions >= wheel.missing.saturating_add(4) && wheel.missing < 100;
        (whole || gapped).then(|| {
            let edges = MEMORY_TURNS * f32::from(wheel.positions - wheel.missing);
            let memory = if edges > MEMORY_EDGES { edges } else { MEMORY_EDGES };
            Self {
                wheel,
                line: EventClock {
                    memory,
                    period_uncertainty: AGREEMENT / JITTER_PITCHES,
                },
            }
        })
    }

    /// The wheel.
    pub fn wheel(&self) -> Wheel {
        self.wheel
    }

    fn teeth(&self) -> u16 {
        self.wheel.positions - self.wheel.missing
    }

    /// Takes the next edge. Edges come in the order of their time.
    pub fn observe(&self, state: &mut TachometerState, edge: Edge) -> EdgeKind {
        self.expire(state, edge.time);
        let kind = match &mut state.lock {
            None => self.search(state, edge.time),
            Some(_) => self.follow(state, edge.time),
        };
        state.newest = Some(edge.time);
        kind
    }

    /// Gives up the lock when no edge came for too long before `now`.
    pub fn expire(&self, state: &mut TachometerState, now: Nanoseconds) {
        let Some(lock) = &state.lock else { return };
        let longest = (f32::from(self.wheel.missing) + 1.0) * LOST_INTERVALS;
        let waited_ns = now.seconds_since(lock.edge) * 1e9;
        if waited_ns > longest * lock.pitch_ns {
            state.lose();
        }
    }

    /// Looks for a steady train, and for the gap in it where the wheel has one.
    fn search(&self, state: &mut TachometerState, time: Nanoseconds) -> EdgeKind {
        let Some(newest) = state.newest else {
            return EdgeKind::Searching;
        };
        let interval_ns = time.seconds_since(newest) * 1e9;
        let known = usize::from(state.remembered).min(REMEMBERED);
        let before = state.intervals_ns;
        state.intervals_ns.rotate_right(1);
        if let Some(first) = state.intervals_ns.first_mut() {
            *first = interval_ns;
        }
        state.remembered = (known + 1).min(REMEMBERED) as u8;

        let (pitch_ns, gap_pitches) = if self.wheel.missing == 0 {
            let Some(pitch) = agreed(state.intervals_ns.get(..known + 1).unwrap_or(&[])) else {
                return EdgeKind::Searching;
            };
            (pitch, 1.0)
        } else {
            if known < REMEMBERED {
                return EdgeKind::Searching;
            }
            let pitch = median(before);
            let gap = interval_ns / pitch;
            if !self.is_gap(gap) {
                return EdgeKind::Searching;
            }
            (pitch, gap)
        };
        state.lock = Some(Lock {
            line: self.line.start(time, pitch_ns, JITTER_PITCHES * pitch_ns),
            position: 0,
            edge: time,
            pitch_ns,
            gap_pitches,
            mark: Some(time),
            misfits: 0,
        });
        state.remembered = 0;
        EdgeKind::Accepted
    }

    /// True where an interval of this many pitches is the gap. Beside the gap a variable-reluctance
    /// sensor moves its edges by up to ¾ pitch.
    fn is_gap(&self, pitches: f32) -> bool {
        let missing = f32::from(self.wheel.missing);
        pitches > 1.0 + 0.6 * missing && pitches < 1.0 + 1.6 * missing
    }

    /// Goes on with the next edge of a locked wheel.
    fn follow(&self, state: &mut TachometerState, time: Nanoseconds) -> EdgeKind {
        let Some(lock) = &mut state.lock else {
            return EdgeKind::Searching;
        };
        let pitches = time.seconds_since(lock.edge) * 1e9 / lock.pitch_ns;
        let Some(steps) = self.steps(lock, pitches) else {
            state.rejected = state.rejected.saturating_add(1);
            lock.misfits += 1;
            if lock.misfits >= MISFITS_AT_MOST {
                state.lose();
            }
            return EdgeKind::Rejected;
        };
        if steps.positions == self.wheel.missing + 1 && steps.missed == 0 {
            lock.gap_pitches += GAP_FOLLOWS * (pitches - lock.gap_pitches);
        }
        let over_gap = steps.positions > steps.missed + 1;
        if !over_gap {
            let ratio = pitches / f32::from(steps.positions);
            lock.pitch_ns *= 1.0 + PITCH_FOLLOWS * (ratio - 1.0).clamp(-PITCH_MOVES, PITCH_MOVES);
        }
        let passed = lock.position.saturating_add(steps.positions);
        let turned = passed >= self.wheel.positions;
        lock.position = passed % self.wheel.positions;
        state.missed = state.missed.saturating_add(u32::from(steps.missed));
        lock.misfits = if steps.missed == 0 { 0 } else { lock.misfits + 1 };
        self.line
            .observe(&mut lock.line, u32::from(steps.positions), time);
        lock.edge = time;
        if turned {
            let mark = (lock.position == 0).then_some(time);
            if let (Some(last), Some(mark)) = (lock.mark, mark) {
                state.previous_turn_speed = state.turn_speed;
                state.turn_speed = Some(Rpm(60.0 / mark.seconds_since(last)));
                state.turns = state.turns.saturating_add(1);
            }
            lock.mark = mark;
        }
        if lock.misfits >= MISFITS_AT_MOST {
            state.lose();
        }
        EdgeKind::Accepted
    }

    /// How far the wheel went in an interval of this many pitches; `None` where no tooth can be.
    fn steps(&self, lock: &Lock, pitches: f32) -> Option<Steps> {
        // Over the gap one step is as long as this sensor sees it.
        let last = lock.position + 1 == self.teeth();
        let (start, stretch) = if self.wheel.missing > 0 && last {
            (self.wheel.missing, lock.gap_pitches - 1.0)
        } else {
            (0, 0.0)
        };
        let whole = (pitches - stretch + 0.5) as u16;
        let off = pitches - stretch - f32::from(whole);
        if whole == 0 || !(-TOLERANCE_PITCHES..=TOLERANCE_PITCHES).contains(&off) {
            return None;
        }
        let passed = lock.position.saturating_add(start).saturating_add(whole);
        if self.wheel.missing > 0 && passed >= self.teeth() {
            // Over the gap: only positions that carry a tooth can make an edge.
            if passed < self.wheel.positions {
                return None;
            }
            let missed = whole - 1 - (self.wheel.missing - start);
            return Some(Steps {
                positions: start + whole,
                missed,
            });
        }
        Some(Steps {
            positions: whole,
            missed: whole - 1,
        })
    }
}

/// How far the wheel went between two edges.
struct Steps {
    positions: u16,
    missed: u16,
}

impl TachometerState {
    /// Before the first edge.
    pub const fn new() -> Self {
        Self {
            newest: None,
            intervals_ns: [0.0; REMEMBERED],
            remembered: 0,
            lock: None,
            turn_speed: None,
            previous_turn_speed: None,
            turns: 0,
            rejected: 0,
            missed: 0,
            losses: 0,
        }
    }

    fn lose(&mut self) {
        self.lock = None;
        self.remembered = 0;
        self.turn_speed = None;
        self.previous_turn_speed = None;
        self.losses = self.losses.saturating_add(1);
    }
}

impl Tachometer {
    /// Spindle phase as a line about `time`; `None` while the tachometer searches or is lost.
    pub fn phase(&self, state: &TachometerState, time: Nanoseconds) -> Option<Phase> {
        let lock = state.lock.as_ref()?;
        if lock.line.observations() < 2 {
            return None;
        }
        let positions = f32::from(self.wheel.positions);
        let events = lock.line.events_to(time);
        let turns = u64::from(self.wheel.positions);
        let index = lock.line.index();
        let whole = (index / turns + FIRST_TURN) << 32;
        let part = ((index % turns) << 32) / turns;
        let beyond = events / positions * 4_294_967_296.0;
        let angle = if beyond >= 0.0 {
            (whole + part).wrapping_add(beyond as u64)
        } else {
            (whole + part).saturating_sub((-beyond) as u64)
        };
        let per_second = 1e9 / (lock.line.period_ns() * positions);
        let deviation_ns = crate::math::sqrt(lock.line.variance_at_ns2(events));
        Some(Phase {
            time,
            angle: Turns(angle),
            turns_per_second: per_second,
            deviation_turns: deviation_ns * 1e-9 * per_second,
        })
    }

    /// Spindle speed now; `None` while the tachometer searches or is lost.
    pub fn speed(&self, state: &TachometerState) -> Option<Rpm> {
        let lock = state.lock.as_ref().filter(|lock| lock.line.observations() >= 2)?;
        Some(Rpm(
            60e9 / (lock.line.period_ns() * f32::from(self.wheel.positions))
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

/// The newest interval, where the newest two agree.
fn agreed(intervals_ns: &[f32]) -> Option<f32> {
    let (new, old) = (*intervals_ns.first()?, *intervals_ns.get(1)?);
    let difference = if new > old { new - old } else { old - new };
    (difference < AGREEMENT * new).then_some(new)
}

/// The middle one of five.
fn median(mut values: [f32; REMEMBERED]) -> f32 {
    values.sort_unstable_by(f32::total_cmp);
    values.get(REMEMBERED / 2).copied().unwrap_or(0.0)
}
