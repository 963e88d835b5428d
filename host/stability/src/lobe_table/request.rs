//! The request for a lobe table: speeds, depths and layers.

/// Speeds, depths and layers of a lobe table. Values that are not set follow from the cases.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableRequest {
    /// Lowest and highest spindle speed of the table, rev/min. Default, from the first case: the speed limits of the
    /// spindle if the case has them, otherwise 1/2 to 5 tooth passings per vibration period of the most flexible mode.
    pub rpm: Option<(f64, f64)>,
    /// Largest axial depth of the table, mm. Default: four times the lowest first limit of all layers, or 500 mm if no
    /// limit lies below about 330 mm.
    pub depth_mm: Option<f64>,
    /// Feeds per tooth, mm, one layer each; more are added between them where limits bend. Default: the feed of each
    /// case. Without axial-depth modulation and nonlinear effects limits do not depend on the feed, and one layer holds
    /// for all feeds.
    pub feeds_per_tooth_mm: Vec<f64>,
    /// Feed directions, degrees from the machine's x towards its y, one layer each; more are added between them where
    /// limits bend. If empty, the direction of each case, which the table then does not state.
    pub feed_directions_deg: Vec<f64>,
    /// Number of spindle speeds of the table before refinement; fewer than 2 count as 2. Default: 121.
    pub speeds: Option<usize>,
    /// True to store the derivatives of the limits in every entry.
    pub derivatives: bool,
    /// Percentile, percent: depths are stable up to the depth at which this share of the drawn machines has lost
    /// stability, in place of the limits of the case. Stable depths above that depth are omitted. `None` for the limits
    /// of the case.
    pub percentile: Option<f64>,
}
