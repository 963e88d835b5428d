//! The pulses of a wheel on a moving spindle, with the faults of sensors.

use quietcut_core::tachometer::Wheel;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use crate::motion::Motion;

/// A wheel as it is, and its sensor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sensor {
    pub(crate) wheel: Wheel,
    /// A tooth that the settings do not know is missing.
    pub(crate) lost_tooth: bool,
    /// The edge of one mark is late by this part of a pitch.
    pub(crate) late_mark: f64,
    /// Standard deviation of the time of a pulse, in pitches.
    pub(crate) jitter: f64,
    /// Probability that a pulse is followed by another one, anywhere before the next mark.
    pub(crate) doubled: f64,
    /// Probability that a pulse is missing.
    pub(crate) missed: f64,
    /// Each pulse is followed by another one after this part of a pitch.
    pub(crate) bounce: Option<f64>,
}

impl Sensor {
    pub(crate) fn ideal(positions: u16, missing: u16) -> Self {
        Self {
            wheel: Wheel { positions, missing },
            lost_tooth: false,
            late_mark: 0.0,
            jitter: 0.0,
            doubled: 0.0,
            missed: 0.0,
            bounce: None,
        }
    }

    fn has_tooth(&self, position: i64) -> bool {
        let place = position.rem_euclid(i64::from(self.wheel.positions));
        place < i64::from(self.wheel.positions - self.wheel.missing) && !(self.lost_tooth && place == 1)
    }

    /// Times of the pulses, s, in order.
    pub(crate) fn pulses(&self, motion: &Motion, random: &mut impl Rng) -> Vec<f64> {
        let positions = f64::from(self.wheel.positions);
        let first = (motion.angle(0.0) * positions).ceil() as i64;
        let last = (motion.angle(motion.end()) * positions).floor() as i64;
        let mut pulses = Vec::new();
        for position in (first..=last).filter(|&position| self.has_tooth(position)) {
            let place = position.rem_euclid(i64::from(self.wheel.positions));
            let late = if place == 2 % i64::from(self.wheel.positions) {
                self.late_mark
            } else {
                0.0
            };
            let Some(time) = motion.time_of((position as f64 + late) / positions) else {
                continue;
            };
            let pitch = 1.0 / (motion.speed(time).max(0.1) * positions);
            let noise: f64 = StandardNormal.sample(random);
            if !random.random_bool(self.missed) {
                pulses.push(time + self.jitter * pitch * noise);
            }
            if random.random_bool(self.doubled) {
                pulses.push(time + pitch * random.random_range(0.01..0.99));
            }
            if let Some(part) = self.bounce {
                pulses.push(time + part * pitch);
            }
        }
        pulses.sort_by(f64::total_cmp);
        pulses
    }
}
