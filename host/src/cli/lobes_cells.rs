//! `quietcut lobes --cells`: the dominant Floquet multiplier over a grid of spindle speeds and axial depths.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use super::{Error, Output, Range};
use crate::case::Case;
use crate::file;
use crate::report::cell_map::cell_map;
use crate::report::page::{figure, page};
use crate::stability::{CellChart, Method, Verdict, cell_chart};

/// Computes the dominant Floquet multiplier at each speed and depth of the grid, writes the multipliers to each file of
/// `--out`, and prints the counts of stable, unstable and undecided points, or with `--json` the multipliers.
pub(super) fn run(
    case: &Case,
    method: &dyn Method,
    (rpm, depth_mm): (Range, Range),
    out: &[PathBuf],
    output: Output,
) -> Result<(), Error> {
    let chart = cell_chart(method, &rpm.values(), &depth_mm.values())?;
    for path in out {
        write(case, &chart, path)?;
    }
    let mut text = counts_text(&chart);
    for path in out {
        // Writing to a String cannot fail.
        let _ = write!(text, "\n{}", path.display());
    }
    output.answer(&chart, text)
}

fn counts_text(chart: &CellChart) -> String {
    let count = |verdict: Verdict| {
        let verdicts = chart.speeds.iter().flat_map(|line| &line.verdict);
        verdicts.filter(|found| **found == verdict).count()
    };
    format!(
        "method: {}: {} cells, {} stable, {} unstable, {} undecided",
        chart.label,
        chart.speeds.len() * chart.depths_mm.len(),
        count(Verdict::Stable),
        count(Verdict::Unstable),
        count(Verdict::Undecided),
    )
}

fn write(case: &Case, chart: &CellChart, path: &Path) -> Result<(), Error> {
    let text = match file::ending(path).as_str() {
        "json" => serde_json::to_string(chart).map_err(Error::other)?,
        "csv" => as_csv(chart)?,
        "svg" => picture(case, chart)?,
        "html" => {
            let caption = format!(
                "Modulus of the dominant Floquet multiplier over one tooth period. {}. Line: |multiplier| = 1.",
                counts_text(chart)
            );
            let body = maud::html! {
                h1 { (case.name) }
                (figure(&picture(case, chart)?, &caption))
            };
            page(&case.name, &body)
        }
        _ => {
            return Err(Error::input(format!(
                "{}: the ending of the file sets its format; .svg, .html, .csv or .json is needed",
                path.display()
            )));
        }
    };
    Ok(file::write(path, text.as_bytes())?)
}

fn picture(case: &Case, chart: &CellChart) -> Result<String, Error> {
    let mut sorted = chart.clone();
    sorted.speeds.sort_by(|a, b| a.rpm.total_cmp(&b.rpm));
    let title = format!("{}: |Floquet multiplier|, method: {}", case.name, chart.label);
    // The map cannot be drawn for a single spindle speed, a single depth or descending depths: these are input errors.
    cell_map(&title, &sorted).map_err(Error::input)
}

/// Stability map as CSV with one row per grid point: speed, depth, modulus of the dominant Floquet multiplier, error of
/// the modulus, and verdict.
fn as_csv(chart: &CellChart) -> Result<String, Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer
        .write_record([
            "rpm [rev/min]",
            "depth [mm]",
            "multiplier_abs [1]",
            "error [1]",
            "verdict",
        ])
        .map_err(Error::other)?;
    for line in &chart.speeds {
        let cells = line.multiplier_abs.iter().zip(&line.error).zip(&line.verdict);
        for (depth_mm, ((size, error), verdict)) in chart.depths_mm.iter().zip(cells) {
            let numbers = [line.rpm, *depth_mm, *size, *error].map(|number| number.to_string());
            let [rpm, depth_mm, size, error] = &numbers;
            writer
                .write_record([rpm, depth_mm, size, error, verdict.name()])
                .map_err(Error::other)?;
        }
    }
    let bytes = writer.into_inner().map_err(Error::other)?;
    String::from_utf8(bytes).map_err(Error::other)
}
