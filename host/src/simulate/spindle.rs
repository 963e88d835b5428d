//! The turning of the spindle.

use std::f64::consts::TAU;

/// A spindle; its angle is 0 at t = 0, where tooth 1 stands at immersion angle 0.
///
/// Its speed is constant, or fluctuates: Ω(t) = Ω₀(1 + δ sin(2πf_m t + ψ)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spindle {
    speed_rad_per_s: f64,
    fluctuation: Option<Fluctuation>,
}

/// How a speed fluctuates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fluctuation {
    /// δ, between −1 and 1.
    pub delta: f64,
    /// f_m, Hz, positive.
    pub frequency_hz: f64,
    /// ψ, rad.
    pub phase_rad: f64,
}

impl Fluctuation {
    /// ∫ sin(2πf_m s + ψ) ds from 0 to `t`, times δ: how far the spindle is ahead of its mean, s.
    fn ahead_s(self, t: f64) -> f64 {
        let omega = TAU * self.frequency_hz;
        self.delta / omega * (self.phase_rad.cos() - (omega * t + self.phase_rad).cos())
    }

    /// Speed at `t` over the mean speed.
    fn share(self, t: f64) -> f64 {
        1.0 + self.delta * (TAU * self.frequency_hz * t + self.phase_rad).sin()
    }
}

impl Spindle {
    /// A spindle at this speed, which must be positive.
    pub fn new(spindle_rpm: f64) -> Self {
        Self {
            speed_rad_per_s: spindle_rpm * TAU / 60.0,
            fluctuation: None,
        }
    }

    /// The same with a speed that fluctuates.
    #[must_use]
    pub fn fluctuating(self, fluctuation: Fluctuation) -> Self {
        Self {
            fluctuation: Some(fluctuation),
            ..self
        }
    }

    /// How its speed fluctuates; `None` where it does not.
    pub fn fluctuation(&self) -> Option<Fluctuation> {
        self.fluctuation
    }

    /// The mean speed Ω₀, rad/s.
    pub fn speed_rad_per_s(&self) -> f64 {
        self.speed_rad_per_s
    }

    /// The speed at `t`, rad/s.
    pub fn speed_at_rad_per_s(&self, t: f64) -> f64 {
        self.speed_rad_per_s * self.fluctuation.map_or(1.0, |fluctuation| fluctuation.share(t))
    }

    /// The angle turned through since t = 0, rad.
    pub fn angle_rad(&self, t: f64) -> f64 {
        self.speed_rad_per_s
            * self
                .fluctuation
                .map_or(t, |fluctuation| t + fluctuation.ahead_s(t))
    }

    /// When the spindle has turned through `angle_rad` since t = 0, s.
    pub fn time_s(&self, angle_rad: f64) -> f64 {
        let mean_s = angle_rad / self.speed_rad_per_s;
        match self.fluctuation {
            None => mean_s,
            Some(fluctuation) => inverse(fluctuation, mean_s),
        }
    }

    /// How long before `t` the spindle stood `angle_rad` back, s.
    pub fn delay_s(&self, t: f64, angle_rad: f64) -> f64 {
        match self.fluctuation {
            None => angle_rad / self.speed_rad_per_s,
            Some(_) => t - self.time_s(self.angle_rad(t) - angle_rad),
        }
    }

    /// [`Self::delay_s`] over that at the mean speed.
    pub fn delay_share(&self, t: f64, angle_rad: f64) -> f64 {
        match self.fluctuation {
            None => 1.0,
            Some(_) => self.delay_s(t, angle_rad) * self.speed_rad_per_s / angle_rad,
        }
    }

    /// How long after `t` the spindle stands `angle_rad` further, s.
    pub fn advance_s(&self, t: f64, angle_rad: f64) -> f64 {
        -self.delay_s(t, -angle_rad)
    }

    /// The shortest and the longest time in which the spindle ever turns through `angle_rad`, s: bounds, and exact
    /// where the speed is constant.
    pub fn bounds_s(&self, angle_rad: f64) -> [f64; 2] {
        let delta = self
            .fluctuation
            .map_or(0.0, |fluctuation| fluctuation.delta.abs());
        [1.0 + delta, 1.0 - delta].map(|share| angle_rad / (self.speed_rad_per_s * share))
    }
}

/// t with t + ahead(t) = `mean_s`, to rounding: Newton between bounds, since the left side grows.
fn inverse(fluctuation: Fluctuation, mean_s: f64) -> f64 {
    let reach_s = 2.0 * fluctuation.delta.abs() / (TAU * fluctuation.frequency_hz);
    let (mut low, mut high) = (mean_s - reach_s, mean_s + reach_s);
    let mut t = mean_s;
    // Bisection alone halves a reach of a second to rounding in 60 steps; Newton takes five.
    for _ in 0..60 {
        let excess_s = t + fluctuation.ahead_s(t) - mean_s;
        if excess_s > 0.0 {
            high = t;
        } else {
            low = t;
        }
        let newton = t - excess_s / fluctuation.share(t);
        let next = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        let step = next - t;
        t = next;
        if step.abs() <= 2.0 * f64::EPSILON * t.abs().max(reach_s) {
            break;
        }
    }
    t
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_and_angle_of_a_fluctuating_spindle_are_inverse_and_its_speed_is_the_rate() {
        for delta in [0.0, 1e-3, 0.3, -0.95] {
            let spindle = Spindle::new(900.0).fluctuating(Fluctuation {
                delta,
                frequency_hz: 2.3,
                phase_rad: 0.7,
            });
            assert_eq!(spindle.angle_rad(0.0), 0.0);
            for i in -20..200 {
                let t = f64::from(i) * 0.013;
                let back = spindle.time_s(spindle.angle_rad(t));
                // Rounding of the angle over the least speed, 5 % of the mean.
                assert!((back - t).abs() < 1e-13, "{delta} {t}: {back}");
                let h = 1e-5;
                let rate = (spindle.angle_rad(t + h) - spindle.angle_rad(t - h)) / (2.0 * h);
                // Third derivative δ Ω (2π f_m)² h²/6, and rounding of angles of 300 rad over 2e-5 s.
                assert!(
                    (rate / spindle.speed_at_rad_per_s(t) - 1.0).abs() < 1e-6,
                    "{rate}"
                );
                let delay_s = spindle.delay_s(t, 1.0);
                let [shortest, longest] = spindle.bounds_s(1.0);
                assert!((shortest * 0.999_999..=longest * 1.000_001).contains(&delay_s));
                assert!((spindle.advance_s(t - delay_s, 1.0) - delay_s).abs() < 1e-13);
            }
        }
    }
}
