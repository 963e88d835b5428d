//! `quietcut lobes` over the feed per tooth or the feed direction: the lines of a chart for each of them.

use std::fmt::Write;

use serde::Serialize;

use super::method::MethodChoice;
use super::{Error, Output, Range};
use crate::case::Case;
use crate::stability::{Label, SpeedLine, chart};

/// What is varied beside speed and depth; at most one.
#[derive(Debug, clap::Args)]
pub(super) struct Varied {
    /// Limits over the feed direction too: degrees from the machine's x towards its y, first:last:count.
    #[arg(long, value_name = "R", allow_negative_numbers = true, requires = "rpm", conflicts_with_all = ["out", "cells", "feed_mm"])]
    feed_direction_deg: Option<Range>,
    /// Limits over the feed per tooth too, in mm, first:last:count: it matters with axial-depth-modulation and with cubic terms.
    #[arg(long, value_name = "R", value_parser = Range::positive, requires = "rpm", conflicts_with_all = ["out", "cells"])]
    feed_mm: Option<Range>,
}

/// The quantity, and its values.
pub(super) struct Variation {
    name: &'static str,
    values: Vec<f64>,
    set: fn(&mut Case, f64),
}

#[derive(Serialize)]
struct Answer {
    #[serde(flatten)]
    label: Label,
    varied: &'static str,
    charts: Vec<Of>,
}

#[derive(Serialize)]
struct Of {
    value: f64,
    speeds: Vec<SpeedLine>,
}

impl Varied {
    /// What was asked for.
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

/// Answers with a chart for each value.
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
        charts.push(Of {
            value,
            speeds: chart.speeds,
        });
    }
    // A range has one value at least.
    let Some(label) = label else { return Ok(()) };
    let mut text = format!(
        "by {label}\n{:>18}    rev/min  first limit [mm]  kind",
        variation.name
    );
    for of in &charts {
        for line in &of.speeds {
            let (depth, kind) = line.first_limit.map_or_else(
                || ("none".into(), ""),
                |limit| (format!("{:.4}", limit.depth_mm), limit.kind.name()),
            );
            // Writing to a String cannot fail.
            let _ = write!(text, "\n{:>18}  {:>9.1}  {depth:>16}  {kind}", of.value, line.rpm);
        }
    }
    let answer = Answer {
        label,
        varied: variation.name,
        charts,
    };
    output.answer(&answer, text)
}
