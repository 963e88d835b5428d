//! Curves of stability losses as results: points, resonances, ends, and the record from which a curve goes on.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::super::branch::Event;
use super::super::parameter::{Parameter, Setting};
use crate::spectrum::stability_loss::StabilityLoss;

/// Plane of two parameters in which a curve is followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// The parameters.
    pub parameters: [Parameter; 2],
    /// First and last value of each, in the unit of results.
    pub ranges: [[f64; 2]; 2],
}

/// Orbit on a curve of stability losses.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Parameters of the orbit.
    #[serde(flatten)]
    pub setting: Setting,
    /// Rotation of the vibration per revolution of the spindle: N θ/2π, less its integer part, with N teeth and the
    /// angle θ in [0, π] of the critical multiplier.
    pub rotation: f64,
    /// Rotation per tooth, θ/2π.
    pub rotation_per_tooth: f64,
    /// Half the peak-to-peak displacement of the tool on the orbit, at the collocation nodes, in feed, normal and axial
    /// direction, mm.
    pub amplitude_mm: [f64; 3],
    /// Number of other Floquet multipliers outside the unit circle: 0 where the curve bounds stable orbits.
    pub outside: i32,
}

/// Point of a curve at which the critical multiplier is a root of unity e^{2πi p/q}, with q up to 4 (strong resonance).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Resonance {
    /// Denominator q.
    pub q: u32,
    /// The orbit.
    #[serde(flatten)]
    pub point: CurvePoint,
}

/// Point of a curve at which another multiplier meets the unit circle too (bifurcation of codimension two).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DoubleLoss {
    /// Kind of the other loss.
    pub other: StabilityLoss,
    /// Rotation of the other multiplier per tooth, θ/2π.
    pub other_rotation_per_tooth: f64,
    /// The orbit.
    #[serde(flatten)]
    pub point: CurvePoint,
}

/// Reason why a side of a curve ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CurveEnd {
    /// A parameter reaches an end of its range.
    Range(Parameter),
    /// The two multipliers of a torus meet at e^{2πi/q}, +1 for q = 1 or −1 for q = 2.
    Resonance(u32),
    /// The curve is closed.
    Closed,
    /// The curve is not found further with the shortest step.
    Lost,
}

/// Curve of stability losses of one kind in a plane of two parameters.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curve {
    /// Kind of stability loss.
    pub kind: StabilityLoss,
    /// The two parameters that vary.
    pub parameters: [Parameter; 2],
    /// Orbits in the order of the curve.
    pub points: Vec<CurvePoint>,
    /// Strong resonances on the curve, in its order.
    pub resonances: Vec<Resonance>,
    /// Points at which another multiplier meets the unit circle, in the order of the curve.
    pub doubles: Vec<DoubleLoss>,
    /// Reasons why the curve ends at the first and at the last point.
    pub ends: [CurveEnd; 2],
    /// State of the orbit at the start of the period, at the first and at the last point.
    #[serde(skip)]
    pub(super) seeds: [Vec<f64>; 2],
    /// Largest error of each parameter, in the unit of results: a multiple of its change on a finer mesh, computed where
    /// the mesh is coarsest for the motion, at the slowest spindle speed of the curve and at its ends.
    pub error: [f64; 2],
}

/// Orbit at which a curve begins.
#[derive(Clone, Debug, PartialEq)]
pub struct CurveSeed {
    /// Kind of stability loss.
    pub kind: StabilityLoss,
    /// Values of both parameters of the plane, in the unit of results.
    pub(super) values: [f64; 2],
    /// Angle of the critical multiplier, rad.
    pub(super) angle: f64,
    /// State of the orbit at the start of the period.
    pub(super) start: Vec<f64>,
}

impl CurveSeed {
    /// Seed at a bifurcation on a branch over the first parameter of a plane, at a value of the second one in the unit of
    /// results.
    pub fn of_event(event: &Event, second: f64) -> Self {
        Self {
            kind: event.kind,
            values: [event.value, second],
            angle: event.multiplier.arg().abs(),
            start: event.orbit.start.as_slice().to_vec(),
        }
    }
}

impl Curve {
    /// True if the curve passes a seed of its kind: if straight lines between neighbouring points do, within a tenth of the
    /// distance of the neighbours.
    pub fn passes(&self, seed: &CurveSeed) -> bool {
        let at = |point: &CurvePoint| self.parameters.map(|parameter| point.setting.get(parameter));
        let unit = [0, 1].map(|index| {
            let values = self.points.iter().map(|point| at(point)[index]);
            let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(value), high.max(value))
            });
            if high > low { high - low } else { 1.0 }
        });
        self.kind == seed.kind
            && self.points.windows(2).any(|pair| {
                let (from, to) = (at(&pair[0]), at(&pair[1]));
                let step = [0, 1].map(|index| (to[index] - from[index]) / unit[index]);
                let way = [0, 1].map(|index| (seed.values[index] - from[index]) / unit[index]);
                let square = step[0] * step[0] + step[1] * step[1];
                let share = (step[0] * way[0] + step[1] * way[1]) / square;
                let share = if share.is_finite() {
                    share.clamp(0.0, 1.0)
                } else {
                    0.0
                };
                let miss = [0, 1].map(|index| way[index] - share * step[index]);
                miss[0].hypot(miss[1]) <= 0.1 * square.sqrt() + 1e-9
            })
    }

    /// Seeds of the curves that go on from the ends of a torus curve at which its multipliers meet on the real axis: a
    /// flip curve where they meet at −1 and a fold curve at +1. The first unstable orbits beyond the end are theirs.
    pub fn beyond_ends(&self) -> Vec<CurveSeed> {
        let ends = self.ends.iter().zip([self.points.first(), self.points.last()]);
        let seeds = ends.zip(&self.seeds).filter_map(|((end, point), start)| {
            let (kind, angle) = match end {
                CurveEnd::Resonance(2) => (StabilityLoss::Flip, PI),
                CurveEnd::Resonance(1) => (StabilityLoss::Fold, 0.0),
                _ => return None,
            };
            let setting = &point?.setting;
            Some(CurveSeed {
                kind,
                values: self.parameters.map(|parameter| setting.get(parameter)),
                angle,
                start: start.clone(),
            })
        });
        seeds.collect()
    }
}

/// Orbit on a curve with what is needed to go on from it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurveRecord {
    /// Unknowns of the extended system: state of the orbit at the start of the period, parameters, mode, angle.
    pub(super) unknowns: Vec<f64>,
    /// Unit tangent in the direction in which the curve is followed.
    pub(super) along: Vec<f64>,
    /// Condition on the mode.
    pub(super) phase: Vec<f64>,
    /// Length of the next step.
    pub(super) next_step: f64,
    /// Result at this orbit.
    pub(super) point: CurvePoint,
    /// Strong resonances on the step that led to this orbit.
    pub(super) resonances: Vec<Resonance>,
    /// Point on that step at which another multiplier meets the unit circle.
    #[serde(default)]
    pub(super) double: Option<DoubleLoss>,
}

/// Where the orbits of a curve are recorded while it is followed, so that an interrupted computation can go on.
pub trait CurveJournal {
    /// Orbits of an earlier computation of the same curve on one side of its start, 0 or 1, in their order.
    fn recorded(&mut self, side: usize) -> Vec<CurveRecord>;

    /// Records the next orbit on a side.
    ///
    /// # Errors
    /// The record cannot be kept; the text says why. The computation then stops.
    fn record(&mut self, side: usize, record: &CurveRecord) -> Result<(), String>;
}

/// Journal that keeps nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoJournal;

impl CurveJournal for NoJournal {
    fn recorded(&mut self, _side: usize) -> Vec<CurveRecord> {
        Vec::new()
    }

    fn record(&mut self, _side: usize, _record: &CurveRecord) -> Result<(), String> {
        Ok(())
    }
}
