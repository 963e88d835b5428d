//! Limits of the machine's spindle.

/// Limits of spindle speed and power of the machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MachineLimits {
    /// Slowest spindle speed, rev/min.
    pub rpm_min: f64,
    /// Fastest spindle speed, rev/min.
    pub rpm_max: f64,
    /// Spindle power, W; `None` if the case does not give it.
    pub power_w: Option<f64>,
}

impl MachineLimits {
    /// True if the spindle may run at the speed `rpm`, rev/min: from `rpm_min` to `rpm_max`, both included.
    pub fn allows(&self, rpm: f64) -> bool {
        (self.rpm_min..=self.rpm_max).contains(&rpm)
    }
}
