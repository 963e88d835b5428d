//! Branches of the forced orbits of a problem, and single orbits with their dominant Floquet multiplier (characteristic
//! multiplier).

use num_complex::Complex64;

use super::branch::{Branch, BrokenBranch, Extent};
use super::branch_record::{BranchJournal, Unrecorded};
#[cfg(test)]
use super::follower::orbit_at_depth;
use super::follower::{Follower, size_at};
use super::forced::ForcedProblem;
use super::parameter::{Parameter, Place, Setting};
#[cfg(test)]
use super::periodic_orbit::Orbit;
use super::periodic_orbit::{OrbitError, PeriodMap};
use super::revolution_period::RevolutionPeriod;
use super::tooth_period::ToothPeriod;
use super::varied_period::VariedPeriod;

/// Follows the forced orbits at one spindle speed from depth 0 until the depth reaches `depth_mm` or returns to 0; with
/// [`Extent::FirstLoss`] at most until a multiplier leaves the unit circle.
///
/// # Errors
/// The branch cannot be followed further with the shortest step, or takes too many steps; or no preceding tooth cuts
/// the surface in front of some tooth.
pub fn follow_depth(
    problem: &ForcedProblem,
    rpm: f64,
    depth_mm: f64,
    extent: Extent,
) -> Result<Branch, OrbitError> {
    let depth_m = depth_mm * 1e-3;
    match &problem.uneven {
        None => Follower::new(ToothPeriod::new(problem, rpm), rpm, depth_m).follow(extent),
        Some(uneven) => {
            let map = RevolutionPeriod::new(problem, uneven, rpm, depth_m).ok_or(singular_at(depth_mm))?;
            Follower::new(map, rpm, depth_m).follow(extent)
        }
    }
}

/// Follows the forced orbits of a setting over one parameter, from its first value to the last one or back to the first
/// one through folds. The parameter's own value in the setting is not used.
///
/// The first orbit is reached by continuation in depth from rest at depth 0.
///
/// # Errors
/// The first orbit is not reached, or the branch cannot be followed further with the shortest step, or takes too many
/// steps; the error then holds the branch so far.
pub fn follow(
    problem: &ForcedProblem,
    setting: Setting,
    parameter: Parameter,
    range: [f64; 2],
    extent: Extent,
) -> Result<Branch, BrokenBranch> {
    follow_recorded(problem, setting, parameter, range, extent, &mut Unrecorded)
}

/// As [`follow`], with every orbit recorded in a journal; goes on from the orbits that it has recorded before.
///
/// # Errors
/// As [`follow`]; or the journal fails, or its orbits are none of this branch.
pub fn follow_recorded(
    problem: &ForcedProblem,
    setting: Setting,
    parameter: Parameter,
    range: [f64; 2],
    extent: Extent,
    journal: &mut dyn BranchJournal,
) -> Result<Branch, BrokenBranch> {
    let none = |cause| BrokenBranch { cause, branch: None };
    check(problem, parameter).map_err(none)?;
    let [from, to] = range.map(|value| value * parameter.result_unit());
    let first = setting.at(parameter, from);
    let map = VariedPeriod::new(problem, setting, parameter, range);
    let start = map.first_orbit(first).map_err(none)?;
    // A branch that begins at rest has its size at the far end of the range as the unit of its state.
    let state = match parameter {
        Parameter::Depth | Parameter::Feed => size_at(&map, from.max(to)),
        Parameter::Rpm | Parameter::Kappa | Parameter::Nu => start.start.norm(),
    };
    Follower::over([from, to], map, first.rpm, state)
        .landing()
        .whole(&start, extent, journal)
}

/// Refuses a parameter on which the orbits of a problem do not depend, or that is not covered.
fn check(problem: &ForcedProblem, parameter: Parameter) -> Result<(), OrbitError> {
    let what = match parameter {
        _ if problem.is_over_revolution() => {
            "teeth with unequal pitch or runout: their orbits have the period of the revolution, and are followed over the \
             depth by lobes only; leave out runout and unequal pitch"
        }
        Parameter::Kappa | Parameter::Nu if problem.cubic.is_none() => {
            "kappa and nu without cubic terms: they scale structure.cubic_stiffness and structure.cubic_damping"
        }
        _ => return Ok(()),
    };
    Err(OrbitError::NotCovered { what })
}

fn singular_at(depth_mm: f64) -> OrbitError {
    OrbitError::Singular {
        place: Place {
            parameter: Parameter::Depth,
            value: depth_mm,
        },
    }
}

/// Dominant Floquet multiplier of a forced orbit.
pub(super) struct Dominant {
    /// Dominant multiplier of the orbit; of a conjugate pair the one above the real axis.
    pub(super) multiplier: Complex64,
    /// Vibration frequency of the Floquet mode that belongs to the multiplier, Hz; `None` if it cannot be computed.
    pub(super) chatter_hz: Option<f64>,
}

/// Dominant Floquet multiplier about the forced orbit at a depth, from the working mesh and from a finer one.
pub(super) fn multiplier_at(
    problem: &ForcedProblem,
    rpm: f64,
    depth_mm: f64,
) -> Result<[Dominant; 2], OrbitError> {
    match &problem.uneven {
        None => dominant_of(ToothPeriod::new(problem, rpm), rpm, depth_mm),
        Some(uneven) => {
            let map =
                RevolutionPeriod::new(problem, uneven, rpm, depth_mm * 1e-3).ok_or(singular_at(depth_mm))?;
            dominant_of(map, rpm, depth_mm)
        }
    }
}

/// Forced orbit at a depth, reached by continuation from depth 0.
#[cfg(test)]
pub(super) fn orbit_at(problem: &ForcedProblem, rpm: f64, depth_mm: f64) -> Result<Orbit, OrbitError> {
    let depth_m = depth_mm * 1e-3;
    match &problem.uneven {
        None => orbit_at_depth(ToothPeriod::new(problem, rpm), rpm, depth_m),
        Some(uneven) => {
            let map = RevolutionPeriod::new(problem, uneven, rpm, depth_m).ok_or(singular_at(depth_mm))?;
            orbit_at_depth(map, rpm, depth_m)
        }
    }
}

fn dominant_of<M: PeriodMap>(map: M, rpm: f64, depth_mm: f64) -> Result<[Dominant; 2], OrbitError> {
    let singular = singular_at(depth_mm);
    let finer = map.finer().ok_or(singular)?;
    let at = |map: M| {
        let follower = Follower::new(map, rpm, depth_mm * 1e-3);
        let orbit = follower.up_to(depth_mm * 1e-3)?.orbit;
        let all = follower.map.multipliers(&orbit);
        let all = all.map_err(|cause| OrbitError::of_multipliers(cause, follower.place(&orbit)))?;
        let multiplier = *all.first().ok_or(singular)?;
        let multiplier = Complex64::new(multiplier.re, multiplier.im.abs());
        Ok(Dominant {
            multiplier,
            chatter_hz: follower.map.chatter_hz(&orbit, multiplier),
        })
    };
    Ok([at(map)?, at(finer)?])
}
