//! Checks the test oracle with causes that are exactly equivalent, or exactly invisible, by their equations.

use std::collections::BTreeSet;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::cause::{Cause, EffectKind};
use super::cut::{CutBench, EVERY_FORCE, EVERY_SENSOR};
use super::machine::Machine;
use super::oracle::{Lab, Oracle, Verdict};
use super::rig::{Bench, Rig, Test};

/// Noise of one percent of each sensor's reading. In a cut, the noise of the spindle angle follows.
fn percent(lab: &dyn Lab, angle_sigma: Option<f64>) -> Vec<f64> {
    let plain = lab.output(&[]);
    let sensors = plain[0].len() - usize::from(angle_sigma.is_some());
    let of = |sensor: usize| {
        let values: Vec<f64> = plain.iter().flat_map(|run| run[sensor].iter().copied()).collect();
        0.01 * (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
    };
    (0..sensors).map(of).chain(angle_sigma).collect()
}

fn verdict(lab: &dyn Lab, sigma: &[f64], hidden: &Cause) -> Verdict {
    Oracle::new(lab, sigma).verdict(hidden, &mut ChaCha8Rng::seed_from_u64(1))
}

fn gain(sensor: usize) -> Cause {
    Cause {
        kind: EffectKind::SensorGain,
        axis: 0,
        sensor,
        shares: vec![0.8],
    }
}

/// The first drawn machine with one direction, given by matrices, and with one sensor.
fn single(test: Test) -> Bench {
    for seed in 0.. {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let machine = Machine::draw(&mut random, 1);
        let rig = Rig::draw(&mut random, test, &machine);
        if !machine.modal && rig.sensors.len() == 1 {
            return Bench { machine, rig };
        }
    }
    unreachable!("half of all machines have one mode and one sensor")
}

#[test]
fn a_gain_of_the_only_channel_is_equivalent_to_one_factor() {
    let bench = single(Test::Shaker);
    let sigma = percent(&bench, None);
    let expected = BTreeSet::from(["sensor-gain", "mass", "stiffness", "damping"]);
    assert_eq!(verdict(&bench, &sigma, &gain(0)), Verdict::Equivalent(expected));
}

#[test]
fn a_gain_is_invisible_in_the_decay_of_a_linear_machine() {
    // The initial state is unknown: a larger one is equivalent to a gain.
    let bench = single(Test::FreeDecay);
    let sigma = percent(&bench, None);
    assert_eq!(verdict(&bench, &sigma, &gain(0)), Verdict::Invisible);
}

#[test]
fn gains_of_two_sensors_are_equivalent_in_a_free_decay() {
    let (mut tried, mut seed) = (0, 0);
    while tried < 2 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        seed += 1;
        let machine = Machine::draw(&mut random, 1);
        let rig = Rig::draw(&mut random, Test::FreeDecay, &machine);
        if rig.sensors.len() != 2 {
            continue;
        }
        tried += 1;
        let bench = Bench { machine, rig };
        let sigma = percent(&bench, None);
        let expected = BTreeSet::from(["sensor-gain"]);
        assert_eq!(verdict(&bench, &sigma, &gain(0)), Verdict::Equivalent(expected));
    }
}

#[test]
fn a_gain_of_the_only_channel_is_equivalent_to_one_factor_on_modes() {
    for seed in 0.. {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let machine = Machine::draw(&mut random, 1);
        let rig = Rig::draw(&mut random, Test::Shaker, &machine);
        if !machine.modal || rig.sensors.len() != 1 || rig.sensors[0].at_housing {
            continue;
        }
        let bench = Bench { machine, rig };
        let sigma = percent(&bench, None);
        let expected = BTreeSet::from(["sensor-gain", "mass", "stiffness", "damping"]);
        assert_eq!(verdict(&bench, &sigma, &gain(0)), Verdict::Equivalent(expected));
        return;
    }
}

#[test]
fn a_common_gain_of_a_cut_without_force_is_equivalent_to_a_factor_on_the_force() {
    for seed in [0, 2] {
        let bench = CutBench::draw(&mut ChaCha8Rng::seed_from_u64(seed), false);
        let sigma = percent(&bench, Some(bench.angle_sigma()));
        let mut expected: BTreeSet<&str> = bench.names(EffectKind::CommonForce).iter().copied().collect();
        expected.insert("sensor-gain");
        assert_eq!(
            verdict(&bench, &sigma, &gain(EVERY_SENSOR)),
            Verdict::Equivalent(expected),
            "seed {seed}"
        );
    }
}

#[test]
fn measured_force_separates_a_common_gain_from_the_force() {
    let bench = CutBench::draw(&mut ChaCha8Rng::seed_from_u64(0), true);
    let sigma = percent(&bench, Some(bench.angle_sigma()));
    assert_eq!(verdict(&bench, &sigma, &gain(EVERY_SENSOR)), Verdict::Separable);
    // A gain of the dynamometer, as a whole or along one axis, does not change the motion.
    for sensor in [EVERY_FORCE, 0] {
        assert_eq!(verdict(&bench, &sigma, &gain(sensor)), Verdict::Separable);
    }
}
