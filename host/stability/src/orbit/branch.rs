//! Branch of forced orbits over the axial depth, with the crossings of the unit circle by its Floquet multipliers
//! (characteristic multipliers).

use num_complex::Complex64;
use serde::Serialize;

use crate::limits::speed_line::{Limit, SpeedLine, Switch, union};
use crate::spectrum::stability_loss::StabilityLoss;

/// Forced orbit on a branch, given by its depth, amplitude and stability.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BranchPoint {
    /// Axial depth, mm.
    pub depth_mm: f64,
    /// Half the peak-to-peak displacement of the tool on the orbit, at the collocation nodes, in feed, normal and axial
    /// direction, mm.
    pub amplitude_mm: [f64; 3],
    /// Absolute value of the largest Floquet multiplier of the orbit.
    pub multiplier_abs: f64,
    /// Number of Floquet multipliers of the orbit outside the unit circle.
    pub outside: i32,
}

/// Bifurcation of a forced orbit: one of its Floquet multipliers crosses the unit circle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Event {
    /// Axial depth, mm.
    pub depth_mm: f64,
    /// Error estimate of the depth of the bifurcation, mm: the change of depth along the branch over which the
    /// multiplier moves by its error, plus a multiple of the change of the depth on a finer mesh; the requested depth
    /// if this cannot be computed.
    pub error_mm: f64,
    /// Kind of bifurcation; at a fold the branch turns back in depth. With unequal teeth the kind is that of the
    /// multiplier over the revolution.
    pub kind: StabilityLoss,
    /// True if the multiplier moves into the unit circle along the branch.
    pub gain: bool,
    /// Multiplier at the crossing.
    #[serde(skip)]
    pub multiplier: Complex64,
    /// Frequency of the vibration that begins or ends at the bifurcation, Hz; `None` at a fold, or if it cannot be
    /// computed.
    pub chatter_hz: Option<f64>,
}

/// Branch of forced orbits that starts from rest at depth 0.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Branch {
    /// Spindle speed, rev/min.
    pub rpm: f64,
    /// Forced orbits along the branch, in the order in which it is followed.
    pub points: Vec<BranchPoint>,
    /// Bifurcations along the branch, in the order in which it is followed.
    pub events: Vec<Event>,
}

/// Extent to which a branch of forced orbits is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// To the end of the first step along the branch in which a multiplier leaves the unit circle, which suffices for a
    /// limit.
    FirstLoss,
    /// To the last requested depth, through folds of the branch, or back to depth 0.
    Whole,
}

impl Branch {
    /// Depth intervals with a stable forced orbit, mm, in the order of the branch.
    pub fn stable_mm(&self) -> Vec<[f64; 2]> {
        let mut outside = self.points.first().map_or(0, |point| point.outside);
        let mut from = (outside == 0).then_some(0.0);
        let mut stable = Vec::new();
        for event in &self.events {
            let count = event.kind.count();
            outside += if event.gain { -count } else { count };
            match (from, outside) {
                (Some(start), 1..) => {
                    stable.push([start, event.depth_mm]);
                    from = None;
                }
                (None, ..=0) => from = Some(event.depth_mm),
                _ => {}
            }
        }
        if let (Some(start), Some(last)) = (from, self.points.last()) {
            stable.push([start, last.depth_mm]);
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
        let ends = union(self.stable_mm()).into_iter().flatten();
        let around = ends.filter_map(|end_mm| {
            let event = self.events.iter().find(|event| event.depth_mm == end_mm)?;
            Some([(end_mm - event.error_mm).max(0.0), end_mm + event.error_mm])
        });
        union(around.collect())
    }

    /// Depth intervals in which two stable forced orbits exist, mm: the overlap of every two intervals of
    /// [`stable_mm`](Self::stable_mm), in their order.
    pub fn bistable_mm(&self) -> Vec<[f64; 2]> {
        let stable = self.stable_mm();
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

    /// Stability at the spindle speed of the branch, as in a stability chart.
    ///
    /// The first limit is the first loss of stability along a branch that begins stable. A depth is stable if some
    /// forced orbit there is stable.
    pub fn speed_line(&self) -> SpeedLine {
        let switches: Vec<Switch> = self
            .events
            .iter()
            .map(|event| Switch {
                depth_mm: event.depth_mm,
                error_mm: Some(event.error_mm),
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
            stable_mm: union(self.stable_mm()),
            undecided_mm: self.undecided_mm(),
            bistable_mm: self.bistable_mm(),
            first_limit,
            switches,
            spread: None,
            largest: Vec::new(),
            without_error: Vec::new(),
        }
    }
}
