//! A method with the structure and the cutting coefficients of each spindle speed.

use crate::error::StabilityError;
use crate::limits::cell::Cell;
use crate::limits::method::Method;
use crate::limits::point::CutStability;
use crate::limits::speed_line::SpeedLine;
use crate::process::speed_dependence::at_speed;
use quietcut_model::case::Case;

/// Spindle speed, rev/min, at which the constructor tries the method: an arbitrary choice, since refusals, name and
/// settings of the method do not depend on the speed.
const TRIED_RPM: f64 = 1000.0;

/// Gives the method of a case whose structure and cutting coefficients do not depend on the spindle speed.
type MethodOf = fn(&Case) -> Result<Box<dyn Method>, StabilityError>;

/// Stability method of a case whose structure or cutting coefficients depend on the spindle speed. Each speed has its own problem
/// and method.
pub(crate) struct AtEachSpeed {
    case: Case,
    method_of: MethodOf,
    tried: Box<dyn Method>,
}

impl AtEachSpeed {
    /// The method that `method_of` gives for a case, at each speed.
    ///
    /// # Errors
    /// As `method_of`, for the case at one speed.
    pub(crate) fn new(case: &Case, method_of: MethodOf) -> Result<Self, StabilityError> {
        Ok(Self {
            case: case.clone(),
            method_of,
            tried: method_of(&at_speed(case, TRIED_RPM)?)?,
        })
    }

    fn at(&self, rpm: f64) -> Result<Box<dyn Method>, StabilityError> {
        (self.method_of)(&at_speed(&self.case, rpm)?)
    }
}

impl Method for AtEachSpeed {
    fn name(&self) -> &'static str {
        self.tried.name()
    }

    fn blind_to(&self) -> Option<&'static str> {
        self.tried.blind_to()
    }

    fn settings(&self) -> Option<String> {
        self.tried.settings()
    }

    fn takes_seconds(&self) -> bool {
        self.tried.takes_seconds()
    }

    fn point(&self, rpm: f64, depth_mm: f64) -> Result<CutStability, StabilityError> {
        self.at(rpm)?.point(rpm, depth_mm)
    }

    fn line(&self, rpm: f64, depth_mm: f64, samples: usize) -> Result<SpeedLine, StabilityError> {
        self.at(rpm)?.line(rpm, depth_mm, samples)
    }

    fn cells(&self, rpm: f64, depths_mm: &[f64]) -> Result<Vec<Cell>, StabilityError> {
        self.at(rpm)?.cells(rpm, depths_mm)
    }
}
