//! Depths and speeds of a layer that the spindle cannot drive or must not run at.

use crate::error::StabilityError;
use crate::limits::speed_line::SpeedLine;
use quietcut_model::CuttingLoad;
use quietcut_model::case::{Case, MachineLimits};

/// Relative distance from the end of a range of speeds at which a table has a further speed, outside of the range. It is
/// the least step of speeds in a table.
const BEYOND: f64 = 2e-4;

/// Ranges of speed, power and torque of the spindle of a case, as far as the header of a table cannot state them.
pub(super) struct SpindleLimit {
    limits: MachineLimits,
    /// `None` if neither power nor torque is limited, or if the load is not known.
    load: Option<CuttingLoad>,
}

impl SpindleLimit {
    /// The limit of the spindle of a case, and a warning if the load of the cut is not known; no limit for a case that
    /// limits the lowest and highest speed at most.
    pub(super) fn of_case(case: &Case) -> (Option<Self>, Option<String>) {
        let Some(limits) = &case.limits else {
            return (None, None);
        };
        let (load, warning) = match CuttingLoad::of_limited(case) {
            Ok(load) => (load, None),
            Err(error) => (
                None,
                Some(format!(
                    "power and torque of the spindle are not considered: {error}"
                )),
            ),
        };
        let limit = Self {
            limits: limits.clone(),
            load,
        };
        let has_limits = limit.load.is_some() || !limits.ranges_rpm.is_empty();
        (has_limits.then_some(limit), warning)
    }

    /// Stability at one speed with the depths that the spindle cannot drive left out of the stable ones; the table then
    /// states them as undecided, so that no advice leads there. At speeds outside the ranges of the spindle no depth
    /// stays stable.
    pub(super) fn limited(&self, line: SpeedLine) -> Result<SpeedLine, StabilityError> {
        let driven = match &self.load {
            _ if !self.limits.allows(line.rpm) => Some(0.0),
            Some(load) => load.driven_depth(line.rpm)?.map(|driven| driven.depth_mm),
            None => None,
        };
        let Some(driven_mm) = driven else {
            return Ok(line);
        };
        let stable = line.stable_mm.iter().map(|&[from, to]| [from, to.min(driven_mm)]);
        Ok(SpeedLine {
            stable_mm: stable.filter(|[from, to]| from < to).collect(),
            ..line
        })
    }

    /// Speeds, rev/min, that a table needs beside those where limits bend: the ends of the ranges of speed, and one
    /// closely outside of each.
    pub(super) fn speeds_rpm(&self) -> Vec<f64> {
        let ranges = self.limits.ranges_rpm.iter();
        ranges
            .flat_map(|&[from, to]| [from * (1.0 - BEYOND), from, to, to * (1.0 + BEYOND)])
            .collect()
    }
}
