//! `quietcut simulate --experiment porous|speed-sweep`: cuts that excite the structure.

use serde::Serialize;
use std::path::PathBuf;

use super::experiment::{Common, Kind};
use super::{Error, Output, non_negative, positive};
use crate::case::Case;
use crate::recording::Quantity;
use crate::simulate::{Effects, Entry, Pores, Recorder, TachometerModel, VirtualCut};

/// The options of cuts that excite the structure.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Milling rigs")]
pub(super) struct MillingRig {
    /// The speed to which speed-sweep glides by the end, in rev/min; --rpm is where it begins.
    #[arg(long, value_name = "N", value_parser = positive, allow_negative_numbers = true)]
    to_rpm: Option<f64>,
    /// Share of the material of porous that is pores, in percent.
    #[arg(long, value_name = "P", default_value_t = 50.0, value_parser = share, allow_negative_numbers = true)]
    pores_percent: f64,
    /// Size of these pores in mm.
    #[arg(long, value_name = "D", default_value_t = 0.2, value_parser = positive, allow_negative_numbers = true)]
    pore_mm: f64,
    /// By how much the pressures along the cut, towards the axis and along it vary each by itself, in percent.
    #[arg(long, value_name = "P", default_value_t = 40.0, value_parser = share, allow_negative_numbers = true)]
    strength_percent: f64,
    /// Immersion angle at which teeth enter, in degrees, instead of that of the case.
    #[arg(long, value_name = "A", value_parser = non_negative, allow_negative_numbers = true)]
    start_deg: Option<f64>,
    /// Immersion angle at which teeth leave, in degrees, instead of that of the case.
    #[arg(long, value_name = "A", value_parser = positive, allow_negative_numbers = true)]
    exit_deg: Option<f64>,
}

#[derive(Debug, Serialize)]
struct Answer {
    recording: PathBuf,
    sample_rate_hz: f64,
    samples: usize,
    largest_displacement_mm: f64,
    /// Root mean square of each force about its mean, N.
    force_rms_n: Vec<f64>,
    steps: u64,
    contact_changes: u64,
}

/// Samples per second where nothing is asked for: the motion of a robot ends far below.
const SAMPLE_RATE_HZ: f64 = 2048.0;

/// Cuts, and writes what the sensors record.
pub(super) fn run(
    case: &Case,
    kind: Kind,
    (spindle_rpm, depth_mm): (f64, f64),
    rig: &MillingRig,
    common: &Common<'_>,
    output: Output,
) -> Result<(), Error> {
    let input = |error: &dyn std::fmt::Display| Error::input(format!("{}: {error}", case.path.display()));
    let case = &immersed(case, rig)?;
    let seconds = common
        .seconds
        .ok_or_else(|| Error::input("--seconds is needed for a cut"))?;
    let effects = Effects::parse_over(common.effects.iter().map(String::as_str), Some(seconds))
        .map_err(Error::input)?;
    let cut = VirtualCut {
        last_rpm: last_rpm(kind, rig)?,
        pores: (kind == Kind::Porous).then_some(Pores {
            share: 0.01 * rig.pores_percent,
            size_m: 1e-3 * rig.pore_mm,
            strength: 0.01 * rig.strength_percent,
            seed: common.seed,
        }),
        entry: Entry::None,
        air_s: 0.0,
        effects,
        measured: [Quantity::Force]
            .into_iter()
            .chain(common.channels.measured())
            .collect(),
        ..VirtualCut::new(spindle_rpm, depth_mm, seconds)
    };
    let rate_hz = common.sample_rate_hz.unwrap_or(SAMPLE_RATE_HZ);
    let recorder = Recorder::Filtered {
        rate_hz,
        oversampling: (fastest_hz(&cut, case) / rate_hz).ceil() as usize,
    };
    let tachometer = TachometerModel::ONE_MARK;
    let (mut recording, statistics) = cut
        .record(case, recorder, tachometer, common.out)
        .map_err(|error| input(&error))?;
    let largest = recording
        .channels
        .iter()
        .filter(|channel| channel.quantity == Quantity::Displacement)
        .flat_map(|channel| &channel.samples)
        .fold(0.0_f64, |a, b| a.max(b.abs()));
    common.channels.add_noise(&mut recording, common.seed)?;
    recording.write(common.out)?;
    let forces = recording
        .channels
        .iter()
        .filter(|channel| channel.quantity == Quantity::Force);
    let answer = Answer {
        recording: common.out.into(),
        sample_rate_hz: recording.sample_rate_hz,
        samples: recording.len(),
        largest_displacement_mm: 1e3 * largest,
        force_rms_n: forces.map(|channel| deviation(&channel.samples)).collect(),
        steps: statistics.steps,
        contact_changes: statistics.contact_changes,
    };
    let forces: Vec<String> = answer
        .force_rms_n
        .iter()
        .map(|force| format!("{force:.2}"))
        .collect();
    let text = format!(
        "{}: {} samples at {:.1} Hz; forces vary by {} N (root mean square), the tool moves by up to {:.4} mm",
        answer.recording.display(),
        answer.samples,
        answer.sample_rate_hz,
        forces.join(", "),
        answer.largest_displacement_mm
    );
    output.answer(&answer, text)
}

/// Twice what the force has of frequencies: teeth enter and leave suddenly, and pass three pores and more per period.
fn fastest_hz(cut: &VirtualCut, case: &Case) -> f64 {
    let turns_hz = cut.spindle_rpm.max(cut.last_rpm.unwrap_or(0.0)) / 60.0;
    let tool = case.tool.as_ref();
    let teeth_hz = turns_hz * tool.map_or(1, |tool| tool.teeth) as f64;
    let diameter_m = 1e-3 * tool.and_then(|tool| tool.diameter_mm).unwrap_or(0.0);
    let pores_hz = cut.pores.map_or(0.0, |pores| {
        std::f64::consts::PI * diameter_m * turns_hz / pores.size_m
    });
    (3.0 * pores_hz).max(1000.0 * teeth_hz)
}

/// The case with the immersion that was asked for.
fn immersed(case: &Case, rig: &MillingRig) -> Result<Case, Error> {
    let mut case = case.clone();
    if let Some(cut) = &mut case.cut {
        cut.start_deg = rig.start_deg.unwrap_or(cut.start_deg);
        cut.exit_deg = rig.exit_deg.unwrap_or(cut.exit_deg);
        if !(cut.start_deg < cut.exit_deg && cut.exit_deg <= 180.0) {
            return Err(Error::input(format!(
                "--start-deg {} and --exit-deg {}: teeth must enter before they leave, from 0 to 180",
                cut.start_deg, cut.exit_deg
            )));
        }
    }
    Ok(case)
}

fn last_rpm(kind: Kind, rig: &MillingRig) -> Result<Option<f64>, Error> {
    match (kind, rig.to_rpm) {
        (Kind::SpeedSweep, None) => Err(Error::input(
            "--to-rpm is needed: a speed sweep glides from --rpm to another speed",
        )),
        (Kind::SpeedSweep, last_rpm) => Ok(last_rpm),
        (_, None) => Ok(None),
        (_, Some(_)) => Err(Error::input(
            "--to-rpm belongs to --experiment speed-sweep; leave it out",
        )),
    }
}

/// Root mean square about the mean.
fn deviation(samples: &[f64]) -> f64 {
    let count = samples.len().max(1) as f64;
    let mean = samples.iter().sum::<f64>() / count;
    (samples.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count).sqrt()
}

fn share(text: &str) -> Result<f64, String> {
    match non_negative(text)? {
        value if value <= 100.0 => Ok(value),
        value => Err(format!("{value} is not possible: it must be 0 to 100")),
    }
}
