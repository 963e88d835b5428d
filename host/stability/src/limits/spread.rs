//! The spread of a limit: percentiles with their confidence intervals.

use serde::Serialize;

/// 5, 50 and 95 % of all machines have a first limit below these depths, mm; `None` beyond the last depth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Percentiles {
    /// Nineteen machines of twenty are stable up to here.
    #[serde(rename = "5")]
    pub low: Option<f64>,
    /// The median.
    #[serde(rename = "50")]
    pub median: Option<f64>,
    /// One machine of twenty is stable up to here.
    #[serde(rename = "95")]
    pub high: Option<f64>,
}

/// For each of the [`Percentiles`] the depths, mm, between which it lies with 90 % confidence; `None` beyond the last depth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PercentileIntervals {
    /// Of the 5 % limit.
    #[serde(rename = "5")]
    pub low: [Option<f64>; 2],
    /// Of the median.
    #[serde(rename = "50")]
    pub median: [Option<f64>; 2],
    /// Of the 95 % limit.
    #[serde(rename = "95")]
    pub high: [Option<f64>; 2],
}

/// One percentile of the limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Percentile {
    /// The depth, mm; `None` beyond the last depth.
    pub depth_mm: Option<f64>,
    /// Between which depths, mm, it lies with 90 % confidence; `None` beyond the last depth.
    pub ci90_mm: [Option<f64>; 2],
}

impl Percentile {
    /// How far it may be off, mm, with 90 % confidence: the farther end of its interval, which ends at `deepest_mm` where it
    /// goes beyond. `None` where the percentile itself lies beyond.
    pub fn error_mm(&self, deepest_mm: f64) -> Option<f64> {
        let depth_mm = self.depth_mm?;
        let [from, to] = self.ci90_mm.map(|end| end.unwrap_or(deepest_mm));
        Some((depth_mm - from).max(to - depth_mm))
    }
}

/// Spread of the first limit at one speed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LimitSpread {
    /// Of the first limit.
    pub limit_percentiles_mm: Percentiles,
    /// Between which depths each percentile lies with 90 % confidence, mm.
    pub limit_percentiles_ci90_mm: PercentileIntervals,
    /// How many machines were drawn.
    pub machines: usize,
    /// Share of machines that are stable at each depth asked for; empty where none was.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub stable_share: Vec<f64>,
}
