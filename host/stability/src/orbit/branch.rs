//! Branch of forced orbits over one parameter, with the crossings of the unit circle by its Floquet multipliers
//! (characteristic multipliers).

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::parameter::Parameter;
use super::periodic_orbit::{Orbit, OrbitError};
use crate::limits::speed_line::{Limit, SpeedLine, Switch, union};
use crate::spectrum::stability_loss::StabilityLoss;

/// Forced orbit on a branch, given by its depth, amplitude and stability.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BranchPoint {
    /// Value of the varied parameter: axial depth, mm, spindle speed, rev/min, feed per tooth, mm, κ or ν.
    pub value: f64,
    /// Half the peak-to-peak displacement of the tool on the orbit, at the collocation nodes, in feed, normal and axial
    /// direction, mm.
    pub amplitude_mm: [f64; 3],
    /// Displacement of the tool at the start of the period, when a tooth enters, in the same directions, mm.
    pub displacement_mm: [f64; 3],
    /// Absolute value of the largest Floquet multiplier of the orbit.
    pub multiplier_abs: f64,
    /// Number of Floquet multipliers of the orbit outside the unit circle.
    pub outside: i32,
}

/// Bifurcation of a forced orbit: one of its Floquet multipliers crosses the unit circle.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Event {
    /// Value of the varied parameter, in the unit of [`BranchPoint::value`].
    pub value: f64,
    /// Error estimate of that value: its change along the branch over which the multiplier moves by its error, plus a
    /// multiple of its change on a finer mesh; the requested range if this cannot be computed.
    pub error: f64,
    /// Kind of bifurcation; at a fold the branch turns back in the varied parameter. With unequal teeth the kind is that of the
    /// multiplier over the revolution.
    pub kind: StabilityLoss,
    /// True if the multiplier moves into the unit circle along the branch.
    pub gain: bool,
    /// Number of orbits of the branch before the bifurcation.
    #[serde(skip)]
    pub after: usize,
    /// Multiplier at the crossing.
    #[serde(skip)]
    pub multiplier: Complex64,
    /// Forced orbit at the bifurcation.
    #[serde(skip)]
    pub orbit: Orbit,
    /// Amplitude of that orbit, as [`BranchPoint::amplitude_mm`].
    pub amplitude_mm: [f64; 3],
    /// Displacement on that orbit at the start of the period, as [`BranchPoint::displacement_mm`].
    pub displacement_mm: [f64; 3],
    /// Frequency of the vibration that begins or ends at the bifurcation, Hz; `None` at a fold, or if it cannot be
    /// computed.
    pub chatter_hz: Option<f64>,
}

/// Branch of forced orbits over one parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Branch {
    /// Parameter that varies along the branch.
    pub parameter: Parameter,
    /// Spindle speed, rev/min; where it varies, that at the start of the branch.
    pub rpm: f64,
    /// Forced orbits along the branch, in the order in which it is followed.
    pub points: Vec<BranchPoint>,
    /// Bifurcations along the branch, in the order in which it is followed.
    pub events: Vec<Event>,
}

/// Branch that cannot be followed to its end.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{cause}")]
pub struct BrokenBranch {
    /// Reason.
    pub cause: OrbitError,
    /// The branch so far; `None` if not even its first orbit is found.
    pub branch: Option<Box<Branch>>,
}

/// Extent to which a branch of forced orbits is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// To the end of the first step along the branch in which a multiplier leaves the unit circle, which suffices for a
    /// limit.
    FirstLoss,
    /// To an end of the requested range, through folds of the branch.
    Whole,
}

impl Branch {
    /// Intervals of the varied parameter with a stable forced orbit, in the order of the branch.
    pub fn stable(&self) -> Vec<[f64; 2]> {
        let mut outside = self.points.first().map_or(0, |point| point.outside);
        let mut from = (outside == 0).then(|| self.points.first().map_or(0.0, |point| point.value));
        let mut stable = Vec::new();
        for event in &self.events {
            let count = event.kind.count();
            outside += if event.gain { -count } else { count };
            match (from, outside) {
                (Some(start), 1..) => {
                    stable.push([start, event.value]);
                    from = None;
                }
                (None, ..=0) => from = Some(event.value),
                _ => {}
            }
        }
        if let (Some(start), Some(last)) = (from, self.points.last()) {
            stable.push([start, last.value]);
        }
        stable.retain_mut(|interval| {
            interval.sort_by(f64::total_cmp);
            interval[1] > interval[0]
        });
        stable
    }

    /// Depth intervals, mm, in which the errors of the bifurcations leave the stability of the orbit open: around the
    /// ends of the stable intervals.
    fn undecided_mm(&self) -> Vec<[f64; 2]> {
        let ends = union(self.stable()).into_iter().flatten();
        let around = ends.filter_map(|end_mm| {
            let event = self.events.iter().find(|event| event.value == end_mm)?;
            Some([(end_mm - event.error).max(0.0), end_mm + event.error])
        });
        union(around.collect())
    }

    /// Intervals of the varied parameter in which two stable forced orbits exist: the overlap of every two intervals of
    /// [`stable`](Self::stable), in their order.
    pub fn bistable(&self) -> Vec<[f64; 2]> {
        let stable = self.stable();
        let mut both = Vec::new();
        for (i, a) in stable.iter().enumerate() {
            for b in &stable[i + 1..] {
                let (from, to) = (a[0].max(b[0]), a[1].min(b[1]));
                if from < to {
                    both.push([from, to]);
                }
            }
        }
        both
    }

    /// Stability at the spindle speed of a branch over the axial depth, as in a stability chart.
    ///
    /// The first limit is the first loss of stability along a branch that begins stable. A depth is stable if some
    /// forced orbit there is stable.
    pub fn speed_line(&self) -> SpeedLine {
        let switches: Vec<Switch> = self
            .events
            .iter()
            .map(|event| Switch {
                depth_mm: event.value,
                error_mm: Some(event.error),
                kind: event.kind,
                gain: event.gain,
                chatter_hz: event.chatter_hz,
            })
            .collect();
        let starts_stable = self.points.first().is_some_and(|point| point.outside == 0);
        let first_limit = switches
            .iter()
            .find(|switch| starts_stable && !switch.gain)
            .map(Limit::from);
        SpeedLine {
            rpm: self.rpm,
            stable_mm: union(self.stable()),
            undecided_mm: self.undecided_mm(),
            bistable_mm: self.bistable(),
            first_limit,
            switches,
            spread: None,
            largest: Vec::new(),
            without_error: Vec::new(),
        }
    }
}
