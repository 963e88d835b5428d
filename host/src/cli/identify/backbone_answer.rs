//! Answer of `--method backbone`: natural frequency and damping ratio over the amplitude.

use std::path::PathBuf;

use quietcut_numerics::statistics::NINETY_PERCENT;
use serde::Serialize;

use super::Error;
use super::figure::Figure;
use super::force_and_motion::force_and_motion;
use crate::frf::{LevelMeasurement, LevelPeak, PeaksOverLevel};
use crate::identify::decay_curve::{DecayCurve, DecayPoint, DecayRecord, decay_curve};
use crate::recording::{Quantity, Recording, TestKind};
use crate::report::backbone_chart::{BackboneLine, BackbonePoint};
use crate::report::digits::significant;

/// Result of `--method backbone`.
#[derive(Debug, Default, Serialize)]
pub(super) struct Backbone {
    /// One entry for each recording of a free decay.
    pub(super) decays: Vec<Decay>,
    /// One entry for each receptance with a peak, over the force levels of the recordings with a force.
    pub(super) levels: Vec<Levels>,
}

/// Frequency and damping over the amplitude of one free decay.
#[derive(Debug, Serialize)]
pub(super) struct Decay {
    recording: PathBuf,
    /// Name of the evaluated channel.
    channel: String,
    points: Vec<PointAnswer>,
    /// Mean over the decay, weighted with the squared amplitude: about what a linear model fitted to the decay has.
    average: AverageAnswer,
    /// True if neither frequency nor damping depends on the amplitude beyond the noise.
    is_flat: bool,
    /// False if they are no smooth function of the amplitude, as where two modes beat.
    is_smooth: bool,
}

#[derive(Debug, Serialize)]
struct PointAnswer {
    /// Time at the centre of the window, s.
    t_s: f64,
    /// Amplitude of the displacement, m.
    amplitude_m: Figure,
    frequency_hz: Figure,
    damping_ratio: Figure,
}

#[derive(Debug, Serialize)]
struct AverageAnswer {
    /// Smallest and largest amplitude of the average, m.
    amplitude_m: [f64; 2],
    frequency_hz: Figure,
    damping_ratio: Figure,
}

/// Frequency and damping of the largest peak of one receptance over the force level.
#[derive(Debug, Serialize)]
pub(super) struct Levels {
    name: String,
    points: Vec<LevelPoint>,
    /// True if the levels differ beyond their intervals, `null` with one level.
    is_nonlinear: Option<bool>,
}

#[derive(Debug, Serialize)]
struct LevelPoint {
    force_n: f64,
    /// Amplitude of the displacement, m; `null` for a hammer.
    amplitude_m: Option<f64>,
    frequency_hz: Figure,
    damping_ratio: Figure,
}

/// True for a recording of a free decay: by its kind, or without kind by a force that is missing or constant.
pub(super) fn is_free_decay(recording: &Recording) -> bool {
    let changes = |samples: &[f64]| samples.windows(2).any(|pair| pair[0] != pair[1]);
    match recording.sidecar.kind {
        Some(kind) => kind == TestKind::FreeDecay,
        None => !recording
            .channels
            .iter()
            .any(|channel| channel.quantity == Quantity::Force && changes(&channel.samples)),
    }
}

/// Warning that one frequency and damping of a recording, as `method` gives them, are averages over amplitudes; `None` if the recording is no
/// free decay, or if its frequency and damping do not depend on the amplitude.
pub(super) fn average_warning(recording: &Recording, band_hz: Option<[f64; 2]>) -> Option<String> {
    if !is_free_decay(recording) {
        return None;
    }
    let decay = Decay::of(recording, band_hz).ok()?;
    let words = decay.average_in_words()?;
    Some(format!(
        "{words}; --method backbone gives them over the amplitude, and --method restoring-force with nonlinear terms a model"
    ))
}

fn of_point(point: &DecayPoint) -> [Figure; 3] {
    [
        Figure::new(point.amplitude_m, point.amplitude_std_m),
        Figure::new(point.frequency_hz, point.frequency_std_hz),
        Figure::new(point.damping_ratio, point.damping_ratio_std),
    ]
}

/// Significant digits of frequencies, and of other numbers, in the text output: a choice.
const DIGITS: [usize; 2] = [6, 4];

fn with_half(figure: Figure, factor: f64, digits: usize) -> String {
    format!(
        "{} ± {}",
        significant(factor * figure.value, digits),
        significant(factor * 0.5 * (figure.ci90[1] - figure.ci90[0]), 2)
    )
}

impl Decay {
    pub(super) fn of(recording: &Recording, band_hz: Option<[f64; 2]>) -> Result<Self, Error> {
        let motion = force_and_motion(recording)?;
        let curve = decay_curve(&DecayRecord {
            samples: motion.motion,
            quantity: motion.quantity,
            rate_hz: recording.sample_rate_hz,
            band_hz,
        })
        .map_err(|error| Error::input(format!("{}: {error}", recording.path.display())))?;
        let prefix = match motion.quantity {
            Quantity::Velocity => "v",
            Quantity::Acceleration => "a",
            _ => "",
        };
        Ok(Self::new(
            recording.path.clone(),
            format!("{prefix}{}", motion.direction),
            &curve,
        ))
    }

    fn new(recording: PathBuf, channel: String, curve: &DecayCurve) -> Self {
        let [_, frequency_hz, damping_ratio] = of_point(&curve.average);
        let amplitudes = || curve.points.iter().map(|point| point.amplitude_m);
        Self {
            recording,
            channel,
            points: curve
                .points
                .iter()
                .map(|point| {
                    let [amplitude_m, frequency_hz, damping_ratio] = of_point(point);
                    PointAnswer {
                        t_s: point.time_s,
                        amplitude_m,
                        frequency_hz,
                        damping_ratio,
                    }
                })
                .collect(),
            average: AverageAnswer {
                amplitude_m: [
                    amplitudes().fold(f64::INFINITY, f64::min),
                    amplitudes().fold(0.0, f64::max),
                ],
                frequency_hz,
                damping_ratio,
            },
            is_flat: curve.is_flat,
            is_smooth: curve.is_smooth,
        }
    }

    /// Sentence that one frequency and damping of the decay are averages; `None` for a flat curve.
    fn average_in_words(&self) -> Option<String> {
        let [low, high] = self.average.amplitude_m;
        (!self.is_flat).then(|| {
            format!(
                "{}: frequency and damping of this decay change with its amplitude: {} Hz and {} % are averages over {} to {} µm, no linear model",
                self.recording.display(),
                significant(self.average.frequency_hz.value, DIGITS[1]),
                significant(100.0 * self.average.damping_ratio.value, DIGITS[1]),
                significant(1e6 * low, 3),
                significant(1e6 * high, 3)
            )
        })
    }

    pub(super) fn warnings(&self) -> Vec<String> {
        let mut warnings: Vec<String> = self.average_in_words().into_iter().collect();
        if !self.is_smooth {
            warnings.push(format!(
                "{}: frequency and damping are no smooth function of the amplitude: another mode within the band, or a disturbance; take one mode by \
                 --band-hz, or a part by --from-s and --until-s. The intervals contain the scatter",
                self.recording.display()
            ));
        }
        warnings
    }
}

impl Levels {
    pub(super) fn new(levels: &[LevelMeasurement], of: &PeaksOverLevel) -> Self {
        let point = |one: &LevelPeak| {
            // Figure takes standard deviations of a normal distribution.
            let student = one.peak.ninety_percent() / NINETY_PERCENT;
            LevelPoint {
                force_n: levels[one.level].force_n,
                amplitude_m: one.amplitude_m,
                frequency_hz: Figure::new(one.peak.frequency_hz, student * one.peak.frequency_std_hz),
                damping_ratio: Figure::new(one.peak.damping_ratio, student * one.peak.damping_ratio_std),
            }
        };
        Self {
            name: of.name.clone(),
            points: of.peaks.iter().map(point).collect(),
            is_nonlinear: (of.peaks.len() > 1).then_some(of.is_nonlinear),
        }
    }

    pub(super) fn warning(&self) -> Option<String> {
        let [first, .., last] = self.points.as_slice() else {
            return None;
        };
        self.is_nonlinear.unwrap_or(false).then(|| {
            format!(
                "H{}: frequency or damping differ between {} and {} N beyond their intervals: the structure is nonlinear, a linear model holds at one \
                 level only, and an average over levels at none",
                self.name,
                significant(first.force_n, DIGITS[1]),
                significant(last.force_n, DIGITS[1])
            )
        })
    }
}

impl Backbone {
    pub(super) fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for decay in &self.decays {
            lines.push(format!("{} of {}:", decay.channel, decay.recording.display()));
            lines.push(format!(
                "{:>22} {:>26} {:>22}",
                "amplitude [µm]", "frequency [Hz]", "damping ratio [%]"
            ));
            lines.extend(decay.points.iter().map(|point| {
                format!(
                    "{:>22} {:>26} {:>22}",
                    with_half(point.amplitude_m, 1e6, DIGITS[1]),
                    with_half(point.frequency_hz, 1.0, DIGITS[0]),
                    with_half(point.damping_ratio, 100.0, DIGITS[1])
                )
            }));
            if decay.is_flat {
                lines.push(format!(
                    "no dependence on the amplitude beyond the noise: {} Hz, damping ratio {} %",
                    with_half(decay.average.frequency_hz, 1.0, DIGITS[0]),
                    with_half(decay.average.damping_ratio, 100.0, DIGITS[1])
                ));
            }
        }
        for level in &self.levels {
            lines.push(format!("H{} over the force level:", level.name));
            lines.push(format!(
                "{:>12} {:>16} {:>26} {:>22}",
                "force [N]", "amplitude [µm]", "frequency [Hz]", "damping ratio [%]"
            ));
            lines.extend(level.points.iter().map(|point| {
                format!(
                    "{:>12} {:>16} {:>26} {:>22}",
                    significant(point.force_n, DIGITS[1]),
                    point
                        .amplitude_m
                        .map_or_else(|| "-".into(), |size| significant(1e6 * size, DIGITS[1])),
                    with_half(point.frequency_hz, 1.0, DIGITS[0]),
                    with_half(point.damping_ratio, 100.0, DIGITS[1])
                )
            }));
            lines.push(
                match level.is_nonlinear {
                    Some(true) => "the levels differ beyond their 90 % intervals",
                    Some(false) => "no dependence on the level beyond the 90 % intervals",
                    None => "one level: nothing is known of its dependence",
                }
                .into(),
            );
        }
        lines
    }

    /// Table with one line for each point, units in the head.
    pub(super) fn csv(&self) -> String {
        let mut lines = vec![
            "source,channel,force [N],t [s],amplitude [m],amplitude_low [m],amplitude_high [m],frequency [Hz],frequency_low [Hz],frequency_high [Hz],\
             damping_ratio [1],damping_ratio_low [1],damping_ratio_high [1]"
                .to_owned(),
        ];
        let of = |figure: Figure| format!("{:e},{:e},{:e}", figure.value, figure.ci90[0], figure.ci90[1]);
        for decay in &self.decays {
            let source = quoted(&decay.recording.display().to_string());
            lines.extend(decay.points.iter().map(|point| {
                format!(
                    "{source},{},,{},{},{},{}",
                    decay.channel,
                    point.t_s,
                    of(point.amplitude_m),
                    of(point.frequency_hz),
                    of(point.damping_ratio)
                )
            }));
        }
        for level in &self.levels {
            lines.extend(level.points.iter().map(|point| {
                format!(
                    "force levels,h{},{},,{},,,{},{}",
                    level.name,
                    point.force_n,
                    point
                        .amplitude_m
                        .map_or_else(String::new, |size| format!("{size:e}")),
                    of(point.frequency_hz),
                    of(point.damping_ratio)
                )
            }));
        }
        lines.join("\n") + "\n"
    }

    pub(super) fn drawn(&self) -> Vec<BackboneLine> {
        let decays = self.decays.iter().map(|decay| BackboneLine {
            name: decay
                .recording
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
            points: decay
                .points
                .iter()
                .map(|point| BackbonePoint {
                    amplitude_m: point.amplitude_m.value,
                    frequency_hz: point.frequency_hz.ci90,
                    damping_ratio: point.damping_ratio.ci90,
                })
                .collect(),
        });
        let levels = self.levels.iter().map(|level| BackboneLine {
            name: format!("H{} over the force level", level.name),
            points: level
                .points
                .iter()
                .filter_map(|point| {
                    Some(BackbonePoint {
                        amplitude_m: point.amplitude_m?,
                        frequency_hz: point.frequency_hz.ci90,
                        damping_ratio: point.damping_ratio.ci90,
                    })
                })
                .collect(),
        });
        decays
            .chain(levels)
            .filter(|line| !line.points.is_empty())
            .collect()
    }
}

/// A field of a CSV table, in quotation marks if it needs them.
pub(super) fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}
