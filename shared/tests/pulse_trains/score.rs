//! What a tachometer says of a pulse train, against the motion that made the train.

use quietcut_core::tachometer::{Edge, Tachometer, TachometerState};
use quietcut_core::units::Nanoseconds;

use crate::motion::Motion;
use crate::sensor::Sensor;

/// The score of a pulse train, over its spans of gentle motion.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Score {
    /// Spans, and those in which the speed was never right.
    pub(crate) spans: u32,
    pub(crate) deaf: u32,
    /// Spans in which the speed was right too late, or the phase.
    pub(crate) late: u32,
    pub(crate) late_phase: u32,
    /// Times at which the speed was asked for after it is due, times at which it was off by more than 2 % or unknown, and at which
    /// the phase was off or unknown.
    pub(crate) asked: u32,
    pub(crate) off: u32,
    pub(crate) phase_off: u32,
    /// Longest time with half or double speed, in revolutions, from the first pulse of a span on.
    pub(crate) wrong_octave: f64,
}

impl Score {
    pub(crate) fn is_perfect(&self) -> bool {
        let Self {
            deaf,
            late,
            late_phase,
            off,
            ..
        } = self;
        deaf + late + late_phase + off == 0 && self.wrong_octave <= 2.0
    }

    pub(crate) fn add(&mut self, other: &Self) {
        self.spans += other.spans;
        self.deaf += other.deaf;
        self.late += other.late;
        self.late_phase += other.late_phase;
        self.asked += other.asked;
        self.off += other.off;
        self.phase_off += other.phase_off;
        self.wrong_octave = self.wrong_octave.max(other.wrong_octave);
    }
}

/// The speed is right within this part.
const SPEED: f64 = 0.02;
/// The angle is right within this part of the angle between two pulses.
const PHASE: f64 = 0.06;
/// Times per revolution at which the tachometer is asked.
const ASKED: f64 = 7.3;

/// Feeds the pulses of a motion, and asks for speed and phase on the way.
pub(crate) fn score(sensor: &Sensor, motion: &Motion, pulses: &[f64]) -> Score {
    let Some(tachometer) = Tachometer::new(sensor.wheel) else {
        return Score::default();
    };
    let mut state = TachometerState::default();
    let mut next = pulses.iter().peekable();
    let mut total = Score::default();
    for (start, end) in motion.gentle_spans() {
        let (first, last) = (motion.angle(start), motion.angle(end));
        let positions = f64::from(sensor.wheel.positions);
        // Speed within 3 revolutions or 6 marks, phase within 2 revolutions and a gap. A pulse is due up to one pitch later.
        let speed_due = 3.0_f64.max(6.0 / positions) + 1.0 / positions;
        let phase_due = if sensor.wheel.missing > 0 { 3.0 } else { 2.0 } + 1.5 / positions;
        let mut span = Score {
            spans: 1,
            ..Score::default()
        };
        let (mut ever, mut octave_since) = (false, None::<f64>);
        let mut first_right = None;
        let mut first_phase = None;
        for n in 0..((last - first) * ASKED) as u64 {
            let Some(now) = motion.time_of(first + (n as f64 + 0.5) / ASKED) else {
                continue;
            };
            while let Some(&&time) = next.peek()
                && time <= now
            {
                next.next();
                tachometer.observe(&mut state, edge(time));
            }
            tachometer.expire(&mut state, edge(now).time);
            let turned = motion.angle(now) - first;
            let said = tachometer.speed(&state).map(|rpm| f64::from(rpm.0) / 60.0);
            // What a tachometer knows of the speed is at most a pitch and a half old.
            let old = motion.speed((now - 1.5 / positions / motion.speed(now)).max(start));
            let (least, most) = (motion.speed(now).min(old), motion.speed(now).max(old));
            let right = said.is_some_and(|s| s > least * (1.0 - SPEED) && s < most * (1.0 + SPEED));
            let phase = tachometer.phase(&state, edge(now).time).is_some_and(|phase| {
                let angle = f64::from(phase.angle.fraction()) / 4_294_967_296.0;
                let round = if sensor.wheel.missing > 0 { 1.0 } else { positions };
                let error = (angle - motion.angle(now)) * round;
                (error - error.round()).abs() / round < PHASE / positions.min(8.0)
            });
            ever |= right;
            if right && first_right.is_none() {
                first_right = Some(turned);
            }
            if phase && first_phase.is_none() {
                first_phase = Some(turned);
            }
            if turned > speed_due {
                span.asked += 1;
                span.off += u32::from(!right);
                span.phase_off += u32::from(!phase);
            }
            let octave = said.is_some_and(|s| {
                let ratio = s / motion.speed(now);
                (ratio - 0.5).abs() < 0.05 || (ratio - 2.0).abs() < 0.2
            });
            let since = *octave_since.get_or_insert(turned.max(1.0 / positions));
            if octave {
                span.wrong_octave = span.wrong_octave.max(turned - since);
            } else {
                octave_since = None;
            }
        }
        span.deaf = u32::from(!ever);
        span.late = u32::from(first_right.is_none_or(|turned| turned > speed_due));
        span.late_phase = u32::from(first_phase.is_none_or(|turned| turned > phase_due));
        if last - first > speed_due + 2.0 {
            total.add(&span);
        }
    }
    total
}

fn edge(seconds: f64) -> Edge {
    Edge {
        time: Nanoseconds((seconds * 1e9).round() as u64),
    }
}
