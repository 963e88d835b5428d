//! Reads the limits of the machine's spindle from the case file.

use toml::Spanned;

use super::Check;
use crate::case::file::{LimitsFile, Number};
use crate::case::{CaseError, MachineLimits};
use crate::criteria::SPEED_MAX_RPM;

impl Check<'_> {
    pub(super) fn limits(&self, file: &LimitsFile) -> Result<MachineLimits, CaseError> {
        let rpm_min = self.number(&file.rpm_min, "limits.rpm_min", |x| x >= 0.0, "0 or more")?;
        let rpm_max = self.number(
            &file.rpm_max,
            "limits.rpm_max",
            |x| x > rpm_min && x <= SPEED_MAX_RPM,
            &format!("a speed above limits.rpm_min ({rpm_min}) and up to {SPEED_MAX_RPM} rev/min"),
        )?;
        let positive = |value: &Option<Number>, key: &str| match value {
            Some(value) => self.positive(value, key).map(Some),
            None => Ok(None),
        };
        let ends = [rpm_min, rpm_max];
        Ok(MachineLimits {
            rpm_min,
            rpm_max,
            ranges_rpm: self.ranges(&file.ranges_rpm, ends)?,
            power_w: positive(&file.power_w, "limits.power_w")?,
            torque_nm: positive(&file.torque_nm, "limits.torque_nm")?,
            power_curve_rpm_w: self.curve(&file.power_curve_rpm_w, "limits.power_curve_rpm_w", ends)?,
            torque_curve_rpm_nm: self.curve(&file.torque_curve_rpm_nm, "limits.torque_curve_rpm_nm", ends)?,
        })
    }

    /// Ranges of spindle speed: `[from, to]` each, ascending, apart from each other and within the lowest and highest
    /// speed.
    fn ranges(
        &self,
        ranges: &Option<Spanned<Vec<[f64; 2]>>>,
        [rpm_min, rpm_max]: [f64; 2],
    ) -> Result<Vec<[f64; 2]>, CaseError> {
        let Some(ranges) = ranges else {
            return Ok(Vec::new());
        };
        let key = "limits.ranges_rpm";
        let mut above = None;
        for &[from, to] in ranges.get_ref() {
            let follows = above.is_none_or(|above| from > above);
            if !(follows && from < to && rpm_min <= from && to <= rpm_max) {
                return Err(self.wrong(
                    ranges,
                    key,
                    format!("[{from}, {to}]"),
                    format!("each range [from, to] above the one before it and within {rpm_min} to {rpm_max} rev/min"),
                ));
            }
            above = Some(to);
        }
        if ranges.get_ref().is_empty() {
            return Err(self.wrong(
                ranges,
                key,
                "no range",
                "one range [from, to] in rev/min at least",
            ));
        }
        Ok(ranges.get_ref().clone())
    }

    /// A curve over the spindle speed: points with ascending speeds from the lowest to the highest speed or beyond, and
    /// values of 0 or more.
    fn curve(
        &self,
        curve: &Option<Spanned<Vec<[f64; 2]>>>,
        key: &str,
        [rpm_min, rpm_max]: [f64; 2],
    ) -> Result<Vec<[f64; 2]>, CaseError> {
        let Some(curve) = curve else {
            return Ok(Vec::new());
        };
        let points = curve.get_ref();
        for (index, &[rpm, value]) in points.iter().enumerate() {
            let follows = index == 0 || points[index - 1][0] < rpm;
            if !(follows && rpm >= 0.0 && rpm.is_finite() && value >= 0.0 && value.is_finite()) {
                return Err(self.wrong(
                    curve,
                    key,
                    format!("[{rpm}, {value}] as point {}", index + 1),
                    "points [rev/min, value] with ascending speeds and values of 0 or more",
                ));
            }
        }
        match (points.first(), points.last()) {
            (Some([first, _]), Some([last, _])) if *first <= rpm_min && *last >= rpm_max => {
                Ok(points.clone())
            }
            (Some([first, _]), Some([last, _])) => Err(self.wrong(
                curve,
                key,
                format!("a curve from {first} to {last} rev/min"),
                format!("a curve from rpm_min or less to rpm_max or more ({rpm_min} to {rpm_max} rev/min)"),
            )),
            _ => Err(self.wrong(curve, key, "no point", "points [rev/min, value]")),
        }
    }
}
