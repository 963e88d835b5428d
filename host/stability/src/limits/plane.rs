//! Limits as linear functions (planes) of the uncertain variables of a case, from their derivatives at every stability
//! switch at which a multiplier leaves the unit circle.

use std::f64::consts::TAU;

use nalgebra::DVector;

use super::sampling::Variable;
use super::sensitivity::{Sensitivity, Slope, Tangent, no_derivative};
use super::speed_line::{SpeedLine, Switch};
use crate::error::StabilityError;
use crate::problem::linear::{CubicTerms, Problem};
use quietcut_model::case::Case;

/// Change of an uncertain variable to each side, in standard deviations, from which the central difference of the delay
/// problem is computed. If one side is no valid machine, the difference is one-sided.
const STEP: f64 = 0.05;

/// Message about an uncertain parameter for which the delay problem has no difference quotient, since both sides lie
/// out of bounds.
const OUT_OF_BOUNDS: &str = "a parameter leaves its bounds if it changes by a twentieth of its standard deviation to either side; \
    a smaller deviation is needed";

/// Linear delay problem of a case with its derivative along each uncertain variable, per standard deviation.
#[derive(Clone, Debug)]
pub struct Linearized {
    problem: Problem,
    tangents: Vec<Tangent>,
}

/// Crossing out of the unit circle by a multiplier: its axial depth and chatter frequency as linear functions of the
/// uncertain variables of a case.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// Axial depth of the crossing on the nominal machine, mm.
    pub depth_mm: f64,
    /// Gradient of the depth of the crossing, mm per standard deviation, with one entry per uncertain variable in their
    /// order.
    pub gradient: DVector<f64>,
    /// Chatter frequency, Hz, with its gradient, Hz per standard deviation; `None` at a flip, whose frequency follows
    /// from the spindle speed alone, or if no variable changes the angle of the multiplier.
    pub chatter_hz: Option<(f64, DVector<f64>)>,
}

impl Linearized {
    /// Linearizes the delay problem of a case along its uncertain variables.
    ///
    /// # Errors
    /// The linear part of the case is not covered, or the case varied along a variable is valid on neither side.
    pub fn new(case: &Case, variables: &[Variable]) -> Result<Self, StabilityError> {
        let problem = Problem::new(case, CubicTerms::LeaveOut)?;
        let tangents = variables.iter().map(|variable| {
            let at = |deviations: f64| {
                let mut moved = case.clone();
                if variable.shift(&mut moved, deviations) {
                    Problem::new(&moved, CubicTerms::LeaveOut)
                } else {
                    Err(StabilityError::NotCovered {
                        path: case.path.clone(),
                        what: OUT_OF_BOUNDS,
                    })
                }
            };
            match (at(-STEP), at(STEP)) {
                (Ok(low), Ok(high)) => Ok(Tangent::between(&low, &high, 2.0 * STEP)),
                (Err(_), Ok(high)) => Ok(Tangent::between(&problem, &high, STEP)),
                (Ok(low), Err(_)) => Ok(Tangent::between(&low, &problem, STEP)),
                (Err(_), Err(reason)) => Err(reason),
            }
        });
        let tangents = tangents.collect::<Result<Vec<_>, _>>()?;
        Ok(Self { problem, tangents })
    }

    /// Crossings out of the unit circle by multipliers at one spindle speed, each linearized over the uncertain
    /// variables, by depth. `Err` is the reason why a crossing has no derivative.
    pub fn planes(&self, line: &SpeedLine) -> Vec<Result<Plane, StabilityError>> {
        let losses = line.switches.iter().filter(|switch| !switch.gain);
        losses.map(|switch| self.plane(line.rpm, switch)).collect()
    }

    fn plane(&self, rpm: f64, switch: &Switch) -> Result<Plane, StabilityError> {
        let sensitivity = Sensitivity::new(&self.problem, rpm, switch)?;
        let slopes: Option<Vec<Slope>> = self
            .tangents
            .iter()
            .map(|tangent| sensitivity.slope(tangent))
            .collect();
        let slopes = slopes.ok_or_else(|| no_derivative(rpm, switch))?;
        let count = slopes.len();
        let chatter_hz = switch
            .chatter_hz
            .filter(|_| slopes.iter().any(|slope| slope.angle != 0.0));
        let chatter_hz = chatter_hz.map(|hz| {
            let period_s = self.problem.tooth_period_s(rpm);
            // The product ωτ of chatter frequency and tooth period is the angle of the Floquet multiplier or its
            // negative, modulo 2π; derivatives refer to the angle above the real axis.
            let sign = if (hz * period_s).fract() > 0.5 { -1.0 } else { 1.0 };
            let per_angle = sign / (TAU * period_s);
            (
                hz,
                DVector::from_fn(count, |index, _| slopes[index].angle * per_angle),
            )
        });
        Ok(Plane {
            depth_mm: switch.depth_mm,
            gradient: DVector::from_fn(count, |index, _| slopes[index].depth_mm),
            chatter_hz,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use quietcut_model::case::{Deviation, Parameter};
    use quietcut_testkit::case;

    #[test]
    fn a_case_or_variable_without_derivatives_is_refused_with_the_reason() {
        let damping = |std| {
            vec![Variable::together(vec![Deviation {
                parameter: Parameter::DampingRatio(0),
                std,
            }])]
        };
        let case = case("kuka-kr90-acetal");
        assert!(Linearized::new(&case, &damping(1e-3)).is_ok());
        let error = Linearized::new(&case, &damping(f64::INFINITY))
            .unwrap_err()
            .to_string();
        assert!(error.contains("leaves its bounds"), "{error}");
        let mut uneven = case.clone();
        uneven.tool.as_mut().unwrap().pitch_deg = vec![170.0, 190.0];
        let error = Linearized::new(&uneven, &damping(1e-3)).unwrap_err().to_string();
        assert!(error.contains("equal pitch"), "{error}");
    }
}
