//! The page of a diagnosis: what was believed, what was seen, why, how sure, what it changes.

use maud::{Markup, html};

use super::PictureError;
use super::comparison::{Line, Look, comparison};
use super::page::{figure, page};
use super::time_signal::thinned;
use crate::diagnose::answer::{Figure, NamedCause, Outcome};
use crate::diagnose::{Diagnosis, View};

/// Channels that get pictures: those that miss most.
const PICTURED: usize = 4;

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
        (pictures(diagnosis)?)
        @if !diagnosis.causes.is_empty() {
            h2 { @if diagnosis.outcome == Outcome::Confounded { "What explains it, and cannot be told apart" } @else { "Why" } }
            @for cause in &diagnosis.causes { (cause_table(cause)) }
        }
        @if let Some(test) = &diagnosis.next_test {
            h2 { "The next test" }
            p { b { (test.kind) } ": " (test.why) "." }
        }
        h2 { "What is left" }
        p {
            (format!("{:.2} % of the energy that the case misses is neither explained nor noise. ", 100.0 * diagnosis.unexplained.fraction))
            @if diagnosis.unexplained.fraction > 0.0 { (diagnosis.unexplained.place) "." }
        }
        @if let Some(extended) = extended {
            h2 { "The extended case" }
            pre { (extended) }
        }
        @if !diagnosis.warnings.is_empty() {
            h2 { "To be known about the records" }
            ul { @for warning in &diagnosis.warnings { li { (warning) } } }
        }
        footer {
            "Residuals are taken along the measured motion; free decays and offsets of sensors are fitted and taken out; noise is taken to be white, at the floor of what the model leaves. Intervals are 90 %."
        }
    };
    Ok(page("Diagnosis", &body))
}

fn verdict(case_name: &str, diagnosis: &Diagnosis) -> Markup {
    let names: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.name).collect();
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
                "is wrong; these explain it equally well: " span.chatter { (names.join(", ")) } "."
            },
            Outcome::Unexplained => {
                "is wrong in a way that " span.chatter { "no known cause explains" } "."
            },
        }
        @if let (Some(extended), Some(gain)) = (diagnosis.extended, diagnosis.gain) {
            (format!(
                " On what was held out it misses {}; with the extension {}: {:.1} % of the residual's energy beyond the noise is gone.",
                percent(diagnosis.baseline.nrmse_heldout), percent(extended.nrmse_heldout), 100.0 * gain.residual_energy_removed
            ))
        } @else {
            (format!(" On what was held out it misses {}.", percent(diagnosis.baseline.nrmse_heldout)))
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
                    td { (view.record) }
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

fn pictures(diagnosis: &Diagnosis) -> Result<Markup, PictureError> {
    let mut views: Vec<&View> = diagnosis.views.iter().collect();
    let loudness = |view: &View| view.sizes()[1] / view.deviation.max(f64::MIN_POSITIVE);
    views.sort_by(|a, b| loudness(b).total_cmp(&loudness(a)));
    let mut all = Vec::new();
    for view in views.into_iter().take(PICTURED) {
        let what = format!("{} of {}", view.channel, view.record);
        all.push(html! {
            (figure(&over_time(view, &what)?, &format!("{what} over time: what was measured, what the case misses, and what the extended case misses.")))
            div.pair {
                (figure(&over_frequency(view)?, "Over frequency, as powers of ten of the amplitude per line."))
                (figure(&over_displacement(view)?, "What the case misses over the displacement: a spring that is not linear bends it, friction and play open it."))
            }
        });
    }
    Ok(html! { @for picture in all { (picture) } })
}

fn over_time(view: &View, what: &str) -> Result<String, PictureError> {
    let t_s: Vec<f64> = (0..view.measured.len())
        .map(|n| n as f64 / view.rate_hz)
        .collect();
    let line = |name: &str, look, samples: &[f64]| Line {
        name: name.into(),
        points: thinned(&t_s, samples),
        look,
    };
    let mut lines = vec![
        line("measured", Look::Measured, &view.measured),
        line("missed by the case", Look::Missed, &view.residual),
    ];
    if !view.left.is_empty() {
        lines.push(line("missed with the extension", Look::Left, &view.left));
    }
    let unit = format!("{} [{}]", view.channel, view.unit);
    comparison((960, 300), [what, "time [s]", &unit], &lines, None)
}

fn over_frequency(view: &View) -> Result<String, PictureError> {
    let line = |name: &str, look, samples: &[f64]| Line {
        name: name.into(),
        points: view
            .spectrum(samples, 500)
            .into_iter()
            .filter(|(_, amplitude)| *amplitude > 0.0)
            .map(|(hertz, amplitude)| (hertz, amplitude.log10()))
            .collect(),
        look,
    };
    let mut lines = vec![
        line("measured", Look::Measured, &view.measured),
        line("missed by the case", Look::Missed, &view.residual),
    ];
    if !view.left.is_empty() {
        lines.push(line("missed with the extension", Look::Left, &view.left));
    }
    let unit = format!("log10 of {} [{}]", view.channel, view.unit);
    comparison((470, 330), ["", "frequency [Hz]", &unit], &lines, None)
}

fn over_displacement(view: &View) -> Result<String, PictureError> {
    let every = view.residual.len().div_ceil(3000).max(1);
    let cloud = |samples: &[f64]| -> Vec<(f64, f64)> {
        view.displacement
            .iter()
            .zip(samples)
            .step_by(every)
            .map(|(x, y)| (1e3 * x, *y))
            .collect()
    };
    let mut lines = vec![Line {
        name: "missed by the case".into(),
        points: cloud(&view.residual),
        look: Look::Cloud,
    }];
    if lines[0].points.len() < 2 {
        lines[0].points = vec![(0.0, 0.0), (1.0, 0.0)];
    }
    let unit = format!("{} [{}]", view.channel, view.unit);
    comparison((470, 330), ["", "displacement [mm]", &unit], &lines, None)
}

fn cause_table(cause: &NamedCause) -> Markup {
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
