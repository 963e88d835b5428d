//! Refusal of speeds and depths that are out of range.

use crate::error::StabilityError;

pub(crate) fn check_speed(rpm: f64) -> Result<(), StabilityError> {
    if rpm.is_finite() && rpm > 0.0 {
        Ok(())
    } else {
        Err(StabilityError::Argument {
            quantity: "spindle speed, rev/min,",
            value: rpm,
            expected: "a speed greater than 0",
        })
    }
}

pub(crate) fn check_depth(depth_mm: f64) -> Result<(), StabilityError> {
    if depth_mm.is_finite() && depth_mm >= 0.0 {
        Ok(())
    } else {
        Err(StabilityError::Argument {
            quantity: "axial depth, mm,",
            value: depth_mm,
            expected: "a depth of 0 or more",
        })
    }
}
