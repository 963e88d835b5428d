//! A milling machine of two modes, drawn at random.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// One mode: displacement along `direction` (a unit vector in the plane of x, the feed, and y).
#[derive(Clone, Copy, Debug)]
pub struct Mode {
    pub frequency_hz: f64,
    pub damping_ratio: f64,
    pub mass_kg: f64,
    pub direction: [f64; 2],
}

/// Structure, tool and material.
#[derive(Clone, Debug)]
pub struct Machine {
    pub modes: [Mode; 2],
    pub teeth: usize,
    /// Cutting force coefficients, tangential and radial, N/m².
    pub coefficients: [f64; 2],
    /// Immersion, clockwise from +y.
    pub start_deg: f64,
    pub exit_deg: f64,
    pub feed_per_tooth_m: f64,
    /// Tooth j reaches `runout_m`·cos(`runout_angle` + 2πj/N) beyond the nominal circle.
    pub runout_m: f64,
    pub runout_angle: f64,
    pub turns_per_second: f64,
    /// Root spectral density of a white force on each mode, N/√Hz.
    pub force_noise: f64,
}

impl Machine {
    /// Draws a machine: f·T from 0.3 to 6 waves per tooth period, so that lobes of low number are met, where process damping does not hide chatter.
    pub fn draw(random: &mut ChaCha8Rng) -> Self {
        let teeth = [1, 2, 2, 3, 4, 4, 5, 6, 8][random.random_range(0..9)];
        // Half the machines are robots with low modes, half have a mode of the tool.
        let is_robot = random.random_bool(0.5);
        let frequency_hz = if is_robot {
            log_uniform(random, 14.0, 90.0)
        } else {
            log_uniform(random, 250.0, 2200.0)
        };
        let waves = log_uniform(random, 0.3, 6.0);
        let tooth_hz = (frequency_hz / waves).max(300.0 / 60.0 * teeth as f64);
        let turns_per_second = (tooth_hz / teeth as f64).min(500.0);
        let damping_ratio = log_uniform(random, 0.01, 0.08);
        let mass_kg = if is_robot { 40.0 } else { 0.05 };
        let first_angle: f64 = random.random_range(0.0..TAU);
        let across = first_angle + TAU / 4.0 + random.random_range(-0.3..0.3);
        let mode = |frequency_hz: f64, angle: f64| Mode {
            frequency_hz,
            damping_ratio,
            mass_kg,
            direction: [angle.cos(), angle.sin()],
        };
        let second_hz = frequency_hz * random.random_range(1.02..1.5);
        let modes = [mode(frequency_hz, first_angle), mode(second_hz, across)];
        let width_deg = log_uniform(random, 15.0, 180.0);
        let (start_deg, exit_deg) = if random.random_bool(0.5) {
            (0.0, width_deg)
        } else {
            (180.0 - width_deg, 180.0)
        };
        let feed_per_tooth_m = log_uniform(random, 0.03e-3, 0.2e-3);
        let middle = 0.5 * (start_deg + exit_deg);
        // With more runout than this a tooth would lose contact over much of its path in every cut.
        let largest_runout_m = 0.25 * feed_per_tooth_m * middle.to_radians().sin();
        Self {
            modes,
            teeth,
            coefficients: [6e8, 2e8],
            start_deg,
            exit_deg,
            feed_per_tooth_m,
            runout_m: largest_runout_m * random.random::<f64>(),
            runout_angle: random.random_range(0.0..TAU),
            turns_per_second,
            force_noise: 0.0,
        }
    }

    pub fn tooth_period_s(&self) -> f64 {
        1.0 / (self.turns_per_second * self.teeth as f64)
    }

    /// Steps of the integrator per tooth period: 24 per period of the higher mode.
    pub fn steps(&self) -> usize {
        let waves = self.modes[1].frequency_hz * self.tooth_period_s();
        ((24.0 * waves).ceil() as usize).clamp(48, 400)
    }

    pub fn runout(&self, tooth: usize) -> f64 {
        let part = (tooth % self.teeth) as f64 / self.teeth as f64;
        self.runout_m * (self.runout_angle + TAU * part).cos()
    }
}

/// A number whose logarithm is uniform.
pub fn log_uniform(random: &mut ChaCha8Rng, from: f64, to: f64) -> f64 {
    from * (to / from).powf(random.random::<f64>())
}
