//! The last tooth passings: what happens once per tooth period.
//!
//! About the forced orbit a cut is linear with coefficients periodic in the tooth: a deviation seen once per tooth is a sum of
//! c_r·μ_r^k, the same multipliers at every slot and axis. The cut is lost where the largest leaves the unit circle, through a complex
//! pair (Hopf) or through −1 (flip). `detector::growth` estimates the multipliers; the shape of the deviation within the
//! tooth period, which tells the frequency, comes from the passings kept here.

pub(crate) mod roots;
mod shape;

use crate::synchronous::{CHANNELS, MAX_CLASSES, ToothPassing, clamp_classes};

/// Passings remembered.
pub const CAPACITY: usize = 32;

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
}
