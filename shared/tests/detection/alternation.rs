//! Vibration that alternates from tooth to tooth in stable cuts, from runout alone: how large it is before it can be no runout.
//!
//! With two teeth, tooth j reaches r·(−1)^j beyond the nominal circle. The chip thickness is f·sin φ without runout and differs by 2r from tooth to
//! tooth with it, so that about the stable orbit
//!
//! ```text
//! alternating vibration / tooth-periodic vibration = G·r/f
//! ```
//!
//! where G is the ratio of the closed-loop responses at half the tooth frequency and at the tooth frequency. It is large where a flip is near:
//! the multiplier −|μ| of the stable cut amplifies what alternates by 1/(1 − |μ|). The signal chain raises an alarm for "flip or runout" beyond
//! the 99.9 % quantile of G at an assumed r/f.

use std::fmt::Write;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::floquet::{depth_of, multiplier};
use super::integrator::Integrator;
use super::machine::Machine;
use super::session::STABLE;

/// Slots of a tooth period over which the signal chain takes means.
const SLOTS: usize = 8;
/// Passings until the orbit is reached: with |μ| = 0.95, 0.95^200 = 4·10⁻⁵.
const SETTLING: usize = 200;

/// G of each machine with two teeth that these seeds draw, at a depth where |μ| lies between 0.6 and [`STABLE`].
fn ratios(seeds: std::ops::Range<u64>) -> Vec<f64> {
    seeds.filter_map(ratio).collect()
}

fn ratio(seed: u64) -> Option<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut machine = Machine::draw(&mut random);
    machine.teeth = 2;
    machine.turns_per_second = machine.turns_per_second.min(500.0);
    let abs = random.random_range(0.6..STABLE);
    if multiplier(&machine, 0.0).norm() > 0.98 * abs {
        return None;
    }
    let depth_m = depth_of(&machine, abs)?;
    let alternating_m = 0.5 * (machine.runout(0) - machine.runout(1)).abs();
    let [even, odd] = orbit(&machine, depth_m);
    let (mut alternating, mut common, mut mean) = (0.0, 0.0, [0.0; 2]);
    for (a, b) in even.iter().zip(&odd) {
        for axis in 0..2 {
            alternating += (0.5 * (a[axis] - b[axis])).powi(2);
            common += (0.5 * (a[axis] + b[axis])).powi(2);
            mean[axis] += 0.5 * (a[axis] + b[axis]) / SLOTS as f64;
        }
    }
    common -= SLOTS as f64 * (mean[0] * mean[0] + mean[1] * mean[1]);
    // The wear of numbers: without runout the ratio has no meaning.
    let relative = alternating_m / machine.feed_per_tooth_m;
    (relative > 1e-3 && common > 0.0).then(|| (alternating / common).sqrt() / relative)
}

/// Means of the acceleration over the slots of two successive tooth periods on the orbit.
fn orbit(machine: &Machine, depth_m: f64) -> [[[f64; 2]; SLOTS]; 2] {
    let mut integrator = Integrator::new(machine);
    let steps = integrator.steps();
    for _ in 0..SETTLING * steps {
        integrator.advance(machine.turns_per_second, depth_m);
    }
    [0, 1].map(|_| {
        let (mut sums, mut counts) = ([[0.0; 2]; SLOTS], [0.0; SLOTS]);
        for step in 0..steps {
            let slot = step * SLOTS / steps;
            let acceleration = integrator.advance(machine.turns_per_second, depth_m);
            sums[slot] = [0, 1].map(|axis| sums[slot][axis] + acceleration[axis]);
            counts[slot] += 1.0;
        }
        std::array::from_fn(|slot| sums[slot].map(|sum| sum / counts[slot]))
    })
}

/// Quantiles of G as text.
pub fn report(seeds: std::ops::Range<u64>) -> String {
    let mut found = ratios(seeds);
    found.sort_by(f64::total_cmp);
    let mut text = format!(
        "G of {} stable cuts with two teeth and runout\n\n| quantile | G |\n|---|---|\n",
        found.len()
    );
    for share in [0.5, 0.9, 0.99, 0.999] {
        let place = ((share * found.len() as f64).ceil() as usize).clamp(1, found.len().max(1)) - 1;
        if let Some(g) = found.get(place) {
            let _ = writeln!(text, "| {} % | {g:.2} |", 100.0 * share);
        }
    }
    text
}
