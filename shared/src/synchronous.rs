//! Resampling at fixed spindle angles, and the synchronous average with its residual.
//!
//! A tooth period (one tooth pitch of the spindle) is divided into [`SLOTS`] equal angles. [`Sampler`] converts the
//! samples of a band, which are equally spaced in time, into one [`ToothPassing`] per tooth period: three axes at
//! each slot. The tooth passings of one tooth, one per revolution, form a *class*. [`Average`] keeps the mean of each
//! class and splits the signal:
//!
//! ```text
//! tooth passing = at rest + forced (same for all teeth)
//!                 + runout (same for one tooth, sums to 0 over the teeth) + residual
//! ```
//!
//! The caller compensates the group delay of preceding filters: each sample comes with the spindle angle at the time
//! that it represents.

use crate::math::sqrt;
use crate::tachometer::Turns;

/// Angles per tooth period.
pub const SLOTS: usize = 8;
/// Number of values per tooth period: three axes at each of the [`SLOTS`] fixed angles.
pub const CHANNELS: usize = 3 * SLOTS;
/// Largest number of classes of tooth periods: one class per tooth.
pub const MAX_CLASSES: usize = 12;

/// The resampled acceleration of one tooth period in m/s²: for each fixed spindle angle (slot) the values along x, y
/// and z.
pub type ToothPassing = [f32; CHANNELS];

/// Method of resampling.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Each slot gets the mean of the signal from its angle to that of the next slot: the bandwidth is about SLOTS/2
    /// cycles per tooth period, with the least noise.
    ///
    /// The samples are joined by straight lines. A tone with n samples per cycle gets an amplitude that is too small by
    /// the relative amount π²/(3n²): 0.3 % for 33 samples.
    Mean,
    /// Each slot gets the value of the signal at its angle, with the bandwidth of the samples.
    ///
    /// A cubic through the four nearest samples gives the value. The relative error of a tone with n samples per cycle
    /// is at most 36.5/n⁴: 0.06 % for 16, 1 % for 8 samples.
    Value,
}

/// Resamples a band from fixed sample times to fixed spindle angles, and returns one [`ToothPassing`] per tooth period.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampler {
    /// Teeth of the tool.
    pub teeth: u8,
    /// Method of resampling.
    pub method: Method,
}

/// State of a [`Sampler`].
#[derive(Clone, Copy, Debug)]
pub struct SamplerState {
    /// The last four acceleration samples of the band, newest last.
    samples: [[f32; 3]; 4],
    /// Spindle angles of the second and the third of the last four samples.
    angles: [Turns; 2],
    /// Spindle angle of the newest sample of the band.
    angle: Turns,
    /// Number of samples taken since the start, up to 4.
    filled: u8,
    /// Number of the next slot (fixed spindle angle) to fill, counted from angle 0; `None` before the first.
    next_slot: Option<u64>,
    /// Number of consecutive slots (fixed spindle angles) filled without a gap, up to [`SLOTS`] + 1.
    unbroken: u8,
    /// Integral of the signal over time since the angle of the last filled slot, in m/s² times sample periods.
    integral: [f32; 3],
    /// Time since the angle of the last filled slot, in sample periods.
    span: f32,
    passing: ToothPassing,
}

impl Default for SamplerState {
    fn default() -> Self {
        Self::new()
    }
}

impl SamplerState {
    /// The state of the resampling before the first sample.
    pub const fn new() -> Self {
        Self {
            samples: [[0.0; 3]; 4],
            angles: [Turns(0); 2],
            angle: Turns(0),
            filled: 0,
            next_slot: None,
            unbroken: 0,
            integral: [0.0; 3],
            span: 0.0,
            passing: [0.0; CHANNELS],
        }
    }
}

/// A complete tooth period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passed {
    /// Number of tooth periods since angle 0 of the tachometer.
    pub tooth: u64,
    /// Acceleration at each angle slot.
    pub passing: ToothPassing,
}

impl Sampler {
    /// Spindle angle at which the slot with number `slot` begins.
    fn angle_of(&self, slot: u64) -> Turns {
        let per_turn = u64::from(self.teeth) * SLOTS as u64;
        let part = ((slot % per_turn) << 32) / per_turn;
        Turns(((slot / per_turn) << 32) | part)
    }

    /// Number of the first slot whose spindle angle is `angle` or later.
    fn slot_from(&self, angle: Turns) -> u64 {
        let per_turn = u64::from(self.teeth) * SLOTS as u64;
        let part = u64::from(angle.fraction()) * per_turn;
        (angle.0 >> 32) * per_turn + part.div_ceil(1 << 32)
    }

    /// Processes the next sample (x, y, z in m/s²) with the spindle angle at the time that it represents. Small steps
    /// back of the angle, from a correction of the tachometer's estimate, are allowed.
    ///
    /// Returns the tooth period that this sample completes. A tooth period must contain at least two samples.
    pub fn step(&self, state: &mut SamplerState, sample: [f32; 3], angle: Turns) -> Option<Passed> {
        state.samples.rotate_left(1);
        if let Some(newest) = state.samples.last_mut() {
            *newest = sample;
        }
        state.angles = [state.angles[1], state.angle];
        state.angle = angle;
        if state.filled < 4 {
            state.filled += 1;
            return None;
        }
        let [from, to] = state.angles;
        if to.0.saturating_sub(from.0) > Turns::ONE.0 / u64::from(self.teeth) {
            // If the spindle angle moves by more than a tooth period within one sample, the tachometer's estimate has
            // jumped.
            *state = SamplerState::default();
            return None;
        }
        let mut slot = match state.next_slot {
            Some(slot) => slot,
            None => {
                state.unbroken = 0;
                *state.next_slot.insert(self.slot_from(from))
            }
        };
        let mut passed = None;
        let mut done = 0.0;
        while self.angle_of(slot) < to {
            let ahead = self.angle_of(slot).0.saturating_sub(from.0);
            let part = ahead as f32 / to.0.saturating_sub(from.0).max(1) as f32;
            passed = self.fill(state, slot, done, part).or(passed);
            done = part;
            slot += 1;
        }
        state.next_slot = Some(slot);
        state.integrate(done, 1.0);
        passed
    }

    /// Handles the angle of a slot, which lies between the second and third of the last four samples, at the fraction
    /// `part` of their distance: fills this slot, with [`Method::Mean`] the one before. Returns the tooth period that
    /// is complete then. The integral already covers the distance up to the fraction `done`.
    fn fill(&self, state: &mut SamplerState, slot: u64, done: f32, part: f32) -> Option<Passed> {
        let value = match self.method {
            Method::Mean => {
                state.integrate(done, part);
                let span = if state.span > 0.0 { state.span } else { 1.0 };
                state.integral.map(|sum| sum / span)
            }
            Method::Value => cubic(&state.samples, part),
        };
        (state.integral, state.span) = ([0.0; 3], 0.0);
        // The mean from the angle of a slot to that of the next is known only at the next slot, so it belongs to the
        // slot before.
        let slot = match self.method {
            Method::Mean => slot.checked_sub(1)?,
            Method::Value => slot,
        };
        let place = (slot % SLOTS as u64) as usize;
        if let Some(values) = state.passing.get_mut(3 * place..3 * place + 3) {
            values.copy_from_slice(&value);
        }
        // The integral for the first mean began after the angle of its slot, so this mean is incomplete and not used.
        let partial = self.method == Method::Mean && state.unbroken == 0;
        state.unbroken = state.unbroken.saturating_add(1).min(SLOTS as u8 + 1);
        let whole = usize::from(state.unbroken) >= SLOTS + usize::from(self.method == Method::Mean);
        (place + 1 == SLOTS && whole && !partial).then_some(Passed {
            tooth: slot / SLOTS as u64,
            passing: state.passing,
        })
    }
}

impl SamplerState {
    /// Adds the integral of the straight line between the second and third of the last four samples, from the fraction
    /// `from` to the fraction `to` of their distance.
    fn integrate(&mut self, from: f32, to: f32) {
        let [_, a, b, _] = &self.samples;
        let (length, middle) = (to - from, 0.5 * (to + from));
        for ((sum, a), b) in self.integral.iter_mut().zip(a).zip(b) {
            *sum += length * (a + middle * (b - a));
        }
        self.span += length;
    }
}

/// Value of the cubic through four equally spaced samples, at the fraction `part` of the distance from the second to
/// the third sample.
fn cubic(samples: &[[f32; 3]; 4], part: f32) -> [f32; 3] {
    let (before, after) = (part + 1.0, part - 1.0);
    let beyond = part - 2.0;
    let weights = [
        -part * after * beyond / 6.0,
        before * after * beyond / 2.0,
        -before * part * beyond / 2.0,
        before * part * after / 6.0,
    ];
    let mut value = [0.0; 3];
    for (sample, weight) in samples.iter().zip(weights) {
        for (sum, x) in value.iter_mut().zip(sample) {
            *sum += weight * x;
        }
    }
    value
}

/// Synchronous average: mean of the tooth periods of each class (tooth), and the mean square of the residual.
///
/// Over the first [`MEMORY`](Self::MEMORY) revolutions the mean of a class is the arithmetic mean, later an
/// exponentially weighted mean. After a change of the cutting conditions, [`reset`](Self::reset) discards the past.
#[derive(Clone, Copy, Debug)]
pub struct Average {
    means: [ToothPassing; MAX_CLASSES],
    /// Number of tooth periods of each class since the reset, at most `MEMORY` − 1.
    counts: [u8; MAX_CLASSES],
    classes: u8,
    /// Mean square of the residual (the part not periodic with the revolution), over all values of a tooth period,
    /// (m/s²)².
    residual: f32,
    /// Number of tooth periods in the mean square of the residual, at most `MEMORY` per class.
    residual_count: u16,
}

/// Levels of the components of the vibration: root mean squares over the angles of a tooth period and the axes, in
/// m/s².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Levels {
    /// Forced vibration: the component common to all teeth, without its mean over the tooth period.
    pub forced: f32,
    /// Runout: the component that differs from tooth to tooth and repeats with each revolution.
    pub runout: f32,
    /// Component of the runout vibration that changes sign from tooth to tooth; 0 for odd numbers of teeth.
    pub alternating: f32,
    /// Residual: the component of the vibration that is not periodic with the revolution.
    pub residual: f32,
}

impl Average {
    /// Memory of the mean tooth period of each class, in revolutions.
    pub const MEMORY: u8 = 8;

    /// The average before the first tooth period, for a number of classes (teeth) from 1 to [`MAX_CLASSES`].
    pub const fn new(classes: u8) -> Self {
        Self {
            means: [[0.0; CHANNELS]; MAX_CLASSES],
            counts: [0; MAX_CLASSES],
            classes: clamp_classes(classes),
            residual: 0.0,
            residual_count: 0,
        }
    }

    /// True if the average was created for this number of classes (teeth).
    pub fn is_for(&self, classes: u8) -> bool {
        self.classes == clamp_classes(classes)
    }

    /// Resets to the initial state.
    pub fn reset(&mut self) {
        *self = Self::new(self.classes);
    }

    /// Updates the mean of a class with the tooth period of number `tooth`, whose values are `passing`.
    pub fn update(&mut self, tooth: u64, passing: &ToothPassing) {
        let class = (tooth % u64::from(self.classes)) as usize;
        let (Some(mean), Some(count)) = (self.means.get_mut(class), self.counts.get_mut(class)) else {
            return;
        };
        let gain = 1.0 / (f32::from(*count) + 1.0);
        let mut square = 0.0;
        for (mean, value) in mean.iter_mut().zip(passing) {
            let difference = value - *mean;
            *mean += gain * difference;
            square += difference * difference;
        }
        if *count > 0 {
            // White noise of variance s deviates from the mean of c tooth periods with the variance s·(1 + 1/c). The
            // factor (1 − gain) removes this excess.
            let power = square * (1.0 - gain) / CHANNELS as f32;
            let memory = u16::from(Self::MEMORY) * u16::from(self.classes);
            self.residual_count = (self.residual_count + 1).min(memory);
            self.residual += (power - self.residual) / f32::from(self.residual_count);
        }
        *count = (*count + 1).min(Self::MEMORY - 1);
    }

    /// True once every class (tooth) has had at least two tooth periods.
    pub fn is_filled(&self) -> bool {
        self.counts
            .iter()
            .take(usize::from(self.classes))
            .all(|&count| count >= 2)
    }

    /// The present levels of forced vibration, runout and residual.
    pub fn levels(&self) -> Levels {
        let classes = usize::from(self.classes);
        let share = 1.0 / classes as f32;
        let (mut common, mut alternating) = ([0.0; CHANNELS], [0.0; CHANNELS]);
        for (class, mean) in self.means.iter().take(classes).enumerate() {
            let sign = if classes % 2 == 1 {
                0.0
            } else if class % 2 == 0 {
                share
            } else {
                -share
            };
            for ((common, alternating), mean) in common.iter_mut().zip(&mut alternating).zip(mean) {
                *common += share * mean;
                *alternating += sign * mean;
            }
        }
        let mut runout = 0.0;
        for mean in self.means.iter().take(classes) {
            runout += share * distance_square(mean, &common);
        }
        let mut rest = [0.0; CHANNELS];
        for (channel, value) in rest.iter_mut().enumerate() {
            *value = common.iter().skip(channel % 3).step_by(3).sum::<f32>() / SLOTS as f32;
        }
        let root = |square: f32| sqrt(square / CHANNELS as f32);
        Levels {
            forced: root(distance_square(&common, &rest)),
            runout: root(runout),
            alternating: root(alternating.iter().map(|a| a * a).sum()),
            residual: sqrt(self.residual),
        }
    }
}

/// Clamps a number of classes (teeth) to the range 1 to `MAX_CLASSES`.
pub(crate) const fn clamp_classes(classes: u8) -> u8 {
    if classes == 0 {
        1
    } else if classes as usize > MAX_CLASSES {
        MAX_CLASSES as u8
    } else {
        classes
    }
}

/// Sum of the squared differences between the values of two tooth periods, (m/s²)².
pub(crate) fn distance_square(a: &ToothPassing, b: &ToothPassing) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Passings of a signal that is a function of the spindle angle in revolutions, with this number of samples per
    /// revolution.
    fn sampled(method: Method, samples_per_turn: f64, signal: impl Fn(f64) -> f64) -> std::vec::Vec<Passed> {
        let sampler = Sampler { teeth: 2, method };
        let mut state = SamplerState::new();
        (0..(6.0 * samples_per_turn) as u32)
            .filter_map(|n| {
                let turns = f64::from(n) / samples_per_turn;
                let value = signal(turns) as f32;
                sampler.step(
                    &mut state,
                    [value, 2.0 * value, 0.0],
                    Turns((turns * 2f64.powi(32)) as u64),
                )
            })
            .collect()
    }

    #[test]
    fn values_and_means_stand_at_their_angles() {
        let tau = std::f64::consts::TAU;
        // Three cycles per revolution at 100.3 samples per revolution are 33 samples per cycle, which bounds the
        // error of both methods by 0.3 %.
        let value = |turns: f64| (tau * 3.0 * turns).sin();
        let mean = |turns: f64| {
            let integral = |t: f64| -(tau * 3.0 * t).cos() / (tau * 3.0);
            16.0 * (integral(turns + 1.0 / 16.0) - integral(turns))
        };
        for method in [Method::Value, Method::Mean] {
            let passings = sampled(method, 100.3, value);
            assert!(passings.len() >= 10);
            for passed in passings {
                for slot in 0..SLOTS {
                    let turns = (passed.tooth as f64 + slot as f64 / 8.0) / 2.0;
                    let expected = match method {
                        Method::Value => value(turns),
                        Method::Mean => mean(turns),
                    };
                    let found = passed.passing[3 * slot];
                    assert!(
                        (f64::from(found) - expected).abs() < 4e-3,
                        "{method:?} {turns}: {found}"
                    );
                    assert_eq!(passed.passing[3 * slot + 1], 2.0 * found);
                }
            }
        }
    }

    #[test]
    fn levels_split_forced_runout_and_residual() {
        let mut average = Average::new(2);
        for tooth in 0..400_u64 {
            let sign = |odd: bool| if odd { -1.0 } else { 1.0 };
            let runout = 0.5 * sign(tooth % 2 == 1);
            let residual = 0.1 * sign(tooth % 4 >= 2);
            let passing: ToothPassing = std::array::from_fn(|channel| {
                let forced = 2.0 * sign(channel / 3 % 2 == 1);
                9.8 + forced + runout + residual
            });
            average.update(tooth, &passing);
        }
        let levels = average.levels();
        // A vibration that changes sign with each revolution leaves a share of about 1/(2·memory) in the means.
        assert!((levels.forced - 2.0).abs() < 1e-3, "{levels:?}");
        assert!(
            (levels.runout - 0.5).abs() < 0.02 && (levels.alternating - 0.5).abs() < 0.02,
            "{levels:?}"
        );
        assert!((levels.residual - 0.1).abs() < 0.02, "{levels:?}");
    }
}
