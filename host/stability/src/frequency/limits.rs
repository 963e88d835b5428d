//! Roots of the loop that the cut closes around the structure, with averaged or with periodic directional coefficients:
//! their crossings of the imaginary axis as the axial depth grows, and the number of unstable ones.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

use super::loci::{argument_increase, crossings, trace};
use super::open_loop::OpenLoop;
use crate::criteria::{HALF_REVOLUTION_ERROR, LEAST_ERROR, REAL_END_OFFSET, SAME_LIMIT};
use crate::error::{Breakdown, StabilityError};
use crate::limits::speed_line::{SpeedLine, Switch};
use crate::spectrum::stability_loss::StabilityLoss;

/// Limit of a loop: an axial depth at which a root of the loop crosses the imaginary axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AxisCrossing {
    /// Depth, m.
    pub(crate) depth_m: f64,
    /// Imaginary part ω of the root iω of the loop at this limit, rad/s.
    pub(crate) omega: f64,
    /// Kind of stability loss.
    pub(crate) kind: StabilityLoss,
    /// True if the root of the loop moves into the right half plane (becomes unstable) with growing depth.
    pub(crate) outward: bool,
}

/// All crossings of the imaginary axis, at ω ≥ 0 in the frequency range of the loop, by roots of the loop up to an
/// axial depth (m), by depth.
///
/// # Errors
/// Receptances are infinite, a result is not finite, an eigenvalue iteration fails, or a crossing is not found in an
/// interval in which a locus changes sides of the real axis.
pub(crate) fn limits(open_loop: &impl OpenLoop, depth_m: f64) -> Result<Vec<AxisCrossing>, Breakdown> {
    let floor = depth_m.recip();
    let mut grid = open_loop.grid(floor)?;
    let real_end = open_loop.real_end()?;
    let mut limits = Vec::new();
    if let Some(end) = &real_end {
        // The real characteristic loci at this end of the frequency range are crossings themselves. Samples closer to
        // the end are left out, where rounding of imaginary parts would show further crossings.
        let next_to_end = if end.omega > 0.0 {
            let next_to_end = end.omega * (1.0 - REAL_END_OFFSET);
            grid.retain(|&omega| omega < next_to_end);
            grid.push(next_to_end);
            next_to_end
        } else {
            let next_to_end = grid.get(1).ok_or(Breakdown::NoSolution)? * REAL_END_OFFSET;
            grid.retain(|&omega| omega > next_to_end);
            grid.insert(0, next_to_end);
            next_to_end
        };
        let loci = open_loop.loci(next_to_end, floor * 0.1)?;
        for &value in end.loci.iter().filter(|&&value| value >= floor) {
            let near = loci
                .iter()
                .min_by(|p, q| (*p - value).norm().total_cmp(&(*q - value).norm()))
                .ok_or(Breakdown::NoSolution)?;
            limits.push(AxisCrossing {
                depth_m: value.recip(),
                omega: end.omega,
                kind: end.kind,
                // Beyond the end of the range a locus continues as its mirror image in the real axis, so that it
                // crosses the axis downward at ω > 0 if it lies above the axis next to the end.
                outward: (near.im > 0.0) == (end.omega > 0.0),
            });
        }
    }
    let loci = |omega: f64| open_loop.loci(omega, 0.2 * floor);
    let samples = trace(&loci, &grid, floor, 1.0)?;
    limits.extend(
        crossings(&loci, &samples, floor)?
            .into_iter()
            .map(|crossing| AxisCrossing {
                depth_m: crossing.value.recip(),
                omega: crossing.omega,
                kind: StabilityLoss::Hopf,
                // A root becomes unstable where its characteristic locus crosses the real axis downward: 1 − w·locus
                // then winds clockwise about 0.
                outward: !crossing.rises,
            }),
    );
    limits.sort_by(|a, b| a.depth_m.total_cmp(&b.depth_m));
    Ok(limits)
}

/// Number of roots with Re s > `sigma` (1/s) at an axial depth (m), by the Nyquist criterion on the determinant D(s).
///
/// The zeros of D are the roots, its poles the poles of the structure. Along the line Re s = `sigma` from the real axis
/// to the end of the frequency range (infinity, or half the tooth-passing frequency for periodic coefficients) the
/// argument of D grows by π (P − N) for P poles and N roots right of the line, conjugates included. `None` if the
/// number cannot be told, for example since the line meets a root or passes close to one.
pub(crate) fn unstable_roots(open_loop: &impl OpenLoop, depth_m: f64, sigma: f64) -> Option<i32> {
    let grid = open_loop.grid(depth_m.max(1e-9).recip()).ok()?;
    let determinant = |omega: f64| {
        let s = Complex64::new(sigma, omega);
        open_loop.determinant(s, open_loop.regeneration(s) * depth_m)
    };
    let mut increase = argument_increase(&determinant, &grid)?;
    if open_loop.real_end().ok()?.is_none_or(|end| end.omega == 0.0) {
        // Beyond the grid the loop gain is below one, so that the determinant goes to 1 and its argument to 0 without a
        // further revolution.
        increase -= determinant(*grid.last()?)?.arg();
    }
    let half_turns = increase / PI;
    // At both ends of the path the determinant is real, apart from rounding and from the truncation of harmonics at ω =
    // 0: the number of half revolutions is an integer.
    let rounded = half_turns.round();
    ((half_turns - rounded).abs() < HALF_REVOLUTION_ERROR)
        .then_some(open_loop.problem().poles_right_of(sigma) - rounded as i32)
}

/// Error estimate of a limit, m: the sum of its changes with other computations (every second line of a table, another
/// number of harmonics), plus [`LEAST_ERROR`] of the depth. `None` if another computation lacks the limit.
fn error_m(limit: &AxisCrossing, others: &[Vec<AxisCrossing>]) -> Option<f64> {
    others.iter().try_fold(LEAST_ERROR * limit.depth_m, |sum, other| {
        let changes = other
            .iter()
            .filter(|other| other.kind == limit.kind && other.outward == limit.outward)
            .map(|other| (other.depth_m - limit.depth_m).abs());
        let change = changes.min_by(f64::total_cmp)?;
        (change < SAME_LIMIT * limit.depth_m).then_some(sum + change)
    })
}

/// Stability at one spindle speed from the limits of a loop. `others` are the limits of the other computations from
/// whose difference the error is estimated, one list each; `chatter_hz` returns the vibration frequency at a limit.
///
/// # Errors
/// The roots at depth 0 cannot be counted, or a vibration lies outside the measured frequencies.
pub(crate) fn speed_line(
    open_loop: &impl OpenLoop,
    rpm: f64,
    depth_mm: f64,
    limits: &[AxisCrossing],
    others: &[Vec<AxisCrossing>],
    chatter_hz: impl Fn(&AxisCrossing) -> Option<f64>,
) -> Result<SpeedLine, StabilityError> {
    let outside = outside_at_no_depth(open_loop).ok_or(StabilityError::BrokeDown {
        rpm,
        depth_mm: 0.0,
        what: "the roots at depth 0 cannot be counted",
    })?;
    let switches = limits
        .iter()
        .map(|limit| {
            let switch = Switch {
                depth_mm: limit.depth_m * 1e3,
                error_mm: error_m(limit, others).map(|error_m| 1e3 * error_m),
                kind: limit.kind,
                gain: !limit.outward,
                chatter_hz: chatter_hz(limit),
            };
            open_loop
                .problem()
                .check_band(switch.chatter_hz, rpm, switch.depth_mm)?;
            Ok(switch)
        })
        .collect::<Result<Vec<_>, StabilityError>>()?;
    Ok(SpeedLine::of_switches(rpm, depth_mm, outside, switches))
}

/// Number of unstable roots of a loop at depth 0: edge and feed forces that depend on the axial vibration may cause
/// some. `None` as by [`unstable_roots`].
pub(crate) fn outside_at_no_depth(open_loop: &impl OpenLoop) -> Option<i32> {
    if open_loop.problem().process.axial_depth_modulation {
        unstable_roots(open_loop, 0.0, 0.0)
    } else {
        Some(0)
    }
}

/// Chatter frequency ω/2π at a stability limit, Hz.
pub(crate) fn hertz(limit: &AxisCrossing) -> Option<f64> {
    Some(limit.omega / TAU)
}
