//! Stability at one spindle speed: limits, crossings of the unit circle, stable depths.

use num_complex::Complex64;
use serde::Serialize;

use super::spread::LimitSpread;
use crate::spectrum::stability_loss::StabilityLoss;

/// A stability switch: a depth at which a Floquet multiplier crosses the unit circle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Switch {
    /// Axial depth, mm.
    pub depth_mm: f64,
    /// Error estimate of the depth, mm: a distance in depth at which |μ| differs from 1 by at least the error of the
    /// multiplier, or the change of the depth between two computations; the last depth if it cannot be computed. `None`
    /// if the method has no estimate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_mm: Option<f64>,
    /// Kind of crossing.
    pub kind: StabilityLoss,
    /// True if the multiplier moves into the unit circle with growing depth (on a branch of forced orbits: along the
    /// branch). Stability is gained if no other multiplier is outside.
    pub gain: bool,
    /// Frequency of the vibration that begins or ends at the depth of the switch, Hz; `None` if there is none or if it
    /// cannot be computed.
    pub chatter_hz: Option<f64>,
}

/// Stability limit at one spindle speed: the axial depth at which stability is first lost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Limit {
    /// Axial depth, mm.
    pub depth_mm: f64,
    /// Error estimate of the limiting depth, mm, as that of a [`Switch`]; `None` if the method has no estimate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_mm: Option<f64>,
    /// Kind of stability loss.
    pub kind: StabilityLoss,
    /// Chatter frequency, Hz; `None` if there is none or if it cannot be computed.
    pub chatter_hz: Option<f64>,
}

/// Stability at one spindle speed: limits, crossings and stable depths.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SpeedLine {
    /// Spindle speed, rev/min.
    pub rpm: f64,
    /// Stable depths at this spindle speed, mm, as intervals in ascending order between 0 and the last depth.
    pub stable_mm: Vec<[f64; 2]>,
    /// Depths at this spindle speed, mm, whose stability is open within the error, as intervals in ascending order
    /// around the ends of the stable intervals.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub undecided_mm: Vec<[f64; 2]>,
    /// Bistable depths at this spindle speed, mm, as intervals: two forced orbits are stable, or a period-doubled one
    /// beside the forced one, below a subcritical flip. Only nonlinear structures have them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub bistable_mm: Vec<[f64; 2]>,
    /// Limit at which stability is first lost at this spindle speed; `None` if it is never lost up to the last depth,
    /// or on a branch of forced orbits that begins unstable.
    pub first_limit: Option<Limit>,
    /// Every crossing of the unit circle by a multiplier, including those while another multiplier is outside: by
    /// depth, or, for a branch of forced orbits, in the order of the branch.
    pub switches: Vec<Switch>,
    /// Spread of the first limit over drawn machines; `None` if the case has no deviations, or if it was not requested.
    #[serde(flatten)]
    pub spread: Option<LimitSpread>,
    /// Absolute value of the largest Floquet multiplier at the equal steps in depth of the scan, from depth 0 to the
    /// last; empty for methods without such a scan.
    #[serde(skip)]
    pub(crate) largest: Vec<f64>,
    /// For each switch whose error cannot be computed, and is therefore stated as the last depth, the reason.
    #[serde(skip)]
    pub without_error: Vec<String>,
}

impl SpeedLine {
    /// Stability at one spindle speed from its switches (by depth) over depths from 0 to `depth_mm`, with `outside`
    /// multipliers outside the unit circle at depth 0.
    pub(crate) fn of_switches(rpm: f64, depth_mm: f64, mut outside: i32, switches: Vec<Switch>) -> Self {
        let mut stable_from = (outside == 0).then_some(0.0);
        let mut stable_mm = Vec::new();
        let mut undecided_mm = Vec::new();
        let mut first_limit = None;
        for switch in &switches {
            let count = switch.kind.count();
            outside += if switch.gain { -count } else { count };
            match (stable_from, outside) {
                (Some(from), 1..) => {
                    stable_mm.push([from, switch.depth_mm]);
                    stable_from = None;
                    first_limit = first_limit.or(Some(Limit::from(switch)));
                }
                (None, ..=0) => stable_from = Some(switch.depth_mm),
                _ => continue,
            }
            undecided_mm.extend(switch.error_mm.map(|error_mm| {
                [
                    (switch.depth_mm - error_mm).max(0.0),
                    (switch.depth_mm + error_mm).min(depth_mm),
                ]
            }));
        }
        if let Some(from) = stable_from {
            stable_mm.push([from, depth_mm]);
        }
        Self {
            rpm,
            stable_mm,
            undecided_mm: union(undecided_mm),
            bistable_mm: Vec::new(),
            first_limit,
            switches,
            spread: None,
            largest: Vec::new(),
            without_error: Vec::new(),
        }
    }
}

impl SpeedLine {
    /// The switch at exactly this depth, mm, as the ends of the stable intervals have it.
    pub(crate) fn switch_at(&self, depth_mm: f64) -> Option<&Switch> {
        self.switches.iter().find(|switch| switch.depth_mm == depth_mm)
    }

    /// The same limits with larger errors: `further_mm` gives the addition for a switch, mm, or `None` if it cannot be
    /// computed. The error is then the last depth `depth_mm`.
    pub(crate) fn with_further_errors(
        mut self,
        depth_mm: f64,
        further_mm: impl Fn(&Switch) -> Option<f64>,
    ) -> Self {
        for switch in &mut self.switches {
            let further_mm = further_mm(switch);
            if further_mm.is_none() {
                self.without_error.push(format!(
                    "the change of the limit at {} rev/min, {} mm with the receptances cannot be computed",
                    self.rpm, switch.depth_mm
                ));
            }
            let sum_mm = further_mm.and_then(|further_mm| Some(switch.error_mm? + further_mm));
            switch.error_mm = Some(sum_mm.unwrap_or(depth_mm).min(depth_mm));
        }
        let ends = || self.stable_mm.iter().flatten();
        let bounds = self
            .switches
            .iter()
            .filter(|switch| ends().any(|end| *end == switch.depth_mm));
        let around = bounds.filter_map(|switch| {
            let error_mm = switch.error_mm?;
            Some([
                (switch.depth_mm - error_mm).max(0.0),
                (switch.depth_mm + error_mm).min(depth_mm),
            ])
        });
        self.undecided_mm = union(around.collect());
        if let Some(first) = &mut self.first_limit {
            let same = self
                .switches
                .iter()
                .find(|switch| switch.depth_mm == first.depth_mm && !switch.gain);
            first.error_mm = same.and_then(|switch| switch.error_mm);
        }
        self
    }
}

impl Switch {
    /// Floquet multiplier on the unit circle at this switch, above the real axis, from its kind and chatter frequency;
    /// `None` for a fold, or for a Hopf switch without a chatter frequency.
    pub(crate) fn multiplier(&self, tooth_period_s: f64) -> Option<Complex64> {
        match (self.kind, self.chatter_hz) {
            (StabilityLoss::Flip, _) => Some(-Complex64::ONE),
            // The product ωτ of chatter frequency and tooth period is the angle of the multiplier, modulo 2π.
            (StabilityLoss::Hopf, Some(hz)) => {
                let angle = std::f64::consts::TAU * (hz * tooth_period_s).fract();
                Some(Complex64::new(angle.cos(), angle.sin().abs()))
            }
            _ => None,
        }
    }
}

impl From<&Switch> for Limit {
    fn from(switch: &Switch) -> Self {
        Self {
            depth_mm: switch.depth_mm,
            error_mm: switch.error_mm,
            kind: switch.kind,
            chatter_hz: switch.chatter_hz,
        }
    }
}

/// Union of depth intervals: those that overlap or touch are joined; in ascending order.
pub(crate) fn union(mut intervals: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    intervals.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut joined: Vec<[f64; 2]> = Vec::with_capacity(intervals.len());
    for interval in intervals {
        match joined.last_mut() {
            Some(last) if interval[0] <= last[1] => last[1] = last[1].max(interval[1]),
            _ => joined.push(interval),
        }
    }
    joined
}
