//! Random histories of a spindle.

use rand::{Rng, RngExt};

use crate::motion::{Kind, Motion};
use crate::sensor::Sensor;

/// What is wrong with the pulses of a family.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Faults {
    /// Jitter only.
    None,
    /// One mark is longer, one tooth is lost that the settings do not know, or each pulse bounces.
    Wheel,
    /// Doubled and missed pulses.
    Pulses,
    /// Pulses of other origin while the spindle stands.
    Disturbances,
}

/// A wheel of 1 to 64 marks, with a gap or without.
pub(crate) fn random_sensor(faults: Faults, random: &mut impl Rng) -> Sensor {
    let mut sensor = match random.random_range(0..10) {
        0..4 => Sensor::ideal(1, 0),
        4..7 => Sensor::ideal(random.random_range(2..=64), 0),
        _ => {
            let missing = random.random_range(1..=2);
            Sensor::ideal(random.random_range(8..=64), missing)
        }
    };
    sensor.jitter = 0.002 * random.random_range(0.0..1.0);
    let Sensor { wheel, .. } = sensor;
    match faults {
        Faults::Wheel if random.random_bool(0.3) => sensor.bounce = Some(random.random_range(0.005..0.1)),
        Faults::Wheel if wheel.positions > 3 && wheel.missing == 0 && random.random_bool(0.5) => {
            sensor.lost_tooth = true
        }
        Faults::Wheel if wheel.positions > 1 => sensor.late_mark = random.random_range(-0.35..0.35),
        Faults::Pulses => {
            sensor.doubled = 0.01 * random.random_range(0.0..1.0);
            sensor.missed = 0.01 * random.random_range(0.0..1.0);
        }
        _ => {}
    }
    sensor
}

/// A motion of several spans, and its pulses.
pub(crate) fn random_history(sensor: &Sensor, faults: Faults, random: &mut impl Rng) -> (Motion, Vec<f64>) {
    let mut motion = Motion::new(random.random_range(0.0..1.0));
    let mut speed = 0.0;
    for _ in 0..random.random_range(2..6) {
        let next = random_speed(random);
        let run_up = if random.random_bool(0.5) {
            random.random_range(0.02..3.0)
        } else {
            // A spindle drive gives up to about 400 revolutions per second squared.
            (next - speed).abs() / random.random_range(20.0..400.0) + 0.01
        };
        motion.then(run_up, next);
        speed = next;
        motion.then(random.random_range(8.0..60.0) / speed, speed);
        if random.random_bool(0.5) {
            speed = ramp(&mut motion, speed, random);
            motion.then(random.random_range(8.0..30.0) / speed, speed);
        }
        if random.random_bool(0.7) {
            let stop = if random.random_bool(0.5) {
                0.03..0.3
            } else {
                0.3..3.0
            };
            motion.then(random.random_range(stop), 0.0);
            motion.then(random.random_range(0.05..4.0), 0.0);
            speed = 0.0;
        }
    }
    let mut pulses = sensor.pulses(&motion, random);
    if faults == Faults::Disturbances {
        disturb(&motion, &mut pulses, random);
    }
    (motion, pulses)
}

/// 60 to 30 000 rev/min, in revolutions per second.
fn random_speed(random: &mut impl Rng) -> f64 {
    500.0_f64.powf(random.random_range(0.0..1.0))
}

/// A ramp of at most 50 % of the speed per second. Returns the speed at its end.
fn ramp(motion: &mut Motion, speed: f64, random: &mut impl Rng) -> f64 {
    let ratio: f64 = 2.0_f64
        .powf(random.random_range(-1.0..1.0))
        .clamp(1.0 / speed, 500.0 / speed);
    let slowest = speed.min(speed * ratio);
    let fastest_change = 0.5 * random.random_range(0.1..1.0) * slowest;
    let end = speed * ratio;
    if (end - speed).abs() > 1e-6 {
        motion.then((end - speed).abs() / fastest_change, end);
    }
    end
}

/// Adds a train of pulses, regular or not, to each standstill.
fn disturb(motion: &Motion, pulses: &mut Vec<f64>, random: &mut impl Rng) {
    for piece in motion
        .pieces
        .iter()
        .filter(|piece| piece.kind == Kind::Standstill)
    {
        let interval = 1e-5 * 1e5_f64.powf(random.random_range(0.0..1.0));
        let irregular = random.random_range(0.0..1.0);
        let mut time = piece.start + interval;
        while time < piece.end() {
            pulses.push(time);
            time += interval * (1.0 + irregular * random.random_range(-0.95..4.0));
        }
    }
    pulses.sort_by(f64::total_cmp);
}
