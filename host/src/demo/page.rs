//! The report of the demonstration.

use std::ops::{Range, RangeInclusive};

use maud::{Markup, html};
use quietcut_core::lobes::LobeTable;

use super::trial::{Trial, seconds};
use crate::report::lobe_chart::{Column, lobe_chart};
use crate::report::marks::{Mark, MarkKind};
use crate::report::page::{figure, page as whole_page};
use crate::report::spectrum::{SpectrumMarks, spectrum};
use crate::report::stroboscope::samples_per_tooth;
use crate::report::time_signal::{Moment, time_signal};
use crate::report::{PictureError, words};

/// A cut that was tried, and the cut that the device advised.
#[derive(Clone, Debug)]
pub struct Story {
    /// The first cut.
    pub first: Trial,
    /// The cut with the advised speed and depth; `None` where there was nothing to follow.
    pub advised: Option<Trial>,
}

/// Spindle speeds that the chart shows, rev/min.
const CHART_RPM: RangeInclusive<f64> = 850.0..=1200.0;
/// Depths that the chart shows, mm.
const CHART_DEPTH_MM: f64 = 4.0;
/// Frequencies that the spectra show: the modes of the robot and a few harmonics of the teeth.
const SPECTRUM_HZ: f64 = 120.0;

/// The page: the lobe chart of the table with all cuts on it, then each story with its pictures.
///
/// # Errors
/// Where a picture cannot be drawn.
pub fn page(title: &str, table: &LobeTable<'_>, stories: &[Story]) -> Result<String, PictureError> {
    let chart = chart(table, stories)?;
    let chapters = stories.iter().map(chapter).collect::<Result<Vec<_>, _>>()?;
    let body = html! {
        h1 { (title) }
        p {
            "A milling robot cuts acetal. The device on its spindle hears chatter, says which kind it is, looks up in the \
             stability lobes of this robot which speed is quiet, and the next cut shows that it is. Robot, cut, sensor \
             and device are computed; the device is the same program as on the board, at the other end of a serial line."
        }
        (figure(&chart, "Lobes as the device has them. Green: stable. Crosses: cuts that chattered; arrows: what the device said; \
                         dots: the cuts after that."))
        @for chapter in &chapters { (chapter) }
        footer { "Made by quietcut demo. Sensor: ±16 g, 16 bit, 26.7 kHz, its clock 1 % fast, with noise; one tachometer mark per turn." }
    };
    Ok(whole_page(title, &body))
}

fn chart(table: &LobeTable<'_>, stories: &[Story]) -> Result<String, PictureError> {
    let mut columns = Column::of_table(table, 0);
    columns.retain(|column| CHART_RPM.contains(&column.rpm));
    let mut marks = Vec::new();
    for (index, story) in stories.iter().enumerate() {
        let advised = story.advised.as_ref();
        marks.push(mark(
            &story.first,
            &format!("{}: {}", index + 1, kind(&story.first)),
            advised,
        ));
        marks.extend(advised.map(|trial| mark(trial, &format!("{}: {}", index + 1, kind(trial)), None)));
    }
    lobe_chart(table.name(), &columns, CHART_DEPTH_MM, &marks)
}

fn mark(trial: &Trial, label: &str, advised: Option<&Trial>) -> Mark {
    Mark {
        rpm: trial.rpm,
        depth_mm: trial.depth_mm,
        kind: if trial.is_quiet() {
            MarkKind::Quiet
        } else {
            MarkKind::Chatter
        },
        label: label.into(),
        advice: advised.map(|trial| (trial.rpm, trial.depth_mm)),
        wrong: false,
    }
}

fn kind(trial: &Trial) -> String {
    match trial.alarm() {
        None => "quiet".into(),
        Some(report) => words::verdict_key(report.judgement.verdict).replace('-', " "),
    }
}

fn chapter(story: &Story) -> Result<Markup, PictureError> {
    let trials: Vec<&Trial> = std::iter::once(&story.first).chain(&story.advised).collect();
    let axis = loudest(&story.first);
    // Both cuts on one scale: the quiet one shall look as quiet as it is.
    let scale = Scale {
        axis,
        signal: around_zero(
            trials
                .iter()
                .flat_map(|trial| trial.trace.axes[axis].iter().copied()),
        ),
        strobes: around_zero(
            trials
                .iter()
                .flat_map(|trial| trial.strobes_in_cut(axis))
                .map(|(_, value)| value),
        ),
    };
    let parts = trials
        .iter()
        .map(|trial| pictures(trial, &scale))
        .collect::<Result<Vec<_>, _>>()?;
    Ok(html! {
        @for (index, (trial, part)) in trials.iter().zip(&parts).enumerate() {
            h2 {
                @if index > 0 { "As the device says: " }
                (headline(trial))
            }
            (account(trial))
            (part)
        }
    })
}

/// What the pictures of one story have in common.
struct Scale {
    axis: usize,
    signal: Range<f64>,
    strobes: Range<f64>,
}

fn around_zero(values: impl Iterator<Item = f64>) -> Range<f64> {
    let largest = 1.08 * values.fold(0.0, |largest: f64, value| largest.max(value.abs()));
    -largest..largest
}

fn headline(trial: &Trial) -> String {
    format!("{:.0} rev/min, {:.2} mm deep", trial.rpm, trial.depth_mm)
}

/// What happened, in a few sentences.
fn account(trial: &Trial) -> Markup {
    let vibration = trial.vibration()[loudest(trial)];
    html! {
        @match trial.alarm() {
            Some(report) => {
                p {
                    span.chatter { (words::verdict(&report.judgement)) }
                    " " (format!("heard {:.2} s after the start, {:.0} tooth passes after the tool was in full cut ({}).",
                                 seconds(report), trial.teeth_since_entry(seconds(report)).max(0.0), words::reason(report.judgement.reason)))
                }
                @if let Some(advice) = &report.advice {
                    p { "The device says: " b { (words::action(advice)) } " – " (words::why(advice, &report.judgement, report.speed)) "." }
                }
            }
            None => p { span.quiet { "Quiet: " } "the device called no chatter from the first touch to the last." }
        }
        p { (format!("Vibration at the end of the cut, below 400 Hz: {vibration:.2} m/s² rms.")) }
    }
}

fn pictures(trial: &Trial, scale: &Scale) -> Result<Markup, PictureError> {
    let axis = scale.axis;
    let quantity = format!("acceleration {} [m/s²]", ["x", "y", "z"][axis]);
    let [from_s, to_s] = trial.full_cut_s;
    let moment = |t_s, label: &str| Moment {
        t_s,
        label: label.into(),
    };
    let mut moments = vec![moment(from_s, "full cut"), moment(to_s, "tool leaves")];
    moments.extend(
        trial
            .alarm()
            .map(|report| moment(seconds(report), "chatter heard")),
    );
    let (t_s, values) = (&trial.trace.t_s, &trial.trace.axes[axis]);
    let signal = time_signal("", &quantity, t_s, values, &moments, Some(scale.signal.clone()))?;
    let mut pair = Vec::new();
    if let Some(last) = trial.spectrum_in_cut() {
        let frequency_hz: Vec<f64> = (0..last.power.len())
            .map(|bin| bin as f64 * last.bin_hz)
            .collect();
        let amplitude: Vec<f64> = last.power.iter().map(|power| power.sqrt()).collect();
        let chatter = trial.alarm().and_then(|report| report.judgement.chatter);
        let marks = SpectrumMarks {
            tooth_passing_hz: Some(trial.tooth_passing_hz()),
            chatter_hz: chatter.map(|chatter| f64::from(chatter.0)),
        };
        let picture = spectrum(
            "Spectrum at the end of the cut",
            &frequency_hz,
            &amplitude,
            SPECTRUM_HZ,
            marks,
        )?;
        pair.push(figure(
            &picture,
            "As the device computed it; all axes together, rms per bin.",
        ));
    }
    let strobes = trial.strobes_in_cut(axis);
    if !strobes.is_empty() {
        let range = Some(scale.strobes.clone());
        let picture = samples_per_tooth("One sample per tooth", &quantity, &strobes, range)?;
        pair.push(figure(
            &picture,
            "One line: every tooth feels the same. Two lines: period doubling. Waves: a Hopf.",
        ));
    }
    Ok(html! {
        (figure(&signal, "What the sensor felt below 400 Hz."))
        div.pair { @for picture in &pair { (picture) } }
    })
}

/// The axis that vibrates most.
fn loudest(trial: &Trial) -> usize {
    let [x, y, z] = trial.vibration();
    if x >= y && x >= z {
        0
    } else if y >= z {
        1
    } else {
        2
    }
}
