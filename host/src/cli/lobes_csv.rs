//! Stability limits over the spindle speed as CSV.

use super::Error;
use super::lobes_spread::{intervals, percentiles};
use crate::stability::Chart;

/// Stability limits as CSV with one row for each crossing of the unit circle by a Floquet multiplier over the axial
/// depth at each spindle speed. A speed without any crossing has one row with the speed and, if computed, the
/// percentiles of the first limit.
pub(super) fn as_csv(chart: &Chart) -> Result<String, Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let mut header = vec![
        "rpm [rev/min]",
        "depth [mm]",
        "kind",
        "gain",
        "chatter [Hz]",
        "first",
        "error [mm]",
        "undecided_from [mm]",
        "undecided_to [mm]",
    ];
    if chart.speeds.iter().any(|line| line.spread.is_some()) {
        header.extend(["limit_5 [mm]", "limit_50 [mm]", "limit_95 [mm]"]);
        // Lower and upper end of the 90 % confidence interval of each percentile of the first stability limit.
        header.extend(["limit_5_from [mm]", "limit_5_to [mm]"]);
        header.extend(["limit_50_from [mm]", "limit_50_to [mm]"]);
        header.extend(["limit_95_from [mm]", "limit_95_to [mm]"]);
    }
    writer.write_record(&header).map_err(Error::other)?;
    let spread_columns = header.len() - 9;
    for line in chart.lines() {
        let rpm = line.rpm.to_string();
        let mut spread: Vec<String> = line
            .spread
            .iter()
            .flat_map(|spread| {
                let ends = intervals(spread, "").into_iter().flatten();
                percentiles(spread, "").into_iter().chain(ends)
            })
            .collect();
        // Spindle speeds that were added between the requested ones have no percentiles of the limit.
        spread.resize(spread_columns, String::new());
        let spread = spread.iter().map(String::as_str);
        if line.switches.is_empty() {
            let row = [rpm.as_str(), "", "", "", "", "", "", "", ""];
            writer
                .write_record(row.into_iter().chain(spread.clone()))
                .map_err(Error::other)?;
        }
        for switch in &line.switches {
            let first = line
                .first_limit
                .is_some_and(|limit| limit.depth_mm == switch.depth_mm);
            // The interval of axial depths around this crossing in which the method cannot decide.
            let undecided = line
                .undecided_mm
                .iter()
                .find(|[from, to]| (*from..=*to).contains(&switch.depth_mm));
            let number = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
            let row = [
                rpm.as_str(),
                &switch.depth_mm.to_string(),
                switch.kind.name(),
                &switch.gain.to_string(),
                &number(switch.chatter_hz),
                &first.to_string(),
                &number(switch.error_mm),
                &number(undecided.map(|interval| interval[0])),
                &number(undecided.map(|interval| interval[1])),
            ];
            writer
                .write_record(row.into_iter().chain(spread.clone()))
                .map_err(Error::other)?;
        }
    }
    let bytes = writer.into_inner().map_err(Error::other)?;
    String::from_utf8(bytes).map_err(Error::other)
}
