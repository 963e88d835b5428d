//! `quietcut simulate --experiment porous|speed-sweep`: simulated cuts whose forces excite the structure for its
//! identification.

use serde::Serialize;
use std::path::PathBuf;

use super::experiment::{Common, ExperimentKind};
use super::{Error, Output, non_negative, positive};
use crate::case::Case;
use crate::recording::Quantity;
use crate::simulate::{Effects, Entry, Pores, Recorder, TachometerModel, VirtualCut};

/// Options of simulated cuts whose cutting forces excite the structure for its identification.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Milling rigs")]
pub(super) struct MillingRig {
    /// Spindle speed at the end of speed-sweep, in rev/min; --rpm is the speed at its start.
    #[arg(long, value_name = "N", value_parser = positive, allow_negative_numbers = true)]
    to_rpm: Option<f64>,
    /// Volume fraction of pores in the material of porous, in percent.
    #[arg(long, value_name = "P", default_value_t = 50.0, value_parser = share, allow_negative_numbers = true)]
    pores_percent: f64,
    /// Size of the pores in the material of porous, in mm.
    #[arg(long, value_name = "D", default_value_t = 0.2, value_parser = positive, allow_negative_numbers = true)]
    pore_mm: f64,
    /// Amplitude of the independent variations of the tangential, radial and axial cutting coefficients within the
    /// porous material, in percent.
    #[arg(long, value_name = "P", default_value_t = 40.0, value_parser = share, allow_negative_numbers = true)]
    strength_percent: f64,
    /// Immersion angle in degrees where the teeth enter; replaces that of the case.
    #[arg(long, value_name = "A", value_parser = non_negative, allow_negative_numbers = true)]
    start_deg: Option<f64>,
    /// Immersion angle in degrees where the teeth leave; replaces that of the case.
    #[arg(long, value_name = "A", value_parser = positive, allow_negative_numbers = true)]
    exit_deg: Option<f64>,
}

#[derive(Debug, Serialize)]
struct MillingRigOutput {
    recording: PathBuf,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    copies: Vec<PathBuf>,
    sample_rate_hz: f64,
    samples: usize,
    largest_displacement_mm: f64,
    /// Standard deviation over time of each recorded force with its noise, N, in the order of the channels.
    force_rms_n: Vec<f64>,
    steps: u64,
    contact_changes: u64,
}

/// Default sampling rate of the recording of a porous or speed-sweep cut, Hz: a choice far above the natural
/// frequencies of a milling robot (tens of Hz).
const SAMPLE_RATE_HZ: f64 = 2048.0;

/// Simulates the cut of porous or speed-sweep and writes the recording of the cut.
pub(super) fn run(
    case: &Case,
    kind: ExperimentKind,
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
        pores: (kind == ExperimentKind::Porous).then_some(Pores {
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
        .record(case, recorder, tachometer, &common.out.first)
        .map_err(|error| input(&error))?;
    let largest = recording
        .channels
        .iter()
        .filter(|channel| channel.quantity == Quantity::Displacement)
        .flat_map(|channel| &channel.samples)
        .fold(0.0_f64, |a, b| a.max(b.abs()));
    common.channels.add_noise(&mut recording, common.seed)?;
    common.out.write(&recording)?;
    let forces = recording
        .channels
        .iter()
        .filter(|channel| channel.quantity == Quantity::Force);
    let answer = MillingRigOutput {
        recording: common.out.first.clone(),
        copies: common.out.copies.clone(),
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
        "{}: {} samples at {:.1} Hz; standard deviation of the forces {} N, largest displacement of the tool {:.4} mm",
        answer.recording.display(),
        answer.samples,
        answer.sample_rate_hz,
        forces.join(", "),
        answer.largest_displacement_mm
    );
    output.answer(&answer, text)
}

/// Lower bound of the internal sampling rate of the simulation, Hz: the larger of 1000 times the tooth-passing
/// frequency (teeth enter and leave suddenly) and three times the rate at which a tooth passes pores, π·D·n/size with
/// tool diameter D, n revolutions per second and the pore size. The fastest spindle speed of the cut counts.
fn fastest_hz(cut: &VirtualCut, case: &Case) -> f64 {
    let revolutions_hz = cut.spindle_rpm.max(cut.last_rpm.unwrap_or(0.0)) / 60.0;
    let tool = case.tool.as_ref();
    let teeth_hz = revolutions_hz * tool.map_or(1, |tool| tool.teeth) as f64;
    let diameter_m = 1e-3 * tool.and_then(|tool| tool.diameter_mm).unwrap_or(0.0);
    let pores_hz = cut.pores.map_or(0.0, |pores| {
        std::f64::consts::PI * diameter_m * revolutions_hz / pores.size_m
    });
    (3.0 * pores_hz).max(1000.0 * teeth_hz)
}

/// Copy of the case with the immersion angles of `--start-deg` and `--exit-deg`; an option that is not given leaves the
/// angle of the case. A case without a cut stays unchanged.
pub(super) fn immersed(case: &Case, rig: &MillingRig) -> Result<Case, Error> {
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

fn last_rpm(kind: ExperimentKind, rig: &MillingRig) -> Result<Option<f64>, Error> {
    match (kind, rig.to_rpm) {
        (ExperimentKind::SpeedSweep, None) => Err(Error::input(
            "--to-rpm is needed: a speed sweep changes the spindle speed from --rpm to --to-rpm",
        )),
        (ExperimentKind::SpeedSweep, last_rpm) => Ok(last_rpm),
        (_, None) => Ok(None),
        (_, Some(_)) => Err(Error::input(
            "--to-rpm belongs to --experiment speed-sweep; leave it out",
        )),
    }
}

/// Standard deviation of the samples: root mean square about their mean.
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
