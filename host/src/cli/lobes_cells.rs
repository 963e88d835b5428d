//! `quietcut lobes --cells`: the dominant multiplier over a grid of speeds and depths.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use super::{Error, Output, Range};
use crate::case::Case;
use crate::file;
use crate::report::cell_map::cell_map;
use crate::report::page::{figure, page};
use crate::stability::{CellChart, Method, Verdict, cell_chart};

/// Computes the cells, writes them where a file is asked for, and answers.
pub(super) fn run(
    case: &Case,
    method: &dyn Method,
    (rpm, depth_mm): (Range, Range),
    out: Option<PathBuf>,
    output: Output,
) -> Result<(), Error> {
    let chart = cell_chart(method, &rpm.values(), &depth_mm.values())?;
    if let Some(path) = &out {
        write(case, &chart, path)?;
    }
    let mut text = in_words(&chart);
    if let Some(path) = &out {
        // Writing to a String cannot fail.
        let _ = write!(text, "\n{}", path.display());
    }
    output.answer(&chart, text)
}

fn in_words(chart: &CellChart) -> String {
    let count = |verdict: Verdict| {
        let verdicts = chart.speeds.iter().flat_map(|line| &line.verdict);
        verdicts.filter(|found| **found == verdict).count()
    };
    format!(
        "by {}: {} cells, {} stable, {} unstable, {} undecided",
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
                "Size of the dominant multiplier over one tooth period. {}. Line: where it is 1.",
                in_words(chart)
            );
            let body = maud::html! {
                h1 { (case.name) }
                (figure(&picture(case, chart)?, &caption))
            };
            page(&case.name, &body)
        }
        _ => {
            return Err(Error::input(format!(
                "{}: the ending says what to write; .svg, .html, .csv or .json is needed",
                path.display()
            )));
        }
    };
    Ok(file::write(path, text.as_bytes())?)
}

fn picture(case: &Case, chart: &CellChart) -> Result<String, Error> {
    let mut sorted = chart.clone();
    sorted.speeds.sort_by(|a, b| a.rpm.total_cmp(&b.rpm));
    let title = format!("{}: |multiplier|, by {}", case.name, chart.label);
    // What can be wrong with a picture is what was asked for: a single speed, or depths from deep to shallow.
    cell_map(&title, &sorted).map_err(Error::input)
}

/// One row per cell.
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
