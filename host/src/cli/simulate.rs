//! `quietcut simulate`: a simulated cut, or with `--experiment` a simulated vibration test.

use std::path::PathBuf;

use clap::ValueEnum;
use quietcut_core::tachometer::Wheel;
use serde::Serialize;

use super::channels::Channels;
use super::experiment::{self, Experiment};
use super::milling_rig::{self, MillingRig};
use super::output_recordings::OutputRecordings;
use super::{Error, Output, finite, non_negative, positive};
use crate::case::Case;
use crate::file;
use crate::recording::{Quantity, Sidecar, WRITTEN};
use crate::simulate::effect::table::help;
use crate::simulate::{
    Accelerometer, Effects, Entry, Recorder, SimulateError, Statistics, TachometerModel, VirtualCut,
    VirtualCutError,
};

const EXAMPLE: &str = "Example:\n  quietcut simulate tests/cases/kuka-kr90-acetal.toml --rpm 900 --depth-mm 2 --seconds 4 --out cut.csv\n  quietcut simulate tests/cases/kuka-kr90-y17-low.toml --experiment step-sine --frequency-hz 16.6:17.9:14 --force-n 1.8,5.8,9.5 --dwell-s 20 --sample-rate-hz 128 --noise-percent 1 --out steps.csv\n  quietcut simulate tests/cases/kuka-kr90-acetal.toml --experiment porous --rpm 820 --depth-mm 2 --start-deg 0 --exit-deg 180 --seconds 60 --sample-rate-hz 1024 --noise-percent 1 --out porous.csv";

/// Simulates a cut with tooth entry and exit, loss of contact, runout and sensor; with --experiment a vibration test.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLE, after_long_help = format!("{}\n{EXAMPLE}", help()))]
pub struct Args {
    /// The case file: structure, tool, material, cut.
    #[arg(value_name = "CASE")]
    case: PathBuf,
    /// Spindle speed in rev/min.
    #[arg(long, value_name = "N", value_parser = positive, allow_negative_numbers = true, required_unless_present = "experiment")]
    rpm: Option<f64>,
    /// Axial depth of cut in mm.
    #[arg(long, value_name = "A", value_parser = positive, allow_negative_numbers = true, required_unless_present = "experiment")]
    depth_mm: Option<f64>,
    /// Duration in s.
    #[arg(long, value_name = "T", value_parser = positive, allow_negative_numbers = true, required_unless_present = "experiment")]
    seconds: Option<f64>,
    #[command(flatten)]
    experiment: Experiment,
    #[command(flatten)]
    channels: Channels,
    /// Do not record the cutting forces.
    #[arg(long, conflicts_with = "experiment")]
    no_force: bool,
    #[command(flatten)]
    milling_rig: MillingRig,
    /// Effect to add to the case, such as runout=20 (µm) or runout.angle_deg=45; may be repeated; --help lists all effects.
    #[arg(long, value_name = "NAME=VALUE")]
    effect: Vec<String>,
    /// Entry into and exit from the workpiece. Default: feed, or ramp if the tool diameter is not given or the duration
    /// is too short for feed.
    #[arg(long, value_name = "KIND")]
    entry: Option<EntryKind>,
    /// Duration of the depth ramp with --entry ramp, in s. Default: a tenth of the duration of the cut.
    #[arg(long, value_name = "T", value_parser = positive, allow_negative_numbers = true)]
    ramp_s: Option<f64>,
    /// Time in air before and after the cut, in s. Default: a twentieth of the duration, at most 0.2 s.
    #[arg(long, value_name = "T", value_parser = non_negative, allow_negative_numbers = true)]
    air_s: Option<f64>,
    /// Record the exact motion, without noise, quantization and clock error of the sensor.
    #[arg(long, conflicts_with_all = ["range_g", "noise_ug", "clock_error_percent", "tacho_jitter_us"])]
    ideal: bool,
    /// Sampling rate in Hz; in a cut without --ideal it is the nominal rate of the accelerometer. Default: 26667 in a
    /// cut; in a vibration test at least 20 times the highest excited frequency.
    #[arg(long, value_name = "N", value_parser = positive, allow_negative_numbers = true)]
    sample_rate_hz: Option<f64>,
    /// Range of the accelerometer in g: 2, 4, 8 or 16.
    #[arg(long, value_name = "G", default_value_t = 16.0, value_parser = range_g, allow_negative_numbers = true)]
    range_g: f64,
    /// Noise of the accelerometer in µg per √Hz.
    #[arg(long, value_name = "N", default_value_t = 75.0, value_parser = non_negative, allow_negative_numbers = true)]
    noise_ug: f64,
    /// Relative error of the accelerometer clock in percent, −3 to 3; positive if it runs fast.
    #[arg(long, value_name = "P", default_value_t = 0.0, value_parser = clock_error, allow_negative_numbers = true)]
    clock_error_percent: f64,
    /// Number of tooth positions on the tachometer wheel.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    tacho_positions: u16,
    /// Number of consecutive missing teeth on the tachometer wheel.
    #[arg(long, value_name = "N", default_value_t = 0)]
    tacho_missing: u16,
    /// Jitter of the tachometer edges in µs.
    #[arg(long, value_name = "N", default_value_t = 2.0, value_parser = non_negative, allow_negative_numbers = true)]
    tacho_jitter_us: f64,
    /// Seed of the random numbers (sensor noise, scatter of impacts); the same seed gives the same file.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Recording to write; the ending sets the format: csv, uff or unv (UFF 58, text) or bunv (UFF 58, binary). Metadata
    /// go to a sidecar file with the ending .toml. May be repeated.
    #[arg(long, value_name = "REC.csv", value_parser = recording_to_write, required = true)]
    out: Vec<PathBuf>,
    #[command(flatten)]
    output: Output,
}

/// Nominal sampling rate of the accelerometer IIS3DWB, Hz (data sheet).
const SAMPLE_RATE_HZ: f64 = 26_667.0;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum EntryKind {
    /// The tool feeds through the side faces of the workpiece: the immersion increases at entry and decreases at exit.
    Feed,
    /// The axial depth rises linearly from 0 at entry and falls linearly to 0 at exit.
    Ramp,
    /// The tool is fully engaged from the start of the record to its end.
    None,
}

/// Output of a simulated cut.
#[derive(Debug, Serialize)]
struct CutOutput {
    recording: PathBuf,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    copies: Vec<PathBuf>,
    sample_rate_hz: f64,
    samples: usize,
    entry: &'static str,
    full_cut_s: [f64; 2],
    largest_displacement_mm: f64,
    steps: u64,
    contact_changes: u64,
}

/// Parses the path of the recording to write; its ending must be a format that can be written.
fn recording_to_write(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let ending = file::ending(&path);
    if WRITTEN.contains(&ending.as_str()) {
        Ok(path)
    } else {
        Err(format!(
            "`{text}` ends in \"{ending}\"; csv, uff, unv or bunv is needed"
        ))
    }
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    // Without --rpm the spindle stands still.
    let case = Case::read(&args.case)?.at_speed(args.rpm.unwrap_or_default());
    for out in &args.out {
        let sidecar = Sidecar::path_of(out);
        if let (Ok(sidecar), Ok(case)) = (sidecar.canonicalize(), args.case.canonicalize())
            && sidecar == case
        {
            return Err(Error::input(format!(
                "--out {}: the sidecar file of the recording would overwrite the case {}; choose another name",
                out.display(),
                sidecar.display()
            )));
        }
    }
    let files = OutputRecordings::new(&args.out);
    if let Some(kind) = args.experiment.experiment {
        let common = experiment::Common {
            seconds: args.seconds,
            sample_rate_hz: args.sample_rate_hz,
            seed: args.seed,
            out: &files,
            effects: &args.effect,
            channels: &args.channels,
        };
        if kind.is_milling() {
            let (Some(rpm), Some(depth_mm)) = (args.rpm, args.depth_mm) else {
                return Err(Error::input(
                    "--rpm and --depth-mm are needed: this --experiment is a cut",
                ));
            };
            return milling_rig::run(
                &case,
                kind,
                (rpm, depth_mm),
                &args.milling_rig,
                &common,
                args.output,
            );
        }
        if args.rpm.is_some() || args.depth_mm.is_some() {
            return Err(Error::input(
                "--rpm and --depth-mm belong to a cut, not to this --experiment; leave them out",
            ));
        }
        return experiment::run(&case, kind, &args.experiment, &common, args.output);
    }
    let case = milling_rig::immersed(&case, &args.milling_rig)?;
    let tachometer = tachometer(&args)?;
    let sample_rate_hz = args.sample_rate_hz.unwrap_or(SAMPLE_RATE_HZ);
    let effects = Effects::parse_over(args.effect.iter().map(String::as_str), args.seconds);
    let cut = cut(&args, &case, effects.map_err(Error::input)?)?;
    let recorder = if args.ideal {
        Recorder::Ideal {
            rate_hz: sample_rate_hz,
        }
    } else {
        Recorder::Sensor {
            accelerometer: Accelerometer {
                range_g: args.range_g,
                noise_g_per_root_hertz: 1e-6 * args.noise_ug,
                nominal_rate_hz: sample_rate_hz,
                clock_error: 0.01 * args.clock_error_percent,
                ..Accelerometer::IIS3DWB_16G
            },
            seed: args.seed,
        }
    };
    let named = |error| with_source(&args, error);
    let full_cut_s = cut.full_cut_s(&case).map_err(named)?;
    let (
        mut recording,
        Statistics {
            steps,
            contact_changes,
            ..
        },
    ) = cut
        .record(&case, recorder, tachometer, &files.first)
        .map_err(named)?;
    args.channels.add_noise(&mut recording, args.seed)?;
    files.write(&recording)?;
    let displacements = recording
        .channels
        .iter()
        .filter(|channel| ["x", "y", "z"].contains(&channel.name.as_str()))
        .flat_map(|channel| &channel.samples);
    let answer = CutOutput {
        recording: files.first,
        copies: files.copies,
        sample_rate_hz: recording.sample_rate_hz,
        samples: recording.len(),
        entry: match cut.entry {
            Entry::None => "none",
            Entry::Ramp { .. } => "ramp",
            Entry::Feed => "feed",
        },
        full_cut_s,
        largest_displacement_mm: 1e3 * displacements.fold(0.0_f64, |a, b| a.max(b.abs())),
        steps,
        contact_changes,
    };
    let text = text(&answer);
    args.output.answer(&answer, text)
}

fn text(answer: &CutOutput) -> String {
    let [from, to] = answer.full_cut_s;
    let entry = match answer.entry {
        "feed" => "entry and exit through the faces of the workpiece, ",
        "ramp" => "entry and exit with a ramp of the depth, ",
        _ => "",
    };
    format!(
        "{}: {} samples at {:.1} Hz\n{entry}full engagement from {from:.2} to {to:.2} s; largest displacement of the tool {:.3} mm\n{} steps, {} changes of contact",
        answer.recording.display(),
        answer.samples,
        answer.sample_rate_hz,
        answer.largest_displacement_mm,
        answer.steps,
        answer.contact_changes
    )
}

fn tachometer(args: &Args) -> Result<TachometerModel, Error> {
    if args.tacho_missing >= args.tacho_positions {
        return Err(Error::input(format!(
            "--tacho-missing {}: fewer than the {} positions of the wheel are needed",
            args.tacho_missing, args.tacho_positions
        )));
    }
    Ok(TachometerModel {
        wheel: Wheel {
            positions: args.tacho_positions,
            missing: args.tacho_missing,
        },
        jitter_s: 1e-6 * args.tacho_jitter_us,
    })
}

/// Builds the cut from the options. Without `--entry` the entry is feed, or ramp if the tool diameter is not given or
/// the duration is too short for feed.
fn cut(args: &Args, case: &Case, effects: Effects) -> Result<VirtualCut, Error> {
    let (Some(rpm), Some(depth_mm), Some(seconds)) = (args.rpm, args.depth_mm, args.seconds) else {
        return Err(Error::input(
            "--rpm, --depth-mm and --seconds are needed for a cut",
        ));
    };
    let mut cut = VirtualCut {
        effects,
        entry: Entry::None,
        air_s: args.air_s.unwrap_or((0.05 * seconds).min(0.2)),
        measured: (!args.no_force)
            .then_some(Quantity::Force)
            .into_iter()
            .chain(args.channels.measured())
            .collect(),
        ..VirtualCut::new(rpm, depth_mm, seconds)
    };
    let ramp = Entry::Ramp {
        seconds: args.ramp_s.unwrap_or(0.1 * seconds),
    };
    cut.entry = match args.entry {
        Some(EntryKind::None) => Entry::None,
        Some(EntryKind::Ramp) => ramp,
        Some(EntryKind::Feed) => Entry::Feed,
        None => {
            cut.entry = Entry::Feed;
            match cut.full_cut_s(case) {
                Ok(_) => Entry::Feed,
                Err(
                    VirtualCutError::TooShort { .. } | VirtualCutError::Simulate(SimulateError::NoDiameter),
                ) => ramp,
                Err(error) => return Err(with_source(args, error)),
            }
        }
    };
    Ok(cut)
}

/// Adds to an error of a simulated cut the case file or the option that caused it.
fn with_source(args: &Args, error: VirtualCutError) -> Error {
    let case = args.case.display();
    match error {
        VirtualCutError::Case(error) => error.into(),
        VirtualCutError::TooShort { .. } => {
            Error::input(format!("--seconds {}: {error}", args.seconds.unwrap_or(0.0)))
        }
        VirtualCutError::WheelTooFine { .. } => Error::input(format!("--tacho-positions: {error}")),
        other => Error::input(format!("{case}: {other}")),
    }
}

fn range_g(text: &str) -> Result<f64, String> {
    match finite(text)? {
        value if [2.0, 4.0, 8.0, 16.0].contains(&value) => Ok(value),
        value => Err(format!("{value} is not possible: it must be 2, 4, 8 or 16")),
    }
}

fn clock_error(text: &str) -> Result<f64, String> {
    match finite(text)? {
        value if value.abs() <= 3.0 => Ok(value),
        value => Err(format!("{value} is not possible: it must be −3 to 3")),
    }
}
