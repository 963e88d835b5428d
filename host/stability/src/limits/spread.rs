//! The spread of a stability limit under parameter uncertainty: percentiles with confidence intervals.

use serde::Serialize;

/// The 5, 50 and 95 % percentiles of the first stability limit over the drawn machines that are physical, mm; `None`
/// beyond the last depth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Percentiles {
    /// The 5 % percentile of the first limit, mm: nineteen machines of twenty are stable up to this depth; `None`
    /// beyond the last depth.
    #[serde(rename = "5")]
    pub low: Option<f64>,
    /// The median.
    #[serde(rename = "50")]
    pub median: Option<f64>,
    /// The 95 % percentile of the first limit, mm: one machine of twenty is stable up to this depth; `None` beyond the
    /// last depth.
    #[serde(rename = "95")]
    pub high: Option<f64>,
}

/// Confidence intervals (90 %) of the [`Percentiles`], mm; `None` for an end beyond the last depth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PercentileIntervals {
    /// Confidence interval of the 5 % percentile of the first limit, mm.
    #[serde(rename = "5")]
    pub low: [Option<f64>; 2],
    /// Interval of the median.
    #[serde(rename = "50")]
    pub median: [Option<f64>; 2],
    /// Confidence interval of the 95 % percentile of the first limit, mm.
    #[serde(rename = "95")]
    pub high: [Option<f64>; 2],
}

/// One percentile of the first stability limit over drawn machines, with its confidence interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Percentile {
    /// Percentile of the first limit, mm; `None` beyond the last depth.
    pub depth_mm: Option<f64>,
    /// Confidence interval (90 %) of the percentile of the first limit, mm; `None` for an end beyond the last depth.
    pub ci90_mm: [Option<f64>; 2],
}

impl Percentile {
    /// Error of the percentile with 90 % confidence, mm: the distance to the farther end of its interval, where an end
    /// beyond `deepest_mm` counts as `deepest_mm`. `None` if the percentile itself lies beyond.
    pub fn error_mm(&self, deepest_mm: f64) -> Option<f64> {
        let depth_mm = self.depth_mm?;
        let [from, to] = self.ci90_mm.map(|end| end.unwrap_or(deepest_mm));
        Some((depth_mm - from).max(to - depth_mm))
    }
}

/// Spread of the first stability limit over drawn machines at one spindle speed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LimitSpread {
    /// Percentiles of the first limit.
    pub limit_percentiles_mm: Percentiles,
    /// Confidence intervals (90 %) of the percentiles of the first limit, mm.
    pub limit_percentiles_ci90_mm: PercentileIntervals,
    /// Number of machines drawn, those that are not physical included. With a single uncertain variable their limits are
    /// interpolated between fewer machines.
    pub machines: usize,
    /// Share of stable machines at each requested depth, among the drawn machines that are physical; empty if no depth
    /// was requested.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub stable_share: Vec<f64>,
}
