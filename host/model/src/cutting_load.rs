//! Mean torque and power of a cut, and the axial depth that a spindle can drive.

use std::f64::consts::TAU;
use std::path::PathBuf;

use serde::Serialize;

use crate::case::{Case, CaseError, MachineLimits};
use crate::{Cutter, Effects, ModelError};
use quietcut_numerics::quadrature::Gauss;

/// Number of Gauss nodes over the engagement of a tooth. The force of a linear law is a constant plus a sine over the
/// engagement, at most half a revolution, which 16 nodes integrate to rounding; a power law begins as φᵖ where the chip
/// begins with zero thickness, with an error of some 1e-3 of itself.
const NODES: usize = 16;

/// Axial depth, m, at which the force is evaluated. An arbitrary choice, since the force is proportional to the depth.
const UNIT_DEPTH_M: f64 = 1e-3;

/// Mean torque and power of a cut over one revolution, per axial depth.
///
/// The torque is T = R/(2π)·Σ_j ∫ F_t,j(φ) dφ over the engagement, with the radius R of the tool and the tangential force
/// F_t,j of tooth j at the chip thickness of its feed, edge force included; the power is P = T·Ω, which is the mean
/// tangential force times the cutting speed (Altintas, Manufacturing Automation, ch. 2). With a linear force law
/// T = a·N·R/(2π)·(K_tc·f·sin γ·(cos φ_s − cos φ_e) + K_te/sin γ·(φ_e − φ_s)). Vibration and runout are not included: as
/// long as all teeth cut, they change the mean of a linear force law not at all.
#[derive(Clone, Debug)]
pub struct CuttingLoad {
    case: Case,
}

/// Reason why torque and power of a cut are not known.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The case has no tool, material or cut.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// The cutting force of the case cannot be computed.
    #[error("{}: {cause}", path.display())]
    Model {
        /// Path of the case file.
        path: PathBuf,
        /// The fault.
        cause: ModelError,
    },
    /// The tool has no diameter, on which torque and power depend.
    #[error("{}: torque and power of a cut depend on the diameter of the tool; add diameter_mm under [tool]", .0.display())]
    Diameter(PathBuf),
}

/// Quantity of the spindle that limits the axial depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LoadLimit {
    /// The power of the spindle.
    Power,
    /// The torque of the spindle.
    Torque,
}

impl LoadLimit {
    /// Name in texts and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Power => "power",
            Self::Torque => "torque",
        }
    }
}

/// Largest axial depth that a spindle can drive at one speed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DrivenDepth {
    /// Spindle speed, rev/min.
    pub rpm: f64,
    /// Axial depth at which the mean cutting power or torque reaches that of the spindle, mm.
    pub depth_mm: f64,
    /// Whichever of power and torque is reached first.
    pub by: LoadLimit,
}

impl CuttingLoad {
    /// The load of the cut of a case.
    ///
    /// # Errors
    /// The case has no tool, material or cut, the tool has no diameter, or an extension cannot be applied.
    pub fn of_case(case: &Case) -> Result<Self, LoadError> {
        let load = Self { case: case.clone() };
        // Another speed changes the values only, so that what can fail fails here.
        load.torque_nm_per_mm(1000.0)?;
        Ok(load)
    }

    /// Mean torque per axial depth at the spindle speed `rpm`, rev/min, in N·m/mm.
    ///
    /// # Errors
    /// As [`Self::of_case`].
    pub fn torque_nm_per_mm(&self, rpm: f64) -> Result<f64, LoadError> {
        let case = &self.case;
        let wrong = |cause| LoadError::Model {
            path: case.path.clone(),
            cause,
        };
        let cutter = Cutter::new(case.tool()?, case.material()?, case.cut()?, UNIT_DEPTH_M).map_err(wrong)?;
        let effects = Effects::of_case(case).map_err(|cause| wrong(cause.into()))?;
        let cutter = effects.cutter(cutter.at_speed(rpm)).map_err(wrong)?;
        let radius_m = cutter
            .radius_m
            .ok_or_else(|| LoadError::Diameter(case.path.clone()))?;
        Ok(radius_m * mean_tangential_force_n(&cutter) / (1e3 * UNIT_DEPTH_M))
    }

    /// Mean power per axial depth at the spindle speed `rpm`, rev/min, in W/mm.
    ///
    /// # Errors
    /// As [`Self::of_case`].
    pub fn power_w_per_mm(&self, rpm: f64) -> Result<f64, LoadError> {
        Ok(self.torque_nm_per_mm(rpm)? * TAU * rpm / 60.0)
    }

    /// The load of the cut of a case that limits the power or the torque of its spindle; `None` for another case.
    ///
    /// # Errors
    /// As [`Self::of_case`].
    pub fn of_limited(case: &Case) -> Result<Option<Self>, LoadError> {
        let is_limited = case.limits.as_ref().is_some_and(MachineLimits::limit_load);
        is_limited.then(|| Self::of_case(case)).transpose()
    }

    /// Largest axial depth that the spindle can drive at the speed `rpm`, rev/min; `None` if the case limits neither
    /// power nor torque, or if the mean torque of the cut is not positive.
    ///
    /// # Errors
    /// As [`Self::of_case`].
    pub fn driven_depth(&self, rpm: f64) -> Result<Option<DrivenDepth>, LoadError> {
        let Some(limits) = &self.case.limits else {
            return Ok(None);
        };
        let of = |available: Option<f64>, per_mm: f64, by| {
            Some(DrivenDepth {
                rpm,
                depth_mm: available? / per_mm,
                by,
            })
            .filter(|_| per_mm > 0.0)
        };
        let power = of(
            limits.power_at_w(rpm),
            self.power_w_per_mm(rpm)?,
            LoadLimit::Power,
        );
        let torque = of(
            limits.torque_at_nm(rpm),
            self.torque_nm_per_mm(rpm)?,
            LoadLimit::Torque,
        );
        Ok(power
            .into_iter()
            .chain(torque)
            .min_by(|a, b| a.depth_mm.total_cmp(&b.depth_mm)))
    }
}

/// Mean over a revolution of the tangential force of all teeth, N, at the chip thickness of the feed.
fn mean_tangential_force_n(cutter: &Cutter) -> f64 {
    let length = cutter.exit_rad - cutter.start_rad;
    let gauss = Gauss::shared(NODES);
    let over_engagement = |feed_m: f64| -> f64 {
        let nodes = gauss.nodes.iter().zip(&gauss.weights);
        nodes
            .map(|(node, weight)| {
                let at = cutter.immersion(cutter.start_rad + length * node);
                let force = cutter
                    .force
                    .force_n(at, cutter.recession_m(at, feed_m), cutter.depth_m);
                let [x, y] = at.outward;
                weight * length * (force[1] * x - force[0] * y)
            })
            .sum()
    };
    let integrals = cutter.teeth.iter().map(|tooth| over_engagement(tooth.feed_m));
    integrals.sum::<f64>() / TAU
}

#[cfg(test)]
mod tests;
