//! `quietcut frf --by-level`: frequency, damping and size of the peaks at each force level.

use std::fmt::Write;

use serde::Serialize;

use super::args::Args;
use super::figure::{Figure, PeakFigures, PeakText};
use crate::cli::Error;
use crate::cli::segment::Recorded;
use crate::frf::{FittedPeak, LevelMeasurement, fitted_peaks, measure_levels};
use crate::report::digits::significant;

/// Output of `quietcut frf --by-level --json`.
#[derive(Serialize)]
struct LevelsOutput {
    levels: Vec<LevelAnswer>,
    dependences: Vec<Dependence>,
    warnings: Vec<String>,
}

/// The largest fitted peak of each receptance that has one, at one force level.
#[derive(Serialize)]
struct LevelAnswer {
    /// Force level, N: see [`LevelMeasurement::force_n`].
    force_n: f64,
    peaks: Vec<LevelPeak>,
}

#[derive(Serialize)]
struct LevelPeak {
    name: String,
    #[serde(flatten)]
    figures: PeakFigures,
    /// Amplitude of the displacement at the peak, m; `null` unless the force is a stepped sine.
    amplitude_m: Option<f64>,
}

/// Change of the largest fitted peak of a receptance from the lowest to the highest level at which it has one.
#[derive(Serialize)]
struct Dependence {
    name: String,
    /// Lowest and highest level with a fitted peak of this receptance, N.
    force_n: [f64; 2],
    /// Change of the frequency, relative to that at the lowest of these levels.
    frequency: Figure,
    /// Change of the damping ratio, relative to that at the lowest of these levels.
    damping_ratio: Figure,
    /// True if the 90 % interval of one of the two changes does not contain 0.
    is_nonlinear: bool,
}

/// Runs `quietcut frf --by-level`.
pub(super) fn run(args: &Args) -> Result<(), Error> {
    if let Some(target) = args.out.first() {
        return Err(Error::input(format!(
            "--out {}: --by-level gives no table, since a table holds one level; leave one of the two out, or choose a level by --force-n",
            target.path.display()
        )));
    }
    let Recorded {
        recordings,
        understood,
    } = args.segment.read(&args.recordings)?;
    let levels = measure_levels(&recordings, &args.settings())?;
    if levels.len() < 2 {
        return Err(Error::input(format!(
            "{}: one force level, {} N; --by-level needs recordings at two or more, or a stepped sine at several",
            args.recordings[0].display(),
            levels
                .first()
                .map_or_else(String::new, |level| significant(level.force_n, 4))
        )));
    }
    let peaks: Vec<Vec<(String, FittedPeak)>> = levels.iter().map(largest_peaks).collect();
    if peaks.iter().all(Vec::is_empty) {
        return Err(Error::input(format!(
            "{}: at no force level does a receptance have a peak with eight settled lines that falls to half its power on both sides; take finer \
             steps over a wider band and longer dwells, or test a stepped sine by identify --method linearity",
            args.recordings[0].display()
        )));
    }
    let mut warnings: Vec<String> = Vec::new();
    for (level, peaks) in levels.iter().zip(&peaks) {
        for warning in &level.measurement.warnings {
            if !warnings.contains(warning) {
                warnings.push(warning.clone());
            }
        }
        if peaks.is_empty() {
            warnings.push(format!(
                "at {} N no receptance has a peak with eight lines that falls to half its power on both sides: take a finer resolution or a wider \
                 band",
                significant(level.force_n, 4)
            ));
        }
    }
    let answer = LevelsOutput {
        dependences: dependences(&levels, &peaks),
        levels: levels
            .iter()
            .zip(&peaks)
            .map(|(level, peaks)| LevelAnswer::new(level, peaks))
            .collect(),
        warnings,
    };
    for warning in &answer.warnings {
        tracing::warn!("{warning}");
    }
    let text = answer.text();
    args.output.answer_with(&understood, &answer, text)
}

/// The largest fitted peak of each receptance of a level that has one, with the name of the receptance; in the order of
/// the table.
fn largest_peaks(level: &LevelMeasurement) -> Vec<(String, FittedPeak)> {
    let table = &level.measurement.table;
    let largest = |entry| {
        fitted_peaks(table, entry)
            .into_iter()
            .max_by(|a, b| a.receptance.total_cmp(&b.receptance))
    };
    table
        .entries()
        .iter()
        .filter_map(|entry| Some((entry.name(), largest(entry)?)))
        .collect()
}

fn dependences(levels: &[LevelMeasurement], peaks: &[Vec<(String, FittedPeak)>]) -> Vec<Dependence> {
    let names = peaks.iter().flatten().map(|(name, _)| name.clone());
    let mut different: Vec<String> = Vec::new();
    for name in names {
        if !different.contains(&name) {
            different.push(name);
        }
    }
    let dependence = |name: String| {
        let of = |at: usize| {
            peaks[at]
                .iter()
                .find(|(other, _)| *other == name)
                .map(|(_, peak)| *peak)
        };
        let present: Vec<usize> = (0..levels.len()).filter(|&at| of(at).is_some()).collect();
        let (&first, &last) = (present.first()?, present.last()?);
        let (low, high) = (of(first)?, of(last)?);
        let relative = |quantity: fn(&FittedPeak) -> [f64; 2]| {
            let ([old, old_std], [new, new_std]) = (quantity(&low), quantity(&high));
            let half = (low.ninety_percent() * old_std).hypot(high.ninety_percent() * new_std);
            Figure::new((new - old) / old, half / old.abs())
        };
        let frequency = relative(|peak| [peak.frequency_hz, peak.frequency_std_hz]);
        let damping_ratio = relative(|peak| [peak.damping_ratio, peak.damping_ratio_std]);
        (first != last).then(|| Dependence {
            is_nonlinear: frequency.excludes_zero() || damping_ratio.excludes_zero(),
            force_n: [levels[first].force_n, levels[last].force_n],
            frequency,
            damping_ratio,
            name,
        })
    };
    different.into_iter().filter_map(dependence).collect()
}

impl LevelAnswer {
    fn new(level: &LevelMeasurement, peaks: &[(String, FittedPeak)]) -> Self {
        Self {
            force_n: level.force_n,
            peaks: peaks
                .iter()
                .map(|(name, peak)| LevelPeak {
                    name: name.clone(),
                    figures: PeakFigures::new(peak),
                    amplitude_m: level.is_amplitude.then_some(level.force_n * peak.receptance),
                })
                .collect(),
        }
    }
}

impl LevelsOutput {
    fn text(&self) -> String {
        let mut lines = Vec::new();
        for level in &self.levels {
            for peak in &level.peaks {
                let mut line = format!(
                    "{} N: H{}: {}",
                    significant(level.force_n, 4),
                    peak.name,
                    PeakText(&peak.figures)
                );
                if let Some(amplitude_m) = peak.amplitude_m {
                    // Writing to a String cannot fail.
                    let _ = write!(line, ", amplitude {} µm", significant(1e6 * amplitude_m, 4));
                }
                lines.push(line);
            }
        }
        for found in &self.dependences {
            let percent = |figure: Figure| {
                format!(
                    "{}{} ± {} %",
                    if figure.value < 0.0 { "−" } else { "+" },
                    significant(100.0 * figure.value.abs(), 2),
                    significant(100.0 * figure.half(), 2)
                )
            };
            lines.push(format!(
                "H{} from {} to {} N: frequency {}, damping ratio {}: {}",
                found.name,
                significant(found.force_n[0], 4),
                significant(found.force_n[1], 4),
                percent(found.frequency),
                percent(found.damping_ratio),
                if found.is_nonlinear {
                    "the structure is nonlinear; a linear model holds at one level only, and an average over levels at none"
                } else {
                    "no dependence on the level beyond the 90 % intervals"
                }
            ));
        }
        lines.join("\n")
    }
}
