//! The stroboscopic map: the dominant multiplier μ over one tooth period.
//!
//! About the forced orbit a cut is linear with coefficients periodic in the tooth: a deviation seen once per tooth is a sum of
//! c_r·μ_r^k, the same multipliers at every slot and axis. The cut is lost where the largest leaves the unit circle, through a complex
//! pair (Hopf) or through −1 (flip). The forced vibration, runout included, is a constant of each class (tooth): an unknown offset of
//! each channel and class, which is estimated *jointly* with the multipliers, so that runout, which alternates
//! like a flip when the number of teeth is even, cannot pass for one: only growth can.
//!
//! Three estimators look at the last passings:
//! - [`prediction`]: linear prediction with coefficients common to all channels, over several strides, for fast growth;
//! - [`exponential`]: one complex pair fitted to a whole window, for slow growth that noise hides;
//! - [`alternation`]: the growth of an alternating part, where an offset lies next to the multiplier −1.

pub mod alternation;
pub mod exponential;
pub mod prediction;
mod roots;
mod shape;

#[cfg(test)]
mod tests;

use crate::synchronous::{CHANNELS, MAX_CLASSES, ToothPassing, clamp_classes};

pub use alternation::Alternation;
pub use exponential::{Exponential, Guess};
pub use prediction::{Plan, Prediction};

/// Passings remembered.
pub const CAPACITY: usize = 64;

/// The last passings, less those of the first revolution after the reset, so that rounding does not follow gravity and force.
#[derive(Clone, Debug)]
pub struct Stroboscope {
    passings: [ToothPassing; CAPACITY],
    /// The first passing of each class.
    reference: [ToothPassing; MAX_CLASSES],
    classes: u8,
    /// Passings remembered, up to the capacity.
    filled: u8,
    /// Where the next passing goes.
    next: u8,
    /// Passings since the reset.
    since_reset: u32,
    /// Class of the newest passing.
    class: u8,
}

/// A part of the past: the last `rows` passings, oldest first.
#[derive(Clone, Copy, Debug)]
pub struct Window<'a> {
    stroboscope: &'a Stroboscope,
    length: usize,
}

impl Stroboscope {
    /// Knows nothing yet. `classes` is the number of teeth.
    pub const fn new(classes: u8) -> Self {
        Self {
            passings: [[0.0; CHANNELS]; CAPACITY],
            reference: [[0.0; CHANNELS]; MAX_CLASSES],
            classes: clamp_classes(classes),
            filled: 0,
            next: 0,
            since_reset: 0,
            class: 0,
        }
    }

    /// Forgets the past: after a gap, and where the conditions have changed.
    pub fn reset(&mut self) {
        (self.filled, self.next, self.since_reset) = (0, 0, 0);
    }

    /// Takes a passing of tooth period `tooth`. Tooth periods come in order and without gaps, or the caller resets.
    pub fn push(&mut self, tooth: u64, passing: &ToothPassing) {
        self.class = (tooth % u64::from(self.classes)) as u8;
        let Some(reference) = self.reference.get_mut(usize::from(self.class)) else {
            return;
        };
        if self.since_reset < u32::from(self.classes) {
            *reference = *passing;
        }
        if let Some(slot) = self.passings.get_mut(usize::from(self.next)) {
            for ((slot, value), reference) in slot.iter_mut().zip(passing).zip(reference.iter()) {
                *slot = value - reference;
            }
        }
        self.next = (self.next + 1) % CAPACITY as u8;
        self.filled = (self.filled + 1).min(CAPACITY as u8);
        self.since_reset = self.since_reset.saturating_add(1);
    }

    /// Number of classes.
    pub fn classes(&self) -> usize {
        usize::from(self.classes)
    }

    /// The passing a revolution before the next one; `None` where it is not known.
    pub fn a_revolution_ago(&self) -> Option<ToothPassing> {
        let turn = self.window(self.classes()).filter(|turn| turn.length() > 0)?;
        let mut passing = *turn.row(0);
        for (value, reference) in passing.iter_mut().zip(self.reference.get(turn.class(0))?) {
            *value += reference;
        }
        Some(passing)
    }

    /// Passings since the reset.
    pub fn since_reset(&self) -> u32 {
        self.since_reset
    }

    /// Passings that can be looked at.
    pub fn filled(&self) -> usize {
        usize::from(self.filled)
    }

    /// The last `length` passings, where there are as many.
    pub fn window(&self, length: usize) -> Option<Window<'_>> {
        (length <= self.filled()).then_some(Window {
            stroboscope: self,
            length,
        })
    }
}

impl Window<'_> {
    /// Number of passings.
    pub fn length(&self) -> usize {
        self.length
    }

    /// Number of classes.
    pub fn classes(&self) -> usize {
        usize::from(self.stroboscope.classes)
    }

    /// Class of row `row`, 0 the oldest.
    pub fn class(&self, row: usize) -> usize {
        let age = self.length - 1 - row.min(self.length - 1);
        let classes = self.classes();
        (usize::from(self.stroboscope.class) + classes - age % classes) % classes
    }

    /// Tooth passing in row `row`, 0 the oldest, less the reference of its class.
    pub fn row(&self, row: usize) -> &ToothPassing {
        let start = usize::from(self.stroboscope.next) + 2 * CAPACITY - self.length;
        // The remainder is below the capacity.
        &self.stroboscope.passings[(start + row) % CAPACITY]
    }

    /// By how much what all classes have in common moved from the first half of the window to the second, as a root mean square over the
    /// channels, in m/s². An orbit that does not change gives noise here, one that is still being entered does not.
    pub fn drift(&self) -> f32 {
        self.shift(self.length / 2 / self.classes() * self.classes())
    }

    /// The same from the turn before the last to the last: an orbit that is being left.
    pub fn recent_drift(&self) -> f32 {
        self.shift(self.classes())
    }

    /// Root mean square of the difference of the means of the last `count` rows and of the `count` before.
    fn shift(&self, count: usize) -> f32 {
        if count == 0 || 2 * count > self.length {
            return 0.0;
        }
        let mut difference = [0.0; CHANNELS];
        for row in 0..count {
            let (old, new) = (
                self.row(self.length - 1 - count - row),
                self.row(self.length - 1 - row),
            );
            for ((sum, new), old) in difference.iter_mut().zip(new).zip(old) {
                *sum += new - old;
            }
        }
        let square: f32 = difference.iter().map(|d| d * d).sum();
        crate::math::sqrt(square / CHANNELS as f32) / count as f32
    }
}
