//! What the spindle can reach of the limits that `quietcut lobes` computes, and the cut that it proposes within.

use std::fmt::Write;

use maud::{Markup, html};
use quietcut_core::advice::SPEED_BAND;
use serde::Serialize;

use super::Error;
use crate::case::{Case, MachineLimits};
use crate::cutting_load::{CuttingLoad, DrivenDepth, LoadError};
use crate::report::spindle_area::SpindleArea;
use crate::stability::{Chart, SpeedLine};

/// Number of speeds at which the depth that the spindle can drive is computed for a picture. A choice.
const DRAWN: usize = 200;

/// Speeds, power and torque of the spindle of a case.
pub(super) struct Reach<'a> {
    limits: Option<&'a MachineLimits>,
    /// `None` if power and torque are not limited, or if the load of the cut is not known.
    load: Option<CuttingLoad>,
}

impl<'a> Reach<'a> {
    /// The reach of the spindle of a case. A warning says that power and torque are not considered if the load of the
    /// cut is not known.
    pub(super) fn of_case(case: &'a Case) -> Self {
        let load = CuttingLoad::of_limited(case).unwrap_or_else(|error| {
            tracing::warn!("power and torque of the spindle are not considered: {error}");
            None
        });
        Self {
            limits: case.limits.as_ref(),
            load,
        }
    }

    fn driven(&self, rpm: f64) -> Result<Option<DrivenDepth>, Error> {
        let driven = self.load.as_ref().map(|load| load.driven_depth(rpm)).transpose();
        Ok(driven.map_err(|error: LoadError| Error::input(error))?.flatten())
    }

    /// Limit of the spindle that a cut exceeds, `speed`, `power` or `torque`; `None` if the spindle can make it.
    pub(super) fn beyond(&self, rpm: f64, depth_mm: f64) -> Result<Option<&'static str>, Error> {
        if self.limits.is_some_and(|limits| !limits.allows(rpm)) {
            return Ok(Some("speed"));
        }
        let driven = self.driven(rpm)?;
        Ok(driven
            .filter(|driven| driven.depth_mm < depth_mm)
            .map(|driven| driven.by.name()))
    }
}

/// What the spindle of a case can reach of a chart.
#[derive(Serialize)]
pub(super) struct Spindle {
    /// Ranges of spindle speed in which the spindle may run, rev/min.
    allowed_rpm: Vec<[f64; 2]>,
    /// True if the spindle may run at a speed of the chart.
    #[serde(skip)]
    is_reached: bool,
    /// Depth that the spindle can drive at each requested speed, with the quantity that limits it; empty if power and
    /// torque are not limited.
    driven: Vec<DrivenDepth>,
    /// The cut with the largest product of speed and depth that is stable and within the limits of the spindle; `None`
    /// if there is none.
    proposal: Option<Proposal>,
    #[serde(skip)]
    drawn: Vec<(f64, f64)>,
}

/// A stable cut within the limits of the spindle.
#[derive(Clone, Copy, Debug, Serialize)]
struct Proposal {
    /// Spindle speed, rev/min.
    rpm: f64,
    /// Largest axial depth there that is stable over the speed band around it and that the spindle can drive, mm.
    depth_mm: f64,
    /// What limits the depth: `stability`, `power`, `torque`, or `chart` where the last depth of the chart does.
    by: &'static str,
    /// True if the chart has no further speed in the speed band on at least one side, so that the band was not computed there.
    #[serde(skip)]
    is_alone: bool,
}

impl Spindle {
    /// The reach of the spindle in a chart; `None` if the case has no limits.
    ///
    /// # Errors
    /// The load of the cut cannot be computed at a speed.
    pub(super) fn of_chart(case: &Case, chart: &Chart) -> Result<Option<Self>, Error> {
        let reach = Reach::of_case(case);
        let (Some(limits), Some(first), Some(last)) =
            (reach.limits, chart.speeds.first(), chart.speeds.last())
        else {
            return Ok(None);
        };
        let mut driven = Vec::new();
        for line in &chart.speeds {
            driven.extend(reach.driven(line.rpm)?);
        }
        let mut drawn = Vec::new();
        for index in 0..DRAWN {
            let share = index as f64 / (DRAWN - 1) as f64;
            let rpm = first.rpm + (last.rpm - first.rpm) * share;
            drawn.extend(reach.driven(rpm)?.map(|driven| (rpm, driven.depth_mm)));
        }
        Ok(Some(Self {
            allowed_rpm: limits.allowed_rpm(),
            is_reached: chart.lines().iter().any(|line| limits.allows(line.rpm)),
            driven,
            proposal: proposal(&reach, limits, &chart.lines())?,
            drawn,
        }))
    }

    /// Text beside the limit at one requested speed.
    pub(super) fn beside(&self, rpm: f64) -> String {
        let mut text = String::new();
        if !self
            .allowed_rpm
            .iter()
            .any(|[from, to]| (*from..=*to).contains(&rpm))
        {
            text.push_str("; outside the speeds of the spindle");
        }
        if let Some(driven) = self.driven.iter().find(|driven| driven.rpm == rpm) {
            // Writing to a String cannot fail.
            let _ = write!(
                text,
                "; {} of the spindle: {:.3} mm",
                driven.by.name(),
                driven.depth_mm
            );
        }
        text
    }

    /// Sentence with the proposed cut, after a line break.
    pub(super) fn as_text(&self) -> String {
        format!("\n{}", self.sentence())
    }

    fn sentence(&self) -> String {
        let ranges: Vec<String> = self
            .allowed_rpm
            .iter()
            .map(|[from, to]| format!("{from} to {to}"))
            .collect();
        let within = format!("within the limits of the spindle ({} rev/min)", ranges.join(", "));
        match &self.proposal {
            Some(proposal) => format!(
                "{within} speed times depth is largest at {:.0} rev/min: up to {:.3} mm, limited by {}{}",
                proposal.rpm,
                proposal.depth_mm,
                match proposal.by {
                    "stability" => "stability",
                    "power" => "the power of the spindle",
                    "torque" => "the torque of the spindle",
                    _ => "the last depth of the chart",
                },
                if proposal.is_alone {
                    format!(
                        "; not all speeds within ±{} % of it were computed: ask for more speeds, or leave --no-refine out",
                        100.0 * SPEED_BAND
                    )
                } else {
                    String::new()
                }
            ),
            None if !self.is_reached => format!("{within} lies no speed of the chart"),
            None => format!(
                "{within} no cut of the chart is stable over ±{} % of its speed{}",
                100.0 * SPEED_BAND,
                if self.driven.is_empty() {
                    ""
                } else {
                    " and can be driven"
                }
            ),
        }
    }

    /// Section of a page about the spindle.
    pub(super) fn section(&self) -> Markup {
        html! {
            h2 { "Spindle" }
            p { (self.sentence()) "." }
            @if !self.driven.is_empty() {
                table {
                    tr { th { "rev/min" } th { "depth the spindle can drive [mm]" } th { "limited by" } }
                    @for driven in &self.driven {
                        tr {
                            td { (format!("{:.1}", driven.rpm)) }
                            td { (format!("{:.3}", driven.depth_mm)) }
                            td { (driven.by.name()) }
                        }
                    }
                }
            }
        }
    }

    /// The reach of the spindle for a picture.
    pub(super) fn area(&self) -> SpindleArea {
        SpindleArea {
            allowed_rpm: self.allowed_rpm.clone(),
            driven: self.drawn.clone(),
        }
    }
}

/// The cut with the largest product of speed and depth, of those that are stable from depth 0 on over the speed band of
/// the device's advice, and that the spindle can run at and drive. With percentiles of the limit the 5 % percentile counts.
fn proposal(
    reach: &Reach<'_>,
    limits: &MachineLimits,
    lines: &[&SpeedLine],
) -> Result<Option<Proposal>, Error> {
    let band = f64::from(SPEED_BAND);
    let mut best: Option<Proposal> = None;
    for line in lines.iter().filter(|line| limits.allows(line.rpm)) {
        let near: Vec<&SpeedLine> = lines
            .iter()
            .filter(|other| (other.rpm / line.rpm - 1.0).abs() <= band)
            .copied()
            .collect();
        let stable_mm = near
            .iter()
            .map(|other| stable_to_mm(other))
            .fold(f64::INFINITY, f64::min);
        let has = |beside: fn(f64, f64) -> bool| near.iter().any(|other| beside(other.rpm, line.rpm));
        let is_alone = !(has(|other, own| other < own) && has(|other, own| other > own));
        let by = if line.first_limit.is_some() || stable_mm < last_mm(line) {
            "stability"
        } else {
            "chart"
        };
        let (depth_mm, by) = match reach.driven(line.rpm)? {
            Some(driven) if driven.depth_mm < stable_mm => (driven.depth_mm, driven.by.name()),
            _ => (stable_mm, by),
        };
        let removal = |proposal: &Proposal| proposal.rpm * proposal.depth_mm;
        let found = Proposal {
            rpm: line.rpm,
            depth_mm,
            by,
            is_alone,
        };
        if removal(&found) > best.as_ref().map_or(0.0, removal) {
            best = Some(found);
        }
    }
    Ok(best)
}

/// Upper end of the last stable interval of a line, mm.
fn last_mm(line: &SpeedLine) -> f64 {
    line.stable_mm.last().map_or(0.0, |interval| interval[1])
}

/// Depth, mm, up to which a cut is stable from depth 0 on: with percentiles the smaller of the 5 % percentile and the
/// limit.
fn stable_to_mm(line: &SpeedLine) -> f64 {
    let from_zero = line.stable_mm.first().filter(|interval| interval[0] == 0.0);
    let stable_mm = from_zero.map_or(0.0, |interval| interval[1]);
    let low_mm = line
        .spread
        .as_ref()
        .and_then(|spread| spread.limit_percentiles_mm.low);
    low_mm.map_or(stable_mm, |low_mm| stable_mm.min(low_mm))
}
