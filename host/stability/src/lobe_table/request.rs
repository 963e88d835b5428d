//! The request for a table: speeds, depths and layers.

/// Speeds, depths and layers of a table; values that are not set follow from the first case.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableRequest {
    /// Slowest and fastest spindle speed, rev/min; default the machine's limits, else 1/2 to 5 teeth per
    /// vibration of the most flexible mode.
    pub rpm: Option<(f64, f64)>,
    /// Largest axial depth, mm; default four times the lowest limit.
    pub depth_mm: Option<f64>,
    /// Feeds per tooth, mm, one layer each, and more between them where limits bend; default that of each case. Without axial
    /// depth modulation and cubic terms limits do not depend on the feed, and one layer holds for all.
    pub feeds_per_tooth_mm: Vec<f64>,
    /// Feed directions, degrees from the machine's x towards its y, one layer each, and more between them where limits bend;
    /// none: that of each case, which the table then does not state.
    pub feed_directions_deg: Vec<f64>,
    /// Speeds before refinement, at least 2; default 121.
    pub speeds: Option<usize>,
    /// True for the derivatives of every entry beside the entries.
    pub derivatives: bool,
    /// The first limit of all but this share of the machines that the deviations describe, in percent, instead of the
    /// limits of the case itself; what is stable again above the limit is left out.
    pub percentile: Option<f64>,
}
