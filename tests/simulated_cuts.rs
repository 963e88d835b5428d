//! Simulated cuts of the robot below and above its stability limit, with entry, exit and all errors of the sensors: no alarm below the
//! limit; above it a timely alarm of the correct kind.

use quietcut_tests::acceptance::{ABOVE, AcceptanceCut, BELOW, LIMITS};
use quietcut_tests::virtual_cut::{Outcome, SimulatedCut};

/// Largest ratio of the vibration to the forced vibration at the first alarm.
const IN_TIME: f64 = 5.0;

/// Largest allowed error of the chatter frequency in the first alarm, Hz: at 1100 rev/min, where the aliases lie closest together, they are 1.3 Hz apart.
const SAME_HZ: f64 = 0.5;

/// Simulates a cut at this depth relative to the stability limit. The sensors differ between the speeds.
fn cut(index: usize, share: f64) -> Outcome {
    let acceptance = AcceptanceCut::new(index, share);
    let outcome = SimulatedCut::of(&acceptance).outcome(acceptance.seed);
    println!("seed {}: {outcome}", acceptance.seed);
    outcome
}

#[test]
fn a_fifth_below_the_limit_there_is_no_alarm() {
    let alarms: Vec<String> = (0..LIMITS.len())
        .map(|index| cut(index, BELOW))
        .filter(|outcome| outcome.first_alarm().is_some())
        .map(|outcome| outcome.to_string())
        .collect();
    assert!(alarms.is_empty(), "{}", alarms.join("\n"));
}

#[test]
fn a_fifth_above_the_limit_the_right_kind_is_called_in_time() {
    let missed: Vec<String> = (0..LIMITS.len())
        .map(|index| (index, cut(index, ABOVE)))
        .filter(|(index, outcome)| {
            // If loss of contact limits the vibration to a smaller ratio, the alarm must come before the end of the cut.
            let deadline_s = outcome.grown_to(IN_TIME).unwrap_or(outcome.full_cut_s[1]);
            let (.., kind, chatter_hz) = LIMITS[*index];
            !outcome.first_alarm().is_some_and(|(t, verdict, found_hz)| {
                t <= deadline_s && verdict == kind && (found_hz - chatter_hz).abs() < SAME_HZ
            })
        })
        .map(|(_, outcome)| outcome.to_string())
        .collect();
    assert!(missed.is_empty(), "{}", missed.join("\n"));
}
