//! `quietcut frf --by-level`: frequency, damping and size of the peaks at each force level.

use std::fmt::Write;

use serde::Serialize;

use super::args::Args;
use super::figure::{Figure, PeakFigures, PeakText};
use crate::cli::Error;
use crate::cli::segment::Recorded;
use crate::frf::{FittedPeak, LevelMeasurement, PeaksOverLevel, level_peaks, measure_levels};
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
    peaks: Vec<Peak>,
}

#[derive(Serialize)]
struct Peak {
    name: String,
    #[serde(flatten)]
    figures: PeakFigures,
    /// Amplitude of the displacement at the peak, m: see [`crate::frf::LevelPeak::amplitude_m`]; `null` for a hammer.
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
    /// True if the structure is nonlinear: see [`PeaksOverLevel::is_nonlinear`].
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
    let settings = args.settings();
    let levels = measure_levels(&recordings, &settings)?;
    if levels.len() < 2 {
        return Err(Error::input(format!(
            "{}: one force level, {} N; --by-level needs recordings at two or more, or a stepped sine at several",
            args.recordings[0].display(),
            levels
                .first()
                .map_or_else(String::new, |level| significant(level.force_n, 4))
        )));
    }
    let peaks = level_peaks(&recordings, &settings, &levels)?;
    if peaks.is_empty() {
        return Err(Error::input(format!(
            "{}: at no force level does a receptance have a peak with eight settled lines that falls to half its power on both sides; take finer \
             steps over a wider band and longer dwells, or test a stepped sine by identify --method linearity",
            args.recordings[0].display()
        )));
    }
    let mut warnings: Vec<String> = Vec::new();
    for warning in levels.iter().flat_map(|level| &level.measurement.warnings) {
        if !warnings.contains(warning) {
            warnings.push(warning.clone());
        }
    }
    warnings.extend(levels_without_peak(&levels, &peaks));
    let answer = LevelsOutput {
        dependences: peaks.iter().filter_map(|of| dependence(&levels, of)).collect(),
        levels: levels
            .iter()
            .enumerate()
            .map(|(index, level)| LevelAnswer::new(index, level, &peaks))
            .collect(),
        warnings,
    };
    for warning in &answer.warnings {
        tracing::warn!("{warning}");
    }
    let text = answer.text();
    args.output.answer_with(&understood, &answer, text)
}

/// Warnings of the force levels at which no receptance has a peak.
pub(crate) fn levels_without_peak(levels: &[LevelMeasurement], peaks: &[PeaksOverLevel]) -> Vec<String> {
    let has_peak = |index: usize| {
        peaks
            .iter()
            .flat_map(|of| &of.peaks)
            .any(|one| one.level == index)
    };
    levels
        .iter()
        .enumerate()
        .filter(|(index, _)| !has_peak(*index))
        .map(|(_, level)| {
            format!(
                "at {} N no receptance has a peak with eight lines that falls to half its power on both sides: take a finer resolution or a wider \
                 band",
                significant(level.force_n, 4)
            )
        })
        .collect()
}

/// The change of the largest peak of a receptance from the lowest to the highest level; `None` with one level.
fn dependence(levels: &[LevelMeasurement], of: &PeaksOverLevel) -> Option<Dependence> {
    let [low, .., high] = of.peaks.as_slice() else {
        return None;
    };
    let relative = |quantity: fn(&FittedPeak) -> [f64; 2]| {
        let ([old, old_std], [new, new_std]) = (quantity(&low.peak), quantity(&high.peak));
        let half = (low.peak.ninety_percent() * old_std).hypot(high.peak.ninety_percent() * new_std);
        Figure::new((new - old) / old, half / old.abs())
    };
    Some(Dependence {
        name: of.name.clone(),
        force_n: [levels[low.level].force_n, levels[high.level].force_n],
        frequency: relative(|peak| [peak.frequency_hz, peak.frequency_std_hz]),
        damping_ratio: relative(|peak| [peak.damping_ratio, peak.damping_ratio_std]),
        is_nonlinear: of.is_nonlinear,
    })
}

impl LevelAnswer {
    fn new(index: usize, level: &LevelMeasurement, peaks: &[PeaksOverLevel]) -> Self {
        let of_level = |of: &PeaksOverLevel| {
            let one = of.peaks.iter().find(|one| one.level == index)?;
            Some(Peak {
                name: of.name.clone(),
                figures: PeakFigures::new(&one.peak),
                amplitude_m: one.amplitude_m,
            })
        };
        Self {
            force_n: level.force_n,
            peaks: peaks.iter().filter_map(of_level).collect(),
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
