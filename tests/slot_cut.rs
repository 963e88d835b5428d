//! A measured slot cut with chatter: four flutes at 5 000 rev/min, one channel of unknown unit, no tachometer.

#![allow(clippy::unwrap_used)]

use quietcut::recording::{Recording, Sensed, SpindleSettings};
use quietcut_core::monitor::{Monitor, State};
use quietcut_testkit::measured;

#[test]
#[ignore = "measured records: QUIETCUT_DATA names their folder"]
fn the_tone_of_the_measured_slot_cut_is_detected() {
    let path = measured("milling/slot_5000rpm_4flutes.mat");
    let speed = SpindleSettings {
        rpm: Some(5000.0),
        teeth: Some(4),
    };
    let sensed = Sensed::new(&Recording::read(path).unwrap(), speed).unwrap();
    let monitor = Monitor::new(sensed.settings).unwrap();
    let mut state = Box::new(State::new());
    let mut chatter = Vec::new();
    for (block, edges) in sensed.steps() {
        let report = monitor.step(&mut state, block, edges, None, None);
        let at_s = block.time.seconds_since(sensed.blocks[0].time);
        if report.judgement.verdict.is_chatter() {
            chatter.push((at_s, report.judgement.chatter.unwrap().0));
        }
    }
    let (first_s, first_hz) = chatter[0];
    println!("first detected at {first_s} s, {first_hz} Hz");
    // The tool is in the cut from 3.5 to 4.9 s. The chatter tone falls from 740 to 684 Hz while it grows. The tone at 146 Hz,
    // first the larger one, is present all the time.
    assert!((3.5..4.3).contains(&first_s), "{first_s}");
    assert!((690.0..740.0).contains(&first_hz), "{first_hz}");
    for (at_s, hz) in chatter {
        assert!((675.0..760.0).contains(&hz), "{hz} Hz at {at_s} s");
        assert!(at_s < 5.5, "still detected at {at_s} s");
    }
}
