//! Experiments that a machine could make, and what their sensors would say.

use std::f64::consts::TAU;
use std::path::Path;

use nalgebra::Matrix3;
use num_complex::Complex64;

use super::separation::Difference;
use crate::case::Case;
use crate::diagnose::answer::NextTest;
use crate::diagnose::noise::rms;
use crate::diagnose::scene::Baseline;
use crate::diagnose::views::View;
use crate::milling::Cut;
use crate::recording::{Kind, Quantity, Recording};
use crate::simulate::rig::{Impact, Rig, Signal, Step};
use crate::simulate::{Effects, Entry, Recorder, TachometerModel, VirtualCut};
use crate::structure::Direction;

/// Most samples that are simulated of one test.
const SAMPLES: f64 = 8192.0;
/// Periods of the slowest mode that a test of the structure lasts where no record says how long they are.
const PERIODS: f64 = 60.0;
/// Samples per period of the fastest mode.
const SAMPLES_PER_PERIOD: f64 = 24.0;
/// Noise that is assumed of a sensor that has not been heard yet, as a share of what it says.
const NOISE: f64 = 0.01;
/// A cut whose motion is so many times that of the records is none that anyone would try.
const TOO_LARGE: f64 = 10.0;
/// The smallest blow of a hammer, N.
const LEAST_BLOW_N: f64 = 1.0;
/// Longest time constants of the structure after which a cut has settled: records are of tools in full cut.
const SETTLED: f64 = 12.0;
/// The longest that is waited for that, in lengths of the record.
const WAITED: f64 = 4.0;

/// Which sensors are heard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sensors {
    /// Those that made the records.
    Mounted,
    /// Those, and beside each of them another at the tool.
    Second,
    /// Those, and a dynamometer.
    Force,
}

/// Which sensor a reading is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Of {
    Mounted,
    Second,
    Force,
}

/// What one sensor says.
pub(super) struct Reading {
    name: String,
    of: Of,
    pub(super) samples: Vec<f64>,
}

/// Something to do, without what is measured.
#[derive(Clone, Debug)]
pub(super) enum Doing {
    /// A force on the structure at standstill.
    Rig { direction: Direction, signal: Signal },
    /// A stable cut.
    Cut {
        rpm: f64,
        depth_mm: f64,
        feed_per_tooth_mm: f64,
        seconds: f64,
    },
}

/// An experiment.
#[derive(Clone, Debug)]
pub(super) struct Experiment {
    pub(super) doing: Doing,
    rate_hz: f64,
    /// How much more work it is than another.
    pub(super) effort: f64,
}

/// A machine and its sensors, as the records show them.
pub(super) struct Bench<'a> {
    pub(super) case: &'a Case,
    baseline: Baseline<'a>,
    /// Of every channel of motion that was heard: name, quantity, deviation of its noise.
    channels: Vec<(String, Quantity, f64)>,
    has_force: bool,
    /// Peak force of the tests of the structure, N; what moves it as far as the records where none was measured.
    force_n: f64,
    largest_m: f64,
    seconds: f64,
    rate_hz: f64,
    /// The first recorded cut: speed, depth and the cut, as the file says it beside the case.
    cut: Option<(f64, f64, Cut)>,
}

impl Sensors {
    pub(super) fn effort(self) -> f64 {
        match self {
            Self::Mounted => 0.0,
            Self::Second => 1.0,
            Self::Force => 1.5,
        }
    }

    fn described(self) -> Option<&'static str> {
        match self {
            Self::Mounted => None,
            Self::Second => Some("a second sensor at the tool beside each that is mounted"),
            Self::Force => Some("the cutting force, with a dynamometer"),
        }
    }
}

impl Reading {
    pub(super) fn is_heard(&self, sensors: Sensors) -> bool {
        match self.of {
            Of::Mounted => true,
            Of::Second => sensors == Sensors::Second,
            Of::Force => sensors == Sensors::Force,
        }
    }

    pub(super) fn described(&self) -> String {
        match self.of {
            Of::Second => format!("a second sensor of {}", self.name),
            Of::Mounted | Of::Force => self.name.clone(),
        }
    }
}

fn motion(quantity: Quantity) -> bool {
    matches!(
        quantity,
        Quantity::Displacement | Quantity::Velocity | Quantity::Acceleration
    )
}

impl<'a> Bench<'a> {
    /// `None` where the machine cannot be simulated, or does not vibrate.
    pub(super) fn new(case: &'a Case, recordings: &[Recording], views: &[View]) -> Option<Self> {
        let baseline = Baseline::new(case).ok()?;
        let lowest_hz = baseline.lowest_hz()?;
        let mut channels: Vec<(String, Quantity, f64)> = Vec::new();
        for channel in recordings.iter().flat_map(|recording| &recording.channels) {
            let known = channels.iter().any(|(name, ..)| *name == channel.name);
            if motion(channel.quantity) && !known && baseline.pickup(&channel.name).is_some() {
                channels.push((
                    channel.name.clone(),
                    channel.quantity,
                    deviation(views, &channel.name),
                ));
            }
        }
        let highest_hz = highest_hz(&baseline)?;
        let rate_hz = (SAMPLES_PER_PERIOD * highest_hz).max(2.0 * lowest_hz);
        let longest_s = recordings
            .iter()
            .map(|recording| recording.len() as f64 / recording.sample_rate_hz)
            .fold(0.0, f64::max);
        let seconds = longest_s.clamp(PERIODS / 3.0 / lowest_hz, PERIODS / lowest_hz);
        let seconds = seconds.min(SAMPLES / rate_hz);
        let peak = |samples: &[f64]| samples.iter().fold(0.0, |most: f64, value| value.abs().max(most));
        let is_cut = |recording: &&Recording| recording.sidecar.kind == Some(Kind::Cutting);
        let of_rigs = recordings.iter().filter(|recording| !is_cut(recording));
        let forces = of_rigs.flat_map(|recording| recording.channels.iter());
        let measured_n = forces
            .filter(|channel| channel.quantity == Quantity::Force)
            .map(|channel| peak(&channel.samples))
            .fold(0.0, f64::max);
        let largest_m = recordings
            .iter()
            .flat_map(|recording| &recording.channels)
            .filter_map(|channel| {
                let derivatives = crate::diagnose::scene::derivatives(channel.quantity);
                motion(channel.quantity).then(|| peak(&channel.samples) / (TAU * lowest_hz).powi(derivatives))
            })
            .fold(0.0, f64::max);
        let compliance = compliance(&baseline, lowest_hz);
        let force_n = if measured_n > 0.0 {
            measured_n
        } else {
            largest_m / compliance
        };
        let cut = recordings.iter().find(is_cut).and_then(|recording| {
            let (said, believed) = (recording.sidecar.cut?, case.cut().ok()?);
            let cut = Cut {
                start_deg: said.start_deg.unwrap_or(believed.start_deg),
                exit_deg: said.exit_deg.unwrap_or(believed.exit_deg),
                feed_per_tooth_mm: said.feed_per_tooth_mm.unwrap_or(believed.feed_per_tooth_mm),
                feed_direction_deg: believed.feed_direction_deg,
            };
            Some((said.spindle_rpm?, said.axial_depth_mm?, cut))
        });
        let has_force = recordings
            .iter()
            .filter(is_cut)
            .flat_map(|recording| &recording.channels)
            .any(|channel| channel.quantity == Quantity::Force);
        let usable = force_n.is_finite() && force_n > 0.0 && !channels.is_empty();
        usable.then_some(Self {
            case,
            baseline,
            channels,
            has_force,
            force_n,
            largest_m,
            seconds,
            rate_hz,
            cut,
        })
    }

    /// Everything that is thought of, with what each costs.
    pub(super) fn experiments(&self) -> Vec<Experiment> {
        let mut all = Vec::new();
        for direction in &self.baseline.structure.directions {
            all.extend(self.of_structure(*direction));
        }
        all.extend(self.of_cuts());
        all
    }

    /// Blows, a sweep at three levels and over a longer time, and three levels at the resonances.
    fn of_structure(&self, direction: Direction) -> Vec<Experiment> {
        let (Some(lowest_hz), Some(highest_hz)) = (self.baseline.lowest_hz(), highest_hz(&self.baseline))
        else {
            return Vec::new();
        };
        let experiment = |signal: Signal, effort: f64| Experiment {
            doing: Doing::Rig { direction, signal },
            rate_hz: self.rate_hz,
            effort,
        };
        let sweep = |level: f64, longer: f64| Signal::Sweep {
            first_hz: 0.5 * lowest_hz,
            last_hz: 1.5 * highest_hz,
            amplitude_n: level * self.force_n,
            seconds: longer * self.seconds,
        };
        let dwell_s = self.seconds / 8.0;
        let levels = [1.0 / 3.0, 1.0, 3.0].map(|level| Step {
            frequency_hz: lowest_hz,
            amplitude_n: level * self.force_n,
        });
        let step_sine = Signal::StepSine {
            steps: levels.to_vec(),
            dwell_s,
            pause_s: dwell_s,
        };
        let mut all = vec![
            experiment(sweep(1.0, 1.0), 1.0),
            experiment(sweep(1.0 / 3.0, 1.0), 1.1),
            experiment(step_sine, 1.2),
            experiment(sweep(3.0, 1.0), 1.3),
            experiment(sweep(1.0, 4.0), 1.5),
        ];
        // Up to the highest mode a half sine of this length excites without a gap: its first zero is at 1.5/pulse. It moves the
        // structure as far as the records have it.
        let pulse_s = 0.75 / highest_hz;
        let impulse_ns = self.largest_m / (TAU * lowest_hz * compliance(&self.baseline, 0.0));
        let peak_n = (impulse_ns / (2.0 / std::f64::consts::PI * pulse_s)).max(LEAST_BLOW_N);
        if peak_n.is_finite() {
            let impacts = vec![Impact {
                start_s: 0.05 * self.seconds,
                peak_n,
                pulse_s,
            }];
            let blow = Signal::Impacts {
                impacts,
                seconds: self.seconds,
            };
            all.push(experiment(blow, 0.9));
        }
        all
    }

    /// Cuts at other speeds, depths and feeds than the recorded one, and that one for longer.
    fn of_cuts(&self) -> Vec<Experiment> {
        let Some((rpm, depth_mm, cut)) = &self.cut else {
            return Vec::new();
        };
        let feed = cut.feed_per_tooth_mm;
        let some = [
            (1.0, 1.0, 1.0, 1.0),
            (0.8, 1.0, 1.0, 1.0),
            (1.25, 1.0, 1.0, 1.0),
            (1.0, 0.5, 1.0, 1.0),
            (1.0, 1.5, 1.0, 1.0),
            (1.0, 1.0, 0.5, 1.0),
            (1.0, 1.0, 2.0, 1.0),
            (1.0, 1.0, 1.0, 4.0),
        ];
        some.into_iter()
            .map(|(by_rpm, by_depth, by_feed, longer)| Experiment {
                doing: Doing::Cut {
                    rpm: by_rpm * rpm,
                    depth_mm: by_depth * depth_mm,
                    feed_per_tooth_mm: by_feed * feed,
                    seconds: longer * self.seconds,
                },
                rate_hz: self.rate_hz,
                effort: if longer > 1.0 { 1.0 } else { 0.8 },
            })
            .collect()
    }

    /// The noise of each reading.
    pub(super) fn deviations(&self, readings: &[Reading]) -> Vec<f64> {
        let of = |reading: &Reading| {
            let heard = self.channels.iter().find(|(name, ..)| *name == reading.name);
            let known = heard
                .map(|(.., deviation)| *deviation)
                .filter(|deviation| *deviation > 0.0);
            known.unwrap_or_else(|| (NOISE * rms(&reading.samples)).max(f64::MIN_POSITIVE))
        };
        readings.iter().map(of).collect()
    }

    /// How long a cut takes until nothing is left of its beginning, s.
    fn settled_s(&self) -> f64 {
        (SETTLED * self.baseline.slowest_decay_s()).min(WAITED * self.seconds)
    }

    fn quantities(&self) -> Vec<Quantity> {
        let mut all: Vec<Quantity> = Vec::new();
        for (_, quantity, _) in &self.channels {
            if !all.contains(quantity) {
                all.push(*quantity);
            }
        }
        all
    }
}

impl Experiment {
    /// The sensors with which it can be made.
    pub(super) fn sensors(&self) -> Vec<Sensors> {
        match self.doing {
            Doing::Rig { .. } => vec![Sensors::Mounted, Sensors::Second],
            Doing::Cut { .. } => vec![Sensors::Mounted, Sensors::Second, Sensors::Force],
        }
    }

    /// What all sensors say of it, while the machine is `case`; `None` where that cannot be simulated, or moves too far.
    pub(super) fn readings(&self, bench: &Bench<'_>, case: &Case) -> Option<Vec<Reading>> {
        let mounted = self.recording(bench, case)?;
        // A sensor that is put beside the mounted ones has none of their faults.
        let mut faultless = case.clone();
        faultless
            .extensions
            .retain(|name, _| !name.starts_with("sensor-") && name != "cross-axis");
        let second = self.recording(bench, &faultless)?;
        let mut all = Vec::new();
        for (recording, of) in [(&mounted, Of::Mounted), (&second, Of::Second)] {
            for (name, ..) in &bench.channels {
                let channel = recording.channels.iter().find(|channel| channel.name == *name)?;
                all.push((name.clone(), of, channel.samples.clone()));
            }
        }
        if let Doing::Cut { .. } = self.doing {
            let of = if bench.has_force { Of::Mounted } else { Of::Force };
            let forces = second
                .channels
                .iter()
                .filter(|channel| channel.quantity == Quantity::Force);
            all.extend(forces.map(|channel| (channel.name.clone(), of, channel.samples.clone())));
        }
        let from = match self.doing {
            Doing::Rig { .. } => 0,
            Doing::Cut { .. } => (bench.settled_s() * self.rate_hz) as usize,
        };
        let whole = all
            .iter()
            .all(|(.., samples)| samples.iter().all(|value| value.is_finite()));
        whole.then(|| {
            all.into_iter()
                .map(|(name, of, mut samples)| {
                    samples.drain(..from.min(samples.len()));
                    Reading { name, of, samples }
                })
                .collect()
        })
    }

    fn recording(&self, bench: &Bench<'_>, case: &Case) -> Option<Recording> {
        match &self.doing {
            Doing::Rig { direction, signal } => {
                let mut rig = Rig::new(*direction, signal.clone(), self.rate_hz);
                rig.measured = bench.quantities();
                rig.effects = Effects::of_case(case).ok()?;
                Some(rig.record(case.structure().ok()?, Path::new("next-test")).ok()?.0)
            }
            Doing::Cut {
                rpm,
                depth_mm,
                feed_per_tooth_mm,
                seconds,
            } => {
                let mut case = case.clone();
                case.cut = bench.cut.as_ref().map(|(.., cut)| Cut {
                    feed_per_tooth_mm: *feed_per_tooth_mm,
                    ..*cut
                });
                let mut measured = bench.quantities();
                measured.push(Quantity::Force);
                measured.push(Quantity::Displacement);
                measured.dedup();
                let cut = VirtualCut {
                    entry: Entry::None,
                    air_s: 0.0,
                    measured,
                    ..VirtualCut::new(*rpm, *depth_mm, *seconds + bench.settled_s())
                };
                let recorder = Recorder::Ideal {
                    rate_hz: self.rate_hz,
                };
                let tachometer = TachometerModel {
                    jitter_s: 0.0,
                    ..TachometerModel::ONE_MARK
                };
                let (recording, _) = cut
                    .record(&case, recorder, tachometer, Path::new("next-test"))
                    .ok()?;
                let most = recording
                    .channels
                    .iter()
                    .filter(|channel| channel.quantity == Quantity::Displacement)
                    .flat_map(|channel| &channel.samples)
                    .fold(0.0, |most: f64, value| value.abs().max(most));
                (most <= TOO_LARGE * bench.largest_m).then_some(recording)
            }
        }
    }

    /// As the answer has it.
    pub(super) fn described(&self, sensors: Sensors, least: &Difference, why: String) -> NextTest {
        let plain = NextTest {
            kind: "",
            direction: None,
            force_n: Vec::new(),
            band_hz: None,
            spindle_rpm: None,
            axial_depth_mm: None,
            feed_per_tooth_mm: None,
            seconds: 0.0,
            measure: sensors.described(),
            distance: least.squared.sqrt(),
            why,
        };
        match &self.doing {
            Doing::Rig { direction, signal } => {
                let (kind, force_n, band_hz) = match signal {
                    Signal::Sweep {
                        first_hz,
                        last_hz,
                        amplitude_n,
                        ..
                    } => ("sweep", vec![*amplitude_n], Some([*first_hz, *last_hz])),
                    Signal::StepSine { steps, .. } => (
                        "step-sine",
                        steps.iter().map(|step| step.amplitude_n).collect(),
                        steps.first().map(|step| [step.frequency_hz; 2]),
                    ),
                    Signal::Impacts { impacts, .. } => {
                        ("hammer", impacts.iter().map(|blow| blow.peak_n).collect(), None)
                    }
                    Signal::Tones { .. } => ("shaker", Vec::new(), None),
                    Signal::Release { force_n, .. } => ("free-decay", vec![*force_n], None),
                };
                NextTest {
                    kind,
                    direction: Some(direction.name()),
                    force_n,
                    band_hz,
                    seconds: signal.duration_s(),
                    ..plain
                }
            }
            Doing::Cut {
                rpm,
                depth_mm,
                feed_per_tooth_mm,
                seconds,
            } => NextTest {
                kind: "cutting",
                spindle_rpm: Some(*rpm),
                axial_depth_mm: Some(*depth_mm),
                feed_per_tooth_mm: Some(*feed_per_tooth_mm),
                seconds: *seconds,
                ..plain
            },
        }
    }
}

/// The noise of a channel, the mean over the records; 0 where it is not known.
fn deviation(views: &[View], name: &str) -> f64 {
    let known: Vec<f64> = views
        .iter()
        .filter(|view| view.channel == name)
        .map(|view| view.deviation)
        .collect();
    rms(&known)
}

fn highest_hz(baseline: &Baseline<'_>) -> Option<f64> {
    let poles = baseline.first_order.poles();
    let modes = poles.iter().filter(|pole| pole.im > 0.0);
    modes.map(|pole| pole.norm() / TAU).max_by(f64::total_cmp)
}

/// The largest compliance along an axis at a frequency, m/N.
fn compliance(baseline: &Baseline<'_>, frequency_hz: f64) -> f64 {
    let receptance: Matrix3<Complex64> = baseline.receptance.at(TAU * frequency_hz);
    let along = baseline.axes.iter().map(|axis| receptance[(*axis, *axis)].norm());
    along.fold(0.0, f64::max)
}
