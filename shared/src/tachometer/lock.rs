//! A wheel whose pitch is known: which position each edge is, and where the gap lies.

use super::recent_edges::{BASE, Ramp, RecentEdges};
use super::wheel::Wheel;
use crate::event_clock::{EventClock, EventClockState, Observation};
use crate::math::sqrt;
use crate::units::Nanoseconds;

/// Standard deviation of an edge expected at least before any was seen, in pitches.
pub(super) const JITTER_PITCHES: f32 = 0.001;
/// An edge belongs to the nearest position.
const TOLERANCE_PITCHES: f32 = 0.5;
/// An edge in the gap belongs to the tooth beside it within this many pitches: a variable-reluctance sensor moves the edges
/// there by up to 0.46 pitches. A tooth where none can be is a whole pitch away.
const BESIDE_GAP_PITCHES: f32 = 0.6;
/// With one mark there are no uneven marks, and an edge elsewhere is a disturbance or a change of speed. The tolerance then
/// covers jitter and a speed that wanders,
const ONE_MARK_TOLERANCE: f32 = 0.1;
/// and changes of the speed by this part per second: twice the steepest ramp that the tachometer follows without searching anew.
const SPEED_CHANGE_PER_SECOND: f32 = 1.0;
/// Part by which the mean square errors of prediction follow each error.
const ERROR_FOLLOWS: f32 = 0.25;
/// A ramp is taken where its mean square error is below this part of that of a line. A single late mark gives
/// both the same error, and the ramp a larger one with the next edge.
const RAMP_ERROR_SHARE: f32 = 0.5;
/// An error of prediction counts up to this, in pitches: beyond it the edge is no evidence of a ramp.
const LARGEST_ERROR: f32 = 0.5;
/// Part by which the mean square distance of the edges from their positions follows each.
const MISPLACEMENT_FOLLOWS: f32 = 0.125;
/// Mean square distance of the edges from their positions above which the pitch is wrong, in pitches². With a wrong pitch the distances
/// are uniform: 1/12. One mark of two that is late by 0.35 pitches makes 0.03.
const MISPLACEMENT_AT_MOST: f32 = 0.05;
/// Edges in a row, each after a missing one, that show a slower train. Two are not rare where pulses are missing at random.
const MISSED_IN_TURN: usize = 3;
/// Edges without a tooth in the gap after which it is the position of the gap that is wrong.
const NO_TEETH_AT_MOST: u8 = 3;

/// A wheel whose pitch is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lock {
    /// Events are the positions of the wheel, the missing ones included.
    pub(super) line: EventClockState,
    /// The newest accepted edges.
    edges: RecentEdges,
    /// Mean time per position over the last revolution, in ns.
    pub(super) pitch_ns: f32,
    /// Number of the position of the newest accepted edge, counted since the lock.
    number: u64,
    /// Number of the position of the newest edge of the line.
    lined: u64,
    /// Number of a position that is angle 0; `None` until the gap has passed.
    origin: Option<u64>,
    /// Number of the position after an interval like the gap where none is expected.
    other_origin: Option<u64>,
    /// Edges since the gap was last seen that fell where the wheel has no tooth.
    no_teeth: u8,
    /// Time of the newest accepted edge.
    pub(super) edge: Nanoseconds,
    /// Number and time of the newest edge at angle 0.
    mark: Option<(u64, Nanoseconds)>,
    /// Speed and acceleration at the newest edge.
    ramp: Option<Ramp>,
    /// Mean square errors of the predictions of the line and of the ramp, in pitches².
    line_error: f32,
    ramp_error: f32,
    /// Mean square distance of the edges from their positions, in pitches².
    misplacement: f32,
    /// Edges in a row that did not fit: rejected, or after one that is missing.
    pub(super) misfits: u8,
    /// One of them was rejected.
    is_off_wheel: bool,
    /// The newest pulses are those of a faster train, or of a disturbance: which, the next one tells.
    pub(super) is_doubtful: bool,
}

/// How far the wheel went between two edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Steps {
    positions: u16,
    pub(super) missed: u16,
}

/// The place of an edge on the wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    Tooth(Steps),
    /// The edge ends the first gap that is seen.
    FirstGap,
    /// This many positions further, where the wheel has no tooth.
    NoTooth {
        positions: u16,
    },
    /// Between two positions.
    Between,
}

/// The fate of an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Outcome {
    Accepted(Steps),
    Rejected,
    /// Accepted; the angles from here on do not continue those before.
    Resynchronized(Steps),
}

impl Lock {
    /// Locks to regular intervals that end at `time`, newest first, in ns.
    // Two callers, and flash is scarce.
    #[inline(never)]
    pub(super) fn new(
        wheel: Wheel,
        clock: &EventClock,
        time: Nanoseconds,
        intervals_ns: &[f32],
    ) -> Option<Self> {
        let mut back_ns: f32 = intervals_ns.iter().sum();
        let pitch_ns = back_ns / intervals_ns.len() as f32;
        let before = |back_ns: f32| Nanoseconds(time.0.saturating_sub((back_ns + 0.5) as u64));
        let oldest = before(back_ns);
        let uneven_ns = intervals_ns
            .iter()
            .map(|interval_ns| interval_ns - pitch_ns)
            .fold(JITTER_PITCHES * pitch_ns, |most, off| most.max(off).max(-off));
        let mut lock = Self {
            line: clock.start(oldest, pitch_ns, uneven_ns),
            edges: RecentEdges::new(),
            pitch_ns,
            number: 0,
            lined: 0,
            origin: (wheel.missing == 0).then_some(0),
            other_origin: None,
            no_teeth: 0,
            edge: oldest,
            mark: None,
            ramp: None,
            line_error: 0.0,
            ramp_error: 0.0,
            misplacement: 0.0,
            misfits: 0,
            is_off_wheel: false,
            is_doubtful: false,
        };
        lock.edges.push(0, oldest);
        for interval_ns in intervals_ns.iter().rev() {
            back_ns -= interval_ns;
            lock.advance(wheel, clock, 1, before(back_ns));
        }
        // The first turn begins here.
        lock.take_turns(wheel);
        (pitch_ns > 0.0).then_some(lock)
    }

    /// True where the newest edges do not lie on the wheel. `count` misfits in a row are evidence enough if one of them was rejected; if all
    /// came after a missing edge, [`MISSED_IN_TURN`].
    pub(super) fn is_unfit(&self, count: usize) -> bool {
        let enough = if self.is_off_wheel {
            count
        } else {
            count.max(MISSED_IN_TURN)
        };
        usize::from(self.misfits) >= enough || self.misplacement > MISPLACEMENT_AT_MOST
    }

    /// Speed at the newest edge, in positions per ns. That of few marks is the mean over the last revolution, in which uneven marks cancel.
    pub(super) fn speed(&self, wheel: Wheel) -> f32 {
        match self.steering_ramp() {
            Some(ramp) => ramp.speed,
            None if wheel.positions > BASE => 1.0 / self.line.period_ns(),
            None => 1.0 / self.pitch_ns,
        }
    }

    /// Positions from the newest accepted edge to `time`.
    fn ahead(&self, wheel: Wheel, time: Nanoseconds) -> f32 {
        match self.steering_ramp() {
            Some(ramp) => {
                ramp.positions_after(time.seconds_since(self.line.time()) * 1e9)
                    - self.number.saturating_sub(self.lined) as f32
            }
            None => {
                let pitch_ns = if wheel.positions > BASE {
                    self.line.period_ns()
                } else {
                    self.pitch_ns
                };
                let lined = self.number.saturating_sub(self.lined) as f32;
                time.seconds_since(self.line.time()) * 1e9 / pitch_ns - lined
            }
        }
    }

    /// The ramp, where it predicts the edges better than a line of constant speed.
    fn steering_ramp(&self) -> Option<&Ramp> {
        self.ramp
            .as_ref()
            .filter(|_| self.ramp_error < RAMP_ERROR_SHARE * self.line_error)
    }

    /// Takes an edge.
    pub(super) fn observe(&mut self, wheel: Wheel, clock: &EventClock, time: Nanoseconds) -> Outcome {
        let mut resynchronized = false;
        let mut place = self.place(wheel, time);
        if let Place::NoTooth { positions } = place
            && let Some(origin) = self.other_origin(wheel, positions, time)
        {
            self.origin = origin;
            (self.other_origin, self.mark, self.no_teeth) = (None, None, 0);
            resynchronized = true;
            place = self.place(wheel, time);
        }
        let steps = match place {
            Place::Tooth(steps) => steps,
            Place::FirstGap => {
                let positions = wheel.missing + 1;
                self.origin = Some(self.number + u64::from(positions));
                Steps { positions, missed: 0 }
            }
            Place::NoTooth { .. } | Place::Between => {
                self.misfits = self.misfits.saturating_add(1);
                self.is_off_wheel = true;
                return Outcome::Rejected;
            }
        };
        let off = self.ahead(wheel, time) - f32::from(steps.positions);
        if steps.missed == 0 {
            (self.misfits, self.is_off_wheel) = (0, false);
        } else {
            self.misfits = self.misfits.saturating_add(1);
        }
        self.notice_gap(wheel, time, steps);
        self.advance(wheel, clock, steps.positions, time);
        if !self.is_beside_gap(wheel) {
            self.misplacement += MISPLACEMENT_FOLLOWS * (off * off - self.misplacement);
        }
        if resynchronized {
            Outcome::Resynchronized(steps)
        } else {
            Outcome::Accepted(steps)
        }
    }

    /// The place of angle 0 that an edge shows where the wheel should have no tooth, `positions` further: behind an interval like the gap, or
    /// where such an interval was seen before. Some(None) where only the place known so far is refuted; `None` where the edge may be a
    /// disturbance.
    fn other_origin(&mut self, wheel: Wheel, positions: u16, time: Nanoseconds) -> Option<Option<u64>> {
        self.no_teeth += 1;
        if is_gap(wheel, self.raw_pitches(time)) {
            return Some(Some(self.number + u64::from(positions)));
        }
        (self.other_origin.is_some() || self.no_teeth >= NO_TEETH_AT_MOST).then_some(self.other_origin)
    }

    /// Position of the newest accepted edge, 0 for the first after the gap.
    fn position(&self, wheel: Wheel) -> Option<u16> {
        let since = self.number.checked_sub(self.origin?)?;
        Some((since % u64::from(wheel.positions)) as u16)
    }

    /// The place on the wheel of an edge at `time`.
    #[inline(never)]
    fn place(&self, wheel: Wheel, time: Nanoseconds) -> Place {
        let pitches = self.ahead(wheel, time);
        let position = self.position(wheel);
        if wheel.missing > 0 && position.is_none() && is_gap(wheel, self.raw_pitches(time)) {
            return Place::FirstGap;
        }
        let positions = (pitches + 0.5) as u16;
        let off = pitches - f32::from(positions);
        let tolerance = self.tolerance(wheel);
        if positions == 0 || !(-tolerance..=tolerance).contains(&off) {
            return Place::Between;
        }
        let Some(position) = position.filter(|_| wheel.missing > 0) else {
            return Place::Tooth(Steps {
                positions,
                missed: positions - 1,
            });
        };
        tooth_near_gap(wheel, position, positions, off)
    }

    fn tolerance(&self, wheel: Wheel) -> f32 {
        if wheel.positions > 1 {
            return TOLERANCE_PITCHES;
        }
        let turn_s = self.pitch_ns * 1e-9;
        (ONE_MARK_TOLERANCE + SPEED_CHANGE_PER_SECOND * turn_s).min(TOLERANCE_PITCHES)
    }

    /// Pitches from the newest edge itself, not from the line.
    fn raw_pitches(&self, time: Nanoseconds) -> f32 {
        time.seconds_since(self.edge) * 1e9 / self.pitch_ns
    }

    /// Remembers an interval like the gap that is elsewhere; forgets it once the gap is where it is expected.
    fn notice_gap(&mut self, wheel: Wheel, time: Nanoseconds, steps: Steps) {
        let Some(position) = self.position(wheel).filter(|_| wheel.missing > 0) else {
            return;
        };
        if position + 1 == wheel.teeth() && steps.missed == 0 {
            (self.other_origin, self.no_teeth) = (None, 0);
        } else if steps.missed > 0 && is_gap(wheel, self.raw_pitches(time)) {
            self.other_origin = Some(self.number + u64::from(steps.positions));
        }
    }

    /// True where a variable-reluctance sensor moves the newest edge: it is no evidence of the speed.
    fn is_beside_gap(&self, wheel: Wheel) -> bool {
        wheel.missing > 0
            && self
                .position(wheel)
                .is_some_and(|position| position == 0 || position + 1 == wheel.teeth())
    }

    /// Goes on to an edge that is `positions` further.
    // Several callers, and flash is scarce.
    #[inline(never)]
    fn advance(&mut self, wheel: Wheel, clock: &EventClock, positions: u16, time: Nanoseconds) {
        self.number = self.number.saturating_add(u64::from(positions));
        self.edge = time;
        if self.is_beside_gap(wheel) {
            return;
        }
        let steps = self.number.saturating_sub(self.lined).min(u64::from(u32::MAX)) as u32;
        let pitch_ns = self.line.period_ns();
        let learn = |error: &mut f32, off_ns: f32| {
            let off = (off_ns / pitch_ns).clamp(-LARGEST_ERROR, LARGEST_ERROR);
            *error += ERROR_FOLLOWS * (off * off - *error);
        };
        if let (Some(ramp), Some(before)) = (&self.ramp, self.edges.newest()) {
            let lasted_ns = time.seconds_since(before) * 1e9;
            learn(&mut self.ramp_error, lasted_ns - ramp.time_to_ns(steps as f32));
            learn(
                &mut self.line_error,
                (self.line.events_to(time) - steps as f32) * pitch_ns,
            );
        }
        self.edges.push(self.number, time);
        self.pitch_ns = self.edges.pitch_ns(wheel.positions).unwrap_or(self.pitch_ns);
        self.lined = self.number;
        let observation = clock.observe(&mut self.line, steps, time);
        self.ramp = self.edges.ramp(wheel.positions);
        let steers = match observation {
            // The newest interval alone, from which the line restarts, may be that of an uneven mark.
            Observation::Restarted => self.ramp.as_ref(),
            Observation::RateChanged if wheel.positions <= BASE => self.ramp.as_ref(),
            _ => self.steering_ramp(),
        };
        if let Some(ramp) = steers {
            let period_ns = 1.0 / ramp.speed;
            self.line.steer(period_ns);
        }
    }

    /// Whole turns and remaining positions from angle 0 to `time`, and the speed then in positions per ns; `None` until the gap has passed.
    pub(super) fn angle(&self, wheel: Wheel, time: Nanoseconds) -> Option<(u64, f32, f32)> {
        let origin = self.origin?;
        let (ahead, speed) = match self.steering_ramp() {
            Some(ramp) => {
                let since_ns = time.seconds_since(self.line.time()) * 1e9;
                (ramp.positions_after(since_ns), ramp.speed_after(since_ns))
            }
            None => (self.line.events_to(time), 1.0 / self.line.period_ns()),
        };
        let since = self.lined.checked_sub(origin)?;
        let positions = u64::from(wheel.positions);
        Some((since / positions, (since % positions) as f32 + ahead, speed))
    }

    /// Standard deviation of the time of the angle at `time`, in ns.
    pub(super) fn deviation_ns(&self, time: Nanoseconds) -> f32 {
        sqrt(self.line.variance_at_ns2(self.line.events_to(time)))
    }

    /// Whole turns and their duration in seconds since the preceding edge at angle 0, if the newest edge is at angle 0.
    pub(super) fn take_turns(&mut self, wheel: Wheel) -> Option<(u32, f32)> {
        if self.position(wheel) != Some(0) {
            return None;
        }
        let (number, time) = self.mark.replace((self.number, self.edge))?;
        let turns = self.number.saturating_sub(number) / u64::from(wheel.positions);
        let seconds = self.edge.seconds_since(time);
        (turns > 0 && seconds > 0.0).then_some((turns as u32, seconds))
    }
}

/// The tooth of an edge that lies `off` pitches after the position `positions` after `position`. An edge in the gap belongs to the
/// tooth beside it where it is close enough.
fn tooth_near_gap(wheel: Wheel, position: u16, positions: u16, off: f32) -> Place {
    let all = u32::from(wheel.positions);
    let mut passed = u32::from(position) + u32::from(positions);
    if let Some(into) = (passed % all)
        .checked_sub(u32::from(wheel.teeth()) - 1)
        .filter(|&into| into > 0)
    {
        let left = u32::from(wheel.missing) + 1 - into;
        if into as f32 + off < BESIDE_GAP_PITCHES {
            passed -= into;
        } else if left as f32 - off < BESIDE_GAP_PITCHES {
            passed += left;
        } else {
            return Place::NoTooth { positions };
        }
    }
    let positions = passed
        .saturating_sub(u32::from(position))
        .min(u32::from(u16::MAX)) as u16;
    let gaps = (passed / all).min(u32::from(u16::MAX)) as u16;
    let without = gaps.saturating_mul(wheel.missing).saturating_add(1);
    if positions == 0 {
        return Place::Between;
    }
    Place::Tooth(Steps {
        positions,
        missed: positions.saturating_sub(without),
    })
}

/// True where an interval of this many pitches is the gap, whose edges are moved by up to [`BESIDE_GAP_PITCHES`].
fn is_gap(wheel: Wheel, pitches: f32) -> bool {
    let missing = f32::from(wheel.missing);
    pitches > 1.0 + 0.6 * missing && pitches < 1.0 + 1.6 * missing
}
