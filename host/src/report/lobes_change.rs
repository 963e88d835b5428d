//! Change of the stability limits by the extension of a case, as sentences and charts.

use maud::{Markup, html};

use super::PictureError;
use super::lobe_chart::{Column, lobe_chart};
use super::marks::Mark;
use super::page::figure;
use crate::criteria::UNCHANGED_LIMIT;
use crate::diagnose::lobes::{Change, Chart, Lobes};

/// Sentences about the change of the stability limits by the extension of a case, about the tried and recorded cuts
/// that the case and the extended case predict wrong, and about the time of drift and wear.
pub fn sentences(lobes: &Lobes) -> Vec<String> {
    let changes = lobes
        .speeds
        .iter()
        .map(|change| change.relative(lobes.searched_mm).abs());
    let most = changes.fold(0.0, f64::max);
    let mut all = Vec::new();
    if most < UNCHANGED_LIMIT {
        all.push("the extension changes no stability limit".into());
    } else {
        all.extend(limits(lobes));
    }
    if let Some(calls) = lobes.calls {
        all.push(format!(
            "of {} cuts, tried and recorded, the case predicts {} wrong ({} missed chatter, {} false alarms), the extended case {} ({} and {})",
            calls.before.cuts,
            calls.before.wrong,
            calls.before.missed_chatter,
            calls.before.false_alarms,
            calls.after.wrong,
            calls.after.missed_chatter,
            calls.after.false_alarms,
        ));
    }
    if let Some(after_s) = lobes.after_s {
        all.push(format!(
            "drift and wear are evaluated at {after_s:.0} s, the end of the longest recording"
        ));
    }
    all
}

fn limits(lobes: &Lobes) -> Vec<String> {
    let mut all = vec![format!(
        "at {:.1} rev/min the limit of the case is {}, that of the extended case {}",
        lobes.at.at_rpm,
        limit(
            lobes.at.limit_before_mm,
            lobes.at.kind_before,
            lobes.at.chatter_before_hz,
            lobes
        ),
        limit(
            lobes.at.limit_after_mm,
            lobes.at.kind_after,
            lobes.at.chatter_after_hz,
            lobes
        ),
    )];
    if let Some([low_mm, high_mm]) = lobes.at.limit_after_ci90_mm {
        let end = |limit_mm: Option<f64>| match limit_mm {
            Some(limit_mm) => format!("{limit_mm:.3} mm"),
            None => format!("beyond {:.3} mm", lobes.searched_mm),
        };
        all[0].push_str(&format!(
            "; 90 % interval from the intervals of the parameters: {} to {}",
            end(low_mm),
            end(high_mm)
        ));
    }
    if let (Some(first), Some(last)) = (lobes.speeds.first(), lobes.speeds.last()) {
        let percent: Vec<f64> = lobes
            .speeds
            .iter()
            .map(|change| 100.0 * change.relative(lobes.searched_mm).exp_m1())
            .collect();
        let lowest = percent.iter().copied().fold(f64::INFINITY, f64::min);
        let highest = percent.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        all.push(format!(
            "from {:.0} to {:.0} rev/min limits change by {lowest:+.1} to {highest:+.1} %",
            first.at_rpm, last.at_rpm
        ));
    }
    all
}

fn limit(
    depth_mm: Option<f64>,
    kind: Option<crate::stability::StabilityLoss>,
    chatter_hz: Option<f64>,
    lobes: &Lobes,
) -> String {
    let Some(depth_mm) = depth_mm else {
        return format!("beyond {:.3} mm", lobes.searched_mm);
    };
    let kind = kind.map_or("", crate::stability::StabilityLoss::name);
    match chatter_hz {
        Some(hertz) => format!("{depth_mm:.3} mm ({kind}, {hertz:.2} Hz)"),
        None => format!("{depth_mm:.3} mm ({kind})"),
    }
}

/// Sentence, without a full stop, with the number of tried and recorded cuts that a chart predicts wrong.
pub fn trial_cut_counts(chart: &Chart) -> String {
    let calls = chart.calls();
    format!(
        "of {} cuts, tried and recorded, the case predicts {} wrong ({} missed chatter, {} false alarms); {} are undecided",
        calls.cuts, calls.wrong, calls.missed_chatter, calls.false_alarms, calls.undecided
    )
}

/// Sentences about the change of the limits, lobe diagrams of the case and of the extended case with the tried and
/// recorded cuts (a ring marks a wrong prediction), and a table of the limits at each spindle speed.
///
/// # Errors
/// A picture cannot be drawn.
pub(super) fn section(lobes: &Lobes) -> Result<Markup, PictureError> {
    let [before, after] = &lobes.charts;
    let mut columns: Vec<Column> = after.lines.iter().map(Column::from).collect();
    for (column, change) in columns.iter_mut().zip(&lobes.speeds) {
        let interval = change.limit_after_ci90_mm;
        column.percentiles_mm = interval.map(|[low, high]| [low, change.limit_after_mm, high]);
    }
    Ok(html! {
        ul { @for sentence in sentences(lobes) { li { (sentence) "." } } }
        (picture("Lobes of the case", before, "The baseline model.")?)
        (figure(
            &drawn("Lobes of the extended case", after, &columns)?,
            &format!("Method: {}. Grey: 90 % interval of the limits. {}", after.method, trial_cut_caption(after))
        ))
        details {
            summary { "Limits at each spindle speed" }
            table {
                tr { th { "rev/min" } th { "limit before [mm]" } th { "chatter [Hz]" } th { "limit after [mm]" } th { "90 % interval [mm]" } th { "chatter [Hz]" } }
                @for change in &lobes.speeds { (row(change)) }
            }
        }
    })
}

/// One lobe diagram with the tried and recorded cuts; a ring marks a cut that the chart predicts wrong.
///
/// # Errors
/// The picture cannot be drawn.
pub(super) fn picture(title: &str, chart: &Chart, sentence: &str) -> Result<Markup, PictureError> {
    let columns: Vec<Column> = chart.lines.iter().map(Column::from).collect();
    let caption = format!("{sentence} {}", trial_cut_caption(chart));
    Ok(figure(&drawn(title, chart, &columns)?, &caption))
}

fn drawn(title: &str, chart: &Chart, columns: &[Column]) -> Result<String, PictureError> {
    let marks: Vec<Mark> = chart
        .cuts
        .iter()
        .map(|(cut, call)| Mark {
            wrong: call.is_wrong(),
            ..Mark::from(cut)
        })
        .collect();
    lobe_chart(title, columns, chart.searched_mm, &marks)
}

fn trial_cut_caption(chart: &Chart) -> &'static str {
    if chart.cuts.is_empty() {
        ""
    } else {
        "Circles: stable trial cuts; crosses: cuts with chatter; squares: marginal cuts; orange ring: wrong prediction of the chart. The outcome of a recorded cut is the verdict of the device's signal chain."
    }
}

fn row(change: &Change) -> Markup {
    let number = |value: Option<f64>, digits: usize| {
        value.map_or_else(|| "–".into(), |value| format!("{value:.digits$}"))
    };
    html! {
        tr {
            td { (format!("{:.1}", change.at_rpm)) }
            td { (number(change.limit_before_mm, 3)) }
            td { (number(change.chatter_before_hz, 2)) }
            td { (number(change.limit_after_mm, 3)) }
            td { @if let Some([low, high]) = change.limit_after_ci90_mm { (number(low, 3)) " to " (number(high, 3)) } @else { "–" } }
            td { (number(change.chatter_after_hz, 2)) }
        }
    }
}
