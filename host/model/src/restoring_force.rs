//! Restoring forces in addition to the linear structure: friction, backlash, hysteresis, nonlinear springs and dampers.

use std::fmt::Debug;

use nalgebra::{Matrix3, Vector3};
use num_complex::Complex64;

use super::Dynamics;

/// Time, displacement and velocity of the tool at one instant, in the machine's x, y, z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionState {
    /// Time, s.
    pub t: f64,
    /// Displacement of the tool, m.
    pub x: [f64; 3],
    /// Velocity of the tool, m/s.
    pub v: [f64; 3],
}

/// Jacobian of a restoring force f_r with respect to displacement and velocity of the tool; rows are the components of
/// the force, columns those of the motion, along x, y, z.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Slopes {
    /// ∂f_r/∂x, N/m.
    pub stiffness: [[f64; 3]; 3],
    /// ∂f_r/∂v, N s/m.
    pub damping: [[f64; 3]; 3],
}

/// Number of a regime of a restoring force, such as stick or slip; each force numbers its own regimes.
pub type Regime = u8;

/// A restoring force f_r, N, along x, y, z in the equation of motion M ẍ + C ẋ + K x + f_r = F.
///
/// A restoring force may have internal states and several regimes, such as stick and slip; the integrator takes f_r as
/// smooth within each. The integrator ends a step where [`RestoringForce::margin`] falls below zero;
/// [`RestoringForce::next`] then selects the next regime, and [`RestoringForce::enter`] may change internal states there. A [`RestoringForce::locked`] regime keeps one axis at rest,
/// as sticking friction does: f_r then balances all other forces on that axis.
pub trait RestoringForce: Debug + Send + Sync {
    /// Number of internal states. Each is a displacement in m, which the error control of the integrator assumes.
    fn states(&self) -> usize {
        0
    }

    /// Updates the internal states `own` to the displacement of `at` and returns true, if the force has a formula for
    /// them. Otherwise returns false and leaves them unchanged: if there are any, they must be integrated.
    fn follow(&self, _at: &MotionState, _own: &mut [f64]) -> bool {
        false
    }

    /// Limits the internal states `own` to their admissible range, which an integration error may leave.
    fn confine(&self, _own: &mut [f64]) {}

    /// Sets the internal states `own` at the first sample of a given motion, such as a recording or a periodic orbit,
    /// in which the tool may already move; a simulation from rest begins with zeros.
    fn begin(&self, _at: &MotionState, _own: &mut [f64]) {}

    /// True if the internal states are a memory of the path that the displacement has taken: they are constant within a
    /// regime, and only [`Self::begin`], [`Self::enter`] and [`Self::follow`] change them. Along a given motion such a force
    /// does not depend on the regime.
    fn remembers(&self) -> bool {
        false
    }

    /// Changes the internal states `own` of a force that remembers its path, at the instant `at` from which `regime`
    /// holds, which may be the regime of before.
    fn enter(&self, _regime: Regime, _at: &MotionState, _own: &mut [f64]) {}

    /// Restoring force f_r, N, in `regime`, which is not a locked one.
    fn restoring_n(&self, regime: Regime, at: &MotionState, own: &[f64]) -> [f64; 3];

    /// Jacobian of f_r; `None` for a force that does not provide it, for example since it has internal states.
    fn slopes(&self, _at: &MotionState) -> Option<Slopes> {
        None
    }

    /// Describing function N(X, ω), N/m: the fundamental of f_r under x = X·sin ωt along the axis of the force, divided
    /// by X. The real part of N is in phase with x, the imaginary part with the velocity. `None` for a force that does
    /// not provide it.
    fn describing_function(&self, _amplitude_m: f64, _omega: f64) -> Option<Complex64> {
        None
    }

    /// Writes the time derivatives of the internal states, m/s.
    fn rate(&self, _regime: Regime, _at: &MotionState, _own: &[f64], _rate: &mut [f64]) {}

    /// The axis that a locked regime keeps at rest; `None` for a force without a locked regime.
    fn holds(&self) -> Option<usize> {
        None
    }

    /// True if `regime` keeps the axis of [`Self::holds`] at rest (stick); [`Self::restoring_n`] is not evaluated in
    /// such a regime.
    fn locked(&self, _regime: Regime) -> bool {
        false
    }

    /// Event function of `regime`: it becomes negative where the regime ends. `holding_n` is the force f_r, N, that
    /// keeps the axis of [`Self::holds`] at rest; 0 unless `regime` is locked.
    fn margin(&self, _regime: Regime, _at: &MotionState, _own: &[f64], _holding_n: f64) -> f64 {
        f64::INFINITY
    }

    /// The regime from the instant `at` on: the first one if `before` is `None`, otherwise the one that follows the
    /// ended regime `before`. `holding_n` is the force f_r, N, that would keep the axis of [`Self::holds`] at rest; 0
    /// if the force has no such axis, and along a given motion.
    fn next(&self, _before: Option<Regime>, _at: &MotionState, _own: &[f64], _holding_n: f64) -> Regime {
        0
    }
}

/// The current regime of each restoring force of a model, in the order of the forces.
#[derive(Clone, Copy, Debug)]
pub struct Regimes<'a>(pub &'a [Regime]);

/// Total number of internal states of all `restoring_forces`.
pub fn states(restoring_forces: &[Box<dyn RestoringForce>]) -> usize {
    restoring_forces
        .iter()
        .map(|restoring_force| restoring_force.states())
        .sum()
}

/// Writes ẏ of structure and restoring forces under the external `force`, N, at the time `t`, s, and the displacement
/// `x` of the tool, m.
///
/// `y` holds the states of the structure, followed by the internal states of the restoring forces in the order of the
/// forces. Returns the force of [`holding_n`] for the sticking axes, N, along x, y, z; zero if none sticks.
pub fn rate(
    dynamics: &Dynamics,
    restoring_forces: &[Box<dyn RestoringForce>],
    regimes: Regimes<'_>,
    (t, x): (f64, [f64; 3]),
    force: [f64; 3],
    y: &[f64],
    rate: &mut [f64],
) -> [f64; 3] {
    let order = dynamics.order();
    let (own_y, own_rate) = (&y[order..], order);
    let mut at = MotionState {
        t,
        x,
        v: dynamics.velocity_under(&y[..order], force),
    };
    let mut left = minus(force, restoring(restoring_forces, regimes, &at, own_y));
    if dynamics.velocity_jumps() {
        // Here the velocity of the tool depends on the force, and a restoring force may depend on the velocity: a
        // fixed-point iteration solves for both. It converges if the norm of C B ∂f_r/∂v is below 1.
        for _ in 0..40 {
            let before = at.v;
            at.v = dynamics.velocity_under(&y[..order], left);
            left = minus(force, restoring(restoring_forces, regimes, &at, own_y));
            let moved = (0..3)
                .map(|axis| (at.v[axis] - before[axis]).abs())
                .fold(0.0, f64::max);
            if moved <= 1e-14 * at.v.iter().fold(0.0_f64, |a, v| a.max(v.abs())) {
                break;
            }
        }
    }
    dynamics.rate(&y[..order], left, &mut rate[..order]);
    let mut place = 0;
    for (restoring_force, regime) in restoring_forces.iter().zip(regimes.0) {
        let own = place..place + restoring_force.states();
        let range = own_rate + own.start..own_rate + own.end;
        restoring_force.rate(*regime, &at, &own_y[own.clone()], &mut rate[range]);
        place = own.end;
    }
    hold(
        dynamics,
        restoring_forces,
        regimes,
        (&y[..order], left),
        &mut rate[..order],
    )
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

/// Sum of f_r, N, of all restoring forces whose regime is not locked.
fn restoring(
    restoring_forces: &[Box<dyn RestoringForce>],
    regimes: Regimes<'_>,
    at: &MotionState,
    own: &[f64],
) -> [f64; 3] {
    let mut sum = [0.0; 3];
    let mut place = 0;
    for (restoring_force, regime) in restoring_forces.iter().zip(regimes.0) {
        let end = place + restoring_force.states();
        if !restoring_force.locked(*regime) {
            for (sum, force) in sum
                .iter_mut()
                .zip(restoring_force.restoring_n(*regime, at, &own[place..end]))
            {
                *sum += force;
            }
        }
        place = end;
    }
    sum
}

/// Adds the effect of [`holding_n`] for the locked (sticking) axes to ẏ in `rate`, and returns that force, N; zero if
/// no axis is locked.
fn hold(
    dynamics: &Dynamics,
    restoring_forces: &[Box<dyn RestoringForce>],
    regimes: Regimes<'_>,
    (y, force): (&[f64], [f64; 3]),
    rate: &mut [f64],
) -> [f64; 3] {
    let mut locked = [false; 3];
    for (restoring_force, regime) in restoring_forces.iter().zip(regimes.0) {
        if let Some(axis) = restoring_force
            .holds()
            .filter(|_| restoring_force.locked(*regime))
        {
            locked[axis] = true;
        }
    }
    if locked == [false; 3] {
        return [0.0; 3];
    }
    let holding = holding_n(dynamics, locked, rate);
    dynamics.rate(y, minus(force, holding), rate);
    holding
}

/// The holding force f_r, N, along x, y, z that makes the accelerations of the `locked` axes zero; `rate` is ẏ of the
/// structure without this force. Zero if the velocity jumps with the force, or if the matrix of acceleration per force
/// of the locked axes is singular.
pub fn holding_n(dynamics: &Dynamics, locked: [bool; 3], rate: &[f64]) -> [f64; 3] {
    let Some(free) = dynamics.acceleration(rate) else {
        return [0.0; 3];
    };
    let mobility = dynamics.acceleration_per_force();
    let matrix = Matrix3::from_fn(|i, j| {
        if locked[i] && locked[j] {
            mobility[i][j]
        } else {
            f64::from(u8::from(i == j))
        }
    });
    let wanted = Vector3::from_fn(|i, _| if locked[i] { free[i] } else { 0.0 });
    matrix.lu().solve(&wanted).map_or([0.0; 3], Into::into)
}
