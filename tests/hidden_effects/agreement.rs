//! Compares this test's equations with those of the library's simulation: each effect name means the same in both.

use std::f64::consts::TAU;
use std::path::Path;

use quietcut::case::Case;
use quietcut::recording::Recording;
use quietcut::simulate::effect::Effects;
use quietcut::simulate::rig::{Rig as LibraryRig, Signal};
use quietcut::simulate::{Entry, Recorder, TachometerModel, VirtualCut};
use quietcut::structure::Direction;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::cause::{Cause, EffectKind, OF_OWN_FAMILY, PROCESS, STRUCTURAL};
use super::cut::CutBench;
use super::machine::Machine;
use super::oracle::Lab;
use super::rig::Rig;
use super::sensor::Sensor;

/// Values of the option `--effect` that describe a cause to the library.
fn texts(cause: &Cause, machine: &Machine, rig: &Rig) -> Vec<String> {
    let name = cause.kind.name();
    let values = cause.values(machine, &rig.scale);
    let mut texts: Vec<String> = if cause.kind == EffectKind::SensorOffsetByMode {
        vec![format!("{name}.ratio={:e},{:e}", values[0].1, values[1].1)]
    } else {
        values
            .iter()
            .map(|(key, value)| format!("{name}.{key}={value:e}"))
            .collect()
    };
    if cause.kind.of_sensor() {
        texts.push(format!("{name}.channel={}", rig.sensors[cause.sensor].name()));
        if cause.kind == EffectKind::CrossAxis {
            texts.push(format!("{name}.direction=y"));
        }
    } else if !matches!(cause.kind, EffectKind::ModeCoupling | EffectKind::Drift) {
        texts.push(format!("{name}.direction={}", ["x", "y", "z"][cause.axis]));
    }
    texts
}

#[test]
fn structural_effects_agree_with_the_library() {
    let all = STRUCTURAL.into_iter().chain(OF_OWN_FAMILY);
    for kind in all.chain([EffectKind::SensorOffsetByMode]) {
        let mut compared = 0;
        for seed in 0..40 {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let machine = Machine::draw(&mut random, 1 + seed as usize % 2);
            if compared == 12 || !Cause::possible(kind, &machine) {
                continue;
            }
            let sensors: Vec<Sensor> = machine
                .axes
                .iter()
                .flat_map(|&axis| {
                    [false, true].map(|acceleration| Sensor {
                        axis,
                        acceleration,
                        at_housing: false,
                    })
                })
                .collect();
            let omega = machine.omega[0];
            let amplitude_n = 0.1 * machine.stiffness_along(0) * machine.amplitude_m;
            let band = [0.4 * omega / TAU, 1.6 * omega / TAU];
            let rig = Rig::sweep(&machine, 0, sensors, amplitude_n, band);
            let cause = Cause {
                kind,
                axis: 0,
                sensor: seed as usize % 2,
                shares: kind.draw(&mut random),
            };
            let ours = rig.output(&machine, std::slice::from_ref(&cause)).remove(0);
            let case = Case::parse(Path::new("machine.toml"), &machine.case_text()).unwrap();
            let seconds = rig.samples as f64 / rig.rate_hz;
            let signal = Signal::Sweep {
                first_hz: band[0],
                last_hz: band[1],
                amplitude_n,
                seconds,
            };
            let mut library = LibraryRig::new(Direction::X, signal, rig.rate_hz);
            let texts = texts(&cause, &machine, &rig);
            library.effects = Effects::parse(texts.iter().map(String::as_str)).unwrap();
            let (recording, _) = library
                .record(case.structure().unwrap(), Path::new("record.csv"))
                .unwrap();
            for (sensor, ours) in rig.sensors.iter().zip(&ours) {
                let theirs = &recording.channel(&sensor.name()).unwrap().samples;
                let size = theirs.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
                // Rounding of the duration may drop the last sample, and a jump of the acceleration may fall on either side of a sample:
                // one percent of the samples is not compared.
                let mut apart: Vec<f64> = ours
                    .iter()
                    .zip(theirs)
                    .map(|(a, b)| (a - b).abs() / size)
                    .collect();
                apart.sort_by(f64::total_cmp);
                let most = apart[apart.len() * 99 / 100];
                // The library integrates to 1e-12 m in each of some thousand steps. Along a direction that hardly moves the
                // error is a larger share.
                let moved_m = moved_m(&rig.sensors, &recording, sensor.axis);
                let tolerance = 2e-5 + (1e-9 / machine.amplitude_m).max(3e-11 / moved_m);
                assert!(
                    most < tolerance,
                    "{} seed {seed} {}: {most:.1e} {texts:?}",
                    kind.name(),
                    sensor.name()
                );
            }
            compared += 1;
        }
        assert!(compared >= 3, "{}", kind.name());
    }
}

/// Largest displacement along an axis in a recording.
fn moved_m(sensors: &[Sensor], recording: &Recording, axis: usize) -> f64 {
    let is_of_axis = |sensor: &&Sensor| sensor.axis == axis && !sensor.acceleration;
    let displacement = sensors.iter().find(is_of_axis).unwrap();
    let samples = &recording.channel(&displacement.name()).unwrap().samples;
    samples.iter().fold(0.0_f64, |most, x| most.max(x.abs()))
}

#[test]
fn cutting_effects_agree_with_the_library() {
    for kind in PROCESS {
        let mut compared = 0;
        for seed in 0..8 {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let bench = CutBench::draw(&mut random, true).starting_at_rest();
            if bench.places(kind).is_empty() {
                continue;
            }
            let cause = Cause {
                kind,
                axis: 0,
                sensor: 0,
                shares: kind.draw(&mut random),
            };
            let ours = bench.output(std::slice::from_ref(&cause)).remove(0);
            let case = Case::parse(Path::new("machine.toml"), &bench.case_text()).unwrap();
            let [spindle_rpm, depth_mm] = bench.working_point();
            let cut = VirtualCut {
                entry: Entry::None,
                air_s: 0.0,
                effects: process_effects(&cause, &bench),
                ..VirtualCut::new(spindle_rpm, depth_mm, bench.scale.seconds)
            };
            let recorder = Recorder::Ideal {
                rate_hz: bench.rate_hz,
            };
            let (recording, _) = cut
                .record(&case, recorder, TachometerModel::ONE_MARK, Path::new("cut.csv"))
                .unwrap();
            for (name, ours) in bench.channel_names().iter().zip(&ours) {
                let theirs = &recording.channel(name).unwrap().samples;
                let size = theirs.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
                // The two simulations start from different surfaces. The last third of the record no longer depends on them.
                let late = ours.len() * 2 / 3..theirs.len().min(ours.len());
                let mut apart: Vec<f64> = ours[late.clone()]
                    .iter()
                    .zip(&theirs[late])
                    .map(|(a, b)| (a - b).abs() / size)
                    .collect();
                apart.sort_by(f64::total_cmp);
                // A sample at the instant of an entry may fall on either side of the step: two percent of the samples are not compared.
                let most = apart[apart.len() * 98 / 100];
                assert!(
                    most < 1e-3,
                    "{} seed {seed} {name}: {most:.1e} {cause:?}",
                    kind.name()
                );
            }
            compared += 1;
        }
        assert!(compared >= 1, "{}", kind.name());
    }
}

/// The library's effect for a cause of the cutting process.
fn process_effects(cause: &Cause, bench: &CutBench) -> Effects {
    let name = cause.kind.name();
    if cause.kind == EffectKind::AxialDepthModulation {
        return Effects::parse(["axial-depth-modulation=1"]).unwrap();
    }
    let mut texts: Vec<String> = cause
        .values(&bench.machine, &bench.scale)
        .iter()
        .map(|(key, value)| format!("{name}.{key}={value:e}"))
        .collect();
    if cause.kind == EffectKind::SpeedFluctuation {
        texts.push(format!("{name}.phase_deg={:e}", cause.shares[2].to_degrees()));
    }
    Effects::parse(texts.iter().map(String::as_str)).unwrap()
}
