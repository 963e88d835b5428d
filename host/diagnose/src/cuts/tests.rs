//! Effects hidden in virtual cuts.

use std::f64::consts::TAU;
use std::time::Instant;

use num_complex::Complex64;

use super::jumps::ChannelJump;
use super::record::ReducedCut;
use super::selection::{Explanation, explain};
use crate::baseline::Baseline;
use crate::tests::cutting::{case, records};
use quietcut_model::case::{Case, Deviation, Parameter};
use quietcut_recording::Recording;
use quietcut_testkit::slice;

/// Names of the effects of the best explanation of two virtual cuts, and χ² per value that the baseline and it leave.
fn explained(effects: &[&str]) -> (Vec<&'static str>, [f64; 2]) {
    explained_in(&records(effects, true, 7), effects)
}

fn explained_in(recordings: &[Recording], effects: &[&str]) -> (Vec<&'static str>, [f64; 2]) {
    explained_beside(&case("0.15", ""), recordings, effects)
}

fn explained_beside(
    baseline_case: &Case,
    recordings: &[Recording],
    effects: &[&str],
) -> (Vec<&'static str>, [f64; 2]) {
    let baseline = Baseline::new(baseline_case).unwrap();
    let reduced: Vec<ReducedCut> = recordings
        .iter()
        .map(|recording| ReducedCut::new(&baseline, recording).unwrap())
        .collect();
    let start = Instant::now();
    let explanations = explain(&baseline, &reduced).unwrap();
    println!("{effects:?}: {:?}", start.elapsed());
    let per_value =
        |explanation: &Explanation<'_>| explanation.fit.left / explanation.fit.residual.len() as f64;
    let best = explanations.ranked.first().unwrap_or(&explanations.baseline);
    for (number, candidate) in best.space.candidates.iter().enumerate() {
        let z = best.space.coordinates(number, &best.fit.z);
        println!(
            "    {} {} {:?}",
            candidate.effect.name(),
            candidate.location,
            candidate.parameters(&z)
        );
    }
    let names = best
        .space
        .candidates
        .iter()
        .map(|candidate| candidate.effect.name());
    (
        names.collect(),
        [per_value(&explanations.baseline), per_value(best)],
    )
}

#[test]
fn effects_far_from_the_baseline_and_below_the_noise_of_a_sample_are_explained() {
    let hidden: [(&[&str], &[&str]); 10] = [
        (&[], &[]),
        (&["force-coefficients=0.2"], &["force-coefficients"]),
        (&["runout=20", "runout.angle_deg=40"], &["runout"]),
        (&["process-damping=4e5"], &["process-damping"]),
        (&["edge-force=1.5", "edge-force.kre_n_per_mm=1"], &["edge-force"]),
        (
            &["force-exponent=0.75", "force-exponent.reference_chip_mm=0.1"],
            &["force-exponent"],
        ),
        (&["stiffness=0.1"], &["stiffness"]),
        (&["mass=0.15", "mass.direction=y"], &["mass"]),
        (
            &["coulomb-friction=0.3", "coulomb-friction.direction=y"],
            &["coulomb-friction"],
        ),
        (&["sensor-gain=1.1", "sensor-gain.channel=x"], &["sensor-gain"]),
    ];
    for (effects, expected) in hidden.into_iter().step_by(slice(3, 1) as usize) {
        let (names, [baseline, best]) = explained(effects);
        assert_eq!(names, expected, "{effects:?}: {baseline} {best}");
        // χ² of 840 values per value: 1 ± 0.05, somewhat below since the variables are fitted.
        assert!(best < 1.15, "{effects:?}: {best}");
    }
}

#[test]
fn effects_beside_an_uncertain_baseline_are_explained() {
    let mut uncertain = case("0.15", "");
    uncertain.deviations = Parameter::of_case(&uncertain)
        .into_iter()
        .filter_map(|parameter| {
            let std = 0.015 * parameter.value(&uncertain)?.abs();
            (std > 0.0).then_some(Deviation { parameter, std })
        })
        .collect();
    let hidden: [(&[&str], &[&str]); 2] = [
        // Ten deviations: without the effect, the uncertain stiffness itself has moved as far.
        (&["stiffness=0.15", "stiffness.direction=x"], &["stiffness"]),
        (&["force-coefficients=0.2"], &["force-coefficients"]),
    ];
    for (effects, expected) in hidden {
        let (names, [baseline, best]) = explained_beside(&uncertain, &records(effects, true, 7), effects);
        assert_eq!(names, expected, "{effects:?}: {baseline} {best}");
        assert!(best < 1.15, "{effects:?}: {best}");
    }
}

#[test]
fn cuts_without_tachometer_are_explained() {
    let hidden: [(&[&str], &[&str]); 5] = [
        (&[], &[]),
        (&["force-coefficients=0.2"], &["force-coefficients"]),
        (&["runout=20", "runout.angle_deg=40"], &["runout"]),
        (&["mass=0.15", "mass.direction=y"], &["mass"]),
        // A speed that wanders by 0.3 %, slowly against the structure, is followed.
        (
            &["speed-fluctuation=0.003", "speed-fluctuation.frequency_hz=0.4"],
            &[],
        ),
    ];
    for (effects, expected) in hidden {
        let mut recordings = records(effects, true, 7);
        for recording in &mut recordings {
            recording.channels.retain(|channel| channel.name != "tacho");
            let cut = recording.sidecar.cut.as_mut().unwrap();
            // A machine shows its speed to some parts in a thousand.
            cut.spindle_rpm = cut.spindle_rpm.map(|rpm| 1.003 * rpm);
        }
        let (names, [baseline, best]) = explained_in(&recordings, effects);
        assert_eq!(names, expected, "{effects:?}: {baseline} {best}");
        assert!(best < 1.15, "{effects:?}: {best}");
    }
}

#[test]
fn a_late_jump_is_folded_as_its_samples_are() {
    let baseline_case = case("0.15", "");
    let baseline = Baseline::new(&baseline_case).unwrap();
    let recording = &records(&[], true, 7)[0];
    let record = ReducedCut::new(&baseline, recording).unwrap();
    let orders = &record.orders;
    let (_, revolutions) = orders.sampled(recording);
    let sample_rad = TAU * record.conditions.spindle_hz / record.rate_hz;
    let start_rad = baseline_case.cut().unwrap().start_deg.to_radians();
    let tooth_rad = TAU / baseline_case.tool().unwrap().teeth as f64;
    for late_samples in [0.0, 0.3, -2.6, 3.9, 11.0, -40.0] {
        // A sawtooth that jumps by 1 where the second tooth enters, as a late channel shows it.
        let angle_rad = start_rad - tooth_rad;
        let late_rad = late_samples * sample_rad;
        let shown = angle_rad + late_rad;
        let samples = revolutions
            .iter()
            .map(|revolution| 0.5 - (revolution - shown / TAU).rem_euclid(1.0));
        let reduced = orders.of_samples(samples, &revolutions);
        let coefficients: Vec<Complex64> = (0..=record.highest)
            .map(|order| match order {
                0 => Complex64::ZERO,
                order => {
                    let order = order as f64;
                    Complex64::cis(-order * shown) / Complex64::new(0.0, TAU * order)
                }
            })
            .collect();
        let jump = ChannelJump {
            angle_rad,
            early_rad: -late_rad,
            size: 1.0,
        };
        let [seen, _] = record.jumps.seen(orders, &coefficients, &[jump]);
        let apart = (1..seen.len()).map(|order| (seen[order] - reduced[order]).norm());
        let apart = apart.fold(0.0, f64::max);
        println!("{late_samples} samples late: {apart:.1e}");
        // Between two sampled delays, a quarter of a sample apart, the sawtooth is interpolated; beyond the range, the
        // orders above the highest known one are left out: both are at most 1/(2π highest) in each order, twice.
        assert!(
            apart < 1.0 / (std::f64::consts::PI * record.highest as f64),
            "{late_samples}: {apart}"
        );
    }
}
