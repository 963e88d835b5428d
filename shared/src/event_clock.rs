//! A train of numbered, time-stamped events: when was number n, and which number is it now?
//!
//! Samples of the accelerometer and positions of the tachometer wheel are both events that come
//! at a nearly constant rate, are numbered exactly, and carry time stamps with jitter. The model is
//! `t(n) = a + b·n`; `a` and `b` follow the stamps by recursive least squares with fading memory:
//! a stamp that is `memory` observations old weighs 1/e of the newest.

use serde::{Deserialize, Serialize};

use crate::math::sqrt;
use crate::units::Nanoseconds;

/// How an [`EventClock`] follows its stamps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EventClock {
    /// Observations after which a stamp weighs 1/e. At least 2.
    pub memory: f32,
    /// How uncertain the first guess of the period is, in standard deviations of one stamp per event.
    pub period_uncertainty: f32,
}

/// What an [`EventClock`] has learnt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EventClockState {
    /// Number of the newest event that was observed.
    index: u64,
    /// Fitted time of that event.
    time_ns: u64,
    /// Time stamp of that event.
    stamp_ns: u64,
    /// Fitted time from one event to the next, in ns.
    period_ns: f32,
    /// Covariance of (time, period) in units of the stamps' variance.
    covariance: [f32; 3],
    /// Variance of the stamps about the line, in ns².
    variance_ns2: f32,
    /// The deviation before, in units of one stamp.
    previous_ns: f32,
    /// Running mean of the deviations: not zero where the line is bent.
    bias_ns: f32,
    /// Stamps in a row that were too far from the line.
    strayed: u8,
    /// Observations since the start.
    observations: u32,
}

/// What one observation was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Observation {
    /// On the line.
    Fitted,
    /// The last few all lie to one side: the rate is changing. The line goes on from this stamp and may turn freely.
    Bent,
    /// Too far from the line; counted with the weight of the largest plausible deviation.
    Strayed,
    /// So many strayed that the line was begun anew through this stamp and the one before.
    Restarted,
}

/// Deviations beyond this many standard deviations are not believed: for white jitter one stamp in 16 000.
const BELIEVED_DEVIATIONS: f32 = 4.0;
/// After this many disbelieved stamps in a row it is the line that is wrong.
const STRAYED_AT_MOST: u8 = 4;
/// Variance follows the stamps with this memory, in observations.
const VARIANCE_MEMORY: f32 = 96.0;
/// The running mean of deviations follows each by this part; its standard deviation is then 0.38 of theirs.
const BIAS_FOLLOWS: f32 = 0.25;
/// A deviation counts for the mean with at most this many standard deviations: one or two outliers bend nothing.
const BIAS_BELIEVES: f32 = 3.0;
/// A mean of this many standard deviations, five of its own, is not chance.
const BENT: f32 = 2.0;
/// The clock's own resolution, below which no variance is believed, in ns.
const RESOLUTION_NS: f32 = 20.0;

impl EventClock {
    /// Begins at event 0, stamped `time`, with a first guess of the period and of the standard deviation of a stamp.
    pub fn start(&self, time: Nanoseconds, period_ns: f32, jitter_ns: f32) -> EventClockState {
        EventClockState {
            index: 0,
            time_ns: time.0,
            stamp_ns: time.0,
            period_ns,
            covariance: self.prior(),
            variance_ns2: jitter_ns * jitter_ns,
            previous_ns: 0.0,
            bias_ns: 0.0,
            strayed: 0,
            observations: 1,
        }
    }

    fn prior(&self) -> [f32; 3] {
        [1.0, 0.0, self.period_uncertainty * self.period_uncertainty]
    }

    /// Takes the stamp of the event `steps` after the newest one.
    pub fn observe(&self, state: &mut EventClockState, steps: u32, stamp: Nanoseconds) -> Observation {
        let dn = steps as f32;
        let predicted_ns = state.time_ns.saturating_add((dn * state.period_ns) as u64);
        let deviation_ns = difference_ns(stamp.0, predicted_ns);

        let fade = self.memory / (self.memory - 1.0);
        let [aa, ab, bb] = state.covariance;
        let aa = (aa + dn * (2.0 * ab + dn * bb)) * fade;
        let ab = (ab + dn * bb) * fade;
        let bb = bb * fade;
        let scale = aa + 1.0;

        state.index = state.index.saturating_add(u64::from(steps));
        state.observations = state.observations.saturating_add(1);

        let bound_ns2 = BELIEVED_DEVIATIONS * BELIEVED_DEVIATIONS * state.variance_ns2 * scale;
        let square_ns2 = deviation_ns * deviation_ns;
        let strays = square_ns2 > bound_ns2;
        // A disbelieved deviation keeps its sign and shrinks to the bound: bound²/deviation is below it.
        let believed_ns = if strays {
            deviation_ns * (bound_ns2 / square_ns2)
        } else {
            deviation_ns
        };
        let bent = state.learn_jitter(believed_ns / sqrt(scale));
        state.strayed = if strays { state.strayed + 1 } else { 0 };
        let before_ns = core::mem::replace(&mut state.stamp_ns, stamp.0);
        let restarts = state.strayed >= STRAYED_AT_MOST;
        if restarts || bent {
            state.time_ns = stamp.0;
            if restarts {
                state.period_ns = difference_ns(stamp.0, before_ns) / dn;
            }
            // The period is now known no better than from this stamp and the one before.
            state.covariance = [1.0, 0.0, 2.0 / (dn * dn)];
            (state.strayed, state.bias_ns, state.previous_ns) = (0, 0.0, 0.0);
            return if restarts {
                Observation::Restarted
            } else {
                Observation::Bent
            };
        }
        let (gain_a, gain_b) = (aa / scale, ab / scale);
        state.time_ns = offset_ns(predicted_ns, gain_a * believed_ns);
        state.period_ns += gain_b * believed_ns;
        state.covariance = [aa - gain_a * aa, ab - gain_a * ab, bb - gain_b * ab];
        if strays {
            Observation::Strayed
        } else {
            Observation::Fitted
        }
    }
}

impl EventClockState {
    /// Takes a deviation in units of one stamp; true where the last few lie to one side.
    ///
    /// The variance is half the mean square of *differences* of deviations: a line that lags behind a
    /// changing rate has a bias, and that must not pass for jitter.
    fn learn_jitter(&mut self, deviation_ns: f32) -> bool {
        let difference_ns = deviation_ns - self.previous_ns;
        self.previous_ns = deviation_ns;
        let bound_ns = BIAS_BELIEVES * sqrt(self.variance_ns2);
        self.bias_ns += (deviation_ns.clamp(-bound_ns, bound_ns) - self.bias_ns) * BIAS_FOLLOWS;
        let observations = self.observations as f32;
        let memory = if observations < VARIANCE_MEMORY {
            observations
        } else {
            VARIANCE_MEMORY
        };
        // 3/(n + 2): the guess made before the first stamp is soon forgotten.
        self.variance_ns2 += (0.5 * difference_ns * difference_ns - self.variance_ns2) * 3.0 / (memory + 2.0);
        if self.variance_ns2 < RESOLUTION_NS * RESOLUTION_NS {
            self.variance_ns2 = RESOLUTION_NS * RESOLUTION_NS;
        }
        self.observations > 4 && self.bias_ns * self.bias_ns > BENT * BENT * self.variance_ns2
    }

    /// Number of the newest event that was observed.
    pub fn index(&self) -> u64 {
        self.index
    }

    /// Fitted time of the newest event.
    pub fn time(&self) -> Nanoseconds {
        Nanoseconds(self.time_ns)
    }

    /// Fitted time from one event to the next, in ns.
    pub fn period_ns(&self) -> f32 {
        self.period_ns
    }

    /// Stamps taken since the start.
    pub fn observations(&self) -> u32 {
        self.observations
    }

    /// Variance of one stamp about the line, in ns².
    pub fn variance_ns2(&self) -> f32 {
        self.variance_ns2
    }

    /// Variance of the fitted time `events` after the newest, in ns²: grows with the distance.
    pub fn variance_at_ns2(&self, events: f32) -> f32 {
        let [aa, ab, bb] = self.covariance;
        self.variance_ns2 * (aa + events * (2.0 * ab + events * bb))
    }

    /// Fitted time of the event `events` after (before, where negative) the newest.
    ///
    /// `events` may be a fraction. The result carries the rounding of one `f32` product: 6e-8 of the distance.
    pub fn time_at(&self, events: f32) -> Nanoseconds {
        Nanoseconds(offset_ns(self.time_ns, events * self.period_ns))
    }

    /// Events from the newest one to `time`; negative before it.
    pub fn events_to(&self, time: Nanoseconds) -> f32 {
        difference_ns(time.0, self.time_ns) / self.period_ns
    }

    /// Keeps the period within bounds that are known from elsewhere.
    pub fn limit_period(&mut self, least_ns: f32, most_ns: f32) {
        self.period_ns = self.period_ns.clamp(least_ns, most_ns);
    }
}

/// `a − b` of two instants, in ns.
fn difference_ns(a: u64, b: u64) -> f32 {
    if a >= b { (a - b) as f32 } else { -((b - a) as f32) }
}

/// The instant `by_ns` after `time_ns`, rounded to the nearest ns.
fn offset_ns(time_ns: u64, by_ns: f32) -> u64 {
    if by_ns >= 0.0 {
        time_ns.saturating_add((by_ns + 0.5) as u64)
    } else {
        time_ns.saturating_sub((0.5 - by_ns) as u64)
    }
}
