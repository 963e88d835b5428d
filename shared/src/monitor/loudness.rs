//! The level of a band from its samples alone: it needs neither spindle speed nor spectrum.

use crate::decimation::Sample;

/// Time over which the constant part of the signal is averaged, s: gravity and offsets.
const REST_S: f32 = 0.5;
/// Time over which the mean square is averaged, s. It is short against the second within which an alarm ends, and several periods of the
/// lowest tone of the structure band.
const LEVEL_S: f32 = 0.15;

/// Mean square of the samples of a band about their mean.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Loudness {
    /// Mean of each axis, in units of the samples; `None` before the first block.
    rest: Option<[f32; 3]>,
    /// Mean square about the mean, summed over the axes, in squares of these units.
    square: f32,
    /// The samples of the present block.
    count: u16,
    sums: [f32; 3],
    squares: f32,
}

impl Loudness {
    pub(super) const fn new() -> Self {
        Self {
            rest: None,
            square: 0.0,
            count: 0,
            sums: [0.0; 3],
            squares: 0.0,
        }
    }

    /// Takes a sample.
    pub(super) fn take(&mut self, sample: Sample) {
        let sample = sample.map(|value| value as f32);
        let rest = self.rest.get_or_insert(sample);
        self.count = self.count.saturating_add(1);
        for ((value, rest), sum) in sample.iter().zip(rest.iter()).zip(&mut self.sums) {
            let moved = value - rest;
            *sum += moved;
            self.squares += moved * moved;
        }
    }

    /// Ends a block of `seconds`.
    pub(super) fn end_block(&mut self, seconds: f32) {
        if self.count == 0 {
            return;
        }
        let share = 1.0 / f32::from(self.count);
        let follows = |time_s: f32| (seconds / time_s).min(1.0);
        self.square += follows(LEVEL_S) * (share * self.squares - self.square);
        for (rest, sum) in self.rest.iter_mut().flatten().zip(self.sums) {
            *rest += follows(REST_S) * share * sum;
        }
        (self.count, self.sums, self.squares) = (0, [0.0; 3], 0.0);
    }

    /// Root of the mean square, in units of the samples.
    pub(super) fn level(&self) -> f32 {
        crate::math::sqrt(self.square.max(0.0))
    }
}
