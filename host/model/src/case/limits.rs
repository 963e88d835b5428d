//! Limits of the machine's spindle.

/// Limits of spindle speed, power and torque of the machine.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MachineLimits {
    /// Slowest spindle speed, rev/min.
    pub rpm_min: f64,
    /// Fastest spindle speed, rev/min.
    pub rpm_max: f64,
    /// Ranges of spindle speed, rev/min, ascending and apart from each other, outside which the spindle must not run;
    /// empty if it may run at every speed from slowest to fastest.
    pub ranges_rpm: Vec<[f64; 2]>,
    /// Spindle power at the tool, W, the same at all speeds; `None` if the case does not give it.
    pub power_w: Option<f64>,
    /// Spindle torque at the tool, N·m, the same at all speeds; `None` if the case does not give it.
    pub torque_nm: Option<f64>,
    /// Points `[rev/min, W]` of the power over the spindle speed, ascending in speed, with straight lines between them;
    /// empty if the case does not give it.
    pub power_curve_rpm_w: Vec<[f64; 2]>,
    /// Points `[rev/min, N·m]` of the torque over the spindle speed, likewise.
    pub torque_curve_rpm_nm: Vec<[f64; 2]>,
}

impl MachineLimits {
    /// True if the spindle may run at the speed `rpm`, rev/min: both ends of each range are allowed.
    pub fn allows(&self, rpm: f64) -> bool {
        let within = |[from, to]: [f64; 2]| (from..=to).contains(&rpm);
        within([self.rpm_min, self.rpm_max])
            && (self.ranges_rpm.is_empty() || self.ranges_rpm.iter().any(|&range| within(range)))
    }

    /// The ranges of spindle speed in which the spindle may run, rev/min, ascending.
    pub fn allowed_rpm(&self) -> Vec<[f64; 2]> {
        if self.ranges_rpm.is_empty() {
            vec![[self.rpm_min, self.rpm_max]]
        } else {
            self.ranges_rpm.clone()
        }
    }

    /// Power of the spindle at the speed `rpm`, rev/min, in W: the smaller of the constant power and the curve; `None`
    /// if the case gives neither. Below its first and above its last point the curve is level.
    pub fn power_at_w(&self, rpm: f64) -> Option<f64> {
        smaller(self.power_w, on_curve(&self.power_curve_rpm_w, rpm))
    }

    /// Torque of the spindle at the speed `rpm`, rev/min, in N·m: the smaller of the constant torque and the curve;
    /// `None` if the case gives neither. Below its first and above its last point the curve is level.
    pub fn torque_at_nm(&self, rpm: f64) -> Option<f64> {
        smaller(self.torque_nm, on_curve(&self.torque_curve_rpm_nm, rpm))
    }

    /// True if the case limits the power or the torque of the spindle.
    pub fn limit_load(&self) -> bool {
        self.power_w.is_some()
            || self.torque_nm.is_some()
            || !self.power_curve_rpm_w.is_empty()
            || !self.torque_curve_rpm_nm.is_empty()
    }
}

fn smaller(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (one, other) => one.or(other),
    }
}

/// Value of a curve at the speed `rpm` by straight lines between its points; level beyond its ends, `None` without
/// points.
fn on_curve(points: &[[f64; 2]], rpm: f64) -> Option<f64> {
    let [first, last] = [points.first()?, points.last()?];
    if rpm <= first[0] {
        return Some(first[1]);
    }
    let inner = points.windows(2).find(|pair| rpm <= pair[1][0]);
    Some(inner.map_or(last[1], |pair| {
        let [[from, low], [to, high]] = [pair[0], pair[1]];
        low + (high - low) * (rpm - from) / (to - from)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn power_and_torque_are_the_smaller_of_number_and_curve() {
        let limits = MachineLimits {
            rpm_min: 100.0,
            rpm_max: 12_000.0,
            power_w: Some(5000.0),
            power_curve_rpm_w: vec![[0.0, 0.0], [1500.0, 6000.0], [12_000.0, 3000.0]],
            torque_nm: None,
            torque_curve_rpm_nm: vec![[1000.0, 40.0], [3000.0, 20.0]],
            ..MachineLimits::default()
        };
        assert_eq!(limits.power_at_w(750.0), Some(3000.0));
        assert_eq!(limits.power_at_w(1500.0), Some(5000.0));
        assert_eq!(limits.power_at_w(12_000.0), Some(3000.0));
        let torques = [500.0, 2000.0, 9000.0].map(|rpm| limits.torque_at_nm(rpm));
        assert_eq!(torques, [Some(40.0), Some(30.0), Some(20.0)]);
        assert!(limits.limit_load() && !MachineLimits::default().limit_load());
        assert_eq!(MachineLimits::default().power_at_w(1.0), None);
    }

    #[test]
    fn a_spindle_with_gears_runs_within_its_ranges_only() {
        let mut limits = MachineLimits {
            rpm_min: 100.0,
            rpm_max: 6000.0,
            ..MachineLimits::default()
        };
        assert_eq!(limits.allowed_rpm(), [[100.0, 6000.0]]);
        assert!(limits.allows(1600.0));
        limits.ranges_rpm = vec![[100.0, 1500.0], [1800.0, 6000.0]];
        let allowed = [99.0, 100.0, 1500.0, 1600.0, 1800.0, 6000.0, 6001.0].map(|rpm| limits.allows(rpm));
        assert_eq!(allowed, [false, true, true, false, true, true, false]);
    }
}
