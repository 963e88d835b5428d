//! The newest accepted edges of a wheel: pitch over a revolution, speed and acceleration.

use crate::math::sqrt;
use crate::units::Nanoseconds;

/// Longest base of an estimate, in positions of the wheel. Up to this number of positions a base is a whole revolution, so that marks
/// of different length cancel.
pub(super) const BASE: u16 = 8;
/// Two bases and the newest edge.
const EDGES: usize = 2 * BASE as usize + 1;

/// The newest accepted edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RecentEdges {
    /// Number of each position, counted without end, in a ring. Only differences matter, so that it may wrap.
    numbers: [u32; EDGES],
    times: [Nanoseconds; EDGES],
    /// Place of the newest edge in the ring; the older ones follow.
    head: u8,
    filled: u8,
}

/// Speed and acceleration at the newest edge, from the angles of three edges: θ = v·t + ½·a·t².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Ramp {
    /// Positions per ns.
    pub(super) speed: f32,
    /// Positions per ns².
    pub(super) acceleration: f32,
}

impl RecentEdges {
    pub(super) const fn new() -> Self {
        Self {
            numbers: [0; EDGES],
            times: [Nanoseconds(0); EDGES],
            head: 0,
            filled: 0,
        }
    }

    pub(super) fn push(&mut self, number: u64, time: Nanoseconds) {
        self.head = self.head.checked_sub(1).unwrap_or(EDGES as u8 - 1);
        let place = self.place(0);
        (self.numbers[place], self.times[place]) = (number as u32, time);
        self.filled = (self.filled + 1).min(EDGES as u8);
    }

    /// Place in the ring of the edge before which `age` newer ones came.
    fn place(&self, age: usize) -> usize {
        (usize::from(self.head) + age) % EDGES
    }

    /// Time of the newest edge.
    pub(super) fn newest(&self) -> Option<Nanoseconds> {
        (self.filled > 0).then_some(self.times[self.place(0)])
    }

    /// Positions from the edge of this age to the newest.
    fn passed(&self, age: usize) -> u32 {
        self.numbers[self.place(0)].wrapping_sub(self.numbers[self.place(age)])
    }

    /// Positions and ns from the newest edge that is at least `positions` old, or from the oldest, to the newest.
    fn back(&self, positions: u16) -> Option<(f32, f32)> {
        let oldest = usize::from(self.filled)
            .checked_sub(1)
            .filter(|&oldest| oldest > 0)?;
        // An edge of this age is at least as many positions old.
        let mut age = usize::from(positions).min(oldest);
        while age > 1 && self.passed(age - 1) >= u32::from(positions) {
            age -= 1;
        }
        let lasted_ns = self.times[self.place(0)].seconds_since(self.times[self.place(age)]) * 1e9;
        (lasted_ns > 0.0).then_some((self.passed(age) as f32, lasted_ns))
    }

    /// Mean time per position over the last revolution, or over [`BASE`] positions of a large wheel, in ns.
    pub(super) fn pitch_ns(&self, positions: u16) -> Option<f32> {
        let (passed, lasted_ns) = self.back(positions.min(BASE))?;
        Some(lasted_ns / passed)
    }

    /// Speed and acceleration over the last two revolutions; `None` before there are three edges.
    pub(super) fn ramp(&self, positions: u16) -> Option<Ramp> {
        let base = positions.min(BASE);
        let oldest = usize::from(self.filled).checked_sub(1)?;
        let reach = self.passed(oldest).min(u32::from(u16::MAX)) as u16;
        let half = base.min(reach / 2).max(1);
        let (near, near_ns) = self.back(half)?;
        let (far, far_ns) = self.back(2 * half)?;
        let between_ns = far_ns - near_ns;
        if between_ns <= 0.0 {
            return None;
        }
        let (new, old) = (near / near_ns, (far - near) / between_ns);
        let acceleration = 2.0 * (new - old) / far_ns;
        let speed = new + 0.5 * acceleration * near_ns;
        (speed > 0.0).then_some(Ramp { speed, acceleration })
    }
}

impl Ramp {
    /// Time in ns from the newest edge to the one `positions` later: the root of θ = v·t + ½·a·t². A spindle that stops before has none;
    /// the time at constant speed stands for it.
    pub(super) fn time_to_ns(&self, positions: f32) -> f32 {
        let square = self.speed * self.speed + 2.0 * self.acceleration * positions;
        if square > 0.0 {
            2.0 * positions / (self.speed + sqrt(square))
        } else {
            positions / self.speed
        }
    }

    /// Positions from the newest edge to `time_ns` later. After a stop the angle stays.
    pub(super) fn positions_after(&self, time_ns: f32) -> f32 {
        let time_ns = self.until_stop_ns(time_ns);
        time_ns * (self.speed + 0.5 * self.acceleration * time_ns)
    }

    /// Speed `time_ns` after the newest edge, in positions per ns.
    pub(super) fn speed_after(&self, time_ns: f32) -> f32 {
        self.speed + self.acceleration * self.until_stop_ns(time_ns)
    }

    fn until_stop_ns(&self, time_ns: f32) -> f32 {
        if self.acceleration < 0.0 {
            time_ns.min(self.speed / -self.acceleration)
        } else {
            time_ns
        }
    }
}
