//! The spindle angle as a function of time: pieces of constant angular acceleration.

/// The kind of a piece of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Steady rotation, or a ramp of at most 50 % of the speed per second.
    Gentle,
    /// A run-up, a stop, a change of speed that is faster than that.
    Rapid,
    /// The spindle stands.
    Standstill,
}

/// A piece of constant angular acceleration.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    pub(crate) kind: Kind,
    /// Start, s.
    pub(crate) start: f64,
    /// Duration, s.
    pub(crate) duration: f64,
    /// Angle at the start, revolutions.
    pub(crate) angle: f64,
    /// Speed at the start, revolutions per second.
    pub(crate) speed: f64,
    /// Change of the speed, revolutions per second squared.
    pub(crate) acceleration: f64,
}

impl Piece {
    pub(crate) fn end(&self) -> f64 {
        self.start + self.duration
    }

    fn angle_after(&self, time: f64) -> f64 {
        self.angle + time * (self.speed + 0.5 * self.acceleration * time)
    }
}

/// The motion of a spindle from standstill at time 0.1 s.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    pub(crate) pieces: Vec<Piece>,
}

impl Motion {
    pub(crate) fn new(angle: f64) -> Self {
        Self {
            pieces: vec![Piece {
                kind: Kind::Standstill,
                start: 0.1,
                duration: 0.01,
                angle,
                speed: 0.0,
                acceleration: 0.0,
            }],
        }
    }

    fn last(&self) -> &Piece {
        &self.pieces[self.pieces.len() - 1]
    }

    /// Appends a piece at whose end the speed is `speed`, in revolutions per second.
    pub(crate) fn then(&mut self, duration: f64, speed: f64) {
        let last = self.last();
        let before = last.speed + last.acceleration * last.duration;
        let acceleration = (speed - before) / duration;
        let slowest = before.min(speed);
        let kind = if before == 0.0 && speed == 0.0 {
            Kind::Standstill
        } else if acceleration.abs() <= 0.500_001 * slowest {
            Kind::Gentle
        } else {
            Kind::Rapid
        };
        self.pieces.push(Piece {
            kind,
            start: last.end(),
            duration,
            angle: last.angle_after(last.duration),
            speed: before,
            acceleration,
        });
    }

    pub(crate) fn end(&self) -> f64 {
        self.last().end()
    }

    fn piece(&self, time: f64) -> &Piece {
        let after = self.pieces.partition_point(|piece| piece.start <= time);
        &self.pieces[after.max(1) - 1]
    }

    /// Angle in revolutions.
    pub(crate) fn angle(&self, time: f64) -> f64 {
        let piece = self.piece(time);
        piece.angle_after(time - piece.start)
    }

    /// Speed in revolutions per second.
    pub(crate) fn speed(&self, time: f64) -> f64 {
        let piece = self.piece(time);
        piece.speed + piece.acceleration * (time - piece.start)
    }

    /// The time at which the spindle first has an angle; `None` where it never has it.
    pub(crate) fn time_of(&self, angle: f64) -> Option<f64> {
        let after = self.pieces.partition_point(|piece| piece.angle < angle);
        let piece = &self.pieces[after.max(1) - 1];
        let ahead = angle - piece.angle;
        let square = piece.speed * piece.speed + 2.0 * piece.acceleration * ahead;
        let root = square.max(0.0).sqrt();
        (piece.speed + root > 0.0)
            .then(|| piece.start + 2.0 * ahead / (piece.speed + root))
            .filter(|&time| ahead >= 0.0 && time <= piece.end() + 1e-9)
    }

    /// Starts and ends of the spans of steady rotation and of gentle ramps, s.
    pub(crate) fn gentle_spans(&self) -> Vec<(f64, f64)> {
        let gentle = self.pieces.iter().filter(|piece| piece.kind == Kind::Gentle);
        gentle.map(|piece| (piece.start, piece.end())).collect()
    }
}
