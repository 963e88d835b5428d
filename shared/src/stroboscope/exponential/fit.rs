//! The fit for a given rate and angle, and the step to better ones.

use super::column::{Column, dot};
use super::guess::{ANGLES, Guess};
use super::nuisance::Nuisance;
use crate::math::{exp, sin_cos_turns, sqrt};
use crate::stroboscope::{CAPACITY, Window};
use crate::synchronous::CHANNELS;

/// ln|μ| from and to. Faster growth is seen by the linear prediction.
const RATES: (f32, f32) = (-0.08, 0.2);
/// The longest step in rate and in angle: of the angle a quarter of the resolution of the longest window, 1/64 turn.
const LONGEST_STEP: (f32, f32) = (0.02, 0.004);
/// Class means and line must leave so much of the determinant of the Gram matrix of the two basis functions.
const LEAST_DETERMINANT: f32 = 1e-2;

/// A value of cosine and one of sine for each channel.
type Pairs = [[f32; 2]; CHANNELS];

/// A symmetric matrix of two rows: first, both, second.
#[derive(Clone, Copy)]
struct Gram([f32; 3]);

impl Gram {
    fn of([a, b]: &[Column; 2]) -> Self {
        Self([dot(a, a), dot(a, b), dot(b, b)])
    }

    fn determinant(self) -> f32 {
        let [first, both, second] = self.0;
        first * second - both * both
    }

    /// xᵀ·inverse·y.
    fn inverse_product(self, [a, b]: [f32; 2], [c, d]: [f32; 2]) -> f32 {
        let [first, both, second] = self.0;
        (a * (second * c - both * d) + b * (first * d - both * c)) / self.determinant()
    }
}

/// e^{g·k}·cos 2πθk and e^{g·k}·sin 2πθk, k = 0 at the newest of `length` rows.
pub(super) fn turning(guess: Guess, length: usize) -> [Column; 2] {
    let (sin, cos) = sin_cos_turns(-guess.angle_turns);
    let shrink = exp(-guess.rate);
    let (sin, cos) = (shrink * sin, shrink * cos);
    let mut columns = [[0.0; CAPACITY]; 2];
    let (mut re, mut im) = (1.0, 0.0);
    let [first, second] = &mut columns;
    for (c, s) in first.iter_mut().zip(second.iter_mut()).take(length).rev() {
        (*c, *s) = (re, im);
        (re, im) = (re * cos - im * sin, re * sin + im * cos);
    }
    columns
}

/// Σ over the rows of columns times passing.
fn project(window: &Window<'_>, columns: &[Column; 2]) -> Pairs {
    let mut sums = [[0.0; 2]; CHANNELS];
    for (row, (a, b)) in columns[0]
        .iter()
        .zip(&columns[1])
        .enumerate()
        .take(window.length())
    {
        for ([x, y], value) in sums.iter_mut().zip(window.row(row)) {
            *x += a * value;
            *y += b * value;
        }
    }
    sums
}

/// A fit with given rate and angle.
pub(super) struct Fit {
    pub(super) guess: Guess,
    /// Cosine and sine with the nuisance taken off.
    pub(super) basis: [Column; 2],
    gram: Gram,
    /// Amplitudes of cosine and sine.
    pub(super) amplitudes: Pairs,
    /// Power that is explained.
    pub(super) power: f32,
}

impl Fit {
    /// `None` where the nuisance leaves too little of what turns so.
    #[inline(never)]
    pub(super) fn new(window: &Window<'_>, nuisance: &Nuisance, guess: Guess) -> Option<Self> {
        let mut basis = turning(guess, nuisance.length);
        let scale = dot(&basis[0], &basis[0]) * dot(&basis[1], &basis[1]);
        for column in &mut basis {
            nuisance.take_off(column);
        }
        let gram = Gram::of(&basis);
        let determinant = gram.determinant();
        let is_left = determinant > LEAST_DETERMINANT * scale;
        if !is_left {
            return None;
        }
        let mut amplitudes = project(window, &basis);
        let mut power = 0.0;
        for pair in &mut amplitudes {
            let projected = *pair;
            *pair = [
                gram.inverse_product([1.0, 0.0], projected),
                gram.inverse_product([0.0, 1.0], projected),
            ];
            power += pair[0] * projected[0] + pair[1] * projected[1];
        }
        Some(Self {
            guess,
            basis,
            gram,
            amplitudes,
            power,
        })
    }

    /// Rate and angle after a step of Gauss and Newton.
    #[inline(never)]
    pub(super) fn improve(&self, window: &Window<'_>, nuisance: &Nuisance) -> Guess {
        // ∂/∂g and ∂/∂2πθ of A·c + B·s are k·(A·c + B·s) and k·(B·c − A·s).
        let mut slopes = turning(self.guess, nuisance.length);
        for column in &mut slopes {
            for (row, value) in column.iter_mut().enumerate().take(nuisance.length) {
                *value *= (row + 1) as f32 - nuisance.length as f32;
            }
            nuisance.take_off(column);
        }
        let [cos, sin] = &self.basis;
        let across = [0, 1].map(|i: usize| [dot(&slopes[i], cos), dot(&slopes[i], sin)]);
        // What of the slopes the basis does not explain: the Schur complement.
        let own = Gram::of(&slopes).0;
        let through = |i: usize, j: usize| self.gram.inverse_product(across[i], across[j]);
        let left = [
            own[0] - through(0, 0),
            own[1] - through(0, 1),
            own[2] - through(1, 1),
        ];
        let (mut aa, mut ab, mut bb, mut by_rate, mut by_angle) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for ([a, b], [r, s]) in self.amplitudes.iter().zip(project(window, &slopes)) {
            let r = r - across[0][0] * a - across[0][1] * b;
            let s = s - across[1][0] * a - across[1][1] * b;
            (aa, ab, bb) = (aa + a * a, ab + a * b, bb + b * b);
            by_rate += a * r + b * s;
            by_angle += b * r - a * s;
        }
        let normal = Gram([
            aa * left[0] + 2.0 * ab * left[1] + bb * left[2],
            ab * (left[0] - left[2]) + (bb - aa) * left[1],
            bb * left[0] - 2.0 * ab * left[1] + aa * left[2],
        ]);
        let is_regular = normal.determinant() > 1e-6 * normal.0[0] * normal.0[2];
        if !is_regular {
            return self.guess;
        }
        let right = [by_rate, by_angle];
        let rate = normal.inverse_product([1.0, 0.0], right);
        let angle = normal.inverse_product([0.0, 1.0], right) / core::f32::consts::TAU;
        let within = |x: f32, limit: f32| x.clamp(-limit, limit);
        let old = self.guess;
        Guess {
            rate: (old.rate + within(rate, LONGEST_STEP.0)).clamp(RATES.0, RATES.1),
            angle_turns: (old.angle_turns + within(angle, LONGEST_STEP.1)).clamp(ANGLES.0, ANGLES.1),
        }
    }

    /// Length of the vector of amplitudes, over √2: what a passing has on the average.
    pub(super) fn size(&self) -> f32 {
        let square: f32 = self.amplitudes.iter().flatten().map(|a| a * a).sum();
        sqrt(0.5 * square)
    }
}
