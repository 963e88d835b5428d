//! Cuts that excite the structure: the force of a gliding spindle in porous material from the recorded motion.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use super::*;
use quietcut_recording::Recording;

const RATE_HZ: f64 = 20_000.0;

/// Spindle speed at the start of the linear sweep, rev/min.
const FIRST_RPM: f64 = 450.0;
/// Spindle speed at the end of the sweep, rev/min.
const LAST_RPM: f64 = 690.0;
const SECONDS: f64 = 4.0;

fn angle_rad(t: f64) -> f64 {
    TAU / 60.0 * (FIRST_RPM * t + 0.5 * (LAST_RPM - FIRST_RPM) / SECONDS * t * t)
}

/// Time, s, at which the spindle was half a revolution behind its angle at `t`, by bisection.
fn half_a_turn_before(t: f64) -> f64 {
    let wanted = angle_rad(t) - PI;
    let (mut low, mut high) = (t - 0.1, t);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if angle_rad(middle) < wanted {
            low = middle
        } else {
            high = middle
        }
    }
    0.5 * (low + high)
}

fn at(recording: &Recording, name: &str, t: f64) -> f64 {
    let samples = &recording.channel(name).unwrap().samples;
    let place = t * RATE_HZ;
    let (k, share) = (place.floor() as usize, place - place.floor());
    samples[k] * (1.0 - share) + samples[k + 1] * share
}

#[test]
fn the_force_of_a_gliding_spindle_in_foam_is_that_of_the_solid_chip() {
    let case = case("kuka-kr90-acetal");
    let pores = Pores {
        share: 0.5,
        size_m: 1e-3,
        strength: 0.4,
        seed: 5,
    };
    let depth_mm = 1.0;
    let cut = VirtualCut {
        last_rpm: Some(LAST_RPM),
        pores: Some(pores),
        entry: Entry::None,
        ..VirtualCut::new(FIRST_RPM, depth_mm, SECONDS)
    };
    let recorder = Recorder::Ideal { rate_hz: RATE_HZ };
    let path = Path::new("cut.csv");
    let (recording, _) = cut
        .record(&case, recorder, TachometerModel::ONE_MARK, path)
        .unwrap();
    let (material, feed_m) = (case.material.unwrap(), 0.15e-3);
    let (mut compared, mut largest) = (0, 0.0_f64);
    for k in ((0.3 * RATE_HZ) as usize..(3.9 * RATE_HZ) as usize).step_by(23) {
        let t = k as f64 / RATE_HZ;
        // One of two teeth is in the cut from 90° to 180°. Near the exit contact may be lost, so that angles up to 137° are compared.
        let phi = [0.0, PI].map(|tooth| (angle_rad(t) + tooth).rem_euclid(TAU));
        let Some(phi) = phi.into_iter().find(|phi| (1.59..2.4).contains(phi)) else {
            continue;
        };
        let before = half_a_turn_before(t);
        let moved = |name| at(&recording, name, t) - at(&recording, name, before);
        // The feed axis moves at constant speed: by the feed per tooth in a tooth-passing period at the mean spindle speed.
        let mean_delay_s = 30.0 / (0.5 * (FIRST_RPM + LAST_RPM));
        let chip_m = feed_m * (t - before) / mean_delay_s * phi.sin()
            + moved("x") * phi.sin()
            + moved("y") * phi.cos();
        let fed_m = feed_m * t / mean_delay_s;
        let shares = pores.at(fed_m + 6.35e-3 * phi.sin(), 6.35e-3 * phi.cos());
        let [along, inward, axial] = shares.map(|share| 1e3 * chip_m * depth_mm * share);
        let (tangential, radial) = (material.ktc_mpa * along, material.krc_mpa * inward);
        let expected = [
            ("fx", -tangential * phi.cos() - radial * phi.sin()),
            ("fy", tangential * phi.sin() - radial * phi.cos()),
            ("fz", -material.kac_mpa * axial),
        ];
        for (name, expected) in expected {
            let found = recording.channel(name).unwrap().samples[k];
            // Forces are up to 18 N. The motion is interpolated linearly between samples, which causes an error of 1e-4 of that.
            assert!(
                (found - expected).abs() < 2e-3,
                "{t} s, {name}: {found} {expected}"
            );
            largest = largest.max(found.abs());
        }
        compared += 1;
    }
    assert!(compared > 500 && largest > 5.0, "{compared}, {largest} N");
}

#[test]
fn a_modulated_sweep_is_refused() {
    let case = case("kuka-kr90-acetal");
    let modulation = ["speed-fluctuation=0.1", "speed-fluctuation.frequency_hz=2"];
    let sweep = VirtualCut {
        last_rpm: Some(LAST_RPM),
        effects: Effects::parse(modulation).unwrap(),
        ..VirtualCut::new(FIRST_RPM, 1.0, SECONDS)
    };
    let message = sweep.model(&case).err().unwrap().to_string();
    assert!(message.contains("leave out one of both"), "{message}");
    let steady = VirtualCut {
        last_rpm: None,
        ..sweep
    };
    assert!(steady.spindle(&case).is_ok());
}

#[test]
fn without_pores_and_without_change_of_speed_it_is_the_plain_cut() {
    let case = case("kuka-kr90-acetal");
    let plain = VirtualCut {
        entry: Entry::None,
        ..VirtualCut::new(820.0, 1.0, 1.0)
    };
    let same = VirtualCut {
        last_rpm: Some(820.0),
        pores: Some(Pores {
            share: 0.0,
            size_m: 1e-3,
            strength: 0.0,
            seed: 1,
        }),
        ..plain.clone()
    };
    let record = |cut: &VirtualCut| {
        let recorder = Recorder::Ideal { rate_hz: 2000.0 };
        cut.record(&case, recorder, TachometerModel::ONE_MARK, Path::new("cut.csv"))
            .unwrap()
            .0
    };
    let (plain, same) = (record(&plain), record(&same));
    for (a, b) in plain.channels.iter().zip(&same.channels) {
        for (a, b) in a.samples.iter().zip(&b.samples) {
            // Within the tolerance of the integration. At entry a sample may fall on either side of a jump of the force.
            assert!(
                (a - b).abs() < 1e-5 * a.abs().max(1e-3) || a.abs().min(b.abs()) < 1e-6,
                "{a} {b}"
            );
        }
    }
}
