//! How plain an effect in disturbed cuts is, and which other causes could stand for it: distances between orders of the spindle in units
//! of their noise, over all values of what is uncertain.
//!
//! With Δ the change of the orders that an effect makes, Σ the covariance of their noise and J their derivatives by what is uncertain, in
//! standard deviations,
//!
//! ```text
//! d² = min over η of (Δ − J η)ᵀ Σ⁻¹ (Δ − J η) + ηᵀ η,
//! ```
//!
//! and with the rival cause r fitted, D_r² = min over its parameters of the same, Δ less what r makes.

use std::collections::BTreeSet;
use std::f64::consts::TAU;

use nalgebra::{Cholesky, Complex, DMatrix, DVector, Dyn};
use quietcut::recording::Recording;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::cause::{Cause, EffectKind};
use super::cut::CutBench;
use super::oracle::{Lab, Output, Verdict};
use super::uncertainty;

/// Distance squared from which on an effect is plain, and a rival cannot stand for it.
const PLAIN: f64 = 60.0;
/// Distance squared up to which a rival is equivalent.
const SAME: f64 = 2.0;
/// Parts of a record, whose orders are compared by themselves: what changes slowly is seen between them.
const PARTS: usize = 3;
/// Orders of a tooth passing that are compared.
const HARMONICS: usize = 10;

/// Orders of the cuts of a bench, whitened.
pub(crate) struct Plainness<'a> {
    bench: &'a CutBench,
    /// By cut: L⁻¹ of the covariance of the amplitudes of all channels, by order from 1.
    whiteners: Vec<Vec<DMatrix<Complex<f64>>>>,
    /// Orders of the machine without effects.
    plain: DVector<f64>,
    /// J, and the Cholesky factor of I + JᵀJ.
    uncertain: DMatrix<f64>,
    factor: Cholesky<f64, Dyn>,
}

/// Amplitudes of one part of a cut, orders from 1 × channels.
fn amplitudes(sensed: &[Vec<f64>], range: std::ops::Range<usize>, highest: usize) -> DMatrix<Complex<f64>> {
    let (angle, channels) = sensed.split_last().unwrap();
    let design = DMatrix::from_fn(range.len(), 2 * highest + 1, |row, column| {
        let order = column.div_ceil(2) as f64;
        let (sin, cos) = (order * angle[range.start + row]).sin_cos();
        if column == 0 {
            1.0
        } else if column % 2 == 1 {
            cos
        } else {
            sin
        }
    });
    let factor = Cholesky::new(design.tr_mul(&design)).unwrap();
    let values = DMatrix::from_fn(range.len(), channels.len(), |row, channel| {
        channels[channel][range.start + row]
    });
    let fitted = factor.solve(&design.tr_mul(&values));
    // y = Y₀ + 2 Re Σ Y_k e^{ikθ}.
    DMatrix::from_fn(highest, channels.len(), |order, channel| {
        0.5 * Complex::new(
            fitted[(2 * order + 1, channel)],
            -fitted[(2 * order + 2, channel)],
        )
    })
}

impl<'a> Plainness<'a> {
    /// The orders of a bench whose noise is that of its recordings; `disturbed` holds their spindle angles.
    pub(crate) fn new(bench: &'a CutBench, disturbed: &Output, recordings: &[Recording]) -> Self {
        let highest = HARMONICS * bench.job.teeth;
        let whiteners = disturbed
            .iter()
            .zip(recordings)
            .map(|(sensed, recording)| {
                let mut recorded: Vec<Vec<f64>> = recording.channels[..sensed.len() - 1]
                    .iter()
                    .map(|channel| channel.samples.clone())
                    .collect();
                recorded.push(sensed[sensed.len() - 1].clone());
                whiteners(&recorded, highest)
            })
            .collect();
        let mut found = Self {
            bench,
            whiteners,
            plain: DVector::zeros(0),
            uncertain: DMatrix::zeros(0, 0),
            factor: Cholesky::new(DMatrix::identity(0, 0)).unwrap(),
        };
        found.plain = found.orders(&bench.output(&[]));
        let count = uncertainty::count(&bench.machine);
        let columns: Vec<DVector<f64>> = (0..count)
            .into_par_iter()
            .map(|index| {
                let at = |step: f64| {
                    let mut z = vec![0.0; count];
                    z[index] = step;
                    found.orders(&bench.moved(&z).output(&[]))
                };
                at(0.5) - at(-0.5)
            })
            .collect();
        found.uncertain = DMatrix::from_columns(&columns);
        let normal = found.uncertain.tr_mul(&found.uncertain) + DMatrix::identity(count, count);
        found.factor = Cholesky::new(normal).unwrap();
        found
    }

    fn orders(&self, output: &Output) -> DVector<f64> {
        let highest = HARMONICS * self.bench.job.teeth;
        let mut values = Vec::new();
        for (sensed, whiteners) in output.iter().zip(&self.whiteners) {
            let length = sensed[0].len() / PARTS;
            for part in 0..PARTS {
                let found = amplitudes(sensed, part * length..(part + 1) * length, highest);
                for (order, whitener) in whiteners.iter().enumerate() {
                    let white = whitener * found.row(order).transpose();
                    // The real and the imaginary part have half the variance each; a part has a third of the samples.
                    let scale = (2.0 / PARTS as f64).sqrt();
                    values.extend(
                        white
                            .iter()
                            .flat_map(|value| [scale * value.re, scale * value.im]),
                    );
                }
            }
        }
        DVector::from_vec(values)
    }

    /// aᵀ (I + J Jᵀ)⁻¹ b.
    fn product(&self, a: &DVector<f64>, b: &DVector<f64>) -> f64 {
        let (left, right) = (self.uncertain.tr_mul(a), self.uncertain.tr_mul(b));
        a.dot(b) - left.dot(&self.factor.solve(&right))
    }

    /// d² of causes.
    pub(crate) fn distance(&self, causes: &[Cause]) -> f64 {
        let change = self.orders(&self.bench.output(causes)) - &self.plain;
        self.product(&change, &change)
    }

    /// D² of `truth` and the best `rival` from its start.
    fn nearest(&self, truth: &DVector<f64>, rival: &Cause) -> f64 {
        let mut best = rival.clone();
        let mut left = truth - self.orders(&self.bench.output(std::slice::from_ref(&best)));
        let mut least = self.product(&left, &left);
        for round in 0..5 {
            let count = best.shares.len();
            let at = self.orders(&self.bench.output(std::slice::from_ref(&best)));
            let columns: Vec<DVector<f64>> = (0..count)
                .map(|index| {
                    let mut moved = best.clone();
                    let step = 1e-2 * moved.shares[index].abs().max(0.05);
                    moved.shares[index] += step;
                    (self.orders(&self.bench.output(&[moved])) - &at) / step
                })
                .collect();
            let normal = DMatrix::from_fn(count, count, |i, j| self.product(&columns[i], &columns[j]));
            let gradient = DVector::from_fn(count, |i, _| self.product(&columns[i], &left));
            let Some(step) = normal.clone().lu().solve(&gradient) else {
                break;
            };
            let reached = least - gradient.dot(&step);
            if round == 0 && reached > 0.5 * least && reached > 4.0 * PLAIN {
                return reached;
            }
            let mut accepted = false;
            for shorter in [1.0, 0.3, 0.1] {
                let mut moved = best.clone();
                for (share, step) in moved.shares.iter_mut().zip(step.iter()) {
                    *share += (shorter * step).clamp(-1.0, 1.0);
                }
                if !moved.sensible() {
                    continue;
                }
                let next = truth - self.orders(&self.bench.output(std::slice::from_ref(&moved)));
                let distance = self.product(&next, &next);
                if distance < least {
                    accepted = least - distance > 0.1;
                    (best, left, least) = (moved, next, distance);
                    break;
                }
            }
            if !accepted || least < 0.5 * SAME {
                break;
            }
        }
        least
    }

    /// d² of a hidden effect, and whether it is plain and separable.
    pub(crate) fn verdict(&self, hidden: &Cause, random: &mut ChaCha8Rng) -> (f64, Verdict) {
        let distance = self.distance(std::slice::from_ref(hidden));
        if distance < SAME {
            return (distance, Verdict::Invisible);
        }
        if distance.is_nan() || distance < PLAIN {
            return (distance, Verdict::Borderline);
        }
        let truth = self.orders(&self.bench.output(std::slice::from_ref(hidden)));
        let mut rivals = Vec::new();
        let mut kinds = self.bench.kinds();
        // It is seen in the spindle angle.
        kinds.retain(|kind| *kind != EffectKind::SpeedFluctuation);
        if hidden.kind == EffectKind::SensorGain {
            kinds.push(EffectKind::CommonForce);
        }
        for kind in kinds {
            for (axis, sensor) in self.bench.places(kind) {
                for shares in kind.starts(random) {
                    let rival = Cause {
                        kind,
                        axis,
                        sensor,
                        shares,
                    };
                    let is_own = kind == hidden.kind && (axis, sensor) == (hidden.axis, hidden.sensor);
                    if !is_own {
                        rivals.push(rival);
                    }
                }
            }
        }
        let distances: Vec<(EffectKind, f64)> = rivals
            .par_iter()
            .map(|rival| (rival.kind, self.nearest(&truth, rival)))
            .collect();
        let mut same = BTreeSet::from([hidden.kind.name()]);
        let mut is_grey = false;
        for (kind, distance) in distances {
            if distance <= SAME {
                same.extend(self.bench.names(kind));
            } else if distance.is_nan() || distance < PLAIN {
                is_grey = true;
            }
        }
        let verdict = match (is_grey, same.len()) {
            (true, _) => Verdict::Borderline,
            (false, 1) => Verdict::Separable,
            _ => Verdict::Equivalent(same),
        };
        (distance, verdict)
    }
}

/// L⁻¹ of the covariance of the amplitudes of a whole record, by order from 1: the power of what is no order, about each order.
fn whiteners(recorded: &[Vec<f64>], highest: usize) -> Vec<DMatrix<Complex<f64>>> {
    let count = recorded[0].len();
    let (angle, channels) = recorded.split_last().unwrap();
    let found = amplitudes(recorded, 0..count, highest);
    let left: Vec<Vec<f64>> = channels
        .iter()
        .enumerate()
        .map(|(channel, samples)| {
            let mean = samples.iter().sum::<f64>() / count as f64;
            samples
                .iter()
                .zip(angle)
                .map(|(value, angle)| {
                    let turn = Complex::cis(*angle);
                    let mut power = Complex::ONE;
                    let mut periodic = mean;
                    for order in 0..highest {
                        power *= turn;
                        periodic += 2.0 * (found[(order, channel)] * power).re;
                    }
                    value - periodic
                })
                .collect()
        })
        .collect();
    let window: Vec<f64> = (0..count)
        .map(|k| 0.5 - 0.5 * (TAU * (k as f64 + 0.5) / count as f64).cos())
        .collect();
    let squares: f64 = window.iter().map(|w| w * w).sum();
    let turns = (angle[count - 1] - angle[0]) / TAU;
    (1..=highest)
        .map(|order| {
            let mut sum = DMatrix::<Complex<f64>>::zeros(channels.len(), channels.len());
            let mut bins = 0.0;
            for offset in -20..=20 {
                // Lines of the orders themselves are taken out, and their neighbours with them.
                let place = order as f64 + f64::from(offset) * 1.5 / 20.0;
                if (place - place.round()).abs() * turns < 2.0 || place <= 0.0 {
                    continue;
                }
                let line = DVector::from_iterator(
                    channels.len(),
                    left.iter().map(|left| {
                        left.iter()
                            .zip(&window)
                            .zip(angle)
                            .map(|((value, w), angle)| Complex::cis(-place * angle) * (value * w))
                            .sum::<Complex<f64>>()
                    }),
                );
                sum += &line * line.adjoint();
                bins += squares;
            }
            let covariance = sum / Complex::from(bins * count as f64);
            Cholesky::new(covariance).unwrap().l().try_inverse().unwrap()
        })
        .collect()
}
