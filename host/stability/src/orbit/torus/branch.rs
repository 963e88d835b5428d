//! Branch of tori from a torus bifurcation, over the depth.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::circle::Circle;
use super::corrector::{Corrected, Corrector, Torus};
use super::motion::Motion;
use super::period::Steps;
use super::start::beside;
use crate::orbit::branch::Event;
use crate::orbit::coefficients::Coefficients;
use crate::orbit::forced::ForcedProblem;
use crate::orbit::parameter::{Parameter, Place, Setting};
use crate::orbit::periodic_orbit::OrbitError;
use crate::spectrum::stability_loss::StabilityLoss;

/// Harmonics of the first torus of a branch. A choice: more are taken as soon as they are needed.
const HARMONICS_FIRST: usize = 6;

/// Largest number of harmonics. A choice: the cost grows as the cube of the number, and a torus that needs more is about to
/// lock or to break.
const HARMONICS_MAX: usize = 30;

/// Largest share of the highest third of the harmonics in the size of a torus, above which more harmonics are taken.
/// A choice: the extremes of the strobe set then change by less than 0.5 % with twice the harmonics.
const TAIL_MAX: f64 = 2e-3;

/// Share of the highest third of the harmonics in the size of a torus, above which it counts as broken if it has the largest
/// number of harmonics. A choice: the extremes of the strobe set are then off by 1 %.
const BROKEN_TAIL: f64 = 1e-2;

/// First, longest and shortest step along the branch: the unit is the root mean square of the relative change of the states
/// over all angles, with the orbit at the bifurcation as their unit, or π of the rotation, or the range of depths. Choices:
/// the tori do not depend on them.
const STEP: [f64; 3] = [0.02, 0.25, 5e-4];

/// Largest number of steps. A choice.
const STEPS_MAX: usize = 400;

/// Angles at which the extremes of the strobe set are evaluated. A choice: between them a harmonic of order 30 changes by
/// at most 0.5 % of its size.
const EXTREME_ANGLES: usize = 600;

/// Torus on a branch.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TorusPoint {
    /// Axial depth, mm.
    pub depth_mm: f64,
    /// Rotation per tooth period, ρ/2π.
    pub rotation_per_tooth: f64,
    /// Smallest and largest displacement of the tool when a tooth enters, in feed, normal and axial direction, mm.
    pub strobe_mm: [[f64; 2]; 3],
    /// Root mean square of the vibration that is not synchronous with the teeth: displacement, mm, in feed, normal and axial
    /// direction.
    pub asynchronous_mm: [f64; 3],
    /// The same of its acceleration, m/s².
    pub asynchronous_m_per_s2: [f64; 3],
    /// Smallest chip thickness of a tooth in the arc of cut, mm: below 0 it has left the surface.
    pub smallest_chip_mm: f64,
    /// Number of harmonics of the torus.
    pub harmonics: usize,
    /// Share of the highest third of the harmonics in the size of the torus: a measure of its error.
    pub tail: f64,
}

/// Reason why a branch of tori ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum TorusEnd {
    /// The depth leaves the range.
    Range,
    /// The torus has shrunk to a forced orbit again.
    Rejoins,
    /// The torus is no longer smooth enough for the largest number of harmonics: the vibration is about to lock to a rational
    /// rotation, or the torus breaks.
    Breaks,
    /// No torus is found further with the shortest step.
    Lost,
}

/// Branch of tori from a torus bifurcation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TorusBranch {
    /// Depth of the bifurcation, mm.
    pub from_mm: f64,
    /// Tori in the order of the branch.
    pub points: Vec<TorusPoint>,
    /// Reason of its end.
    pub end: TorusEnd,
}

impl TorusBranch {
    /// True if the first tori lie beyond the bifurcation, at larger depths.
    pub fn begins_beyond(&self) -> bool {
        self.points
            .first()
            .is_some_and(|first| first.depth_mm > self.from_mm)
    }

    /// Depths, mm, at which the branch turns back in a fold, in its order: the extreme of the parabola through three tori.
    pub fn folds_mm(&self) -> Vec<f64> {
        let depth = |index: usize| self.points[index].depth_mm;
        (1..self.points.len().saturating_sub(1))
            .filter(|&at| (depth(at) - depth(at - 1)) * (depth(at + 1) - depth(at)) < 0.0)
            .map(|at| {
                let size = |index: usize| {
                    let [low, high] = self.points[index].strobe_mm[1];
                    high - low
                };
                vertex([at - 1, at, at + 1].map(|index| [size(index), depth(index)]))
            })
            .collect()
    }

    /// Interval of depths, mm, below a subcritical torus in which a cut is bistable: from the first fold of the tori, where the
    /// unstable ones that begin at the bifurcation meet larger stable ones, to the bifurcation. `None` if the tori begin
    /// beyond the bifurcation, or no fold is found.
    ///
    /// The multipliers of tori are not computed. That the larger tori are stable follows from the fold if no other
    /// bifurcation lies between.
    pub fn bistable_mm(&self) -> Option<[f64; 2]> {
        let fold_mm = *self.folds_mm().first()?;
        (!self.begins_beyond() && fold_mm < self.from_mm).then_some([fold_mm, self.from_mm])
    }

    /// Depth, mm, of the first torus on which a tooth leaves the surface; `None` if all stay in contact.
    pub fn contact_lost_mm(&self) -> Option<f64> {
        let mut lost = self.points.iter().filter(|point| point.smallest_chip_mm < 0.0);
        lost.next().map(|point| point.depth_mm)
    }
}

/// Extreme value of the parabola through three points (x, y); the middle y if they lie on a line.
fn vertex([a, b, c]: [[f64; 2]; 3]) -> f64 {
    let (left, right) = ((b[1] - a[1]) / (b[0] - a[0]), (c[1] - b[1]) / (c[0] - b[0]));
    let bend = (right - left) / (c[0] - a[0]);
    let slope = left + bend * (b[0] - a[0]);
    let extreme = b[1] - slope * slope / (4.0 * bend);
    if extreme.is_finite() { extreme } else { b[1] }
}

/// Follows the tori from a torus bifurcation on a branch over the depth, until the depth leaves `range_mm`, they shrink to
/// a forced orbit, or none is found. Loss of contact is included.
///
/// # Errors
/// The event is no torus, the problem has a feature that is not covered, or no torus is found beside the bifurcation.
pub fn follow_torus(
    problem: &ForcedProblem,
    setting: Setting,
    range_mm: [f64; 2],
    event: &Event,
) -> Result<TorusBranch, OrbitError> {
    check(problem, event)?;
    let problem = problem.at(&setting);
    let steps = Steps::new(&problem, setting.rpm);
    let corrector = Corrector {
        problem: &problem,
        steps: &steps,
        circle: Circle::new(HARMONICS_FIRST),
        state_unit: event.orbit.start.norm(),
        depth_unit_m: 1e-3 * (range_mm[1] - range_mm[0]).abs(),
    };
    let first = beside(&corrector, event).ok_or(OrbitError::Singular {
        place: Place {
            parameter: Parameter::Depth,
            value: event.value,
        },
    })?;
    let mut follower = TorusFollower { corrector, range_mm };
    let (points, end) = follower.from(first);
    Ok(TorusBranch {
        from_mm: event.value,
        points,
        end,
    })
}

fn check(problem: &ForcedProblem, event: &Event) -> Result<(), OrbitError> {
    let process = &problem.linear.process;
    let edge = &process.force.edge;
    let edge = edge.constant.amax() + edge.cosine.amax() + edge.sine.amax();
    let what = if event.kind != StabilityLoss::Hopf {
        "tori from another event than a torus bifurcation"
    } else if problem.is_over_revolution() {
        "tori of teeth with unequal pitch or runout; leave out runout and unequal pitch"
    } else if problem.coefficients != Coefficients::Exact {
        "tori with smoothed or averaged coefficients; use the exact ones"
    } else if problem.chip_exponent().is_some() {
        "tori with extension.force-exponent; leave it out"
    } else if process.axial_depth_modulation {
        "tori with axial-depth modulation; leave it out"
    } else if problem.damping_per_depth([0.0].into_iter(), 1.0).is_some() {
        "tori with process damping; leave it out"
    } else if edge > 0.0 {
        "tori with edge forces, which jump where a tooth leaves the surface; set kte, kre and kae to 0, or simulate (--strobe)"
    } else {
        return Ok(());
    };
    Err(OrbitError::NotCovered { what })
}

struct TorusFollower<'a> {
    corrector: Corrector<'a>,
    range_mm: [f64; 2],
}

impl TorusFollower<'_> {
    /// Tori from the first one on, and the reason why they end.
    fn from(&mut self, first: Corrected) -> (Vec<TorusPoint>, TorusEnd) {
        let mut here = first;
        let mut points = vec![self.point(&here)];
        let (low, high) = (
            self.range_mm[0].min(self.range_mm[1]),
            self.range_mm[0].max(self.range_mm[1]),
        );
        let mut step = STEP[0];
        let first_size = self.size(&here.torus);
        for _ in 0..STEPS_MAX {
            let Some(next) = self.next(&here, &mut step) else {
                return (points, TorusEnd::Lost);
            };
            if next.newton_steps <= 4 {
                step = (1.4 * step).min(STEP[1]);
            } else if next.newton_steps > 6 {
                step *= 0.6;
            }
            let point = self.point(&next);
            if !(low..=high).contains(&point.depth_mm) {
                let end_mm = point.depth_mm.clamp(low, high);
                points.extend(self.landed(&here, &next, end_mm).map(|last| self.point(&last)));
                return (points, TorusEnd::Range);
            }
            if self.size(&next.torus) < 0.5 * first_size {
                return (points, TorusEnd::Rejoins);
            }
            if point.tail > BROKEN_TAIL && point.harmonics >= HARMONICS_MAX {
                return (points, TorusEnd::Breaks);
            }
            points.push(point);
            here = self.refined(next);
        }
        (points, TorusEnd::Lost)
    }

    /// The next torus, with a step that is halved until it is found.
    fn next(&self, here: &Corrected, step: &mut f64) -> Option<Corrected> {
        loop {
            let guess = self.corrector.moved(&here.torus, &here.along, *step);
            let next = self.corrector.correct(&guess, &here.along, &here.torus.states);
            // A turn of more than 60° is another branch, or a step too long.
            if let Some(next) = next.filter(|next| next.along.dot(&here.along) > 0.5) {
                return Some(next);
            }
            *step *= 0.5;
            if *step < STEP[2] {
                return None;
            }
        }
    }

    /// The torus between two neighbours at a depth.
    fn landed(&self, here: &Corrected, next: &Corrected, depth_mm: f64) -> Option<Corrected> {
        let depth_m = 1e-3 * depth_mm;
        let share = (depth_m - here.torus.depth_m) / (next.torus.depth_m - here.torus.depth_m);
        let guess = Torus {
            states: &here.torus.states * (1.0 - share) + &next.torus.states * share,
            rotation: here.torus.rotation * (1.0 - share) + next.torus.rotation * share,
            depth_m,
        };
        let mut along_depth = DVector::zeros(self.corrector.size());
        along_depth[self.corrector.size() - 1] = 1.0;
        self.corrector.correct(&guess, &along_depth, &here.torus.states)
    }

    /// The same torus with more harmonics if its tail is large.
    fn refined(&mut self, here: Corrected) -> Corrected {
        let from = self.corrector.circle;
        if self.tail(&here.torus) < TAIL_MAX || from.harmonics() >= HARMONICS_MAX {
            return here;
        }
        let to = Circle::new((from.harmonics() * 3 / 2).min(HARMONICS_MAX));
        let torus = here.torus.onto(from, to);
        let along = self.onto(&here.along, from, to);
        self.corrector.circle = to;
        match self.corrector.correct(&torus, &along, &torus.states) {
            Some(finer) => finer,
            None => {
                self.corrector.circle = from;
                here
            }
        }
    }

    /// Unit direction at the angles of another circle.
    fn onto(&self, along: &DVector<f64>, from: Circle, to: Circle) -> DVector<f64> {
        let order = self.corrector.problem.order();
        let states = order * from.angles;
        let own = DMatrix::from_column_slice(order, from.angles, &along.as_slice()[..states]);
        let scale = (from.angles as f64 / to.angles as f64).sqrt();
        let moved = own * from.onto(to).transpose() * scale;
        let values = moved.iter().chain(&along.as_slice()[states..]).copied();
        DVector::from_iterator(order * to.angles + 2, values).normalize()
    }

    /// Norm of the displacements of each harmonic from 1 on.
    fn harmonics(&self, torus: &Torus) -> Vec<f64> {
        let circle = self.corrector.circle;
        let displacement = &self.corrector.problem.linear.structure.c * &torus.states;
        (1..=circle.harmonics())
            .map(|m| {
                let part = |of: fn(f64) -> f64| {
                    let turns = DVector::from_fn(circle.angles, |k, _| of(m as f64 * circle.angle(k)));
                    (&displacement * turns).norm_squared()
                };
                (part(f64::cos) + part(f64::sin)).sqrt()
            })
            .collect()
    }

    fn tail(&self, torus: &Torus) -> f64 {
        let all = self.harmonics(torus);
        let norm = |part: &[f64]| part.iter().map(|size| size * size).sum::<f64>().sqrt();
        norm(&all[all.len() - all.len() / 3..]) / norm(&all)
    }

    /// Size of the torus in the state at the start of the period.
    fn size(&self, torus: &Torus) -> f64 {
        let mean = torus.states.column_mean();
        let columns = torus.states.column_iter();
        columns.map(|column| (column - &mean).norm()).fold(0.0, f64::max)
    }

    fn point(&self, here: &Corrected) -> TorusPoint {
        let torus = &here.torus;
        let circle = self.corrector.circle;
        let fine = circle.onto(Circle::new(EXTREME_ANGLES / 2));
        let displacement =
            &self.corrector.problem.linear.structure.c * &torus.states * fine.transpose() * 1e3;
        let corrector = &self.corrector;
        let motion = Motion::new(corrector.problem, circle, torus.rotation, torus.depth_m);
        let structure = &corrector.problem.linear.structure;
        let [displacement_m, acceleration] = corrector.steps.asynchronous(&motion, structure, &torus.states);
        TorusPoint {
            depth_mm: 1e3 * torus.depth_m,
            rotation_per_tooth: torus.rotation / TAU,
            strobe_mm: std::array::from_fn(|axis| {
                let row = displacement.row(axis);
                [row.min(), row.max()]
            }),
            asynchronous_mm: displacement_m.map(|m| 1e3 * m),
            asynchronous_m_per_s2: acceleration,
            smallest_chip_mm: 1e3 * here.smallest_chip_m,
            harmonics: circle.harmonics(),
            tail: self.tail(torus),
        }
    }
}
