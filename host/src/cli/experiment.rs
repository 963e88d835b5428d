//! `quietcut simulate --experiment`: a virtual test rig.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use serde::Serialize;

use super::channels::Channels;
use super::{Error, Output, Range, non_negative, positive};
use crate::case::Case;
use crate::recording::Quantity;
use crate::simulate::Effects;
use crate::simulate::rig::{Rig, Signal};
use crate::structure::{Direction, Structure};

/// The options of a rig.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Test rig")]
pub(super) struct Experiment {
    /// Instead of a cut, a test rig.
    #[arg(long, value_name = "KIND")]
    pub(super) experiment: Option<Kind>,
    /// Direction of the force; the first of the structure where it is not given.
    #[arg(long, value_name = "x|y|z")]
    direction: Option<Direction>,
    /// Frequencies in Hz: of the steps, first and last of a sweep, of the tones of a shaker.
    #[arg(long, value_name = "R", value_parser = Range::positive, allow_negative_numbers = true)]
    frequency_hz: Option<Range>,
    /// Amplitude in N, peak of a blow, or pull before the release. Several with commas: levels of step-sine, or what a
    /// shaker goes from and to.
    #[arg(long, value_name = "F,…", value_parser = positive, allow_negative_numbers = true, value_delimiter = ',')]
    force_n: Vec<f64>,
    /// How long each step of step-sine is excited, in s.
    #[arg(long, value_name = "T", default_value_t = 25.0, value_parser = positive, allow_negative_numbers = true)]
    dwell_s: f64,
    /// How long nothing is done after each step, in s.
    #[arg(long, value_name = "T", default_value_t = 3.0, value_parser = non_negative, allow_negative_numbers = true)]
    pause_s: f64,
    /// How fast a sweep goes, in Hz per minute.
    #[arg(long, value_name = "R", default_value_t = 6.0, value_parser = positive, allow_negative_numbers = true)]
    hz_per_min: f64,
    /// The sweep goes from the last frequency to the first.
    #[arg(long)]
    backward: bool,
    /// Number of blows of the hammer.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..))]
    impacts: u16,
    /// How long a blow lasts, in ms.
    #[arg(long, value_name = "T", default_value_t = 10.0, value_parser = positive, allow_negative_numbers = true)]
    pulse_ms: f64,
    /// How long after a blow the next comes, in s.
    #[arg(long, value_name = "T", default_value_t = 10.0, value_parser = positive, allow_negative_numbers = true)]
    spacing_s: f64,
    /// How much less the shaker's force is per velocity, in N s/m: its drop-out at resonance.
    #[arg(long, value_name = "C", default_value_t = 0.0, value_parser = non_negative, allow_negative_numbers = true)]
    drop_ns_per_m: f64,
}

/// The rigs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Kind {
    /// One tone, or several at once, at a force that is constant or grows.
    Shaker,
    /// One frequency after the other, level after level.
    StepSine,
    /// A frequency that glides.
    Sweep,
    /// Blows of a hammer.
    Hammer,
    /// Pulled and let go.
    FreeDecay,
    /// A cut in porous material, whose force is broad-band.
    Porous,
    /// A cut at a speed that glides; one for each of three or more immersions.
    SpeedSweep,
}

/// What a rig shares with a cut.
pub(super) struct Common<'a> {
    pub(super) seconds: Option<f64>,
    pub(super) sample_rate_hz: Option<f64>,
    pub(super) seed: u64,
    pub(super) out: &'a Path,
    pub(super) effects: &'a [String],
    pub(super) channels: &'a Channels,
}

#[derive(Debug, Serialize)]
struct Answer {
    recording: PathBuf,
    kind: crate::recording::Kind,
    direction: &'static str,
    sample_rate_hz: f64,
    samples: usize,
    seconds: f64,
    largest_displacement_mm: f64,
    steps: u64,
    branch_changes: u64,
}

/// Runs a rig, and writes what it records.
pub(super) fn run(
    case: &Case,
    kind: Kind,
    options: &Experiment,
    common: &Common<'_>,
    output: Output,
) -> Result<(), Error> {
    let structure = case.structure()?;
    let input = |error: &dyn std::fmt::Display| Error::input(format!("{}: {error}", case.path.display()));
    let direction = direction(options, structure).map_err(Error::input)?;
    let signal = signal(kind, options, common)?;
    let effects = Effects::parse_over(
        common.effects.iter().map(String::as_str),
        Some(signal.duration_s()),
    )
    .map_err(Error::input)?;
    let rig = Rig {
        drop_ns_per_m: options.drop_ns_per_m,
        measured: common.channels.measured(),
        effects: Effects::of_case(case)
            .map_err(|error| input(&error))?
            .and(&effects),
        ..Rig::new(
            direction,
            signal,
            common
                .sample_rate_hz
                .unwrap_or_else(|| default_rate_hz(kind, options)),
        )
    };
    let (mut recording, statistics) = rig.record(structure, common.out).map_err(|error| input(&error))?;
    recording.sidecar.posture = case.posture.recorded();
    common.channels.add_noise(&mut recording, common.seed)?;
    recording.write(common.out)?;
    let largest = recording
        .channels
        .iter()
        .filter(|channel| channel.quantity == Quantity::Displacement)
        .flat_map(|channel| &channel.samples)
        .fold(0.0_f64, |a, b| a.max(b.abs()));
    let answer = Answer {
        recording: common.out.into(),
        kind: rig.signal.kind(),
        direction: direction.name(),
        sample_rate_hz: recording.sample_rate_hz,
        samples: recording.len(),
        seconds: rig.signal.duration_s(),
        largest_displacement_mm: 1e3 * largest,
        steps: statistics.steps,
        branch_changes: statistics.branch_changes,
    };
    let text = format!(
        "{}: {} samples at {:.1} Hz, force in {}; the tool moves by up to {:.4} mm",
        answer.recording.display(),
        answer.samples,
        answer.sample_rate_hz,
        answer.direction,
        answer.largest_displacement_mm
    );
    output.answer(&answer, text)
}

impl Kind {
    /// True where a tool cuts.
    pub(super) fn is_milling(self) -> bool {
        matches!(self, Self::Porous | Self::SpeedSweep)
    }
}

fn direction(options: &Experiment, structure: &Structure) -> Result<Direction, String> {
    let first = structure
        .directions
        .iter()
        .find(|direction| direction.axis().is_some());
    options
        .direction
        .or(first.copied())
        .ok_or_else(|| "the structure has no direction in which a force can act".into())
}

/// A power of two that holds the eighth harmonic of what is excited; blows and releases excite up to about 1/pulse.
fn default_rate_hz(kind: Kind, options: &Experiment) -> f64 {
    let highest_hz = match kind {
        Kind::Hammer => 1e3 / options.pulse_ms,
        _ => options
            .frequency_hz
            .map_or(30.0, |range| range.first().max(range.last())),
    };
    (20.0 * highest_hz).log2().ceil().exp2()
}

fn signal(kind: Kind, options: &Experiment, common: &Common<'_>) -> Result<Signal, Error> {
    let frequencies = || {
        options.frequency_hz.ok_or_else(|| {
            Error::input("--frequency-hz is needed: frequencies as first:last:count, or one alone")
        })
    };
    let force = |count: std::ops::RangeInclusive<usize>, what: &str| match options.force_n.len() {
        n if count.contains(&n) => Ok(options.force_n.clone()),
        n => Err(Error::input(format!("--force-n: {n} forces are given; {what}"))),
    };
    Ok(match kind {
        Kind::Shaker => {
            let force = force(1..=2, "one is needed, or two to go from and to")?;
            let seconds = common
                .seconds
                .ok_or_else(|| Error::input("--seconds is needed for a shaker"))?;
            let levels = [force[0], force[force.len() - 1]];
            Signal::tones(&frequencies()?.values(), levels, seconds, common.seed)
        }
        Kind::StepSine => {
            let levels = force(1..=1000, "one or more levels are needed")?;
            Signal::step_sine(
                &frequencies()?.values(),
                &levels,
                options.dwell_s,
                options.pause_s,
            )
        }
        Kind::Sweep => {
            let range = frequencies()?;
            let mut ends = [range.first(), range.last()];
            if options.backward {
                ends.reverse();
            }
            let span = (ends[1] - ends[0]).abs();
            if span == 0.0 {
                return Err(Error::input(format!(
                    "--frequency-hz {range}: a sweep goes from one frequency to another, as in 1:30:2"
                )));
            }
            Signal::Sweep {
                first_hz: ends[0],
                last_hz: ends[1],
                amplitude_n: force(1..=1, "a sweep has one amplitude")?[0],
                seconds: 60.0 * span / options.hz_per_min,
            }
        }
        Kind::Hammer => Signal::impacts(
            usize::from(options.impacts),
            force(1..=1, "the blows have one peak force, from which they scatter")?[0],
            1e-3 * options.pulse_ms,
            options.spacing_s,
            common.seed,
        ),
        Kind::Porous | Kind::SpeedSweep => {
            return Err(Error::input(
                "a cut drives itself; porous and speed-sweep need --rpm and --depth-mm",
            ));
        }
        Kind::FreeDecay => Signal::Release {
            force_n: force(1..=1, "the pull has one force")?[0],
            pull_s: 2.0,
            seconds: common.seconds.unwrap_or(10.0),
        },
    })
}
