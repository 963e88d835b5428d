//! Cuts in which force and motion amplify one another: near a lobe, and in chatter.
//!
//! The chips of a cut are computed along its motion u = x + n, n the noise of the sensors of motion. If the case is right it leaves
//!
//! r = e − H L n
//!
//! of a channel with noise e: H is what the channel hears of a force, L what the force owes to a small motion (`mean_slopes`). Where a
//! cut is well away from its limit, the motion that the case has in closed loop follows from the measured one without its noise. Near it
//! that is not so: (I − H L)⁻¹ is as large as a free motion of the cut lives long, which was there before the record began, and in
//! chatter it has grown. There the motion stays the measured one, and r is compared with the noise that it has:
//!
//! S(ω) = (I − A) D (I − A)ᴴ + P Q Pᴴ
//!
//! with D = diag(σ²) over the channels, A = P L M, P what channels hear of forces (of a force its own axis), M how the measured
//! channels make up the motion, and Q what slopes that come and go carry from other frequencies ([`MeanSlopes::carried`]).

use nalgebra::{DMatrix, Matrix3};
use num_complex::Complex64;
use quietcut_numerics::singular_values::singular_values;

use crate::motion::mean_slopes::MeanSlopes;
use crate::motion::recorded_cut::RecordedCut;
use crate::records::channel::main_axis;
use crate::records::motion_estimate::weighed;
use crate::records::record::Record;
use quietcut_recording::Quantity;

/// |I − H L| below which the loop is not closed: near a resonance it is the damping of a free motion of the cut over that of the structure
/// alone.
const NEARLY_SINGULAR: f64 = 0.1;
/// Share of a motion that does not come again turn after turn, from which on it is chatter.
const NEW_EACH_TURN: f64 = 0.2;
/// Parts of a turn over which that is looked at.
const PARTS: usize = 256;

/// True of a cut whose closed loop is nearly singular at some frequency or not stable, or whose motion, in every channel, is new in each
/// turn to a good part.
///
/// By Nyquist the loop with mean slopes is not stable where det(I − H L) goes around the origin as ω goes from 0 to where H has died.
pub(crate) fn amplifies(record: &Record, cut: &RecordedCut, slopes: &MeanSlopes) -> bool {
    let mut turned_rad = 0.0;
    let mut before = Complex64::ONE;
    for bin in 1..record.grid.bins() {
        let open = record.transfer[bin] * slopes.at(record.grid.omega(bin));
        let closing: Matrix3<Complex64> = Matrix3::identity() - open;
        // A loop whose singular values cannot be computed counts as nearly singular.
        let values = singular_values(DMatrix::from_column_slice(3, 3, closing.as_slice()));
        if values.map_or(true, |values| values.min() < NEARLY_SINGULAR) {
            return true;
        }
        let determinant = closing.determinant();
        turned_rad += (determinant * before.conj()).arg();
        before = determinant;
    }
    f64::abs(turned_rad) > std::f64::consts::PI || is_new_each_turn(record, cut)
}

fn is_new_each_turn(record: &Record, cut: &RecordedCut) -> bool {
    let part_of = |sample: usize| {
        let turned = cut
            .spindle_motion
            .angle_rad(sample as f64 / record.grid.rate_hz())
            / std::f64::consts::TAU;
        ((turned.rem_euclid(1.0) * PARTS as f64) as usize).min(PARTS - 1)
    };
    let share = |samples: &[f64]| {
        let mut sums = [(0.0, 0.0, 0.0); PARTS];
        for sample in record.compared.clone() {
            let (count, sum, square) = &mut sums[part_of(sample)];
            *count += 1.0;
            *sum += samples[sample];
            *square += samples[sample] * samples[sample];
        }
        let (count, sum, square) = sums
            .iter()
            .fold((0.0, 0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1, a.2 + b.2));
        let within: f64 = sums
            .iter()
            .filter(|part| part.0 > 0.0)
            .map(|(count, sum, square)| square - sum * sum / count)
            .sum();
        within / (square - sum * sum / f64::max(count, 1.0)).max(f64::MIN_POSITIVE)
    };
    let mut of_motion = record
        .channels
        .iter()
        .filter(|channel| channel.pickup.quantity != Quantity::Force)
        .peekable();
    of_motion.peek().is_some() && of_motion.all(|channel| share(&channel.measured) > NEW_EACH_TURN)
}

/// The noise of a record that amplifies.
pub(crate) struct LoopNoise<'a> {
    record: &'a Record,
    slopes: MeanSlopes,
    /// Q.
    carried: Matrix3<f64>,
}

impl<'a> LoopNoise<'a> {
    /// `None` of a record that does not amplify.
    pub(crate) fn of(record: &'a Record) -> Option<Self> {
        let slopes = record.cut.as_ref().filter(|_| record.amplifies)?.mean_slopes();
        let mut noise = Self {
            record,
            slopes,
            carried: Matrix3::zeros(),
        };
        let bins = record.grid.bins();
        let mut power_m2 = [0.0; 3];
        for bin in 1..bins {
            let makes_up = noise.makes_up(record.grid.omega(bin), bin);
            for (axis, power_m2) in power_m2.iter_mut().enumerate() {
                let channels = record.channels.iter().enumerate();
                let of_bin: f64 = channels
                    .map(|(index, channel)| makes_up[(axis, index)].norm_sqr() * channel.deviation.powi(2))
                    .sum();
                *power_m2 += of_bin / (bins - 1) as f64;
            }
        }
        noise.carried = noise.slopes.carried(power_m2);
        Some(noise)
    }

    /// S(ω).
    pub(crate) fn covariance(&self, omega: f64) -> DMatrix<Complex64> {
        let record = self.record;
        let channels = record.channels.len();
        let bin = ((omega / record.grid.omega(1)).round() as usize).min(record.grid.bins() - 1);
        let hears = DMatrix::from_fn(channels, 3, |index, axis| self.hears(index, axis, omega, bin));
        let slope = self.slopes.at(omega);
        let slope = DMatrix::from_fn(3, 3, |i, j| slope[(i, j)]);
        let through = DMatrix::identity(channels, channels) - &hears * slope * self.makes_up(omega, bin);
        let own = DMatrix::from_fn(channels, channels, |i, j| {
            let power = record.channels[i].deviation.powi(2);
            Complex64::from(if i == j { power } else { 0.0 })
        });
        let carried = DMatrix::from_fn(3, 3, |i, j| Complex64::from(self.carried[(i, j)]));
        &through * own * through.adjoint() + &hears * carried * hears.adjoint()
    }

    /// An entry of P.
    fn hears(&self, index: usize, axis: usize, omega: f64, bin: usize) -> Complex64 {
        let channel = &self.record.channels[index];
        if channel.pickup.quantity == Quantity::Force {
            return Complex64::from(channel.pickup.weights[axis]);
        }
        let transfer = &self.record.seen_by(channel)[bin];
        let weights = channel.pickup.weights.iter().enumerate();
        let read: Complex64 = weights.map(|(row, weight)| transfer[(row, axis)] * *weight).sum();
        read * channel.factor(omega)
    }

    /// M.
    fn makes_up(&self, omega: f64, bin: usize) -> DMatrix<Complex64> {
        let record = self.record;
        let mut makes_up = DMatrix::zeros(3, record.channels.len());
        for axis in 0..3 {
            let Some(share) = record.measured_share[axis].get(bin) else {
                continue;
            };
            let mut precision = 0.0;
            for (index, channel) in record.channels.iter().enumerate() {
                if channel.pickup.quantity == Quantity::Force || main_axis(channel) != Some(axis) {
                    continue;
                }
                if let Some((factor, gain)) = weighed(channel, axis, omega, record.lowest_hz) {
                    makes_up[(axis, index)] = gain * share / factor;
                    precision += gain;
                }
            }
            if precision > 0.0 {
                makes_up.row_mut(axis).scale_mut(1.0 / precision);
            }
        }
        makes_up
    }
}
