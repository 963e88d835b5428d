//! Tests that can be proposed as the next experiment, and their simulated readings.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use super::bench::Bench;
use super::reading::{SensorOf, Sensors, SimulatedReading};
use crate::conclusion::answer::NextTest;
use crate::criteria::LARGEST_PROPOSED_MOTION;
use quietcut_model::CuttingLoad;
use quietcut_model::case::Case;
use quietcut_model::effects::{Class, EffectName};
use quietcut_model::milling::Cut;
use quietcut_model::structure::Direction;
use quietcut_recording::{Quantity, Recording};
use quietcut_simulate::rig::{Impact, Rig, Signal, Step};
use quietcut_simulate::{Effects, Entry, Recorder, TachometerModel, VirtualCut};

/// Smallest peak force of a proposed impact, N.
const LEAST_IMPACT_N: f64 = 1.0;
/// Excitation of a proposed test: a force on the structure, or a cut.
#[derive(Clone, Debug)]
pub(super) enum Excitation {
    /// A force on the structure at standstill.
    Rig { direction: Direction, signal: Signal },
    /// A cut. Its stability is not checked, but it is refused if the tool moves much farther than in the records.
    Cut {
        rpm: f64,
        depth_mm: f64,
        feed_per_tooth_mm: f64,
        seconds: f64,
    },
}

/// A test that may be proposed: its excitation, its sample rate and its effort.
#[derive(Clone, Debug)]
pub(super) struct Experiment {
    pub(super) excitation: Excitation,
    rate_hz: f64,
    /// Effort of the test relative to others, without that of additional sensors. Of the tests with a set of sensors
    /// that separate the candidate models, the one with the least sum of both efforts is proposed.
    pub(super) effort: f64,
}

/// All tests that can be proposed: of the structure along each of its directions, and cuts if one was recorded whose
/// sidecar gives speed and depth.
pub(super) fn experiments(bench: &Bench<'_>) -> Vec<Experiment> {
    let mut all = Vec::new();
    for direction in &bench.baseline.structure.directions {
        all.extend(of_structure(bench, *direction));
    }
    all.extend(of_cuts(bench));
    all
}

/// Proposed tests of the structure along a direction: an impact, sweeps at three levels, a longer sweep, and a step
/// sine at three levels at the lowest natural frequency.
fn of_structure(bench: &Bench<'_>, direction: Direction) -> Vec<Experiment> {
    let [lowest_hz, highest_hz] = bench.modes_hz;
    let experiment = |signal: Signal, effort: f64| Experiment {
        excitation: Excitation::Rig { direction, signal },
        rate_hz: bench.rate_hz,
        effort,
    };
    let sweep = |level: f64, longer: f64| Signal::Sweep {
        first_hz: 0.5 * lowest_hz,
        last_hz: 1.5 * highest_hz,
        amplitude_n: level * bench.force_n,
        seconds: longer * bench.seconds,
    };
    let levels = [1.0 / 3.0, 1.0, 3.0].map(|level| Step {
        frequency_hz: lowest_hz,
        amplitude_n: level * bench.force_n,
    });
    let step_sine = Signal::StepSine {
        steps: levels.to_vec(),
        dwell_s: bench.seconds / 8.0,
        pause_s: bench.seconds / 8.0,
    };
    let mut all = vec![
        experiment(sweep(1.0, 1.0), 1.0),
        experiment(sweep(1.0 / 3.0, 1.0), 1.1),
        experiment(step_sine, 1.2),
        experiment(sweep(3.0, 1.0), 1.3),
        experiment(sweep(1.0, 4.0), 1.5),
    ];
    // The spectrum of a half-sine pulse has its first zero at the frequency 1.5/`pulse_s`, twice the highest natural
    // frequency. The impulse is chosen so that ω·impulse/k, with the lowest natural frequency ω and the static
    // stiffness k, is the largest displacement of the tool in the records, unless its peak is below `LEAST_IMPACT_N`.
    let pulse_s = 0.75 / highest_hz;
    let impulse_ns = bench.largest_m / (TAU * lowest_hz * bench.static_compliance());
    let peak_n = (impulse_ns / (2.0 / PI * pulse_s)).max(LEAST_IMPACT_N);
    if peak_n.is_finite() {
        let impact = Impact {
            start_s: 0.05 * bench.seconds,
            peak_n,
            pulse_s,
        };
        let signal = Signal::Impacts {
            impacts: vec![impact],
            seconds: bench.seconds,
        };
        all.push(experiment(signal, 0.9));
    }
    all
}

/// Proposed cuts: the recorded cut again, at another spindle speed, axial depth or feed per tooth, and over a longer
/// time. None without a recorded cut, and none at a speed outside the limits of the case.
fn of_cuts(bench: &Bench<'_>) -> Vec<Experiment> {
    let Some(so_far) = &bench.cut else {
        return Vec::new();
    };
    // Factors on spindle speed, axial depth and feed per tooth of the recorded cut, and on the standard duration of a
    // test.
    let factors = [
        (1.0, 1.0, 1.0, 1.0),
        (0.8, 1.0, 1.0, 1.0),
        (1.25, 1.0, 1.0, 1.0),
        (1.0, 0.5, 1.0, 1.0),
        (1.0, 1.5, 1.0, 1.0),
        (1.0, 1.0, 0.5, 1.0),
        (1.0, 1.0, 2.0, 1.0),
        (1.0, 1.0, 1.0, 4.0),
    ];
    // Speeds outside the section `[limits]` of the case are not proposed; without the section every speed counts as
    // possible.
    let is_possible = |rpm: f64| bench.case.limits.as_ref().is_none_or(|limits| limits.allows(rpm));
    factors
        .into_iter()
        .filter(|(by_rpm, ..)| is_possible(by_rpm * so_far.rpm))
        .filter(|factors| {
            let deeper = factors.0 != 1.0 || factors.1 > 1.0 || factors.2 > 1.0;
            !deeper || can_be_driven(bench, *factors)
        })
        .map(|(by_rpm, by_depth, by_feed, longer)| Experiment {
            excitation: Excitation::Cut {
                rpm: by_rpm * so_far.rpm,
                depth_mm: by_depth * so_far.depth_mm,
                feed_per_tooth_mm: by_feed * so_far.cut.feed_per_tooth_mm,
                seconds: longer * bench.seconds,
            },
            rate_hz: bench.rate_hz,
            effort: if longer > 1.0 { 1.0 } else { 0.8 },
        })
        .collect()
}

/// True unless a cut with these factors on speed, depth and feed of the recorded cut exceeds the power or torque of the
/// spindle; without the load of the cut, as of a tool without diameter, every cut counts as possible.
fn can_be_driven(bench: &Bench<'_>, (by_rpm, by_depth, by_feed, _): (f64, f64, f64, f64)) -> bool {
    let Some(so_far) = &bench.cut else {
        return true;
    };
    let mut case = bench.case.clone();
    case.cut = Some(Cut {
        feed_per_tooth_mm: by_feed * so_far.cut.feed_per_tooth_mm,
        ..so_far.cut
    });
    let Ok(Some(load)) = CuttingLoad::of_limited(&case) else {
        return true;
    };
    let driven = load.driven_depth(by_rpm * so_far.rpm).ok().flatten();
    driven.is_none_or(|driven| by_depth * so_far.depth_mm <= driven.depth_mm)
}

impl Experiment {
    /// True if the test is a cut at another spindle speed than that of the recorded cut.
    pub(super) fn changes_speed(&self, bench: &Bench<'_>) -> bool {
        let recorded_rpm = bench.cut.as_ref().map(|so_far| so_far.rpm);
        matches!(self.excitation, Excitation::Cut { rpm, .. } if Some(rpm) != recorded_rpm)
    }

    /// The sets of sensors with which this test can be made.
    pub(super) fn sensors(&self) -> Vec<Sensors> {
        match self.excitation {
            Excitation::Rig { .. } => vec![Sensors::Mounted, Sensors::Second],
            Excitation::Cut { .. } => vec![Sensors::Mounted, Sensors::Second, Sensors::Force],
        }
    }

    /// Simulated readings of all sensors in this test if `case` is the true machine; of a cut without its transient.
    ///
    /// # Errors
    /// The experiment cannot be simulated, the simulation lacks a channel of the records or diverges, or the tool moves
    /// too far in a cut; the error is a sentence.
    pub(super) fn readings(&self, bench: &Bench<'_>, case: &Case) -> Result<Vec<SimulatedReading>, String> {
        let mounted = self.recording(bench, case)?;
        // A second sensor next to a mounted one is taken as free of errors, so the sensor extensions of the case are
        // removed for it.
        let mut faultless = case.clone();
        faultless.extensions.retain(|name, _| {
            name.parse()
                .map(EffectName::spec)
                .is_ok_and(|spec| spec.class != Class::Sensor)
        });
        let second = self.recording(bench, &faultless)?;
        let mut all = Vec::new();
        for (recording, of) in [(&mounted, SensorOf::Mounted), (&second, SensorOf::Second)] {
            for measured_channel in &bench.channels {
                let channel = recording
                    .channels
                    .iter()
                    .find(|channel| channel.name == measured_channel.name)
                    .ok_or_else(|| format!("the simulation has no channel {}", measured_channel.name))?;
                all.push((measured_channel.name.clone(), of, channel.samples.clone()));
            }
        }
        if let Excitation::Cut { .. } = self.excitation {
            let (of, recording) = if bench.has_force {
                (SensorOf::Mounted, &mounted)
            } else {
                (SensorOf::Force, &second)
            };
            let forces = recording
                .channels
                .iter()
                .filter(|channel| channel.quantity == Quantity::Force);
            all.extend(forces.map(|channel| (channel.name.clone(), of, channel.samples.clone())));
        }
        let from = match self.excitation {
            Excitation::Rig { .. } => 0,
            Excitation::Cut { .. } => (bench.settled_s() * self.rate_hz) as usize,
        };
        let whole = all
            .iter()
            .all(|(.., samples)| samples.iter().all(|value| value.is_finite()));
        if !whole {
            return Err("the simulation diverges".into());
        }
        Ok(all
            .into_iter()
            .map(|(name, of, mut samples)| {
                samples.drain(..from.min(samples.len()));
                SimulatedReading { name, of, samples }
            })
            .collect())
    }

    fn recording(&self, bench: &Bench<'_>, case: &Case) -> Result<Recording, String> {
        match &self.excitation {
            Excitation::Rig { direction, signal } => {
                let mut rig = Rig::new(*direction, signal.clone(), self.rate_hz);
                rig.measured = bench.quantities();
                rig.effects = Effects::of_case(case).map_err(|error| error.to_string())?;
                let structure = case.structure().map_err(|error| error.to_string())?;
                let recorded = rig.record(structure, Path::new("next-test"));
                Ok(recorded.map_err(|error| error.to_string())?.0)
            }
            Excitation::Cut {
                rpm,
                depth_mm,
                feed_per_tooth_mm,
                seconds,
            } => {
                let mut case = case.clone();
                case.cut = bench.cut.as_ref().map(|so_far| Cut {
                    feed_per_tooth_mm: *feed_per_tooth_mm,
                    ..so_far.cut
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
                    .map_err(|error| error.to_string())?;
                let most = recording
                    .channels
                    .iter()
                    .filter(|channel| channel.quantity == Quantity::Displacement)
                    .flat_map(|channel| &channel.samples)
                    .fold(0.0, |most: f64, value| value.abs().max(most));
                if most <= LARGEST_PROPOSED_MOTION * bench.largest_m {
                    Ok(recording)
                } else {
                    Err(format!(
                        "in the cut the tool would move {most:.1e} m, far more than in the records"
                    ))
                }
            }
        }
    }

    /// The proposed test as the entry `next_test` of the answer.
    pub(super) fn described(&self, sensors: Sensors, distance: f64, why: String) -> NextTest {
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
            distance,
            why,
        };
        match &self.excitation {
            Excitation::Rig { direction, signal } => {
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
                    Signal::Impacts { impacts, .. } => (
                        "hammer",
                        impacts.iter().map(|impact| impact.peak_n).collect(),
                        None,
                    ),
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
            Excitation::Cut {
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
