//! Terms that the equation of motion gets besides the structure of the case: friction, play, springs that are not linear.

use std::fmt::Debug;

use nalgebra::{Matrix3, Vector3};
use num_complex::Complex64;

use super::Dynamics;

/// The tool at an instant, in the machine's x, y, z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct At {
    /// Time, s.
    pub t: f64,
    /// Displacement, m.
    pub x: [f64; 3],
    /// Velocity, m/s.
    pub v: [f64; 3],
}

/// How f_r changes with the motion, rows force, columns motion along x, y, z.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Slopes {
    /// ∂f_r/∂x, N/m.
    pub stiffness: [[f64; 3]; 3],
    /// ∂f_r/∂v, N s/m.
    pub damping: [[f64; 3]; 3],
}

/// Which of the smooth pieces of a term holds; each term counts its own.
pub type Branch = u8;

/// A term f_r on the restoring side: M ẍ + C ẋ + K x + f_r = F, with f_r in N along x, y, z.
///
/// A term may have states of its own, and pieces (branches) on each of which it is smooth: the integrator ends a step
/// exactly where [`Term::margin`] falls below zero and asks [`Term::next`] what follows. A branch that is
/// [`Term::locked`] holds the velocity of one axis, as friction at rest does: its force is then what the others leave.
pub trait Term: Debug + Send + Sync {
    /// Number of states of its own. They are displacements in m: error control measures them as such.
    fn states(&self) -> usize {
        0
    }

    /// Moves its states along a way that is known, from wherever they were to `at`, and true; false where they do not follow from the
    /// way alone but from its speed.
    fn follow(&self, _at: &At, _own: &mut [f64]) -> bool {
        false
    }

    /// Brings states that a long step has carried beyond where they can be back to there.
    fn confine(&self, _own: &mut [f64]) {}

    /// Puts its own states to what they are where a motion is found going on; a simulation begins with zeros.
    fn begin(&self, _at: &At, _own: &mut [f64]) {}

    /// f_r, N.
    fn restoring_n(&self, branch: Branch, at: &At, own: &[f64]) -> [f64; 3];

    /// Slopes of f_r; `None` for a term that has no slope everywhere, or states of its own.
    fn slopes(&self, _at: &At) -> Option<Slopes> {
        None
    }

    /// Describing function N(X, ω), N/m: under x = X·sin ωt along its axis the fundamental of f_r is N·x, its real part in phase
    /// with x and its imaginary part in phase with the velocity. `None` where there is no closed form.
    fn describing_function(&self, _amplitude_m: f64, _omega: f64) -> Option<Complex64> {
        None
    }

    /// Rates of its own states.
    fn rate(&self, _branch: Branch, _at: &At, _own: &[f64], _rate: &mut [f64]) {}

    /// The axis whose velocity could be held, where a branch of this term can.
    fn holds(&self) -> Option<usize> {
        None
    }

    /// True where `branch` holds the velocity of [`Self::holds`]; [`Self::restoring_n`] is not asked then.
    fn locked(&self, _branch: Branch) -> bool {
        false
    }

    /// Not below zero while `branch` goes on. `holding_n` is the f_r that would hold the axis, 0 where there is none.
    fn margin(&self, _branch: Branch, _at: &At, _own: &[f64], _holding_n: f64) -> f64 {
        f64::INFINITY
    }

    /// The branch at the start (`None`), or after `before` has ended.
    fn next(&self, _before: Option<Branch>, _at: &At, _own: &[f64], _holding_n: f64) -> Branch {
        0
    }
}

/// Room and branches of a set of terms while they are integrated.
#[derive(Clone, Copy, Debug)]
pub struct Branches<'a>(pub &'a [Branch]);

/// Number of own states of all `terms`.
pub fn states(terms: &[Box<dyn Term>]) -> usize {
    terms.iter().map(|term| term.states()).sum()
}

/// ẏ of structure and terms under `force` (N, from outside) with the tool at `x`; `y` are the states of the structure
/// and, behind them, those of the terms in their order. f_r of held axes, in x, y, z, is returned.
pub fn rate(
    dynamics: &Dynamics,
    terms: &[Box<dyn Term>],
    branches: Branches<'_>,
    (t, x): (f64, [f64; 3]),
    force: [f64; 3],
    y: &[f64],
    rate: &mut [f64],
) -> [f64; 3] {
    let order = dynamics.order();
    let (own_y, own_rate) = (&y[order..], order);
    let mut at = At {
        t,
        x,
        v: dynamics.velocity_under(&y[..order], force),
    };
    let mut left = minus(force, restoring(terms, branches, &at, own_y));
    if dynamics.velocity_jumps() {
        // The velocity feels the force itself: a few rounds settle both, damping is small beside the inertia.
        for _ in 0..40 {
            let before = at.v;
            at.v = dynamics.velocity_under(&y[..order], left);
            left = minus(force, restoring(terms, branches, &at, own_y));
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
    for (term, branch) in terms.iter().zip(branches.0) {
        let own = place..place + term.states();
        let range = own_rate + own.start..own_rate + own.end;
        term.rate(*branch, &at, &own_y[own.clone()], &mut rate[range]);
        place = own.end;
    }
    hold(dynamics, terms, branches, (&y[..order], left), &mut rate[..order])
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

/// Sum of f_r of all terms that hold nothing.
fn restoring(terms: &[Box<dyn Term>], branches: Branches<'_>, at: &At, own: &[f64]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    let mut place = 0;
    for (term, branch) in terms.iter().zip(branches.0) {
        let end = place + term.states();
        if !term.locked(*branch) {
            for (sum, force) in sum
                .iter_mut()
                .zip(term.restoring_n(*branch, at, &own[place..end]))
            {
                *sum += force;
            }
        }
        place = end;
    }
    sum
}

/// Holds the locked axes: their accelerations become zero. f_r of what holds them.
fn hold(
    dynamics: &Dynamics,
    terms: &[Box<dyn Term>],
    branches: Branches<'_>,
    (y, force): (&[f64], [f64; 3]),
    rate: &mut [f64],
) -> [f64; 3] {
    let mut locked = [false; 3];
    for (term, branch) in terms.iter().zip(branches.0) {
        if let Some(axis) = term.holds().filter(|_| term.locked(*branch)) {
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

/// f_r that makes the acceleration of the `locked` axes zero, from ẏ without it.
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
