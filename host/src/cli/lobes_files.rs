//! Files that `quietcut lobes --out` writes: picture, page, table, JSON, and the rescaled case.

use std::path::Path;

use serde::Serialize;

use super::lobes_rescaled::{RescaledCase, RescalingOutput};
use super::lobes_spindle::Spindle;
use super::lobes_spread::{intervals, percentiles};
use super::{Error, assumed, lobes_csv};
use crate::case::Case;
use crate::file;
use crate::report::digits::significant;
use crate::report::lobe_chart::{Column, lobe_chart_of_spindle};
use crate::report::marks::Mark;
use crate::report::page::{figure, page};
use crate::stability::{Chart, SpeedLine};
use crate::trial_cuts::Calls;

/// Answer of `quietcut lobes` for a chart.
#[derive(Serialize)]
pub(super) struct LobesOutput<'a> {
    #[serde(flatten)]
    pub(super) chart: &'a Chart,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) cuts: Option<Calls>,
    #[serde(skip_serializing_if = "<[String]>::is_empty")]
    pub(super) assumed: &'a [String],
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) spindle: Option<&'a Spindle>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) rescaling: Option<&'a RescalingOutput>,
}

/// Stability chart of a case, with the trial cuts and assumptions that its files may show.
pub(super) struct ShownChart<'a> {
    pub(super) case: &'a Case,
    pub(super) chart: &'a Chart,
    pub(super) depth_mm: f64,
    pub(super) marks: Vec<Mark>,
    pub(super) assumed: &'a [String],
    pub(super) spindle: Option<&'a Spindle>,
    /// The rescaled case of `--rescale`.
    pub(super) rescaled: Option<&'a RescaledCase>,
}

impl ShownChart<'_> {
    /// Writes the file `path` in the format of its ending.
    ///
    /// # Errors
    /// The chart cannot be drawn, the file cannot be written, or a case is asked for without `--rescale`.
    pub(super) fn write(&self, path: &Path) -> Result<(), Error> {
        let text = match file::ending(path).as_str() {
            "json" => {
                let answer = LobesOutput {
                    chart: self.chart,
                    cuts: None,
                    assumed: self.assumed,
                    spindle: self.spindle,
                    rescaling: self.rescaled.map(|rescaled| &rescaled.answer),
                };
                serde_json::to_string(&answer).map_err(Error::other)?
            }
            "csv" => lobes_csv::as_csv(self.chart)?,
            "svg" => self.picture()?,
            "html" => self.page()?,
            "toml" => self.rescaled.map(|rescaled| rescaled.text.clone()).ok_or_else(|| {
                Error::input(format!(
                    "--out {}: a case is written with --cuts and --rescale only; .svg, .html, .csv or .json is needed",
                    path.display()
                ))
            })?,
            _ => {
                return Err(Error::input(format!(
                    "{}: the ending of the file sets its format; .svg, .html, .csv or .json is needed",
                    path.display()
                )));
            }
        };
        Ok(file::write(path, text.as_bytes())?)
    }

    fn picture(&self) -> Result<String, Error> {
        let columns: Vec<Column> = self.chart.lines().into_iter().map(Column::from).collect();
        // The chart cannot be drawn from only one spindle speed or without a depth: this is an input error.
        let title = format!("{}, method: {}", self.case.name, self.chart.label);
        let area = self.spindle.map(Spindle::area);
        lobe_chart_of_spindle(&title, &columns, self.depth_mm, &self.marks, area.as_ref())
            .map_err(Error::input)
    }

    fn page(&self) -> Result<String, Error> {
        let (case, chart) = (self.case, self.chart);
        let svg = self.picture()?;
        let caption = format!(
            "Stable depths over spindle speed, method: {}. Lines: first loss of stability. Grey areas: undecided within the error \
         of the method. Grey band with lines: 5 to 95 % percentiles and median of the first limit, from the standard \
         deviations of the case. Circles: stable trial cuts; crosses: trial cuts with chatter; squares: marginal trial cuts.",
            chart.label
        );
        let body = maud::html! {
            h1 { (case.name) }
            (figure(&svg, &caption))
            (assumed::section(self.assumed))
            @if let Some(spindle) = self.spindle { (spindle.section()) }
            h2 { "Limits" }
            table {
                tr {
                    th { "rev/min" } th { "first limit [mm]" } th { "error [mm]" } th { "kind" } th { "chatter [Hz]" } th { "stable [mm]" }
                    @if chart.speeds.iter().any(|line| line.spread.is_some()) {
                        th { "5 % percentile of the limit (90 % interval) [mm]" } th { "50 %" } th { "95 %" }
                    }
                }
                @for line in &chart.speeds { (row(line)) }
            }
        };
        Ok(page(&case.name, &body))
    }
}

fn row(line: &SpeedLine) -> maud::Markup {
    let stable: Vec<String> = line
        .stable_mm
        .iter()
        .map(|[from, to]| format!("{from:.3} to {to:.3}"))
        .collect();
    maud::html! {
        tr {
            td { (format!("{:.1}", line.rpm)) }
            @if let Some(limit) = line.first_limit {
                td { (format!("{:.4}", limit.depth_mm)) }
                td { @if let Some(error_mm) = limit.error_mm { (significant(error_mm, 1)) } }
                td { (limit.kind.name()) }
                td { @if let Some(hz) = limit.chatter_hz { (format!("{hz:.2}")) } }
            } @else {
                td { "none" } td {} td {} td {}
            }
            td { (stable.join(", ")) }
            @if let Some(spread) = &line.spread {
                @for (depth, [from, to]) in percentiles(spread, "beyond").into_iter().zip(intervals(spread, "beyond")) {
                    td { (depth) " (" (from) " to " (to) ")" }
                }
            }
        }
    }
}
