//! The page of a diagnosis: what was believed, what was seen, why, how sure, what it changes.

use maud::{Markup, html};

use super::PictureError;
use super::lobes_change::{called, picture, section};
use super::page::page;
use super::residual_pictures::{file_name, pictures};
use crate::diagnose::answer::{EstimatedCause, Figure, Outcome};
use crate::diagnose::{Diagnosis, ResidualView};

/// Channels that get pictures: those that miss most.
const PICTURED: usize = 3;

/// The whole page; `case_name` is what was believed, `extended` the text of the extended case.
///
/// # Errors
/// A picture that cannot be drawn.
pub fn diagnosis_page(
    case_name: &str,
    diagnosis: &Diagnosis,
    extended: Option<&str>,
) -> Result<String, PictureError> {
    let body = html! {
        h1 { "What the simulation gets wrong" }
        p { (verdict(case_name, diagnosis)) }
        h2 { "What was believed, and what was seen" }
        (seen(diagnosis))
        @if !diagnosis.causes.is_empty() {
            h2 { @if diagnosis.outcome == Outcome::Confounded { "What explains it, and cannot be told apart" } @else { "Why" } }
            @for cause in &diagnosis.causes { (cause_table(cause)) }
        }
        @if let Some(lobes) = &diagnosis.lobes {
            h2 { "What it changes" }
            (section(lobes)?)
        }
        @if let Some(chart) = &diagnosis.believed {
            h2 { "Lobes and cuts" }
            p { (called(chart)) "." }
            (picture("Lobes of the case", chart, &format!("By {}.", chart.method))?)
        }
        @if let Some(test) = &diagnosis.next_test {
            h2 { "The next test" }
            p { b { (test.what()) } ": " (test.why) "." }
        }
        h2 { "What is left" }
        p {
            (format!("{:.2} % of the energy that the case misses is neither explained nor noise. ", 100.0 * diagnosis.unexplained.fraction))
            @if diagnosis.unexplained.fraction > 0.0 { (diagnosis.unexplained.location) "." }
        }
        @if let Some(guess) = &diagnosis.unexplained.guess { p { (guess) "." } }
        h2 { "The residual, channel by channel" }
        (all_pictures(diagnosis)?)
        @if let Some(extended) = extended {
            h2 { "The extended case" }
            pre { (extended) }
        }
        @if !diagnosis.warnings.is_empty() {
            h2 { "To be known about the records" }
            ul { @for warning in &diagnosis.warnings { li { (warning) } } }
        }
        footer {
            "Residuals are taken along the measured motion; free decays and offsets of sensors are fitted and taken out; noise of sensors is taken to be white, at the floor of what the model leaves, that of measured forces goes through the receptance. Intervals are 90 %."
        }
    };
    Ok(page("Diagnosis", &body))
}

fn verdict(case_name: &str, diagnosis: &Diagnosis) -> Markup {
    let names = diagnosis.names();
    let sure = diagnosis.causes.first().map_or(0.0, |cause| cause.confidence);
    html! {
        "The model " b { (case_name) } " "
        @match diagnosis.outcome {
            Outcome::None => { "is " span.quiet { "right within the noise" } " of these records." },
            Outcome::Cause => {
                "lacks " span.chatter { (names.join(" and ")) }
                (format!(" (confidence {sure:.2})."))
            },
            Outcome::Confounded => {
                "is wrong; these explain it equally well: " span.chatter { (diagnosis.alternatives()) } "."
            },
            Outcome::Unexplained => {
                "is wrong in a way that " span.chatter { "no known cause explains" } "."
            },
        }
        @if let (Some(extended), Some(gain)) = (diagnosis.extended, diagnosis.gain) {
            (format!(
                " On what was held out it misses {} (on the whole {}); with the extension {}: {:.1} % of the residual's energy beyond the noise is gone (90 % interval {:.1} to {:.1} %).",
                percent(diagnosis.baseline.nrmse_heldout), percent(diagnosis.baseline.nrmse_whole), percent(extended.nrmse_heldout), 100.0 * gain.residual_energy_removed,
                100.0 * gain.ci90[0], 100.0 * gain.ci90[1]
            ))
        } @else {
            (format!(" On what was held out it misses {}, on the whole {}.", percent(diagnosis.baseline.nrmse_heldout), percent(diagnosis.baseline.nrmse_whole)))
        }
    }
}

fn percent(share: f64) -> String {
    format!("{:.3} %", 100.0 * share)
}

fn seen(diagnosis: &Diagnosis) -> Markup {
    html! {
        table {
            tr { th { "record" } th { "channel" } th { "measured, RMS" } th { "missed by the case" } th { "missed with the extension" } th { "noise" } }
            @for view in &diagnosis.views {
                @let [measured, residual, left] = view.sizes();
                tr {
                    td { (file_name(&view.record)) }
                    td { (view.channel) }
                    td { (format!("{measured:.3e} {}", view.unit)) }
                    td { (percent(residual / measured.max(f64::MIN_POSITIVE))) }
                    td { @if view.left.is_empty() { "–" } @else { (percent(left / measured.max(f64::MIN_POSITIVE))) } }
                    td { (percent(view.deviation / measured.max(f64::MIN_POSITIVE))) }
                }
            }
        }
    }
}

/// Pictures of the channels that miss most.
fn all_pictures(diagnosis: &Diagnosis) -> Result<Markup, PictureError> {
    let mut views: Vec<&ResidualView> = diagnosis.views.iter().collect();
    let loudness = |view: &ResidualView| view.sizes()[1] / view.deviation.max(f64::MIN_POSITIVE);
    views.sort_by(|a, b| loudness(b).total_cmp(&loudness(a)));
    let mut all = Vec::new();
    for view in views.into_iter().take(PICTURED) {
        let same_channel = diagnosis
            .views
            .iter()
            .filter(|other| other.channel == view.channel);
        let fellows: Vec<&ResidualView> = same_channel.collect();
        all.push(pictures(view, &fellows, !view.left.is_empty())?);
    }
    Ok(html! { @for picture in all { (picture) } })
}

fn cause_table(cause: &EstimatedCause) -> Markup {
    let place = cause
        .channel
        .clone()
        .or_else(|| cause.direction.map(String::from))
        .or_else(|| cause.directions.map(|pair| pair.join("-")))
        .map_or_else(String::new, |place| format!(" ({place})"));
    html! {
        h3 { (cause.name) (place) (format!(", confidence {:.2}", cause.confidence)) }
        table {
            tr { th { "parameter" } th { "value" } th { "90 % interval" } }
            @for (key, Figure { value, ci90: [low, high] }) in &cause.parameters {
                tr {
                    td { (key) }
                    td { (format!("{value:.5e}")) }
                    td { (format!("{low:.5e} to {high:.5e}")) }
                }
            }
        }
    }
}
