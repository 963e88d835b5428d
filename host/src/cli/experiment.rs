//! `quietcut simulate --experiment`: a simulated vibration test of the structure.

use std::path::PathBuf;

use clap::ValueEnum;
use serde::Serialize;

use super::channels::Channels;
use super::output_recordings::OutputRecordings;
use super::{Error, Output, Range, non_negative, positive};
use crate::case::Case;
use crate::recording::Quantity;
use crate::simulate::Effects;
use crate::simulate::rig::{MultisineLines, Rig, Signal};
use crate::structure::{Direction, Structure};

/// Options of a simulated vibration test: excitation, force levels, durations.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Test rig")]
pub(super) struct Experiment {
    /// Simulate a vibration test with this excitation instead of a cut.
    #[arg(long, value_name = "KIND")]
    pub(super) experiment: Option<ExperimentKind>,
    /// Direction of the excitation force of a vibration test. Default: the first direction of the structure.
    #[arg(long, value_name = "x|y|z")]
    direction: Option<Direction>,
    /// Frequencies in Hz, first:last:count or first:last: the steps of step-sine, the first and last frequency of a
    /// sweep or a multisine, or the tones of a shaker.
    #[arg(long, value_name = "R", value_parser = Range::positive, allow_negative_numbers = true)]
    frequency_hz: Option<Range>,
    /// Force in N: amplitude of a sine, root mean square of a multisine, peak of an impact, or static force before a free
    /// decay. With commas: the levels of step-sine, or the first and last amplitude of a shaker.
    #[arg(long, value_name = "F,…", value_parser = positive, allow_negative_numbers = true, value_delimiter = ',')]
    force_n: Vec<f64>,
    /// Duration of the excitation at each step of step-sine, in s.
    #[arg(long, value_name = "T", default_value_t = 25.0, value_parser = positive, allow_negative_numbers = true)]
    dwell_s: f64,
    /// Pause without force after each step of step-sine, in s.
    #[arg(long, value_name = "T", default_value_t = 3.0, value_parser = non_negative, allow_negative_numbers = true)]
    pause_s: f64,
    /// Sweep rate in Hz per minute.
    #[arg(long, value_name = "R", default_value_t = 6.0, value_parser = positive, allow_negative_numbers = true)]
    hz_per_min: f64,
    /// Sweep downwards, from the last frequency of --frequency-hz to the first.
    #[arg(long)]
    backward: bool,
    /// Period of a multisine in s; its lines are the multiples of the reciprocal.
    #[arg(long, value_name = "T", value_parser = positive, allow_negative_numbers = true)]
    period_s: Option<f64>,
    /// Lines of a multisine that are excited. Nonlinear distortion shows at the others.
    #[arg(long, value_name = "KIND", value_enum, default_value_t)]
    lines: LineKind,
    /// Number of hammer impacts.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..))]
    impacts: u16,
    /// Duration of the force pulse of one hammer impact, in ms.
    #[arg(long, value_name = "T", default_value_t = 10.0, value_parser = positive, allow_negative_numbers = true)]
    pulse_ms: f64,
    /// Time between impacts, in s.
    #[arg(long, value_name = "T", default_value_t = 10.0, value_parser = positive, allow_negative_numbers = true)]
    spacing_s: f64,
    /// Force drop-out of the shaker at resonance: its force decreases by this value times the velocity, in N s/m.
    #[arg(long, value_name = "C", default_value_t = 0.0, value_parser = non_negative, allow_negative_numbers = true)]
    drop_ns_per_m: f64,
}

/// Kinds of excitation of a simulated vibration test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum ExperimentKind {
    /// Shaker with one or several simultaneous tones, whose force is constant or increases linearly.
    Shaker,
    /// Stepped sine: one frequency after the other at each force level.
    StepSine,
    /// Shaker with a periodic signal of equal lines and random phases, which come from --seed.
    Multisine,
    /// Sine whose frequency changes linearly with time.
    Sweep,
    /// Hammer impacts.
    Hammer,
    /// Free decay after a static force is released.
    FreeDecay,
    /// Cut in porous material, with broad-band cutting force.
    Porous,
    /// Cut at a spindle speed that changes linearly. An identification needs recordings at three or more immersions.
    SpeedSweep,
}

/// Lines of a multisine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum LineKind {
    /// All lines of the band.
    #[default]
    All,
    /// Odd lines: even distortion shows between them.
    Odd,
    /// Odd lines without one of each three: even and odd distortion show between them.
    OddSparse,
}

/// Options of `quietcut simulate` that a simulated vibration test shares with a simulated cut.
pub(super) struct Common<'a> {
    pub(super) seconds: Option<f64>,
    pub(super) sample_rate_hz: Option<f64>,
    pub(super) seed: u64,
    pub(super) out: &'a OutputRecordings,
    pub(super) effects: &'a [String],
    pub(super) channels: &'a Channels,
}

#[derive(Debug, Serialize)]
struct ExperimentOutput {
    recording: PathBuf,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    copies: Vec<PathBuf>,
    kind: crate::recording::TestKind,
    direction: &'static str,
    sample_rate_hz: f64,
    samples: usize,
    seconds: f64,
    largest_displacement_mm: f64,
    steps: u64,
    branch_changes: u64,
}

/// Simulates a vibration test on the structure of the case and writes the recording of the test.
pub(super) fn run(
    case: &Case,
    kind: ExperimentKind,
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
    let (mut recording, statistics) = rig
        .record(structure, &common.out.first)
        .map_err(|error| input(&error))?;
    recording.sidecar.posture = case.posture.recorded();
    common.channels.add_noise(&mut recording, common.seed)?;
    common.out.write(&recording)?;
    let largest = recording
        .channels
        .iter()
        .filter(|channel| channel.quantity == Quantity::Displacement)
        .flat_map(|channel| &channel.samples)
        .fold(0.0_f64, |a, b| a.max(b.abs()));
    let answer = ExperimentOutput {
        recording: common.out.first.clone(),
        copies: common.out.copies.clone(),
        kind: rig.signal.kind(),
        direction: direction.name(),
        sample_rate_hz: recording.sample_rate_hz,
        samples: recording.len(),
        seconds: rig.signal.duration_s(),
        largest_displacement_mm: 1e3 * largest,
        steps: statistics.steps,
        branch_changes: statistics.regime_changes,
    };
    let text = format!(
        "{}: {} samples at {:.1} Hz, force in {}; largest displacement of the tool {:.4} mm",
        answer.recording.display(),
        answer.samples,
        answer.sample_rate_hz,
        answer.direction,
        answer.largest_displacement_mm
    );
    output.answer(&answer, text)
}

impl ExperimentKind {
    /// True if the structure is excited by the cutting force of a milling cut (porous, speed-sweep).
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

/// Default number of periods of a multisine. A choice: two for the transient, and six for the scatter.
const PERIODS: f64 = 8.0;

/// Default sampling rate of a simulated vibration test in Hz: the smallest power of two of at least 20 times the
/// highest excited frequency, so that the eighth harmonic of this frequency lies below the Nyquist frequency. The
/// highest excited frequency is 1/T for hammer impacts of duration T; for other excitation the larger end of
/// `--frequency-hz`, or 30 Hz without this option.
fn default_rate_hz(kind: ExperimentKind, options: &Experiment) -> f64 {
    let highest_hz = match kind {
        ExperimentKind::Hammer => 1e3 / options.pulse_ms,
        _ => options
            .frequency_hz
            .map_or(30.0, |range| range.first().max(range.last())),
    };
    (20.0 * highest_hz).log2().ceil().exp2()
}

fn signal(kind: ExperimentKind, options: &Experiment, common: &Common<'_>) -> Result<Signal, Error> {
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
        ExperimentKind::Shaker => {
            let force = force(1..=2, "one amplitude is needed, or two: the first and the last")?;
            let seconds = common
                .seconds
                .ok_or_else(|| Error::input("--seconds is needed for a shaker"))?;
            let levels = [force[0], force[force.len() - 1]];
            Signal::tones(&frequencies()?.values(), levels, seconds, common.seed)
        }
        ExperimentKind::Multisine => {
            let range = frequencies()?;
            let period_s = options
                .period_s
                .ok_or_else(|| Error::input("--period-s is needed for a multisine, such as 4"))?;
            let rms_n = force(1..=1, "a multisine has one root mean square")?[0];
            let lines = match options.lines {
                LineKind::All => MultisineLines::All,
                LineKind::Odd => MultisineLines::Odd,
                LineKind::OddSparse => MultisineLines::OddSparse,
            };
            let seconds = common.seconds.unwrap_or(PERIODS * period_s);
            let ends = [range.first().min(range.last()), range.first().max(range.last())];
            let signal = Signal::multisine(ends, period_s, lines, rms_n, seconds, common.seed);
            if matches!(&signal, Signal::Tones { tones, .. } if tones.is_empty()) {
                return Err(Error::input(format!(
                    "--frequency-hz {range}: no line of a period of {period_s} s lies in this band; take a longer period"
                )));
            }
            signal
        }
        ExperimentKind::StepSine => {
            let levels = force(1..=1000, "one or more levels are needed")?;
            Signal::step_sine(
                &frequencies()?.values(),
                &levels,
                options.dwell_s,
                options.pause_s,
            )
        }
        ExperimentKind::Sweep => {
            let range = frequencies()?;
            let mut ends = [range.first(), range.last()];
            if options.backward {
                ends.reverse();
            }
            let span = (ends[1] - ends[0]).abs();
            if span == 0.0 {
                return Err(Error::input(format!(
                    "--frequency-hz {range}: a sweep needs two different frequencies, such as 1:30:2"
                )));
            }
            Signal::Sweep {
                first_hz: ends[0],
                last_hz: ends[1],
                amplitude_n: force(1..=1, "a sweep has one amplitude")?[0],
                seconds: 60.0 * span / options.hz_per_min,
            }
        }
        ExperimentKind::Hammer => Signal::impacts(
            usize::from(options.impacts),
            force(1..=1, "hammer impacts scatter about one peak force")?[0],
            1e-3 * options.pulse_ms,
            options.spacing_s,
            common.seed,
        ),
        ExperimentKind::Porous | ExperimentKind::SpeedSweep => {
            return Err(Error::input(
                "porous and speed-sweep are cuts; they need --rpm and --depth-mm",
            ));
        }
        ExperimentKind::FreeDecay => Signal::Release {
            force_n: force(1..=1, "a free decay has one static force")?[0],
            pull_s: 2.0,
            seconds: common.seconds.unwrap_or(10.0),
        },
    })
}
