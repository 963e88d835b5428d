//! Percentiles of the first stability limit as text.

use crate::stability::LimitSpread;

/// 5, 50 and 95 % percentiles of the first stability limit as text, mm; `beyond` is the text for a percentile deeper
/// than the largest computed depth.
pub(super) fn percentiles(spread: &LimitSpread, beyond: &str) -> [String; 3] {
    let percentiles = spread.limit_percentiles_mm;
    [percentiles.low, percentiles.median, percentiles.high].map(|depth_mm| depth_or(depth_mm, beyond))
}

/// 90 % confidence interval of each percentile of the first stability limit as text, mm; `beyond` is the text for an
/// end deeper than the largest computed depth.
pub(super) fn intervals(spread: &LimitSpread, beyond: &str) -> [[String; 2]; 3] {
    let intervals = spread.limit_percentiles_ci90_mm;
    let intervals = [intervals.low, intervals.median, intervals.high];
    intervals.map(|interval| interval.map(|end| depth_or(end, beyond)))
}

fn depth_or(depth_mm: Option<f64>, beyond: &str) -> String {
    depth_mm.map_or_else(|| beyond.into(), |depth_mm| format!("{depth_mm:.4}"))
}
