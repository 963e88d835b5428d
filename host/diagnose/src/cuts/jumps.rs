//! Orders where the cutting force jumps: at entry and exit of the teeth.
//!
//! The orders of a jump fall as slowly as 1/k, and all that lie above half the sample rate fold. Of a jump by F at the
//! spindle angle θ they are F/(2πik)·e^{−ikθ}, those of a sawtooth. A prediction is therefore folded without the sawteeth
//! of its jumps, and these are sampled at the angles of the samples, reduced as the record is, and added.
//!
//! A sample beside a jump is before or after it as the spindle angle there is, and its angle is known with an error. If a
//! jump is late by the angle δ, the orders of the force change by
//!
//! ```text
//! ΔF_k = −F δ e^{−ikθ} / 2π.
//! ```
//!
//! Where samples keep their place within the revolution, this error is the same in all revolutions.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, Vector3};
use num_complex::Complex64;
use rayon::prelude::*;

use super::machine::Machine;
use crate::orders::reduction::Orders;
use quietcut_stability::cut_orbit::{CutOrbit, ForceOrders};

/// Standard deviation of the angles of entry and exit, rad: that of a radial depth that is known to a thousandth of the
/// radius of the tool, at 90°.
const ENGAGEMENT: f64 = 1e-3;

/// Range of the delay of a jump for which sawteeth are sampled, in samples, and the number of delays: four to a sample.
const RANGE: f64 = 4.0;
const PHASES: usize = 33;
/// Number of moments of the samples beside a jump.
const MOMENTS: u32 = 3;
/// Largest deviation of the phase for which sawteeth are sampled, rad.
const LARGEST_PHASE: f64 = 0.1;
/// Distance of the spindle angles of the same jump, rad.
const SAME_ANGLE: f64 = 1e-6;

/// A jump of the force.
struct Jump {
    /// Spindle angle, rad.
    angle_rad: f64,
    /// Force after it minus that before it, N.
    force_n: Vector3<f64>,
    is_exit: bool,
}

/// A jump of a channel.
pub(super) struct ChannelJump {
    /// Spindle angle, rad.
    pub angle_rad: f64,
    /// Angle by which the channel shows it early: the phase of the tachometer less the delay of the channel, rad.
    pub early_rad: f64,
    /// Value after it minus that before it, in the unit of the channel.
    pub size: f64,
}

/// What jumps of the force leave in the orders of a record.
pub(super) struct OfJumps {
    sawteeth: Vec<Sawtooth>,
    /// Largest phase at which sawteeth are known, rad.
    range_rad: f64,
    /// One standard deviation of each angle of the engagement, and of the samples beside each jump.
    pub directions: Vec<DMatrix<Complex64>>,
    /// What jumps leave in the trend: their folded orders, which may move slowly against the others, and samples beside
    /// them that are seen on their other side for a part of the record.
    pub trends: Vec<DMatrix<Complex64>>,
}

/// A sawtooth that jumps by 1.
struct Sawtooth {
    angle_rad: f64,
    /// Amplitudes as the record shows them, by the angle by which the jump is early, equally spaced over its range.
    seen: Vec<Vec<Complex64>>,
}

impl OfJumps {
    /// For the jumps of the force of a machine on its orbit, if there is one.
    pub(super) fn new(
        machine: &Machine,
        orbit: Option<&CutOrbit>,
        rate_hz: f64,
        orders: &Orders,
        revolutions: &[f64],
    ) -> Self {
        let jumps = jumps(machine, orbit);
        let largest = jumps.iter().map(|jump| jump.force_n.norm()).fold(0.0, f64::max);
        let acting: Vec<&Jump> = jumps
            .iter()
            .filter(|jump| jump.force_n.norm() > 1e-9 * largest)
            .collect();
        let mut directions = of_engagement(machine, orders, &acting);
        let beside: Vec<_> = acting
            .iter()
            .flat_map(|jump| beside(machine, jump, rate_hz, orders))
            .collect();
        let mut trends = Vec::new();
        if orders.trend.is_some() {
            let folded = |jump: &&Jump| folded_trend(machine, jump, orders, revolutions);
            trends.extend(acting.iter().map(folded));
            trends.extend_from_slice(&beside);
        }
        directions.extend(beside);
        let range_rad = RANGE * TAU * orders.angle.frequency_hz / rate_hz;
        Self {
            trends,
            directions,
            sawteeth: sawteeth(&jumps, range_rad, orders, revolutions),
            range_rad,
        }
    }

    /// Amplitudes as the record shows them, of a channel with these Fourier coefficients and jumps, and their derivative
    /// by the phase of the tachometer.
    pub(super) fn seen(
        &self,
        orders: &Orders,
        coefficients: &[Complex64],
        jumps: &[ChannelJump],
    ) -> [Vec<Complex64>; 2] {
        let mut smooth = coefficients.to_vec();
        let mut sampled = [(); 2].map(|()| vec![Complex64::ZERO; orders.amplitudes.nrows()]);
        for jump in jumps {
            // Beyond the range the sawtooth is folded as the other orders are.
            let known = self.nearest(jump.angle_rad);
            let Some(sawtooth) = known.filter(|_| jump.early_rad.abs() <= self.range_rad) else {
                continue;
            };
            for (order, coefficient) in smooth.iter_mut().enumerate().skip(1) {
                *coefficient -= jump.size * of_sawtooth(order, jump.angle_rad - jump.early_rad);
            }
            let step_rad = 2.0 * self.range_rad / (PHASES - 1) as f64;
            let place = (jump.early_rad + self.range_rad) / step_rad;
            let first = (place as usize).min(PHASES - 2);
            let pairs = sawtooth.seen[first].iter().zip(&sawtooth.seen[first + 1]);
            for (order, (one, next)) in pairs.enumerate() {
                sampled[0][order] += (one + (next - one) * (place - first as f64)) * jump.size;
                sampled[1][order] += (next - one) * (jump.size / step_rad);
            }
        }
        let turned: Vec<Complex64> = smooth
            .iter()
            .enumerate()
            .map(|(order, coefficient)| coefficient * Complex64::new(0.0, order as f64))
            .collect();
        let [mut value, mut slope] = sampled;
        for (sampled, smooth) in [(&mut value, &smooth), (&mut slope, &turned)] {
            for (sum, folded) in sampled.iter_mut().zip(orders.seen(smooth)) {
                *sum += folded;
            }
        }
        [value, slope]
    }

    fn nearest(&self, angle_rad: f64) -> Option<&Sawtooth> {
        let apart = |sawtooth: &&Sawtooth| apart(angle_rad, sawtooth.angle_rad);
        let nearest = self.sawteeth.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
        nearest.filter(|nearest| apart(nearest) < SAME_ANGLE)
    }
}

/// Fourier coefficient of a sawtooth that jumps by 1 at an angle.
fn of_sawtooth(order: usize, angle_rad: f64) -> Complex64 {
    let order = order as f64;
    Complex64::cis(-order * angle_rad) / Complex64::new(0.0, TAU * order)
}

/// The jumps of a machine at entry and exit of its teeth, on its orbit and where it is larger on a rigid tool without
/// runout. At 0° and 180° a chip begins and ends with thickness 0, but for the runout.
fn jumps(machine: &Machine, orbit: Option<&CutOrbit>) -> Vec<Jump> {
    let cutter = &machine.model.cutter;
    let on_orbit = orbit.map_or_else(Vec::new, |orbit| orbit.jumps_of_engagement(&machine.model));
    let mut all = Vec::new();
    for tooth in &cutter.teeth {
        for (edge_rad, sign) in [(cutter.start_rad, 1.0), (cutter.exit_rad, -1.0)] {
            let angle_rad = edge_rad - tooth.angle_rad;
            let at = cutter.immersion(edge_rad);
            let thickness_m = cutter.recession_m(at, tooth.feed_m).max(0.0);
            let rigid_n = sign * Vector3::from(cutter.force.force_n(at, thickness_m, cutter.depth_m));
            let own_n = on_orbit
                .iter()
                .filter(|(time_s, _)| apart(machine.model.rad_per_s * time_s, angle_rad) < SAME_ANGLE)
                .fold(Vector3::zeros(), |sum, (_, force_n)| {
                    sum + Vector3::from(*force_n)
                });
            all.push(Jump {
                angle_rad,
                force_n: if own_n.norm() > rigid_n.norm() {
                    own_n
                } else {
                    rigid_n
                },
                is_exit: sign < 0.0,
            });
        }
    }
    all
}

/// Smallest difference of two angles, rad.
fn apart(one_rad: f64, other_rad: f64) -> f64 {
    let turn = (one_rad - other_rad).rem_euclid(TAU);
    turn.min(TAU - turn)
}

/// The sawteeth of jumps, sampled at the angles of the samples and reduced.
fn sawteeth(jumps: &[Jump], range_rad: f64, orders: &Orders, revolutions: &[f64]) -> Vec<Sawtooth> {
    let seen = |jump: &Jump, phase: usize| {
        let share = 2.0 * phase as f64 / (PHASES - 1) as f64 - 1.0;
        let angle_rad = jump.angle_rad - range_rad * share;
        let samples = revolutions
            .iter()
            .map(|revolution| 0.5 - (revolution - angle_rad / TAU).rem_euclid(1.0));
        orders.of_samples(samples, revolutions)
    };
    jumps
        .par_iter()
        .map(|jump| Sawtooth {
            angle_rad: jump.angle_rad,
            seen: (0..PHASES).map(|phase| seen(jump, phase)).collect(),
        })
        .collect()
}

/// The trend of the channels of force and acceleration that a sawtooth of the size of a jump leaves.
fn folded_trend(machine: &Machine, jump: &Jump, orders: &Orders, revolutions: &[f64]) -> DMatrix<Complex64> {
    let samples: Vec<f64> = revolutions
        .iter()
        .map(|revolution| 0.5 - (revolution - jump.angle_rad / TAU).rem_euclid(1.0))
        .collect();
    let of_one = orders.trend_of(&samples, revolutions);
    let mut trend = DMatrix::zeros(orders.amplitudes.nrows(), orders.channels.len());
    for (channel, size) in sizes(machine, jump).into_iter().enumerate() {
        for (order, one) in of_one.iter().enumerate() {
            trend[(order, channel)] = one * size;
        }
    }
    trend
}

/// By edge of the engagement: the orders of one standard deviation of its angle, at which the force of all teeth jumps.
fn of_engagement(machine: &Machine, orders: &Orders, jumps: &[&Jump]) -> Vec<DMatrix<Complex64>> {
    [false, true]
        .into_iter()
        .filter_map(|is_exit| {
            let of_edge = jumps.iter().filter(|jump| jump.is_exit == is_exit);
            of_edge
                .map(|jump| {
                    let force_n = jump
                        .force_n
                        .map(|force| Complex64::from(-force * ENGAGEMENT / TAU));
                    impulse(machine, orders, force_n, jump.angle_rad)
                })
                .reduce(|sum, one| sum + one)
        })
        .collect()
}

/// What samples leave that are before a jump of a channel and taken as after it, or the reverse: they lie beside the
/// jump, not at it, so that their impulse has moments.
fn beside(machine: &Machine, jump: &Jump, rate_hz: f64, orders: &Orders) -> Vec<DMatrix<Complex64>> {
    let angle = &orders.angle;
    // Where samples keep their place within the revolution, a jump that is late by δ is seen late by the angle γ between
    // two samples with the probability δ/γ, and else not.
    let error = angle.angle_deviation_rad.hypot(ENGAGEMENT);
    let between = TAU * angle.frequency_hz / rate_hz;
    let deviation = error.max((error * between).sqrt());
    let apart = error.hypot(angle.phase_deviation_rad.min(LARGEST_PHASE));
    let sizes = sizes(machine, jump);
    if sizes.iter().all(|size| *size == 0.0) {
        return Vec::new();
    }
    let (rows, columns) = orders.amplitudes.shape();
    let moment = |times: u32| {
        DMatrix::from_fn(rows, columns, |order, channel| {
            let order = order as f64;
            let impulse = Complex64::cis(-order * jump.angle_rad) * (-sizes[channel] * deviation / TAU);
            impulse * Complex64::new(0.0, order * apart).powu(times)
        })
    };
    (0..MOMENTS).map(moment).collect()
}

/// Jumps of the channels of force and acceleration.
fn sizes(machine: &Machine, jump: &Jump) -> Vec<f64> {
    machine
        .reading
        .jump(&machine.model.structure, jump.force_n.into())
}

/// Orders of the channels under an impulse of the force at a spindle angle.
fn impulse(
    machine: &Machine,
    orders: &Orders,
    force_n: Vector3<Complex64>,
    angle_rad: f64,
) -> DMatrix<Complex64> {
    let impulse_n = DMatrix::from_fn(orders.amplitudes.nrows(), 3, |order, axis| {
        force_n[axis] * Complex64::cis(-(order as f64) * angle_rad)
    });
    machine.reading.orders(&ForceOrders {
        cutting_n: impulse_n.clone(),
        structure_n: impulse_n,
    })
}
