//! Spindle angle and speed over time: constant speed, sinusoidal speed modulation, or linear speed sweep.

use std::f64::consts::TAU;

use quietcut_numerics::roots::monotone;

/// Spindle motion; at t = 0 the spindle angle is 0 and the first tooth is at the immersion angle 0.
///
/// The speed is constant, modulated as Ω(t) = Ω₀(1 + δ sin(2πf_m t + ψ)), or changes linearly from one speed to
/// another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spindle {
    speed_rad_per_s: f64,
    profile: SpeedProfile,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum SpeedProfile {
    Steady,
    Fluctuating(Fluctuation),
    Sweep(LinearSweep),
}

/// A linear change of the spindle speed from t = 0 to t = `seconds`; the speed is constant before and after it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LinearSweep {
    /// Spindle speed before and after the change, rad/s.
    speeds: [f64; 2],
    seconds: f64,
}

impl LinearSweep {
    fn speed(self, t: f64) -> f64 {
        let share = (t / self.seconds).clamp(0.0, 1.0);
        self.speeds[0] * (1.0 - share) + self.speeds[1] * share
    }

    fn angle_rad(self, t: f64) -> f64 {
        let within = t.clamp(0.0, self.seconds);
        // Spindle angle within the sweep, at the mean of the speeds at the times 0 and `within`, plus the angle at the
        // constant speed before or after the sweep.
        0.5 * (self.speeds[0] + self.speed(within)) * within + self.speed(t) * (t - within)
    }

    fn time_s(self, angle_rad: f64) -> f64 {
        let [first, last] = self.speeds;
        let whole = self.angle_rad(self.seconds);
        if angle_rad <= 0.0 {
            return angle_rad / first;
        }
        if angle_rad >= whole {
            return self.seconds + (angle_rad - whole) / last;
        }
        // Root t of first·t + ½·a·t² = angle with a the angular acceleration, in the form in which first and square
        // root are added, not subtracted.
        let acceleration = (last - first) / self.seconds;
        2.0 * angle_rad / (first + (first * first + 2.0 * acceleration * angle_rad).sqrt())
    }
}

/// Sinusoidal speed modulation Ω(t) = Ω₀(1 + δ sin(2πf_m t + ψ)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fluctuation {
    /// Relative amplitude δ of the speed modulation, between −1 and 1.
    pub delta: f64,
    /// Modulation frequency f_m, Hz, positive.
    pub frequency_hz: f64,
    /// Phase ψ of the speed modulation at t = 0, rad.
    pub phase_rad: f64,
}

impl Fluctuation {
    /// Lead of the spindle angle over a rotation at the mean speed, divided by the mean speed, s: δ·∫ sin(2πf_m s + ψ)
    /// ds from 0 to `t`.
    fn ahead_s(self, t: f64) -> f64 {
        let omega = TAU * self.frequency_hz;
        self.delta / omega * (self.phase_rad.cos() - (omega * t + self.phase_rad).cos())
    }

    /// Spindle speed at the time `t`, s, divided by the mean spindle speed.
    fn share(self, t: f64) -> f64 {
        1.0 + self.delta * (TAU * self.frequency_hz * t + self.phase_rad).sin()
    }
}

impl Spindle {
    /// A spindle with the constant speed `spindle_rpm`, rev/min, positive.
    pub fn new(spindle_rpm: f64) -> Self {
        Self {
            speed_rad_per_s: spindle_rpm * TAU / 60.0,
            profile: SpeedProfile::Steady,
        }
    }

    /// A spindle whose speed changes linearly from `first_rpm` to `last_rpm`, rev/min, from t = 0 to t = `seconds`, s;
    /// all positive. Its mean speed is the arithmetic mean of both speeds.
    pub fn sweeping(first_rpm: f64, last_rpm: f64, seconds: f64) -> Self {
        let speeds = [first_rpm, last_rpm].map(|rpm| rpm * TAU / 60.0);
        Self {
            speed_rad_per_s: 0.5 * (speeds[0] + speeds[1]),
            profile: SpeedProfile::Sweep(LinearSweep { speeds, seconds }),
        }
    }

    /// A spindle with the mean speed of this one and speed modulation about it, without sweep.
    #[must_use]
    pub fn fluctuating(self, fluctuation: Fluctuation) -> Self {
        Self {
            profile: SpeedProfile::Fluctuating(fluctuation),
            ..self
        }
    }

    /// The speed modulation; `None` for a constant or linearly changing speed.
    pub fn fluctuation(&self) -> Option<Fluctuation> {
        match self.profile {
            SpeedProfile::Fluctuating(fluctuation) => Some(fluctuation),
            _ => None,
        }
    }

    /// Mean spindle speed Ω₀, rad/s.
    pub fn speed_rad_per_s(&self) -> f64 {
        self.speed_rad_per_s
    }

    /// Spindle speed at the time `t`, rad/s.
    pub fn speed_at_rad_per_s(&self, t: f64) -> f64 {
        match self.profile {
            SpeedProfile::Steady => self.speed_rad_per_s,
            SpeedProfile::Fluctuating(fluctuation) => self.speed_rad_per_s * fluctuation.share(t),
            SpeedProfile::Sweep(sweep) => sweep.speed(t),
        }
    }

    /// Spindle angle at the time `t`, rad, from 0 at t = 0.
    pub fn angle_rad(&self, t: f64) -> f64 {
        match self.profile {
            SpeedProfile::Steady => self.speed_rad_per_s * t,
            SpeedProfile::Fluctuating(fluctuation) => self.speed_rad_per_s * (t + fluctuation.ahead_s(t)),
            SpeedProfile::Sweep(sweep) => sweep.angle_rad(t),
        }
    }

    /// Time at which the spindle angle is `angle_rad`, s (inverse of [`Self::angle_rad`]).
    pub fn time_s(&self, angle_rad: f64) -> f64 {
        let mean_s = angle_rad / self.speed_rad_per_s;
        match self.profile {
            SpeedProfile::Steady => mean_s,
            SpeedProfile::Fluctuating(fluctuation) => inverse(fluctuation, mean_s),
            SpeedProfile::Sweep(sweep) => sweep.time_s(angle_rad),
        }
    }

    /// Time, s, that the spindle took to rotate by the last `angle_rad` before the time `t`; for the pitch angle this
    /// is the regenerative delay.
    pub fn delay_s(&self, t: f64, angle_rad: f64) -> f64 {
        match self.profile {
            SpeedProfile::Steady => angle_rad / self.speed_rad_per_s,
            SpeedProfile::Fluctuating(_) | SpeedProfile::Sweep(_) => {
                t - self.time_s(self.angle_rad(t) - angle_rad)
            }
        }
    }

    /// Delay [`Self::delay_s`] divided by the delay at the mean spindle speed.
    pub fn delay_share(&self, t: f64, angle_rad: f64) -> f64 {
        match self.profile {
            SpeedProfile::Steady => 1.0,
            SpeedProfile::Fluctuating(_) | SpeedProfile::Sweep(_) => {
                self.delay_s(t, angle_rad) * self.speed_rad_per_s / angle_rad
            }
        }
    }

    /// Time from `t` until the spindle has rotated by `angle_rad`, s.
    pub fn advance_s(&self, t: f64, angle_rad: f64) -> f64 {
        -self.delay_s(t, -angle_rad)
    }

    /// Lower and upper bound of the time, s, in which the spindle rotates by the positive angle `angle_rad`; equal for
    /// a constant speed.
    pub fn bounds_s(&self, angle_rad: f64) -> [f64; 2] {
        let fastest_and_slowest = match self.profile {
            SpeedProfile::Steady => [self.speed_rad_per_s; 2],
            SpeedProfile::Fluctuating(fluctuation) => {
                let delta = fluctuation.delta.abs();
                [1.0 + delta, 1.0 - delta].map(|share| self.speed_rad_per_s * share)
            }
            SpeedProfile::Sweep(LinearSweep { speeds: [a, b], .. }) => [a.max(b), a.min(b)],
        };
        fastest_and_slowest.map(|speed| angle_rad / speed)
    }
}

/// Solves t + lead(t) = `mean_s` for the time t, s, with the lead of `Fluctuation::ahead_s`, by Newton's method with
/// bisection as safeguard; t + lead(t) increases monotonically.
fn inverse(fluctuation: Fluctuation, mean_s: f64) -> f64 {
    let reach_s = 2.0 * fluctuation.delta.abs() / (TAU * fluctuation.frequency_hz);
    monotone([mean_s - reach_s, mean_s + reach_s], mean_s, |t| {
        [t + fluctuation.ahead_s(t) - mean_s, fluctuation.share(t)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_speed_change_reaches_its_last_speed_and_time_and_angle_are_inverse() {
        for (first, last) in [(450.0, 690.0), (690.0, 450.0)] {
            let spindle = Spindle::sweeping(first, last, 60.0);
            let rpm = |t: f64| spindle.speed_at_rad_per_s(t) * 60.0 / TAU;
            assert!((rpm(-1.0) - first).abs() < 1e-9 && (rpm(61.0) - last).abs() < 1e-9);
            // 570 revolutions: the mean speed for one minute.
            assert!((spindle.angle_rad(60.0) / TAU - 570.0).abs() < 1e-9);
            for i in -20..700 {
                let t = 0.1 * f64::from(i);
                assert!((spindle.time_s(spindle.angle_rad(t)) - t).abs() < 1e-12);
                let h = 1e-4;
                let rate = (spindle.angle_rad(t + h) - spindle.angle_rad(t - h)) / (2.0 * h);
                // Central difference over a kink of the speed at start and end of the sweep, and rounding of angles of
                // 4000 rad.
                assert!((rate - spindle.speed_at_rad_per_s(t)).abs() < 1e-4, "{t}");
                let ([shortest, longest], delay) = (spindle.bounds_s(3.0), spindle.delay_s(t, 3.0));
                // Rounding of angles of 4000 rad.
                assert!(
                    delay > shortest * (1.0 - 1e-9) && delay < longest * (1.0 + 1e-9),
                    "{t}"
                );
            }
        }
    }

    #[test]
    fn time_and_angle_of_a_modulated_spindle_are_inverse_and_its_speed_is_the_rate() {
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
                // Rounding of the angle divided by the smallest speed, 5 % of the mean.
                assert!((back - t).abs() < 1e-13, "{delta} {t}: {back}");
                let h = 1e-5;
                let rate = (spindle.angle_rad(t + h) - spindle.angle_rad(t - h)) / (2.0 * h);
                // Error of the central difference, δ Ω (2π f_m)² h²/6, and rounding of angles of 300 rad divided by
                // 2e-5 s.
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
