//! Virtual cuts through the whole signal chain: the right verdict in time, and no other chatter verdict.

#![allow(clippy::unwrap_used)]

mod virtual_cut;

use quietcut_core::detector::Verdict;
use quietcut_core::monitor::{Band, Monitor, State};
use virtual_cut::listen::{Course, Heard, listen, run, settings};
use virtual_cut::milling::{machine_tool, robot};
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
fn robot_chatter_is_detected_with_its_kind() {
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
        // At the end the tool has left the material.
        assert_eq!(heard.last().unwrap().judgement.verdict, Verdict::AirCut);
    }
}

#[test]
fn a_reset_state_equals_a_new_one() {
    let with = VirtualSensor::usual(3);
    let (robot, tool) = (robot(1050.0), machine_tool(5000.0));
    let chatter = run(&robot, 2e-3, COURSE, 64, &with);
    let other = run(&tool, 0.5e-3, COURSE, 64, &with);
    let mut used = Box::new(State::new());
    for (process, capture) in [(&robot, &chatter), (&tool, &other), (&robot, &chatter)] {
        let monitor = Monitor::new(settings(with.sensor, &with, process.teeth)).unwrap();
        let mut new = Box::new(State::new());
        used.reset();
        for (block, edges) in &capture.blocks {
            let expected = monitor.step(&mut new, block, edges, None, None);
            assert_eq!(monitor.step(&mut used, block, edges, None, None), expected);
            assert_eq!(used.strobes(), new.strobes());
            for band in [Band::Structure, Band::Tool] {
                assert_eq!(used.spectrum(band), new.spectrum(band));
                assert_eq!(used.has_fresh_spectrum(band), new.has_fresh_spectrum(band));
            }
        }
    }
}
