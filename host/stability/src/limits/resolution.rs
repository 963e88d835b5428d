//! Accuracy of the stability limits of a chart between its speeds.

use serde::Serialize;

/// Accuracy of stability limits between the speeds of a chart, and where it is not reached.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Resolution {
    /// Bound of the estimated error in depth of a limit on the straight line between two neighbouring speeds of the
    /// chart, relative to the depth of the limit; outside the gaps `unresolved_rpm`.
    pub depth_share: f64,
    /// Bound of the estimated error in spindle speed, relative to the speed, of a limit that is too steep over the
    /// speed for `depth_share`; outside the gaps `unresolved_rpm`.
    pub speed_share: f64,
    /// Width of the narrowest region of stability or of chatter in the chart that ends within the chart on both sides,
    /// rev/min; `None` if there is no such region.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub narrowest_island_rpm: Option<f64>,
    /// Gaps between two speeds, rev/min, over which stable depths begin, end, or move too fast for a straight line, or
    /// in which a region of stability or of chatter may lie. The verdict within them is open where both ends differ.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub unresolved_rpm: Vec<[f64; 2]>,
}
