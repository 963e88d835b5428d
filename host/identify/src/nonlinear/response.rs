//! Displacement that an identified equation of motion predicts under a recorded force.

use num_complex::Complex64;
use rustfft::FftPlanner;

use crate::nonlinear::restoring_force::ForceTerm;

/// Number of instants per sample at which the force is interpolated for the Runge–Kutta integration; one step spans two
/// of them, so the number must be even.
const FINER: usize = 8;

/// Reason why an equation of motion gives no prediction of the motion.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ResponseError {
    /// The law has no mass, or one that is not finite.
    #[error("the law has no mass, so that its motion cannot be predicted")]
    NoMass,
    /// The motion grows without bound.
    #[error(
        "the motion of the law grows without bound after {time_s:.3} s: the law does not hold at this force"
    )]
    Diverged {
        /// Time of the first sample after which the predicted displacement is no longer finite, s.
        time_s: f64,
    },
}

/// Displacement, m, that the equation of motion Σ θ φ = F predicts from rest, at the samples of `force` (N, at
/// `rate_hz`); `law` holds the terms φ with their coefficients θ.
///
/// Between samples the force is interpolated without a change of its spectrum, as for a signal that passed an
/// anti-aliasing filter. The classical Runge–Kutta method takes four steps per sample.
///
/// # Errors
/// The law has no mass, or one that is not finite; or the predicted motion grows without bound.
pub fn displacement(
    law: &[(ForceTerm, f64)],
    force: &[f64],
    rate_hz: f64,
) -> Result<Vec<f64>, ResponseError> {
    let mass: f64 = law
        .iter()
        .filter(|(term, _)| *term == ForceTerm::Mass)
        .map(|(_, m)| m)
        .sum();
    if mass == 0.0 || !mass.is_finite() {
        return Err(ResponseError::NoMass);
    }
    let fine = finer(force);
    let step = 2.0 / (FINER as f64 * rate_hz);
    let acceleration = |x: f64, v: f64, f: f64| {
        let restoring: f64 = law
            .iter()
            .filter(|(term, _)| *term != ForceTerm::Mass)
            .map(|(term, theta)| theta * term.value(x, v, 0.0))
            .sum();
        (f - restoring) / mass
    };
    let (mut x, mut v) = (0.0, 0.0);
    let mut found = Vec::with_capacity(force.len());
    for index in 0..force.len() {
        found.push(x);
        for part in 0..FINER / 2 {
            let at = index * FINER + 2 * part;
            let f = [0, 1, 2].map(|ahead| fine[(at + ahead).min(fine.len() - 1)]);
            let (v1, a1) = (v, acceleration(x, v, f[0]));
            let (v2, a2) = (
                v + 0.5 * step * a1,
                acceleration(x + 0.5 * step * v1, v + 0.5 * step * a1, f[1]),
            );
            let (v3, a3) = (
                v + 0.5 * step * a2,
                acceleration(x + 0.5 * step * v2, v + 0.5 * step * a2, f[1]),
            );
            let (v4, a4) = (v + step * a3, acceleration(x + step * v3, v + step * a3, f[2]));
            x += step / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
            v += step / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
        }
        if !x.is_finite() {
            return Err(ResponseError::Diverged {
                time_s: index as f64 / rate_hz,
            });
        }
    }
    Ok(found)
}

/// Samples of the force interpolated to [`FINER`] times their rate, with unchanged spectrum.
fn finer(samples: &[f64]) -> Vec<f64> {
    let count = samples.len();
    let mut planner = FftPlanner::new();
    let mut spectrum: Vec<Complex64> = samples.iter().map(|x| Complex64::new(*x, 0.0)).collect();
    planner.plan_fft_forward(count).process(&mut spectrum);
    let mut wide = vec![Complex64::ZERO; FINER * count];
    let half = count.div_ceil(2);
    wide[..half].copy_from_slice(&spectrum[..half]);
    let lower = count - half;
    let end = wide.len();
    wide[end - lower..].copy_from_slice(&spectrum[half..]);
    planner.plan_fft_inverse(FINER * count).process(&mut wide);
    wide.into_iter().map(|x| x.re / count as f64).collect()
}
