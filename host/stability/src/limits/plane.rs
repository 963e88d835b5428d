//! Limits as linear functions (planes) of the uncertain variables of a case, from exact derivatives at every loss of
//! stability.

use std::f64::consts::TAU;

use nalgebra::DVector;

use super::sampling::Variable;
use super::sensitivity::{Sensitivity, Slope, Tangent};
use super::speed_line::{SpeedLine, Switch};
use crate::problem::linear::{CubicTerms, Problem};
use quietcut_model::case::Case;

/// Half width of the central difference of the problem along a variable, in standard deviations. If one side is no
/// valid machine, the difference is one-sided.
const STEP: f64 = 0.05;

/// Linear problem of a case with its derivative along each variable, per standard deviation.
#[derive(Clone, Debug)]
pub struct Linearized {
    problem: Problem,
    tangents: Vec<Tangent>,
}

/// Loss of stability linearized over the variables.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// Axial depth at the nominal machine, mm.
    pub depth_mm: f64,
    /// Gradient of the depth, mm per standard deviation.
    pub gradient: DVector<f64>,
    /// Chatter frequency, Hz, with its gradient, Hz per standard deviation; `None` at a flip, whose frequency follows
    /// from the spindle speed alone.
    pub chatter_hz: Option<(f64, DVector<f64>)>,
}

impl Linearized {
    /// Linearizes the problem of a case along its variables; `None` if the linear part of the case, or of a varied
    /// case, is not valid.
    pub fn new(case: &Case, variables: &[Variable]) -> Option<Self> {
        let problem = Problem::new(case, CubicTerms::LeaveOut).ok()?;
        let tangents = variables.iter().map(|variable| {
            let at = |deviations: f64| {
                let mut moved = case.clone();
                let is_possible = variable.shift(&mut moved, deviations);
                is_possible.then(|| Problem::new(&moved, CubicTerms::LeaveOut).ok())?
            };
            match (at(-STEP), at(STEP)) {
                (Some(low), Some(high)) => Some(Tangent::between(&low, &high, 2.0 * STEP)),
                (None, Some(high)) => Some(Tangent::between(&problem, &high, STEP)),
                (Some(low), None) => Some(Tangent::between(&low, &problem, STEP)),
                (None, None) => None,
            }
        });
        let tangents = tangents.collect::<Option<Vec<_>>>()?;
        Some(Self { problem, tangents })
    }

    /// Linearized losses of stability along a line, the first limit first; those without a derivative are omitted.
    pub fn planes(&self, line: &SpeedLine) -> Vec<Plane> {
        let losses = line.switches.iter().filter(|switch| !switch.gain);
        losses.filter_map(|switch| self.plane(line.rpm, switch)).collect()
    }

    fn plane(&self, rpm: f64, switch: &Switch) -> Option<Plane> {
        let sensitivity = Sensitivity::new(&self.problem, rpm, switch).ok()?;
        let slopes: Option<Vec<Slope>> = self
            .tangents
            .iter()
            .map(|tangent| sensitivity.slope(tangent))
            .collect();
        let slopes = slopes?;
        let count = slopes.len();
        let chatter_hz = switch
            .chatter_hz
            .filter(|_| slopes.iter().any(|slope| slope.angle != 0.0));
        let chatter_hz = chatter_hz.map(|hz| {
            let period_s = self.problem.tooth_period_s(rpm);
            // ωτ is the angle of the multiplier or its negative, modulo 2π; derivatives refer to the angle above the
            // real axis.
            let sign = if (hz * period_s).fract() > 0.5 { -1.0 } else { 1.0 };
            let per_angle = sign / (TAU * period_s);
            (
                hz,
                DVector::from_fn(count, |index, _| slopes[index].angle * per_angle),
            )
        });
        Some(Plane {
            depth_mm: switch.depth_mm,
            gradient: DVector::from_fn(count, |index, _| slopes[index].depth_mm),
            chatter_hz,
        })
    }
}
