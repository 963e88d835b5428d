//! What the machine's spindle can do.

/// Limits of the machine; advice stays within.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MachineLimits {
    /// Slowest spindle speed, rev/min.
    pub rpm_min: f64,
    /// Fastest spindle speed, rev/min.
    pub rpm_max: f64,
    /// Spindle power, W; `None` where the case does not say.
    pub power_w: Option<f64>,
}
