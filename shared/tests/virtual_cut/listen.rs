//! A virtual cut through the whole signal chain, with the verdict of each tooth period.

use quietcut_core::acceleration::Sensor;
use quietcut_core::detector::Judgement;
use quietcut_core::monitor::{Monitor, Settings, State};
use quietcut_core::working_point::Tool;

use super::milling::{Cut, Milling, Process};
use super::virtual_sensor::{Capture, VirtualSensor, capture};

/// A judgement, with the tooth period to which it belongs.
#[derive(Clone, Copy, Debug)]
pub struct Heard {
    pub tooth: f64,
    pub judgement: Judgement,
}

/// Settings of the signal chain for a tool with this number of teeth.
pub fn settings(sensor: Sensor, with: &VirtualSensor, teeth: usize) -> Settings {
    Settings {
        sensor,
        tool: Tool { teeth: teeth as u8 },
        wheel: Some(with.wheel),
        assumed_speed: None,
        limits: None,
    }
}

/// Runs the signal chain over a capture.
pub fn listen(settings: Settings, capture: &Capture) -> Vec<Heard> {
    let monitor = Monitor::new(settings).unwrap();
    let mut state = Box::new(State::new());
    let mut heard = Vec::new();
    let mut samples = 0;
    for (block, edges) in &capture.blocks {
        let report = monitor.step(&mut state, block, edges, None, None);
        samples += block.counts.len();
        let tooth = samples as f64 / capture.rate / capture.tooth_period_s;
        heard.push(Heard {
            tooth,
            judgement: report.judgement,
        });
    }
    heard
}

/// Mean position of the forced orbit, and the largest distance from it, in m.
pub fn forced_orbit(process: &Process, depth_m: f64, steps: usize) -> ([f64; 3], f64) {
    let cut = Cut {
        depth_m,
        enter_s: 0.0,
        ramp_s: 0.0,
        leave_s: f64::INFINITY,
    };
    let mut milling = Milling::new(
        Process {
            regenerative: false,
            ..process.clone()
        },
        cut,
        steps,
    );
    let mut points = Vec::new();
    for step in 0..400 * steps {
        let position = milling.advance().position[1];
        if step >= (400 - process.teeth) * steps {
            points.push(position);
        }
    }
    let mean = [0, 1, 2].map(|d| points.iter().map(|p| p[d]).sum::<f64>() / points.len() as f64);
    let distance = |p: &[f64; 3]| (0..3).map(|d| (p[d] - mean[d]).powi(2)).sum::<f64>().sqrt();
    (mean, points.iter().map(distance).fold(0.0, f64::max))
}

/// Numbers of tooth periods of a cut: in air, in the material (with entry within `ramp` of them), and in air again.
#[derive(Clone, Copy, Debug)]
pub struct Course {
    pub before: f64,
    pub ramp: f64,
    pub cut: f64,
    pub after: f64,
}

/// Simulates a course and measures it with the sensors.
pub fn run(process: &Process, depth_m: f64, course: Course, steps: usize, with: &VirtualSensor) -> Capture {
    let period = 60.0 / process.rpm / process.teeth as f64;
    let cut = Cut {
        depth_m,
        enter_s: course.before * period,
        ramp_s: course.ramp * period,
        leave_s: (course.before + course.cut) * period,
    };
    let (centre, _) = forced_orbit(process, depth_m, steps);
    let seconds = (course.before + course.cut + course.after) * period;
    capture(Milling::new(process.clone(), cut, steps), seconds, with, centre)
}
