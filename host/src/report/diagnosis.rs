//! HTML page of a diagnosis: baseline model and recordings, causes with parameters, change of the lobes, residuals.

use maud::{Markup, html};

use super::PictureError;
use super::digits::significant;
use super::lobes_change::{picture, section, trial_cut_counts};
use super::page::page;
use super::residual_pictures::{file_name, pictures};
use crate::diagnose::answer::{EstimatedCause, Figure, Outcome};
use crate::diagnose::{Diagnosis, ResidualView};

/// Number of recorded channels of which the page of a diagnosis shows residual pictures, those with the largest ratio
/// of residual to noise: a choice.
const PICTURED: usize = 3;

/// Renders the page of `diagnosis`; `case_name` names the baseline model. `extended` is the text of the extended case,
/// or `None` to leave it out.
///
/// # Errors
/// A picture cannot be drawn.
pub fn diagnosis_page(
    case_name: &str,
    diagnosis: &Diagnosis,
    extended: Option<&str>,
) -> Result<String, PictureError> {
    let body = html! {
        h1 { "Diagnosis of the simulation" }
        p { (verdict(case_name, diagnosis)) }
        h2 { "Baseline model and recordings" }
        (prediction_error_table(diagnosis))
        @if !diagnosis.causes.is_empty() {
            h2 { @if diagnosis.outcome == Outcome::Confounded { "Candidate models that fit equally well" } @else { "Cause" } }
            @for cause in &diagnosis.causes { (cause_table(cause)) }
        }
        @if !diagnosis.updates.is_empty() {
            h2 { "What the records say of uncertain parameters" }
            ul { @for update in &diagnosis.updates { li { (update.sentence()) } } }
        }
        @if let Some(lobes) = &diagnosis.lobes {
            h2 { "Change of the stability lobes" }
            (section(lobes)?)
        }
        @if let Some(chart) = &diagnosis.baseline_lobes {
            h2 { "Lobes and trial cuts" }
            p { (trial_cut_counts(chart)) "." }
            (picture("Lobes of the case", chart, &format!("Method: {}.", chart.method))?)
        }
        @if let Some(test) = &diagnosis.next_test {
            h2 { "The next test" }
            p { b { (test.what()) } ": " (test.why) "." }
        }
        h2 { "Unexplained residual" }
        p {
            (format!("{:.2} % of the residual energy of the case is neither explained nor noise. ", 100.0 * diagnosis.unexplained.fraction))
            @if diagnosis.unexplained.fraction > 0.0 { (diagnosis.unexplained.location) "." }
        }
        @if !diagnosis.unexplained.places.is_empty() {
            ul { @for place in &diagnosis.unexplained.places { li { (place.to_string()) } } }
        }
        @if let Some(guess) = &diagnosis.unexplained.guess { p { (guess) "." } }
        h2 { "Residual of each channel" }
        (all_pictures(diagnosis)?)
        @if let Some(extended) = extended {
            h2 { "The extended case" }
            pre { (extended) }
        }
        @if !diagnosis.warnings.is_empty() {
            h2 { "Warnings about the records" }
            ul { @for warning in &diagnosis.warnings { li { (warning) } } }
        }
        footer {
            "Residuals are evaluated along the measured motion. Free decays and sensor offsets are fitted and removed. Sensor noise is assumed white, with the variance of the noise floor of the residual; noise of measured forces passes through the receptance. Intervals are 90 %."
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
            Outcome::None => { span.quiet { "agrees with the recordings" } " within the noise." },
            Outcome::Cause => {
                "lacks " span.chatter { (names.join(" and ")) }
                (format!(" (confidence {sure:.2})."))
            },
            Outcome::Confounded => {
                "is wrong; these candidate models fit equally well: " span.chatter { (diagnosis.alternatives()) } "."
            },
            Outcome::Update => {
                span.quiet { "agrees with the recordings" } " within the noise, with other values within its uncertainty."
            },
            Outcome::Unexplained => {
                "is wrong in a way that " span.chatter { "no known cause explains" } "."
            },
        }
        @if let (Some(extended), Some(gain)) = (diagnosis.extended, diagnosis.gain) {
            (format!(
                " The prediction error (NRMSE) is {} on held-out segments ({} overall); with the extension it is {}, which explains {:.1} % of the residual energy above the noise (90 % interval {:.1} to {:.1} %).",
                percent(diagnosis.baseline.nrmse_heldout), percent(diagnosis.baseline.nrmse_whole), percent(extended.nrmse_heldout), 100.0 * gain.residual_energy_removed,
                100.0 * gain.ci90[0], 100.0 * gain.ci90[1]
            ))
        } @else {
            (format!(" The prediction error (NRMSE) is {} on held-out segments and {} overall.", percent(diagnosis.baseline.nrmse_heldout), percent(diagnosis.baseline.nrmse_whole)))
        }
    }
}

fn percent(share: f64) -> String {
    format!("{:.3} %", 100.0 * share)
}

fn prediction_error_table(diagnosis: &Diagnosis) -> Markup {
    html! {
        table {
            tr { th { "record" } th { "channel" } th { "measured, RMS" } th { "residual of the case" } th { "residual of the extended case" } th { "noise" } }
            @for view in &diagnosis.views {
                @let [measured, residual, left] = view.sizes();
                tr {
                    td { (file_name(&view.record)) }
                    td { (view.channel) }
                    td { (format!("{} {}", significant(measured, 4), view.unit)) }
                    td { (percent(residual / measured.max(f64::MIN_POSITIVE))) }
                    td { @if view.left.is_empty() { "–" } @else { (percent(left / measured.max(f64::MIN_POSITIVE))) } }
                    td { (percent(view.deviation / measured.max(f64::MIN_POSITIVE))) }
                }
            }
        }
    }
}

/// Pictures of the residual of the case in at most [`PICTURED`] recorded channels, those with the largest ratio of
/// residual to noise.
fn all_pictures(diagnosis: &Diagnosis) -> Result<Markup, PictureError> {
    let mut views: Vec<&ResidualView> = diagnosis.views.iter().collect();
    let residual_to_noise = |view: &ResidualView| view.sizes()[1] / view.deviation.max(f64::MIN_POSITIVE);
    views.sort_by(|a, b| residual_to_noise(b).total_cmp(&residual_to_noise(a)));
    let mut all = Vec::new();
    for view in views.into_iter().take(PICTURED) {
        let same_channel = diagnosis
            .views
            .iter()
            .filter(|other| other.channel == view.channel);
        let channel_views: Vec<&ResidualView> = same_channel.collect();
        all.push(pictures(view, &channel_views, !view.left.is_empty())?);
    }
    Ok(html! { @for picture in all { (picture) } })
}

fn cause_table(cause: &EstimatedCause) -> Markup {
    let location = cause
        .channel
        .clone()
        .or_else(|| cause.direction.map(String::from))
        .or_else(|| cause.directions.map(|pair| pair.join("-")))
        .map_or_else(String::new, |location| format!(" ({location})"));
    html! {
        h3 { (cause.name) (location) (format!(", confidence {:.2}", cause.confidence)) }
        table {
            tr { th { "parameter" } th { "value" } th { "90 % interval" } }
            @for (key, Figure { value, ci90: [low, high] }) in &cause.parameters {
                tr {
                    td { (key) }
                    td { (significant(*value, 6)) }
                    td { (significant(*low, 6)) " to " (significant(*high, 6)) }
                }
            }
        }
    }
}
