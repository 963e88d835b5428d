//! Virtual cuts through the whole pipeline: the right verdict, in time, and no other.

#![allow(clippy::unwrap_used)]

mod virtual_cut;

use quietcut_core::detector::Verdict;
use virtual_cut::listen::{Course, Heard, listen, run, settings};
use virtual_cut::milling::robot;
use virtual_cut::virtual_sensor::VirtualSensor;

const COURSE: Course = Course {
    before: 40.0,
    ramp: 0.0,
    cut: 150.0,
    after: 100.0,
};

fn robot_verdicts(rpm: f64, depth_mm: f64, seed: u64) -> Vec<Heard> {
    println!("{rpm} rev/min, {depth_mm} mm, seed {seed}");
    let with = VirtualSensor {
        clock: 0.975,
        ..VirtualSensor::usual(seed)
    };
    let process = robot(rpm);
    listen(
        settings(with.sensor, &with, process.teeth),
        &run(&process, depth_mm * 1e-3, COURSE, 64, &with),
    )
}

#[test]
fn stable_robot_cuts_raise_no_alarm() {
    for (rpm, limit_mm) in [(600.0, 3.174), (1050.0, 1.356), (2000.0, 4.105)] {
        let heard = robot_verdicts(rpm, 0.8 * limit_mm, 1);
        let alarm = heard.iter().find(|h| h.judgement.verdict.is_chatter());
        assert!(alarm.is_none(), "{alarm:?}");
        let said = |verdict| heard.iter().any(|h| h.judgement.verdict == verdict);
        assert!(said(Verdict::AirCut) && said(Verdict::Stable));
        assert_eq!(heard.last().unwrap().judgement.verdict, Verdict::AirCut);
    }
}

#[test]
fn robot_chatter_is_heard_and_named() {
    for (rpm, limit_mm, verdict, chatter_hz) in [
        (900.0, 1.723, Verdict::Hopf, 17.46),
        (1050.0, 1.356, Verdict::PeriodDoubling, 17.5),
    ] {
        let heard = robot_verdicts(rpm, 1.2 * limit_mm, 2);
        let first = heard.iter().find(|h| h.judgement.verdict.is_chatter()).unwrap();
        assert_eq!(first.judgement.verdict, verdict);
        assert!(
            first.tooth > COURSE.before && first.tooth < COURSE.before + 100.0,
            "{first:?}"
        );
        let frequency = f64::from(first.judgement.chatter.unwrap().0);
        assert!((frequency - chatter_hz).abs() < 0.1, "{frequency}");
        // Out of the material again.
        assert_eq!(heard.last().unwrap().judgement.verdict, Verdict::AirCut);
    }
}
