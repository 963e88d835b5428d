//! `quietcut frf`: receptances H = X/F with coherence, estimated from recordings.

use std::fmt::Write;
use std::path::PathBuf;

use maud::html;
use serde::Serialize;

use super::output::keep_inputs;
use super::segment::{Recorded, RecordedSegment};
use super::{Error, Output, finite, positive};
use crate::criteria::{LARGEST_FOLDING, SMALL_FOLDING};
use crate::file;
use crate::frf::{
    Estimator, Excitation, Frf, FrfError, FrfTable, HammerWindows, Measurement, MeasurementSettings,
    ModeRatio, RecordingGroup, Window, calibrate, measure,
};
use crate::identify::student::NINETY_PERCENT;
use crate::recording::UffForm;
use crate::report::frf_chart::frf_chart;
use crate::report::page::{figure, page};

/// Estimates receptances and their coherence from recordings of a shaker, a hammer or a cut.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut simulate tests/cases/kuka-kr90-acetal.toml --experiment hammer --direction y --force-n 300 --sample-rate-hz 512 --noise-percent 0.1 --out hammer.csv\n  quietcut frf hammer.csv --band-hz 10:30 --out frf.csv --out frf.svg\n\n\
                  Recordings with the same forces are averaged; recordings with other forces add columns to the matrix of receptances.\n\
                  The sidecar key `kind` sets how a recording is divided into segments; --excitation overrides it.\n\
                  Forces that are not selected count as noise."
)]
pub struct Args {
    /// The recordings: CSV, UFF 58, WAV or MAT.
    #[arg(value_name = "REC", required = true)]
    recordings: Vec<PathBuf>,
    /// Table or chart to write; the ending sets the format: csv, uff, svg or html. May be repeated.
    #[arg(long, value_name = "FILE", value_parser = OutputFile::parse)]
    out: Vec<OutputFile>,
    /// Estimator: h1 is unbiased by noise of the responses, h2 by noise of the forces, mean is (h1 + h2)/2. pseudo-inverse
    /// combines several cuts, in each of which the forces are linearly dependent.
    #[arg(long, value_enum, default_value_t)]
    method: Method,
    /// Kind of excitation in the recordings; overrides the key kind of the sidecar file.
    #[arg(long, value_enum)]
    excitation: Option<ExcitationKind>,
    /// First and last frequency of the estimated receptances, in Hz.
    #[arg(long, value_name = "FIRST:LAST", value_parser = band)]
    band_hz: Option<(f64, f64)>,
    /// Distance between the frequency lines of the receptances, in Hz. Default: for each force, that of eight segments
    /// of a record of random excitation, or of eight averaged lines of a sweep.
    #[arg(long, value_name = "D", value_parser = positive, allow_negative_numbers = true)]
    resolution_hz: Option<f64>,
    /// Window function on each segment of a record of random excitation.
    #[arg(long, value_enum, default_value_t)]
    window: WindowName,
    /// Overlap of neighbouring segments of a record of random excitation, as a fraction of the segment length.
    #[arg(long, value_name = "FRACTION", value_parser = overlap, default_value = "0.5", allow_negative_numbers = true)]
    overlap: f64,
    /// Channel to use where a recording has several forces, or several sensors of one direction; may be repeated.
    #[arg(long, value_name = "NAME")]
    channel: Vec<String>,
    /// Time constant τ in s of the exponential window on hammer impacts. The window adds 1/τ to the decay rate of every mode;
    /// the written receptances have that damping taken off again.
    #[arg(long, value_name = "TAU", value_parser = positive, allow_negative_numbers = true)]
    exponential_window_s: Option<f64>,
    /// Force level in N to use where a step-sine test has several levels.
    #[arg(long, value_name = "F", value_parser = positive, allow_negative_numbers = true)]
    force_n: Option<f64>,
    /// Tool-tip calibration: FRF from the tool tip to the sensor on the housing.
    #[arg(long, value_name = "FILE", requires = "tip")]
    housing: Option<PathBuf>,
    /// Tool-tip calibration: FRF from the tool tip to itself.
    #[arg(long, value_name = "FILE", requires = "housing")]
    tip: Option<PathBuf>,
    /// Write uff files as binary (58b).
    #[arg(long)]
    uff_binary: bool,
    #[command(flatten)]
    segment: RecordedSegment,
    #[command(flatten)]
    output: Output,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
enum Method {
    #[default]
    H1,
    H2,
    Mean,
    PseudoInverse,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum ExcitationKind {
    Random,
    Sweep,
    Hammer,
    StepSine,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
enum WindowName {
    #[default]
    Hann,
    Hamming,
    Rectangular,
}

/// Output file with its format.
#[derive(Clone, Debug)]
struct OutputFile {
    path: PathBuf,
    format: FileFormat,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FileFormat {
    Csv,
    Uff,
    Svg,
    Html,
}

impl OutputFile {
    fn parse(text: &str) -> Result<Self, String> {
        let path = PathBuf::from(text);
        let ending = file::ending(&path);
        let format = match ending.as_str() {
            "csv" => FileFormat::Csv,
            "uff" | "unv" => FileFormat::Uff,
            "svg" => FileFormat::Svg,
            "html" => FileFormat::Html,
            _ => {
                return Err(format!(
                    "`{text}` ends in \"{ending}\"; csv, uff, svg or html is needed"
                ));
            }
        };
        Ok(Self { path, format })
    }
}

fn band(text: &str) -> Result<(f64, f64), String> {
    let wrong = || format!("`{text}` is no band; two frequencies are needed, such as 10:30");
    let (first, last) = text.split_once(':').ok_or_else(wrong)?;
    let (first, last) = (finite(first)?, finite(last)?);
    if 0.0 <= first && first < last {
        Ok((first, last))
    } else {
        Err(format!(
            "`{text}` is not possible: the first frequency must be 0 or more, and the last greater"
        ))
    }
}

fn overlap(text: &str) -> Result<f64, String> {
    let value = finite(text)?;
    if (0.0..=0.95).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{value} is not possible: it must be from 0 to 0.95"))
    }
}

impl Args {
    fn settings(&self) -> MeasurementSettings {
        MeasurementSettings {
            excitation: self.excitation.map(|kind| match kind {
                ExcitationKind::Random => Excitation::Random,
                ExcitationKind::Sweep => Excitation::Sweep,
                ExcitationKind::Hammer => Excitation::Hammer,
                ExcitationKind::StepSine => Excitation::StepSine,
            }),
            estimator: match self.method {
                Method::H1 => Estimator::H1,
                Method::H2 => Estimator::H2,
                Method::Mean => Estimator::Mean,
                Method::PseudoInverse => Estimator::PseudoInverse,
            },
            resolution_hz: self.resolution_hz,
            overlap: self.overlap,
            window: match self.window {
                WindowName::Hann => Window::Hann,
                WindowName::Hamming => Window::Hamming,
                WindowName::Rectangular => Window::Rectangular,
            },
            band_hz: self.band_hz,
            channels: self.channel.clone(),
            hammer: HammerWindows {
                segment_s: None,
                exponential_s: self.exponential_window_s,
            },
            force_n: self.force_n,
        }
    }
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    for target in &args.out {
        let inputs = args.recordings.iter().chain(&args.housing).chain(&args.tip);
        keep_inputs(inputs.map(PathBuf::as_path), &target.path)?;
    }
    let Recorded {
        recordings,
        understood,
    } = args.segment.read(&args.recordings)?;
    let mut measurement = measure(&recordings, &args.settings())?;
    check_folding(&mut measurement)?;
    let (table, calibration) = match (&args.housing, &args.tip) {
        (Some(housing), Some(tip)) => calibrate(
            &measurement.table,
            &FrfTable::read(housing)?,
            &FrfTable::read(tip)?,
        )?,
        _ => (measurement.table.clone(), Vec::new()),
    };
    for warning in &measurement.warnings {
        tracing::warn!("{warning}");
    }
    for target in &args.out {
        write(target, &table, args.uff_binary)?;
    }
    let answer = FrfOutput::new(&args, &measurement, &table, &calibration);
    let text = answer.text();
    args.output.answer_with(&understood, &answer, text)
}

/// Warns if aliasing (content above half the sample rate, folded into the record) may change the peak of a receptance,
/// and refuses a relative change above [`LARGEST_FOLDING`].
fn check_folding(measurement: &mut Measurement) -> Result<(), Error> {
    // The error by aliasing is inversely proportional to the spectra of force and response. So |H| divided by this
    // error is largest at the resonance that the impacts excite, and small where the force spectrum vanishes.
    let at_peak = |(entry, folding): (&Frf, &Vec<f64>)| {
        let excited = |line: usize| entry.receptance[line].norm() / folding[line].max(f64::MIN_POSITIVE);
        let peak = (0..folding.len()).max_by(|&a, &b| excited(a).total_cmp(&excited(b)));
        (entry.name(), peak.map_or(0.0, |peak| folding[peak]))
    };
    let worst = measurement
        .table
        .entries()
        .iter()
        .zip(&measurement.folding)
        .map(at_peak)
        .max_by(|a, b| a.1.total_cmp(&b.1));
    let Some((name, error)) = worst.filter(|(_, error)| *error > 0.0) else {
        return Ok(());
    };
    let remedy = "a softer tip of the hammer, a higher sample rate or an anti-aliasing filter helps; if there was a filter, say \
                  anti_aliasing = true under [channels.fx] and under the channel of the response in the sidecar";
    if error > LARGEST_FOLDING {
        return Err(Error::input(format!(
            "{}: content above half the sample rate folds into the record and may change the peak of H{name} by {:.0} %, more than {:.0} %: {remedy}",
            measurement.table.path().display(),
            100.0 * error,
            100.0 * LARGEST_FOLDING
        )));
    }
    if error > SMALL_FOLDING {
        measurement.warnings.push(format!(
            "content above half the sample rate folds into the record: it may change the peak of H{name} by {:.1} %, which is in its interval; {remedy}",
            100.0 * error
        ));
    }
    Ok(())
}

fn write(target: &OutputFile, table: &FrfTable, is_binary: bool) -> Result<(), Error> {
    let title = "Frequency response functions";
    let draw = || frf_chart(title, table).map_err(Error::input);
    match target.format {
        FileFormat::Csv => table.write(&target.path)?,
        FileFormat::Uff => {
            let form = if is_binary { UffForm::Binary } else { UffForm::Text };
            table.write_uff(&target.path, form)?;
        }
        FileFormat::Svg => file::write(&target.path, draw()?.as_bytes())?,
        FileFormat::Html => {
            let body = html! {
                h1 { (title) }
                (figure(&draw()?, "Receptances: displacement (first letter) per force (second letter)."))
            };
            file::write(&target.path, page(title, &body).as_bytes())?;
        }
    }
    Ok(())
}

/// Output of `quietcut frf --json`.
#[derive(Serialize)]
struct FrfOutput {
    method: &'static str,
    frequency_hz: [f64; 2],
    lines: usize,
    parts: Vec<ColumnsAnswer>,
    receptances: Vec<ReceptanceAnswer>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    calibration: Vec<RatioAnswer>,
    warnings: Vec<String>,
    out: Vec<PathBuf>,
}

#[derive(Serialize)]
struct ColumnsAnswer {
    forces: Vec<&'static str>,
    excitation: &'static str,
    recordings: usize,
    averages: f64,
    /// Smallest singular value of the matrix of forces, each normalized to unit root mean square: 1 for independent forces, 0 for
    /// linearly dependent ones.
    least_singular_value: f64,
    left_out_hz: Vec<f64>,
    #[serde(rename = "blows", skip_serializing_if = "Option::is_none")]
    impacts: Option<ImpactCounts>,
}

#[derive(Serialize)]
struct ImpactCounts {
    used: usize,
    double_s: Vec<f64>,
}

#[derive(Serialize)]
struct ReceptanceAnswer {
    name: String,
    peak_hz: f64,
    peak_m_per_n: PeakEstimate,
    coherence: Option<CoherenceAnswer>,
}

#[derive(Serialize)]
struct PeakEstimate {
    value: f64,
    /// 90 % interval of the peak magnitude of a receptance; `null` with fewer than three impacts, whose scatter gives
    /// no standard deviation.
    ci90: Option<[f64; 2]>,
}

#[derive(Serialize)]
struct CoherenceAnswer {
    median: f64,
    at_peak: f64,
}

#[derive(Serialize)]
struct RatioAnswer {
    frequency_hz: f64,
    response: &'static str,
    tip_to_housing: f64,
    misfit: f64,
}

impl FrfOutput {
    fn new(args: &Args, measurement: &Measurement, table: &FrfTable, calibration: &[ModeRatio]) -> Self {
        let frequency_hz = table.frequency_hz();
        let receptances = (0..table.entries().len())
            .map(|index| ReceptanceAnswer::new(measurement, table, index))
            .collect();
        Self {
            method: match args.method {
                Method::H1 => "h1",
                Method::H2 => "h2",
                Method::Mean => "mean",
                Method::PseudoInverse => "pseudo-inverse",
            },
            // This index is safe: a table of frequency response functions has at least one frequency line.
            frequency_hz: [frequency_hz[0], frequency_hz[frequency_hz.len() - 1]],
            lines: frequency_hz.len(),
            parts: measurement.groups.iter().map(ColumnsAnswer::new).collect(),
            receptances,
            calibration: calibration
                .iter()
                .map(|ratio| RatioAnswer {
                    frequency_hz: ratio.frequency_hz,
                    response: ratio.response.name(),
                    tip_to_housing: ratio.ratio,
                    misfit: ratio.misfit,
                })
                .collect(),
            warnings: measurement.warnings.clone(),
            out: args.out.iter().map(|target| target.path.clone()).collect(),
        }
    }

    fn text(&self) -> String {
        let mut text = format!(
            "{} frequencies from {:.3} to {:.3} Hz",
            self.lines, self.frequency_hz[0], self.frequency_hz[1]
        );
        for receptance in &self.receptances {
            let PeakEstimate { value, ci90 } = &receptance.peak_m_per_n;
            // Writing to a String cannot fail.
            let _ = write!(
                text,
                "\nH{}: {:.4} µm/N at {:.3} Hz",
                receptance.name,
                1e6 * value,
                receptance.peak_hz
            );
            let _ = match ci90 {
                Some([from, to]) => write!(text, ", 90 % interval {:.4} to {:.4}", 1e6 * from, 1e6 * to),
                None => write!(text, ", no interval from so few impacts"),
            };
            if let Some(coherence) = &receptance.coherence {
                let _ = write!(
                    text,
                    "; coherence {:.3} at the peak, median {:.3}",
                    coherence.at_peak, coherence.median
                );
            }
        }
        for ratio in &self.calibration {
            let _ = write!(
                text,
                "\nratio of tool tip to housing at {:.3} Hz in {}: {:.4} (misfit {:.1} %)",
                ratio.frequency_hz,
                ratio.response,
                ratio.tip_to_housing,
                100.0 * ratio.misfit
            );
        }
        for path in &self.out {
            let _ = write!(text, "\nwritten: {}", path.display());
        }
        text
    }
}

impl ColumnsAnswer {
    fn new(part: &RecordingGroup) -> Self {
        Self {
            forces: part.forces.iter().map(|direction| direction.name()).collect(),
            excitation: part.excitation.name(),
            recordings: part.recordings,
            averages: part.averages,
            least_singular_value: part.least_singular,
            left_out_hz: part.left_out_hz.clone(),
            impacts: part.impacts.as_ref().map(|(used, double)| ImpactCounts {
                used: used.len(),
                double_s: double.iter().map(|impact| impact.time_s).collect(),
            }),
        }
    }
}

impl ReceptanceAnswer {
    /// Peak magnitude of one receptance with its 90 % interval from the random error of the estimate and from folding.
    fn new(measurement: &Measurement, table: &FrfTable, index: usize) -> Self {
        let entry = &table.entries()[index];
        let size = |line: usize| entry.receptance[line].norm();
        let at = (0..entry.receptance.len())
            .max_by(|&a, &b| size(a).total_cmp(&size(b)))
            .unwrap_or(0);
        // The standard deviation is divided by the receptance before the tool-tip calibration. The calibration
        // multiplies both by the same factor, so that their ratio also holds after it.
        let before = measurement.table.entries()[index].receptance[at].norm();
        let relative = if before > 0.0 {
            measurement.deviation[index][at] / before
        } else {
            0.0
        };
        // Half-width of the 90 % interval: the root of the sum of squares of the random error and the error by
        // aliasing. The latter is a bound and does not average out.
        let half = (NINETY_PERCENT * relative).hypot(measurement.folding[index][at]) * size(at);
        Self {
            name: entry.name(),
            peak_hz: table.frequency_hz()[at],
            peak_m_per_n: PeakEstimate {
                value: size(at),
                ci90: measurement.has_deviation[index].then(|| [(size(at) - half).max(0.0), size(at) + half]),
            },
            coherence: entry.coherence.as_ref().map(|coherence| {
                let mut sorted = coherence.clone();
                sorted.sort_by(f64::total_cmp);
                CoherenceAnswer {
                    median: sorted[sorted.len() / 2],
                    at_peak: coherence[at],
                }
            }),
        }
    }
}

impl From<FrfError> for Error {
    fn from(error: FrfError) -> Self {
        match error {
            FrfError::File(cause) => cause.into(),
            FrfError::Recording(cause) => cause.into(),
            other => Self::input(other),
        }
    }
}
