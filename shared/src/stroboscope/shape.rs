//! The shape of a deviation within the tooth period: its angle from one tooth to the next, and its cycles per tooth period.

use super::Window;
use crate::math::sin_cos_turns;
use crate::synchronous::{CHANNELS, MAX_CLASSES, SLOTS};

impl Window<'_> {
    /// Cycles per tooth period of a deviation whose multiplier has the angle `angle_turns`: one of k ± angle_turns, by the shape within
    /// the period.
    ///
    /// Demodulated by its angle, the deviation at slot p turns by (k ± angle)/[`SLOTS`] from slot to slot. The offsets of the classes are
    /// taken off before.
    pub fn cycles(&self, angle_turns: f32) -> Option<f32> {
        strongest(&self.demodulate(angle_turns), angle_turns)
    }

    /// The angle in turns, 0 to ½, that is 1/`stride` of one with the cosine of `angle_turns`: there are as many as the stride, and the one at
    /// which the window has the most power is it.
    pub fn unfold(&self, angle_turns: f32, stride: usize) -> f32 {
        let mut best = (angle_turns, -1.0);
        for turn in 0..=stride / 2 {
            for sign in [-1.0, 1.0] {
                let candidate = (turn as f32 + sign * angle_turns) / stride as f32;
                if !(0.0..=0.5).contains(&candidate) {
                    continue;
                }
                let power = self.power(candidate);
                if power > best.1 {
                    best = (candidate, power);
                }
            }
        }
        best.0
    }

    /// Power of the deviation at an angle. What has the angle of a class and does not change is an offset: there, only growth counts.
    fn power(&self, angle_turns: f32) -> f32 {
        let square = |shape: &[[f32; 2]; CHANNELS]| shape.iter().flatten().map(|x| x * x).sum::<f32>();
        let turns = angle_turns * self.classes() as f32;
        let from_class = (turns - crate::math::round(turns)).abs() * self.length as f32;
        if from_class > self.classes() as f32 {
            return square(&self.demodulate(angle_turns));
        }
        // A ramp has no offset; what doubles within the window has a third of its mean square in it.
        let middle = 0.5 * (self.length - 1) as f32;
        let mut shape = [[0.0; 2]; CHANNELS];
        for row in 0..self.length {
            let (sin, cos) = sin_cos_turns(angle_turns * row as f32);
            let weight = (row as f32 - middle) / middle;
            for (shape, value) in shape.iter_mut().zip(self.row(row)) {
                shape[0] += weight * value * cos;
                shape[1] -= weight * value * sin;
            }
        }
        3.0 * square(&shape)
    }

    /// Σ over the rows of the deviation times e^(−2πi·angle·row), class means taken off.
    fn demodulate(&self, angle_turns: f32) -> [[f32; 2]; CHANNELS] {
        let (mut means, mut counts) = ([[0.0; CHANNELS]; MAX_CLASSES], [0.0; MAX_CLASSES]);
        for row in 0..self.length {
            let class = self.class(row);
            for (mean, value) in means[class].iter_mut().zip(self.row(row)) {
                *mean += value;
            }
            counts[class] += 1.0;
        }
        let mut shape = [[0.0; 2]; CHANNELS];
        for row in 0..self.length {
            let class = self.class(row);
            let (sin, cos) = sin_cos_turns(angle_turns * row as f32);
            for ((shape, value), sum) in shape.iter_mut().zip(self.row(row)).zip(&means[class]) {
                let deviation = value - sum / counts[class];
                shape[0] += deviation * cos;
                shape[1] -= deviation * sin;
            }
        }
        shape
    }

    /// Cycles per tooth period of a flip: an odd number of halves, by the shape of what alternates, as it has changed since the reset.
    pub fn alternating_cycles(&self) -> Option<f32> {
        let mut shape = [[0.0; 2]; CHANNELS];
        for row in 0..self.length {
            let sign = if self.class(row).is_multiple_of(2) {
                1.0
            } else {
                -1.0
            };
            for (shape, value) in shape.iter_mut().zip(self.row(row)) {
                shape[0] += sign * value;
            }
        }
        strongest(&shape, 0.5)
    }
}

/// Cycles per tooth period, k + `angle_turns`, of the integer k with the most power within the tooth period. `shape` has the complex amplitude of
/// each channel.
pub(super) fn strongest(shape: &[[f32; 2]; CHANNELS], angle_turns: f32) -> Option<f32> {
    let mut best = (0.0, None);
    let half = SLOTS as i32 / 2;
    for k in -half..half {
        let cycles = k as f32 + angle_turns;
        let power = power_at(shape, cycles);
        if power > best.0 {
            best = (power, Some(cycles.abs()));
        }
    }
    best.1
}

/// Power of the shape at so many cycles per tooth period, over the axes.
fn power_at(shape: &[[f32; 2]; CHANNELS], cycles: f32) -> f32 {
    let mut sums = [[0.0; 2]; 3];
    for (slot, axes) in shape.chunks_exact(3).enumerate() {
        let (sin, cos) = sin_cos_turns(-cycles * slot as f32 / SLOTS as f32);
        for (sum, [re, im]) in sums.iter_mut().zip(axes) {
            sum[0] += re * cos - im * sin;
            sum[1] += re * sin + im * cos;
        }
    }
    sums.iter().flatten().map(|x| x * x).sum()
}
