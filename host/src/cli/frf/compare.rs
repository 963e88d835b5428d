//! `quietcut frf --compare BEFORE AFTER`: peaks of two tables of receptances and their changes.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use maud::html;
use serde::Serialize;

use super::args::{Args, FileFormat};
use super::figure::{Figure, PeakFigures};
use crate::cli::Error;
use crate::cli::output::keep_inputs;
use crate::criteria::SAME_PEAK;
use crate::file;
use crate::frf::{FittedPeak, Frf, FrfTable, fitted_peaks};
use crate::report::digits::significant;
use crate::report::frf_comparison_chart::frf_comparison_chart;
use crate::report::page::{figure, page};

/// Output of `quietcut frf --compare --json`.
#[derive(Serialize)]
struct Comparison {
    before: PathBuf,
    after: PathBuf,
    peaks: Vec<PeakChange>,
    /// True if [`PeakChange::has_changed`] is true for one of the peaks.
    has_changed: bool,
    warnings: Vec<String>,
    out: Vec<PathBuf>,
}

/// A peak of one receptance in both tables, or in one of them.
#[derive(Serialize)]
struct PeakChange {
    name: String,
    frequency_hz: Change,
    damping_ratio: Change,
    receptance_m_per_n: Change,
    /// True if the 90 % interval of one of the three changes does not contain 0, or if one table lacks the peak.
    has_changed: bool,
}

/// A quantity before and after, and the difference after − before; `null` where a table lacks the peak, and the
/// difference if either does.
#[derive(Serialize)]
struct Change {
    before: Option<Figure>,
    after: Option<Figure>,
    change: Option<Figure>,
}

impl Change {
    fn new(before: Option<Figure>, after: Option<Figure>) -> Self {
        // The errors of the two tests are independent: the squares of the half-widths of their intervals add.
        let change = before.zip(after).map(|(before, after)| {
            Figure::new(after.value - before.value, before.half().hypot(after.half()))
        });
        Self {
            before,
            after,
            change,
        }
    }

    fn exceeds(&self) -> bool {
        self.change.is_none_or(Figure::excludes_zero)
    }
}

impl PeakChange {
    fn new(name: String, before: Option<FittedPeak>, after: Option<FittedPeak>) -> Self {
        let (before, after) = (
            before.as_ref().map(PeakFigures::new),
            after.as_ref().map(PeakFigures::new),
        );
        let change = |quantity: fn(&PeakFigures) -> Figure| {
            Change::new(before.as_ref().map(quantity), after.as_ref().map(quantity))
        };
        let (frequency_hz, damping_ratio, receptance_m_per_n) = (
            change(|peak| peak.frequency_hz),
            change(|peak| peak.damping_ratio),
            change(|peak| peak.receptance_m_per_n),
        );
        Self {
            has_changed: frequency_hz.exceeds() || damping_ratio.exceeds() || receptance_m_per_n.exceeds(),
            name,
            frequency_hz,
            damping_ratio,
            receptance_m_per_n,
        }
    }

    /// Line of the terminal output.
    fn text(&self) -> String {
        let part = |change: &Change, factor: f64, digits: usize, unit: &str| {
            let of = |figure: Option<Figure>| {
                figure.map_or_else(
                    || "–".to_owned(),
                    |figure| significant(factor * figure.value, digits),
                )
            };
            let (before, after) = (of(change.before), of(change.after));
            let change = change.change.map_or_else(String::new, |figure| {
                format!(
                    " ({}{} ± {})",
                    if figure.value < 0.0 { "−" } else { "+" },
                    significant(factor * figure.value.abs(), 2),
                    significant(factor * figure.half(), 2)
                )
            });
            format!("{before} → {after} {unit}{change}")
        };
        let conclusion = match (self.frequency_hz.before, self.frequency_hz.after) {
            (None, _) => "only after the change",
            (_, None) => "only before the change",
            _ if self.has_changed => "changed by more than the 90 % intervals",
            _ => "no change beyond the 90 % intervals",
        };
        format!(
            "H{}: {}; damping ratio {}; peak {}: {conclusion}",
            self.name,
            part(&self.frequency_hz, 1.0, 5, "Hz"),
            part(&self.damping_ratio, 100.0, 3, "%"),
            part(&self.receptance_m_per_n, 1e6, 4, "µm/N"),
        )
    }
}

/// Compares the tables of `--compare`.
pub(super) fn run(args: &Args, before: &Path, after: &Path) -> Result<(), Error> {
    for target in &args.out {
        keep_inputs([before, after], &target.path)?;
        if !matches!(target.format, FileFormat::Svg | FileFormat::Html) {
            return Err(Error::input(format!(
                "--out {}: a comparison is a picture; svg or html is needed",
                target.path.display()
            )));
        }
    }
    let import = args.segment.import();
    let tables = [before, after].map(|path| FrfTable::import(path, &import).map(|imported| imported.table));
    let [old, new] = tables;
    let (old, new) = (old?, new?);
    let peaks = changes(&old, &new);
    if peaks.is_empty() {
        return Err(Error::input(format!(
            "{} and {} have no receptance with a peak in common; measure the same directions, and take a band around the resonances with ten \
             lines or more in each",
            before.display(),
            after.display()
        )));
    }
    let answer = Comparison {
        has_changed: peaks.iter().any(|peak| peak.has_changed),
        warnings: warnings(&old, &new),
        before: before.into(),
        after: after.into(),
        peaks,
        out: args.out.iter().map(|target| target.path.clone()).collect(),
    };
    for warning in &answer.warnings {
        tracing::warn!("{warning}");
    }
    let text = answer.text();
    for target in &args.out {
        let svg = frf_comparison_chart(&old, &new).map_err(Error::input)?;
        let written = match target.format {
            FileFormat::Html => html_page(&svg, &answer),
            _ => svg,
        };
        file::write(&target.path, written.as_bytes())?;
    }
    args.output.answer(&answer, text)
}

fn html_page(svg: &str, answer: &Comparison) -> String {
    let title = "Receptances before and after";
    let body = html! {
        h1 { (title) }
        (figure(svg, "Receptances: displacement (first letter) per force (second letter)."))
        ul {
            @for peak in &answer.peaks { li { (peak.text()) } }
        }
    };
    page(title, &body)
}

/// Changes of the peaks of all receptances that both tables have.
fn changes(before: &FrfTable, after: &FrfTable) -> Vec<PeakChange> {
    let common = |entry: &Frf| after.entry(entry.response, entry.force).cloned();
    before
        .entries()
        .iter()
        .filter_map(|entry| Some((entry, common(entry)?)))
        .flat_map(|(old, new)| {
            let pairs = matched(fitted_peaks(before, old), fitted_peaks(after, &new));
            let name = old.name();
            pairs
                .into_iter()
                .map(move |(old, new)| PeakChange::new(name.clone(), old, new))
        })
        .collect()
}

/// Pairs of a peak before with the free peak after that is nearest in frequency, if the ratio of the two frequencies is
/// below [`SAME_PEAK`]; a peak without a partner stands alone. Ascending in the frequency before, or after where there
/// is none before.
fn matched(
    before: Vec<FittedPeak>,
    mut after: Vec<FittedPeak>,
) -> Vec<(Option<FittedPeak>, Option<FittedPeak>)> {
    let distance = |a: &FittedPeak, b: &FittedPeak| (a.frequency_hz / b.frequency_hz).ln().abs();
    // The largest peaks before choose first among the peaks after that are still free.
    let mut order = before;
    order.sort_by(|a, b| b.receptance.total_cmp(&a.receptance));
    let mut pairs: Vec<(Option<FittedPeak>, Option<FittedPeak>)> = Vec::new();
    for old in order {
        let nearest = (0..after.len())
            .min_by(|&a, &b| distance(&after[a], &old).total_cmp(&distance(&after[b], &old)))
            .filter(|&index| distance(&after[index], &old) < SAME_PEAK.ln());
        pairs.push((Some(old), nearest.map(|index| after.remove(index))));
    }
    pairs.extend(after.into_iter().map(|new| (None, Some(new))));
    let frequency = |pair: &(Option<FittedPeak>, Option<FittedPeak>)| {
        pair.0.or(pair.1).map_or(0.0, |peak| peak.frequency_hz)
    };
    pairs.sort_by(|a, b| frequency(a).total_cmp(&frequency(b)));
    pairs
}

/// Warnings about receptances that only one table has.
fn warnings(before: &FrfTable, after: &FrfTable) -> Vec<String> {
    let lacking = |one: &FrfTable, other: &FrfTable| -> Vec<String> {
        one.entries()
            .iter()
            .filter(|entry| other.entry(entry.response, entry.force).is_none())
            .map(|entry| format!("H{} is in {} only", entry.name(), one.path().display()))
            .collect()
    };
    let mut warnings = lacking(before, after);
    warnings.extend(lacking(after, before));
    warnings
}

impl Comparison {
    fn text(&self) -> String {
        let lines: Vec<String> = self.peaks.iter().map(PeakChange::text).collect();
        let mut text = lines.join("\n");
        text += if self.has_changed {
            "\nThe change exceeds the intervals of the tests: identify the modes anew, and make a new chart."
        } else {
            "\nNo peak changes by more than the intervals of the tests: the chart still holds as far as they tell."
        };
        for path in &self.out {
            // Writing to a String cannot fail.
            let _ = write!(text, "\nwritten: {}", path.display());
        }
        text
    }
}
