//! The experiment that separates what is still confounded.

use super::answer::NextTest;

/// What a pair of names needs to be told apart: names, the kind of recording, why.
const TESTS: [(&[&str], &str, &str); 9] = [
    (
        &["sensor-gain", "mass"],
        "hammer",
        "a second sensor on the same direction, or one calibrated against gravity, reads the motion itself: a gain changes one channel, mass, stiffness and damping change both",
    ),
    (
        &["sensor-gain", "sensor-offset-from-tool-tip"],
        "hammer",
        "a tap test with a sensor at the tool tip beside the one that is mounted: a sensor at another place differs there, a wrong gain does not",
    ),
    (
        &["cubic-damping", "damping"],
        "step-sine",
        "two levels of force at resonance, a factor of three apart: cubic damping grows with amplitude",
    ),
    (
        &["coulomb-friction", "hysteresis"],
        "step-sine",
        "small amplitudes, down to where friction sticks: hysteresis gives way before it slips",
    ),
    (
        &["cubic-stiffness", "softening-hardening"],
        "step-sine",
        "more force at resonance: beyond its turn a softening spring hardens",
    ),
    (
        &["drift"],
        "shaker",
        "the same excitation for longer, or again after a pause: a drift goes on, a changed parameter stays",
    ),
    (
        &["backlash"],
        "step-sine",
        "amplitudes below the gap and far above it",
    ),
    (
        &["cross-axis"],
        "hammer",
        "drive the other direction alone: a cross sensitivity of the sensor is not reciprocal",
    ),
    (
        &["missing-mode"],
        "sweep",
        "a slow sweep over a wider band: a mode has a phase of its own",
    ),
];

/// What would separate the names of a group.
pub(super) fn for_group(group: &[&'static str]) -> NextTest {
    let fitting = TESTS
        .iter()
        .find(|(names, ..)| names.iter().all(|name| group.contains(name)));
    let (kind, why) = fitting.map_or(
        (
            "step-sine",
            "three levels of force, a factor of three apart, over every resonance: linear causes keep the receptance, others move it each in its own way",
        ),
        |(_, kind, why)| (*kind, *why),
    );
    NextTest {
        kind,
        why: format!("separates {}: {why}", group.join(" from ")),
    }
}
