//! `quietcut lobes` over the feed per tooth or the feed direction: one chart of limits for each value.

use std::fmt::Write;

use serde::Serialize;

use super::method::MethodChoice;
use super::{Error, Output, Range};
use crate::case::Case;
use crate::stability::{Label, SpeedLine, chart};

/// Options that vary a third parameter of the stability chart besides spindle speed and axial depth.
#[derive(Debug, clap::Args)]
pub(super) struct Varied {
    /// Compute the limits for each of these feed directions: degrees from the machine's x towards its y,
    /// first:last:count.
    #[arg(long, value_name = "R", allow_negative_numbers = true, requires = "rpm", conflicts_with_all = ["out", "cells", "feed_mm"])]
    feed_direction_deg: Option<Range>,
    /// Compute the limits for each of these feeds per tooth, in mm, first:last:count. Limits depend on the feed with
    /// axial-depth-modulation and with cubic terms.
    #[arg(long, value_name = "R", value_parser = Range::positive, requires = "rpm", conflicts_with_all = ["out", "cells"])]
    feed_mm: Option<Range>,
}

/// Varied parameter of the cut, with its values and the function that sets it in a case.
pub(super) struct Variation {
    name: &'static str,
    values: Vec<f64>,
    set: fn(&mut Case, f64),
}

#[derive(Serialize)]
struct VariedOutput {
    #[serde(flatten)]
    label: Label,
    varied: &'static str,
    charts: Vec<ChartOutput>,
}

#[derive(Serialize)]
struct ChartOutput {
    value: f64,
    speeds: Vec<SpeedLine>,
}

impl Varied {
    /// The parameter of the cut, feed direction or feed per tooth, that the options vary over a range; `None` without
    /// these options.
    pub(super) fn variation(&self) -> Option<Variation> {
        let direction = self.feed_direction_deg.map(|range| Variation {
            name: "feed_direction_deg",
            values: range.values(),
            set: |case, degrees| {
                if let Some(cut) = &mut case.cut {
                    cut.feed_direction_deg = degrees;
                }
            },
        });
        let feed = self.feed_mm.map(|range| Variation {
            name: "feed_per_tooth_mm",
            values: range.values(),
            set: |case, feed_mm| {
                if let Some(cut) = &mut case.cut {
                    cut.feed_per_tooth_mm = feed_mm;
                }
            },
        });
        direction.or(feed)
    }
}

/// Computes and prints the stability limits over the spindle speed for each value of the varied feed or feed direction.
pub(super) fn run(
    case: &Case,
    method: &MethodChoice,
    variation: &Variation,
    rpm: Range,
    depth_mm: Range,
    output: Output,
) -> Result<(), Error> {
    let deepest_mm = depth_mm.first().max(depth_mm.last());
    let mut charts = Vec::with_capacity(variation.values.len());
    let mut label = None;
    for &value in &variation.values {
        let mut case = case.clone();
        (variation.set)(&mut case, value);
        let chart = chart(method.on(&case)?.as_ref(), &rpm.values(), deepest_mm, 0)?;
        label = Some(chart.label);
        charts.push(ChartOutput {
            value,
            speeds: chart.speeds,
        });
    }
    // A range of the command line has at least one value, so there is a label.
    let Some(label) = label else { return Ok(()) };
    let mut text = format!(
        "method: {label}\n{:>18}    rev/min  first limit [mm]  kind",
        variation.name
    );
    for chart in &charts {
        for line in &chart.speeds {
            let (depth, kind) = line.first_limit.map_or_else(
                || ("none".into(), ""),
                |limit| (format!("{:.4}", limit.depth_mm), limit.kind.name()),
            );
            // Writing to a String cannot fail.
            let _ = write!(
                text,
                "\n{:>18}  {:>9.1}  {depth:>16}  {kind}",
                chart.value, line.rpm
            );
        }
    }
    let answer = VariedOutput {
        label,
        varied: variation.name,
        charts,
    };
    output.answer(&answer, text)
}
