//! The turning of the spindle.

use std::f64::consts::TAU;

/// A spindle at constant speed; its angle is 0 at t = 0, where tooth 1 stands at immersion angle 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spindle {
    speed_rad_per_s: f64,
}

impl Spindle {
    /// A spindle at this speed, which must be positive.
    pub fn new(spindle_rpm: f64) -> Self {
        Self {
            speed_rad_per_s: spindle_rpm * TAU / 60.0,
        }
    }

    /// rad/s.
    pub fn speed_rad_per_s(&self) -> f64 {
        self.speed_rad_per_s
    }

    /// The angle turned through since t = 0, rad.
    pub fn angle_rad(&self, t: f64) -> f64 {
        self.speed_rad_per_s * t
    }

    /// When the spindle has turned through `angle_rad` since t = 0, s.
    pub fn time_s(&self, angle_rad: f64) -> f64 {
        angle_rad / self.speed_rad_per_s
    }

    /// How long before `t` the spindle stood `angle_rad` back, s.
    pub fn delay_s(&self, _t: f64, angle_rad: f64) -> f64 {
        angle_rad / self.speed_rad_per_s
    }
}
