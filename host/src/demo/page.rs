//! HTML report of the demonstration.

use std::ops::{Range, RangeInclusive};

use maud::{Markup, html};
use quietcut_core::lobes::LobeTable;

use super::trial::{Trial, seconds};
use crate::report::lobe_chart::{Column, lobe_chart};
use crate::report::marks::{Mark, MarkKind};
use crate::report::page::{figure, page as whole_page};
use crate::report::spectrum::{SpectrumMarks, spectrum};
use crate::report::stroboscope::samples_per_tooth;
use crate::report::time_signal::{TimeMark, time_signal};
use crate::report::{PictureError, words};

/// One chapter of the demonstration: a first cut, and the cut with the advised speed and depth.
#[derive(Clone, Debug)]
pub struct Story {
    /// First cut, before any advice.
    pub first: Trial,
    /// Cut with the advised speed and depth; `None` if no other speed or depth was advised.
    pub advised: Option<Trial>,
}

/// Spindle speeds of the lobe chart, rev/min: a choice that contains all cuts of the demonstration.
const CHART_RPM: RangeInclusive<f64> = 850.0..=1200.0;
/// Largest axial depth of the lobe chart, mm: a choice, twice the depth of the first cuts.
const CHART_DEPTH_MM: f64 = 4.0;
/// Highest frequency of the spectra, Hz: a choice that shows the modes of the robot and the first tooth-passing
/// harmonics.
const SPECTRUM_HZ: f64 = 120.0;

/// Renders the page: the lobe chart of the first layer of the table with all cuts, then the texts and pictures of each
/// story.
///
/// # Errors
/// A picture cannot be drawn.
pub fn page(title: &str, table: &LobeTable<'_>, stories: &[Story]) -> Result<String, PictureError> {
    let chart = chart(table, stories)?;
    let chapters = stories.iter().map(chapter).collect::<Result<Vec<_>, _>>()?;
    let body = html! {
        h1 { (title) }
        p {
            "A milling robot cuts acetal. The device on its spindle detects chatter, names its kind and finds a quiet speed in the \
             stability lobes of this robot. The next cut confirms that speed. Robot, cut and sensor are simulated; the \
             device runs the same program as the board, at the other end of a serial line."
        }
        (figure(&chart, "Lobe table of the device. Green: stable. Crosses: cuts with chatter; arrows: advice of the device; \
                         dots: the advised cuts."))
        @for chapter in &chapters { (chapter) }
        footer { "Made by quietcut demo. Sensor: ±16 g, 16 bit, 26.7 kHz, its clock 1 % fast, with noise; one tachometer mark per revolution." }
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
    let axis = dominant_axis(&story.first);
    // The time signals of the first and the advised cut share one scale, as do their stroboscopic samples, so that the
    // vibrations can be compared.
    let scale = CommonScale {
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
    let sections = trials
        .iter()
        .map(|trial| pictures(trial, &scale))
        .collect::<Result<Vec<_>, _>>()?;
    Ok(html! {
        @for (index, (trial, section)) in trials.iter().zip(&sections).enumerate() {
            h2 {
                @if index > 0 { "Advised cut: " }
                (headline(trial))
            }
            (account(trial))
            (section)
        }
    })
}

/// Axis of the acceleration, and ranges of its values over time and at the tooth passings, that the pictures of both
/// cuts of a story share.
struct CommonScale {
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

/// Sentences about chatter, advice and vibration of one cut.
fn account(trial: &Trial) -> Markup {
    let vibration = trial.vibration()[dominant_axis(trial)];
    html! {
        @match trial.alarm() {
            Some(report) => {
                p {
                    span.chatter { (words::verdict(&report.judgement)) }
                    " " (format!("detected {:.2} s after the start, {:.0} tooth passings after full engagement ({}).",
                                 seconds(report), trial.teeth_since_entry(seconds(report)).max(0.0), words::reason(report.judgement.reason)))
                }
                @if let Some(advice) = &report.advice {
                    p { "Advice: " b { (words::action(advice)) } " – " (words::why(advice, &report.judgement, report.speed)) "." }
                }
            }
            None => p { span.quiet { "Quiet: " } "the device reported no chatter during the whole cut." }
        }
        p { (format!("Vibration at the end of the cut, below 400 Hz: {vibration:.2} m/s² rms.")) }
    }
}

fn pictures(trial: &Trial, scale: &CommonScale) -> Result<Markup, PictureError> {
    let axis = scale.axis;
    let quantity = format!("acceleration {} [m/s²]", ["x", "y", "z"][axis]);
    let [from_s, to_s] = trial.full_cut_s;
    let mark = |t_s, label: &str| TimeMark {
        t_s,
        label: label.into(),
    };
    let mut marks = vec![mark(from_s, "full engagement"), mark(to_s, "tool leaves")];
    marks.extend(
        trial
            .alarm()
            .map(|report| mark(seconds(report), "chatter detected")),
    );
    let (t_s, values) = (&trial.trace.t_s, &trial.trace.axes[axis]);
    let signal = time_signal("", &quantity, t_s, values, &marks, Some(scale.signal.clone()))?;
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
            "Spectrum of the device: sum over all axes, rms per bin.",
        ));
    }
    let strobes = trial.strobes_in_cut(axis);
    if !strobes.is_empty() {
        let range = Some(scale.strobes.clone());
        let picture = samples_per_tooth("One sample per tooth", &quantity, &strobes, range)?;
        pair.push(figure(
            &picture,
            "One line: the same vibration at every tooth. Two lines: period doubling. Waves: Hopf bifurcation.",
        ));
    }
    Ok(html! {
        (figure(&signal, "Acceleration below 400 Hz."))
        div.pair { @for picture in &pair { (picture) } }
    })
}

/// Index of the axis (x, y, z) with the largest standard deviation of the acceleration over the last quarter of full
/// engagement.
fn dominant_axis(trial: &Trial) -> usize {
    let [x, y, z] = trial.vibration();
    if x >= y && x >= z {
        0
    } else if y >= z {
        1
    } else {
        2
    }
}
