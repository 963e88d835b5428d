//! Frequency of the vibration that belongs to a Floquet multiplier (characteristic multiplier).

use std::f64::consts::TAU;

use nalgebra::{DVector, Vector3};
use num_complex::Complex64;

use super::period_parts::PeriodParts;
use crate::problem::element::Port;
use crate::problem::linear::Problem;
use crate::problem::period::{Period, Rates};

/// Vibration frequency, Hz, of the motion u(t) = e^{st} v(t), with v periodic in the tooth period τ and e^{sτ} = μ;
/// `None` if it cannot be computed.
///
/// The motion contains the frequencies |Im ln μ + 2πk|/(2πτ). The result is the one whose harmonic of the tool
/// displacement, û_k = 1/τ ∫₀^τ u(t) e^{−s_k t} dt, has the largest norm. With F̂_k the k-th harmonic of all forces
/// along the Floquet mode, û_k = H(s_k) F̂_k; without forces the motion is free and has the frequency of a structural
/// mode.
pub(crate) fn chatter_hz(
    problem: &Problem,
    rpm: f64,
    period: &Period,
    multiplier: Complex64,
    depth_m: f64,
) -> Option<f64> {
    let forces = eigenfunction_forces(period, multiplier, depth_m)?;
    let period_s = problem.tooth_period_s(rpm);
    if forces.iter().all(|(_, force)| force.norm() == 0.0) {
        return free_hz(problem, period_s, multiplier);
    }
    // For each node: e^{−s t} at the present exponent s, and the factor that leads to the next exponent s + 2πi/T.
    // Computing every exponential anew would take seconds.
    let mut factors: Vec<(Complex64, Complex64)> = Vec::new();
    dominant_frequency_hz(problem, depth_m, period_s, multiplier, |s| {
        let mut harmonic = Vector3::<Complex64>::zeros();
        if factors.is_empty() {
            let times = forces.iter().map(|(time_s, _)| *time_s);
            factors
                .extend(times.map(|time_s| ((-s * time_s).exp(), Complex64::cis(-TAU * time_s / period_s))));
        }
        for ((_, force), (factor, turn)) in forces.iter().zip(&mut factors) {
            harmonic += force * *factor;
            *factor *= *turn;
        }
        Some((problem.structure.transfer(s)? * harmonic).norm())
    })
}

/// Frequency, Hz, of the structural mode that a period of free vibration multiplies by the factor nearest to μ; `None`
/// if the structure has no pole.
fn free_hz(problem: &Problem, period_s: f64, multiplier: Complex64) -> Option<f64> {
    let miss = |pole: &Complex64| ((pole * period_s).exp() - multiplier).norm();
    let poles = problem.structure.poles();
    let pole = poles.iter().min_by(|p, q| miss(p).total_cmp(&miss(q)))?;
    Some(pole.im.abs() / TAU)
}

/// Frequency, Hz, among |Im ln μ + 2πk|/(2πT) at which the motion is largest. `size` gives the norm of the harmonic at
/// an exponent s with e^{sT} = μ; it is called for ascending Im s in steps of 2π/T. `None` if `size` gives a value for
/// no exponent.
pub(crate) fn dominant_frequency_hz(
    problem: &Problem,
    depth_m: f64,
    period_s: f64,
    multiplier: Complex64,
    mut size: impl FnMut(Complex64) -> Option<f64>,
) -> Option<f64> {
    let growth = multiplier.ln();
    // The cut stiffens modes. Above the fastest rate of the structure with cut the harmonics only decrease, and one
    // further harmonic suffices.
    let kappa_m = (Complex64::ONE - multiplier.inv()).norm() * depth_m;
    let highest = (Rates::new(problem).at(kappa_m) * period_s / TAU).ceil() as i32 + 1;
    (-highest..=highest)
        .filter_map(|k| {
            let s = (growth + Complex64::new(0.0, TAU * f64::from(k))) / period_s;
            Some((size(s)?, s.im.abs() / TAU))
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, frequency_hz)| frequency_hz)
}

/// Forces along the Floquet mode times quadrature weight, each with the time of its node. The forces of teeth that cut
/// at the same node are added. `None` if an element is singular, or if [`PeriodParts`] finds no states.
fn eigenfunction_forces(
    period: &Period,
    multiplier: Complex64,
    depth_m: f64,
) -> Option<Vec<(f64, Vector3<Complex64>)>> {
    let kappa = (Complex64::ONE - multiplier.inv()) * depth_m;
    let parts = PeriodParts::new(period, multiplier, depth_m)?;
    let starts = parts.starts(multiplier)?;
    let mut forces: Vec<(f64, Vector3<Complex64>)> = Vec::new();
    for (element, of_part) in period.elements.iter().zip(parts.elements) {
        let start = &starts[of_part.part];
        let mut push = |ports: &[Port], seen: DVector<Complex64>, factor: Complex64| {
            for (port, seen) in ports.iter().zip(seen.iter()) {
                let force = port.force.map(Complex64::from) * (seen * factor * port.weight_s);
                match forces.last_mut() {
                    // Another tooth cuts at the same node: the forces of both add up.
                    Some((time_s, sum)) if *time_s == port.time_s => *sum += force,
                    _ => forces.push((port.time_s, force)),
                }
            }
        };
        push(&element.ports, of_part.chips * start, kappa);
        if let (Some(ports), Some(seen)) = (&element.axial, of_part.axial) {
            push(&ports.ports, seen * start, Complex64::ONE);
        }
    }
    Some(forces)
}
