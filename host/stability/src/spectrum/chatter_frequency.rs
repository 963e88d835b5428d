//! Frequency of the vibration that belongs to a Floquet multiplier (characteristic multiplier).

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector, Vector3};
use num_complex::Complex64;

use crate::problem::element::Port;
use crate::problem::linear::Problem;
use crate::problem::period::{Period, Rates};
use quietcut_numerics::eigenvalues::eigenvector;

/// Growth of a motion over a part of the period, as a factor on the growth of the Floquet mode over that part, beyond
/// which the next part begins. The linear system of all parts then loses about three digits.
const GROWTH: f64 = 1e3;

/// Largest number of unknowns (parts of a period times states) in the linear system for the states at the start of all
/// parts: a limit on computing time. A choice.
const CYCLIC_MAX: usize = 256;

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
/// at the same node are added. `None` if an element is singular, or if [`cyclic_vector`] finds no states.
fn eigenfunction_forces(
    period: &Period,
    multiplier: Complex64,
    depth_m: f64,
) -> Option<Vec<(f64, Vector3<Complex64>)>> {
    let kappa = (Complex64::ONE - multiplier.inv()) * depth_m;
    let complex = |matrix: &DMatrix<f64>| matrix.map(Complex64::from);
    // Divides the period into parts, each starting from its own state, and expresses the displacements in each element
    // by the state at the start of its part.
    let identity = DMatrix::<Complex64>::identity(period.order(), period.order());
    let mut parts = Vec::new();
    let mut part = identity.clone();
    let mut seen_from = Vec::with_capacity(period.elements.len());
    let (mut length, share) = (0.0, 1.0 / period.elements.len().max(1) as f64);
    for element in &period.elements {
        // Ends the part of the period once some motion has grown by the factor `GROWTH` more than the Floquet mode.
        // Over a much longer part the share of the mode would be rounding.
        if part.norm() > GROWTH * multiplier.norm().powf(length) {
            parts.push(std::mem::replace(&mut part, identity.clone()));
            length = 0.0;
        }
        let ports = element.kernel.nrows();
        let implicit = DMatrix::identity(ports, ports) - complex(&element.kernel) * kappa;
        let chips = implicit.lu().solve(&(complex(&element.observe) * &part))?;
        let axial = element
            .axial
            .as_ref()
            .map(|axial| complex(&axial.observe) * &part + complex(&axial.kernel) * &chips * kappa);
        part = complex(&element.flow) * &part + complex(&element.drive) * &chips * kappa;
        seen_from.push((parts.len(), chips, axial));
        length += share;
    }
    parts.push(complex(&period.flight) * part);
    let starts = cyclic_vector(&parts, multiplier)?;
    let mut forces: Vec<(f64, Vector3<Complex64>)> = Vec::new();
    for (element, (part, chips, axial)) in period.elements.iter().zip(seen_from) {
        let start = &starts[part];
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
        push(&element.ports, chips * start, kappa);
        if let (Some(ports), Some(seen)) = (&element.axial, axial) {
            push(&ports.ports, seen * start, Complex64::ONE);
        }
    }
    Some(forces)
}

/// Solves for the states x_g of a Floquet mode at the start of each part of the period: T_g x_g = x_{g+1}, and μ x_0
/// after the last part, with the transition matrices T_g of the parts. `None` if there are more unknowns than
/// [`CYCLIC_MAX`], or if the matrix is not finite or singular after the shift.
///
/// All states are solved for at once. Integration from a start that is exact to rounding would fail if the parts
/// together grow by far more than μ.
fn cyclic_vector(parts: &[DMatrix<Complex64>], multiplier: Complex64) -> Option<Vec<DVector<Complex64>>> {
    let [single] = parts else {
        let (order, count) = (parts.first()?.nrows(), parts.len());
        if order * count > CYCLIC_MAX {
            return None;
        }
        let mut whole = DMatrix::zeros(order * count, order * count);
        for (g, part) in parts.iter().enumerate() {
            whole
                .view_mut((g * order, g * order), (order, order))
                .copy_from(part);
            let (to, factor) = if g + 1 < count {
                ((g + 1) * order, Complex64::ONE)
            } else {
                (0, multiplier)
            };
            for i in 0..order {
                whole[(g * order + i, to + i)] -= factor;
            }
        }
        let vector = eigenvector(&whole, Complex64::ZERO)?;
        return Some(
            (0..count)
                .map(|g| vector.rows(g * order, order).into_owned())
                .collect(),
        );
    };
    Some(vec![eigenvector(single, multiplier)?])
}
