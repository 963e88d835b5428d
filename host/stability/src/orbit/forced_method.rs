//! Stability method of structures whose limits depend on the forced orbit, for charts and single cuts.

use rayon::prelude::*;

use super::branch::{Branch, Event, Extent};
use super::branch_record::Unrecorded;
use super::branches::{follow_depth, multiplier_at};
use super::criticality::criticality;
use super::forced::ForcedProblem;
use super::parameter::Parameter;
use super::periodic_orbit::OrbitError;
use super::subharmonic::follow_doubled;
use crate::criteria::{LEAST_ERROR, ORBIT_ROOM};
use crate::error::StabilityError;
use crate::limits::method::Method;
use crate::limits::point::CutStability;
use crate::limits::speed_line::SpeedLine;
use crate::spectrum::stability_loss::StabilityLoss;

/// Floquet multipliers (characteristic multipliers) about the forced orbit at the feed of the case, followed from depth
/// 0.
impl Method for ForcedProblem {
    fn name(&self) -> &'static str {
        match self.uneven {
            None => "collocation about the forced orbit",
            Some(_) => "collocation about the forced orbit of the revolution",
        }
    }

    fn blind_to(&self) -> Option<&'static str> {
        self.uneven
            .as_ref()
            .map(|_| "teeth that leave the surface within the forced orbit")
    }

    /// Evaluates the orbit that is reached when the depth grows from 0; the error of its multiplier is `ORBIT_ROOM`
    /// times the change with a finer mesh, and at least `LEAST_ERROR` × max(1, |μ|).
    fn point(&self, rpm: f64, depth_mm: f64) -> Result<CutStability, StabilityError> {
        let fail = |cause| broke_down(rpm, depth_mm, cause);
        let [coarse, fine] = multiplier_at(self, rpm, depth_mm).map_err(fail)?;
        let multiplier = fine.multiplier;
        // The coarse mesh errs by far more than the fine one, so that the change from one to the other bounds the error
        // of the fine one.
        let error = (ORBIT_ROOM * (coarse.multiplier - multiplier).norm())
            .max(LEAST_ERROR * multiplier.norm().max(1.0));
        Ok(CutStability::new(
            rpm,
            depth_mm,
            multiplier,
            error,
            fine.chatter_hz,
        ))
    }

    /// Follows the branch of forced orbits with its own steps in depth, and the doubled orbits from its subcritical flips;
    /// `samples` is not used.
    fn line(&self, rpm: f64, depth_mm: f64, _samples: usize) -> Result<SpeedLine, StabilityError> {
        let branch = follow_depth(self, rpm, depth_mm, Extent::Whole)
            .map_err(|cause| broke_down(rpm, depth_mm, cause))?;
        let mut line = branch.speed_line();
        let below = self.bistable_below_flips(rpm, depth_mm, &branch);
        line.bistable_mm.extend(below);
        line.bistable_mm.sort_by(|a, b| a[0].total_cmp(&b[0]));
        Ok(line)
    }

    fn up_to_first_limits(
        &self,
        speeds_rpm: &[f64],
        depth_mm: f64,
        _samples: usize,
    ) -> Result<Vec<SpeedLine>, StabilityError> {
        let line = |rpm: &f64| {
            let branch = follow_depth(self, *rpm, depth_mm, Extent::FirstLoss);
            branch
                .map(|branch| branch.speed_line())
                .map_err(|cause| broke_down(*rpm, depth_mm, cause))
        };
        let lines: Vec<_> = speeds_rpm.par_iter().map(line).collect();
        lines.into_iter().collect()
    }
}

impl ForcedProblem {
    /// Depth intervals, mm, below the subcritical flips of a branch over the depth, in which doubled orbits are stable
    /// beside the forced ones. Of doubled orbits that cannot be followed to their end the known part counts.
    fn bistable_below_flips(&self, rpm: f64, depth_mm: f64, branch: &Branch) -> Vec<[f64; 2]> {
        let (setting, range) = (self.setting(rpm, 0.0), [0.0, depth_mm]);
        let is_subcritical = |event: &&Event| {
            event.kind == StabilityLoss::Flip
                && criticality(self, setting, Parameter::Depth, range, event)
                    .is_some_and(|criticality| !criticality.is_supercritical())
        };
        let doubled = branch.events.iter().filter(is_subcritical).filter_map(|event| {
            match follow_doubled(self, setting, Parameter::Depth, range, event, &mut Unrecorded) {
                Ok(doubled) => Some(doubled),
                Err(broken) => broken.branch.map(|known| *known),
            }
        });
        doubled.flat_map(|doubled| doubled.bistable(branch)).collect()
    }
}

fn broke_down(rpm: f64, depth_mm: f64, cause: OrbitError) -> StabilityError {
    let what = match cause {
        OrbitError::NoConvergence { .. } => "the forced orbit cannot be followed to this depth",
        OrbitError::Singular { .. } => "the equations of the forced orbit are singular",
        OrbitError::Lost { .. } => "the forced orbit is lost in a fold before this depth",
        OrbitError::NotCovered { what } => what,
        OrbitError::Journal { .. } => "the orbits cannot be recorded",
        OrbitError::Eigenvalues { cause, .. } => {
            return StabilityError::Eigenvalues { rpm, depth_mm, cause };
        }
    };
    StabilityError::BrokeDown { rpm, depth_mm, what }
}
