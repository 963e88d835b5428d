//! Estimator of the time of numbered events from time stamps with jitter.
//!
//! Samples of the accelerometer and positions of the tachometer wheel are such events: their rate is nearly constant,
//! their numbers are exact, their time stamps have jitter. The model is `t(n) = a + b·n`. Recursive least squares
//! with exponential forgetting estimates `a` and `b`: a stamp that is `memory` observations old has a weight
//! of about 1/e.

use serde::{Deserialize, Serialize};

use crate::criteria::{
    BIAS_BOUND, BIAS_GAIN, OUTLIER_DEVIATIONS, OUTLIERS_MAX, RATE_CHANGE_BIAS, STAMP_RESOLUTION_NS,
    VARIANCE_MEMORY,
};
use crate::math::sqrt;
use crate::units::Nanoseconds;

/// Settings of the estimator.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EventClock {
    /// Number of time stamps after which the weight of a stamp in the fit has decayed to about 1/e. At least 2.
    pub memory: f32,
    /// Standard deviation of the initial estimate of the period between events, in units of the standard deviation of
    /// one time stamp.
    pub period_uncertainty: f32,
}

/// State of the estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EventClockState {
    /// Number of the event whose time stamp was observed last.
    index: u64,
    /// Fitted time of the event whose time stamp was observed last.
    time_ns: u64,
    /// Time stamp, with jitter, of the event that was observed last.
    stamp_ns: u64,
    /// Fitted time from one event to the next, in ns.
    period_ns: f32,
    /// Covariance of the fitted time a and period b of the events, divided by the variance of one time stamp: var a,
    /// cov(a, b), var b.
    covariance: [f32; 3],
    /// Variance of the time stamps about the fitted line, in ns².
    variance_ns2: f32,
    /// Deviation of the preceding time stamp from its prediction in ns, scaled so that its standard deviation is that
    /// of one stamp.
    previous_ns: f32,
    /// Running mean in ns of the deviations of time stamps from their predictions, each scaled like `previous_ns` and
    /// bounded.
    bias_ns: f32,
    /// Number of consecutive outliers.
    outliers: u8,
    /// Number of time stamps observed since the estimator was started.
    observations: u32,
}

/// Classification of one observation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Observation {
    /// The time stamp agrees with the fitted line.
    Fitted,
    /// The running mean of the deviations of time stamps from the line is too large for jitter: the rate of the
    /// events is changing. The line continues from this stamp with the fitted period, which counts as uncertain.
    RateChanged,
    /// The time stamp is an outlier: too far from the line for jitter. The line is updated with a reduced deviation.
    Outlier,
    /// Too many consecutive time stamps are outliers: the line starts again through this stamp and the preceding one.
    Restarted,
}

impl EventClock {
    /// Starts the estimator at event 0 with time stamp `time`, and with initial estimates of the period between events
    /// and of the standard deviation of the stamps.
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
            outliers: 0,
            observations: 1,
        }
    }

    fn prior(&self) -> [f32; 3] {
        [1.0, 0.0, self.period_uncertainty * self.period_uncertainty]
    }

    /// Processes the time stamp of an event whose number is higher by `steps` than that of the event observed last.
    // Several callers, and flash is scarce.
    #[inline(never)]
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

        let bound_ns2 = OUTLIER_DEVIATIONS * OUTLIER_DEVIATIONS * state.variance_ns2 * scale;
        let square_ns2 = deviation_ns * deviation_ns;
        let is_outlier = square_ns2 > bound_ns2;
        // The deviation of an outlier from the fitted line keeps its sign and is reduced to bound²/deviation, which is
        // below the outlier bound.
        let reduced_ns = if is_outlier {
            deviation_ns * (bound_ns2 / square_ns2)
        } else {
            deviation_ns
        };
        let rate_changes = state.learn_jitter(reduced_ns / sqrt(scale));
        state.outliers = if is_outlier { state.outliers + 1 } else { 0 };
        let before_ns = core::mem::replace(&mut state.stamp_ns, stamp.0);
        let restarts = state.outliers >= OUTLIERS_MAX;
        if restarts || rate_changes {
            state.time_ns = stamp.0;
            if restarts {
                state.period_ns = difference_ns(stamp.0, before_ns) / dn;
            }
            // The period between events is now as uncertain as one that is computed from two time stamps only.
            state.covariance = [1.0, 0.0, 2.0 / (dn * dn)];
            (state.outliers, state.bias_ns, state.previous_ns) = (0, 0.0, 0.0);
            return if restarts {
                Observation::Restarted
            } else {
                Observation::RateChanged
            };
        }
        let (gain_a, gain_b) = (aa / scale, ab / scale);
        state.time_ns = offset_ns(predicted_ns, gain_a * reduced_ns);
        state.period_ns += gain_b * reduced_ns;
        state.covariance = [aa - gain_a * aa, ab - gain_a * ab, bb - gain_b * ab];
        if is_outlier {
            Observation::Outlier
        } else {
            Observation::Fitted
        }
    }
}

impl EventClockState {
    /// Updates the variance of the time stamps with the deviation of one stamp from its prediction, scaled so that
    /// its standard deviation is that of a stamp. Returns true if the running mean of the deviations shows a change
    /// of the event rate.
    ///
    /// The variance is half the mean square of the *differences* of consecutive deviations. During a rate change the
    /// deviations have a bias, which the differences remove.
    fn learn_jitter(&mut self, deviation_ns: f32) -> bool {
        let difference_ns = deviation_ns - self.previous_ns;
        self.previous_ns = deviation_ns;
        let bound_ns = BIAS_BOUND * sqrt(self.variance_ns2);
        self.bias_ns += (deviation_ns.clamp(-bound_ns, bound_ns) - self.bias_ns) * BIAS_GAIN;
        let observations = self.observations as f32;
        let memory = if observations < VARIANCE_MEMORY {
            observations
        } else {
            VARIANCE_MEMORY
        };
        // After n time stamps, counted up to `VARIANCE_MEMORY`, the variance is updated with the gain 3/(n + 2), larger
        // than the 1/n of a mean, so that its initial estimate decays quickly.
        self.variance_ns2 += (0.5 * difference_ns * difference_ns - self.variance_ns2) * 3.0 / (memory + 2.0);
        if self.variance_ns2 < STAMP_RESOLUTION_NS * STAMP_RESOLUTION_NS {
            self.variance_ns2 = STAMP_RESOLUTION_NS * STAMP_RESOLUTION_NS;
        }
        self.observations > 4
            && self.bias_ns * self.bias_ns > RATE_CHANGE_BIAS * RATE_CHANGE_BIAS * self.variance_ns2
    }

    /// Number of the event that was observed last.
    pub fn index(&self) -> u64 {
        self.index
    }

    /// Fitted time of the event that was observed last.
    pub fn time(&self) -> Nanoseconds {
        Nanoseconds(self.time_ns)
    }

    /// Fitted time from one event to the next, in ns.
    pub fn period_ns(&self) -> f32 {
        self.period_ns
    }

    /// Number of time stamps observed since the estimator was started.
    pub fn observations(&self) -> u32 {
        self.observations
    }

    /// Variance of one time stamp about the fitted line, in ns².
    pub fn variance_ns2(&self) -> f32 {
        self.variance_ns2
    }

    /// Variance, in ns², of the fitted time of the event that follows the newest one by `events`. It grows with the
    /// distance to later events.
    pub fn variance_at_ns2(&self, events: f32) -> f32 {
        let [aa, ab, bb] = self.covariance;
        self.variance_ns2 * (aa + events * (2.0 * ab + events * bb))
    }

    /// Fitted time of the event that follows the newest one by `events`; fractions and negative values are allowed.
    ///
    /// The rounding error is that of one `f32` product, 6e-8 of the distance, and of rounding to 1 ns.
    pub fn time_at(&self, events: f32) -> Nanoseconds {
        Nanoseconds(offset_ns(self.time_ns, events * self.period_ns))
    }

    /// Number of events from the newest one to the time `time`, by the fitted line; negative if `time` is earlier.
    pub fn events_to(&self, time: Nanoseconds) -> f32 {
        difference_ns(time.0, self.time_ns) / self.period_ns
    }

    /// Lets the line continue from the newest time stamp with this period, which counts as uncertain as one that is computed from two
    /// time stamps.
    pub fn steer(&mut self, period_ns: f32) {
        self.time_ns = self.stamp_ns;
        self.period_ns = period_ns;
        self.covariance = [1.0, 0.0, 2.0];
        (self.outliers, self.bias_ns, self.previous_ns) = (0, 0.0, 0.0);
    }

    /// Clamps the fitted period between events to the range from `least_ns` to `most_ns`.
    pub fn limit_period(&mut self, least_ns: f32, most_ns: f32) {
        self.period_ns = self.period_ns.clamp(least_ns, most_ns);
    }
}

/// The difference a − b of two instants, in ns.
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
