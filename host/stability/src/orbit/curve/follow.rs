//! Follows a curve of stability losses by pseudo-arclength continuation.

use std::f64::consts::{PI, TAU};

use nalgebra::DVector;

use super::super::forced::ForcedProblem;
use super::super::parameter::{Parameter, Setting};
use super::criteria::{CURVE_COSINE_MIN, CURVE_STEP_FIRST, CURVE_STEP_MAX, CURVE_STEP_MIN};
use super::error::CurveError;
use super::extended::{CriticalOrbit, ExtendedSystem};
use super::newton::{Corrector, CurveOrbit};
use super::points::{Curve, CurveEnd, CurveJournal, CurvePoint, CurveRecord, CurveSeed, Plane, Resonance};
use crate::criteria::{LEAST_ERROR, ORBIT_ROOM};

/// Largest number of steps on one side of a curve. A curve takes about a hundred. A choice.
const STEPS_MAX: usize = 5000;

/// Unit of the mode in the arc length of a curve, in its norm: the length is measured mainly in parameters and orbit. A
/// choice.
const MODE_UNIT: f64 = 10.0;

/// Largest distance of an orbit from the start of a curve, in units of the arc length without the mode, at which the curve
/// is closed. Newton's method settles far below it.
const CLOSED: f64 = 1e-6;

/// Least [`CurveOrbit::alignment`] of a mode with the condition on it: 45°. A choice: any value above 0 serves.
const ALIGNMENT_MIN: f64 = 0.7;

/// Follows the curve of stability losses through a seed to both sides, within the ranges of the plane. `setting` holds all
/// parameters that the plane does not.
///
/// # Errors
/// The problem is not covered, or no curve begins at the seed.
pub fn follow_curve(
    problem: &ForcedProblem,
    setting: Setting,
    plane: Plane,
    seed: &CurveSeed,
    journal: &mut dyn CurveJournal,
) -> Result<Curve, CurveError> {
    check(problem, plane)?;
    let slowest_rpm = plane
        .parameters
        .iter()
        .zip(plane.ranges)
        .find(|(parameter, _)| **parameter == Parameter::Rpm)
        .map_or(setting.rpm, |(_, range)| range[0].min(range[1]));
    let system = ExtendedSystem::new(problem, setting, plane.parameters, seed.kind, slowest_rpm);
    let units = plane.parameters.map(Parameter::result_unit);
    let values = [seed.values[0] * units[0], seed.values[1] * units[1]];
    let none = CurveError::NoStart {
        kind: seed.kind,
        value: seed.values[0],
    };
    let start = DVector::from_vec(seed.start.clone());
    let guess = system.guess(&start, values, seed.angle).ok_or(none.clone())?;
    let follower = CurveFollower::new(&system, plane, &guess);
    let along_second = follower.unit(system.first_parameter() + 1);
    let (guess, phase) = follower.corrector.normalized(&guess);
    let start = follower
        .corrector
        .correct(&guess, &phase, &along_second)
        .ok_or(none)?;
    let (mut orbits, first_end) = follower.side(&start, 0, journal)?;
    let (after, last_end) = if first_end == CurveEnd::Closed {
        (Vec::new(), CurveEnd::Closed)
    } else {
        follower.side(&start, 1, journal)?
    };
    orbits.reverse();
    let resonances = orbits
        .iter()
        .chain(&after)
        .flat_map(|record| record.resonances.iter().copied())
        .collect();
    let doubles = orbits
        .iter()
        .chain(&after)
        .filter_map(|record| record.double)
        .collect();
    orbits.push(follower.record(None, &start, CURVE_STEP_FIRST));
    orbits.extend(after);
    Ok(Curve {
        seeds: [orbits.first(), orbits.last()]
            .map(|record| record.map_or_else(Vec::new, |record| record.unknowns[..system.order()].to_vec())),
        kind: seed.kind,
        parameters: plane.parameters,
        points: orbits.iter().map(|record| record.point).collect(),
        resonances,
        doubles,
        ends: [first_end, last_end],
        error: follower.error(&orbits),
    })
}

fn check(problem: &ForcedProblem, plane: Plane) -> Result<(), CurveError> {
    let [first, second] = plane.parameters;
    if first == second {
        return Err(CurveError::SameParameter { parameter: first });
    }
    if problem.is_over_revolution() {
        return Err(CurveError::NotCovered {
            what: "teeth with unequal pitch or runout, whose orbit has the period of the revolution; leave them out, \
                   or compute limits over the speed (lobes)",
        });
    }
    if problem.has_smooth_forces() {
        return Err(CurveError::NotCovered {
            what: "smooth restoring forces of extensions, whose second derivatives are not known; write cubic terms into \
                   [structure], or compute limits over the speed (lobes)",
        });
    }
    Ok(())
}

pub(super) struct CurveFollower<'a> {
    pub(super) system: &'a ExtendedSystem<'a>,
    pub(super) corrector: Corrector<'a>,
    plane: Plane,
}

impl<'a> CurveFollower<'a> {
    fn new(system: &'a ExtendedSystem<'a>, plane: Plane, guess: &CriticalOrbit) -> Self {
        let order = system.order();
        let mut units = DVector::from_element(system.size(), 1.0);
        // The forces on the orbit are proportional to depth and feed. The unit of its state is its size at the ends of
        // their ranges, so that the arc length measures the parameters as much as the orbit.
        let growth: f64 = plane
            .parameters
            .iter()
            .zip(plane.ranges)
            .enumerate()
            .filter(|(_, (parameter, _))| matches!(parameter, Parameter::Depth | Parameter::Feed))
            .map(|(index, (parameter, range))| {
                let here = guess.unknowns[order + index].abs() / parameter.result_unit();
                if here > 0.0 {
                    range[0].max(range[1]) / here
                } else {
                    1.0
                }
            })
            .product();
        let start = guess.unknowns.rows(0, order).norm() * growth;
        // At rest, without feed and edge forces, any unit of the state serves.
        units
            .rows_mut(0, order)
            .fill(if start > 0.0 { start } else { 1.0 });
        for (index, (parameter, range)) in plane.parameters.iter().zip(plane.ranges).enumerate() {
            let length = (range[1] - range[0]).abs() * parameter.result_unit();
            units[order + index] = if length > 0.0 { length } else { 1.0 };
        }
        if let Some(angle) = system.angle_at() {
            units[angle] = PI;
        }
        units
            .rows_mut(system.first_of_mode(), system.layout.size())
            .fill(MODE_UNIT);
        Self {
            system,
            corrector: Corrector { system, units },
            plane,
        }
    }

    fn unit(&self, index: usize) -> DVector<f64> {
        let mut unit = DVector::zeros(self.system.size());
        unit[index] = 1.0;
        unit
    }

    /// Orbits of the curve on one side of the start, without the start, and the reason why it ends. Side 0 begins with
    /// falling values of the second parameter, side 1 with rising ones.
    fn side(
        &self,
        start: &CurveOrbit,
        side: usize,
        journal: &mut dyn CurveJournal,
    ) -> Result<(Vec<CurveRecord>, CurveEnd), CurveError> {
        let mut first = start.clone();
        if side == 0 {
            first.reverse();
        }
        let mut records = journal.recorded(side);
        let (mut here, mut before, mut step) =
            self.resumed(&first, &records)
                .ok_or_else(|| CurveError::Journal {
                    reason: "the recorded orbits are none of this curve".into(),
                })?;
        let mut outside = match records.last() {
            Some(last) => last.point.outside,
            None => self.outside(&first),
        };
        for _ in records.len()..STEPS_MAX {
            let Some(next) = self.next(&here, before.as_ref(), &mut step) else {
                return Ok((records, CurveEnd::Lost));
            };
            let left = self.left(&here, &next);
            let closed = left.is_none() && records.len() > 5 && self.passes(&here, &next, &first);
            let (found, end) = match left {
                Some((index, value, end)) => (self.at(&here, &next, index, value), Some(end)),
                None if closed => (Some(first.clone()), Some(CurveEnd::Closed)),
                None => (Some(next), None),
            };
            let turned = found.as_ref().map_or(1.0, |next| next.along.dot(&here.along));
            // The angle between successive tangents grows with the step: it is kept near half the largest one. More than
            // four Newton steps say that the prediction is poor.
            let ideal = 0.5 * CURVE_COSINE_MIN.acos() / turned.min(1.0).acos().max(1e-6);
            let most = found
                .as_ref()
                .map_or(1.0, |next| if next.newton_steps > 4 { 0.7 } else { 1.5 });
            let next_step = (step * ideal.clamp(0.5, most)).min(CURVE_STEP_MAX);
            if let Some(found) = found {
                let record = self.record(Some((&here, outside)), &found, next_step);
                outside = record.point.outside;
                if end.is_none() {
                    let kept = journal.record(side, &record);
                    kept.map_err(|reason| CurveError::Journal { reason })?;
                }
                records.push(record);
                before = Some(here);
                here = self.realigned(found);
            }
            if let Some(end) = end {
                return Ok((records, end));
            }
            step = next_step;
        }
        Ok((records, CurveEnd::Lost))
    }

    /// The next orbit, with a step that is halved until the orbit is found and the tangent does not turn too far; `None`
    /// if that fails with the shortest step.
    fn next(&self, here: &CurveOrbit, before: Option<&CurveOrbit>, step: &mut f64) -> Option<CurveOrbit> {
        let units = &self.corrector.units;
        loop {
            let guess = match before {
                Some(before) => here.extrapolated(before, *step, units),
                None => here.predicted(*step, units),
            };
            let next = self.corrector.correct(&guess, &here.phase, &here.along);
            let next = next.filter(|next| next.along.dot(&here.along) > CURVE_COSINE_MIN);
            if next.is_some() {
                return next;
            }
            *step *= 0.5;
            if *step < CURVE_STEP_MIN {
                return None;
            }
        }
    }

    /// The orbit with a new condition on its mode, if the mode has turned far from the present one.
    fn realigned(&self, orbit: CurveOrbit) -> CurveOrbit {
        if orbit.alignment(self.system) > ALIGNMENT_MIN {
            return orbit;
        }
        let (guess, phase) = self.corrector.normalized(&orbit.orbit);
        let mut normal = orbit.along.clone();
        normal
            .rows_mut(self.system.first_of_mode(), self.system.layout.size())
            .fill(0.0);
        self.corrector
            .correct(&guess, &phase, &normal.normalize())
            .unwrap_or(orbit)
    }

    /// The last orbit of a recorded side, the one before it, and the next step; those of the
    /// start if nothing is recorded. `None` if a record does not fit the system.
    fn resumed(
        &self,
        first: &CurveOrbit,
        records: &[CurveRecord],
    ) -> Option<(CurveOrbit, Option<CurveOrbit>, f64)> {
        let restored = |record: &CurveRecord| {
            let size = self.system.size();
            let fits = record.unknowns.len() == size
                && record.along.len() == size
                && record.phase.len() == self.system.layout.size();
            let unknowns = fits.then(|| DVector::from_vec(record.unknowns.clone()))?;
            let along = DVector::from_vec(record.along.clone());
            let phase = DVector::from_vec(record.phase.clone());
            let guess = self.system.of_unknowns(unknowns.clone())?;
            let mut orbit = self.corrector.correct(&guess, &phase, &along)?;
            // Only the node values are needed from the correction. It moves the unknowns within its tolerance, which
            // the positions of all later orbits would show.
            orbit.orbit.unknowns = unknowns;
            orbit.along = along;
            Some(orbit)
        };
        let Some((last, earlier)) = records.split_last() else {
            return Some((first.clone(), None, CURVE_STEP_FIRST));
        };
        let before = match earlier.last() {
            Some(before) => restored(before)?,
            None => first.clone(),
        };
        Some((self.realigned(restored(last)?), Some(before), last.next_step))
    }

    /// Record of an orbit; `from` is the one before it, with the number of its other multipliers outside the unit circle.
    fn record(&self, from: Option<(&CurveOrbit, i32)>, orbit: &CurveOrbit, next_step: f64) -> CurveRecord {
        let point = self.point(orbit);
        CurveRecord {
            unknowns: orbit.orbit.unknowns.as_slice().to_vec(),
            along: orbit.along.as_slice().to_vec(),
            phase: orbit.phase.as_slice().to_vec(),
            next_step,
            point,
            resonances: from.map_or_else(Vec::new, |(from, _)| self.resonances(from, orbit)),
            double: from.and_then(|(from, outside)| self.double([from, orbit], [outside, point.outside])),
        }
    }

    /// Unknown with its value at which the curve ends between two orbits, and the reason; `None` if it goes on.
    fn left(&self, here: &CurveOrbit, next: &CurveOrbit) -> Option<(usize, f64, CurveEnd)> {
        let first = self.system.first_parameter();
        let of_range = self.plane.parameters.iter().zip(self.plane.ranges).enumerate();
        for (index, (parameter, range)) in of_range {
            let value = next.orbit.unknowns[first + index];
            let limits = range.map(|value| value * parameter.result_unit());
            let [low, high] = [limits[0].min(limits[1]), limits[0].max(limits[1])];
            let end = CurveEnd::Range(*parameter);
            if value < low {
                return Some((first + index, low, end));
            }
            if value > high {
                return Some((first + index, high, end));
            }
        }
        let angle_at = self.system.angle_at()?;
        let [from, to] = [here, next].map(|orbit| orbit.orbit.unknowns[angle_at]);
        let crosses = |angle: f64| (from - angle) * (to - angle) <= 0.0 && from != angle;
        [(PI, 2), (0.0, 1)]
            .into_iter()
            .find(|(angle, _)| crosses(*angle))
            .map(|(angle, q)| (angle_at, angle, CurveEnd::Resonance(q)))
    }

    /// The orbit between two neighbours at which an unknown has a value.
    fn at(&self, here: &CurveOrbit, next: &CurveOrbit, index: usize, value: f64) -> Option<CurveOrbit> {
        let units = &self.corrector.units;
        let [from, to] = [here, next].map(|orbit| orbit.orbit.unknowns[index]);
        let share = (value - from) / (to - from);
        let length = (&next.orbit.unknowns - &here.orbit.unknowns)
            .component_div(units)
            .dot(&next.along);
        let mut guess = next.extrapolated(here, length * (share - 1.0), units);
        guess.unknowns[index] = value;
        let mut found = self.corrector.correct(&guess, &here.phase, &self.unit(index))?;
        if found.along.dot(&here.along) < 0.0 {
            found.reverse();
        }
        Some(found)
    }

    /// True if the curve passes an orbit between two neighbours: if it equals that orbit where a parameter has its value.
    fn passes(&self, here: &CurveOrbit, next: &CurveOrbit, orbit: &CurveOrbit) -> bool {
        let first = self.system.first_parameter();
        let value = |of: &CurveOrbit, index: usize| of.orbit.unknowns[index];
        let between = [first + 1, first].into_iter().find(|&index| {
            (value(here, index) - value(orbit, index)) * (value(next, index) - value(orbit, index)) < 0.0
        });
        let found = between.and_then(|index| self.at(here, next, index, value(orbit, index)));
        found.is_some_and(|found| {
            let mut distance =
                (&found.orbit.unknowns - &orbit.orbit.unknowns).component_div(&self.corrector.units);
            // The mode has an arbitrary phase.
            distance
                .rows_mut(self.system.first_of_mode(), self.system.layout.size())
                .fill(0.0);
            distance.norm() < CLOSED
        })
    }

    /// Strong resonances with q = 3 and 4 between neighbours.
    fn resonances(&self, from: &CurveOrbit, to: &CurveOrbit) -> Vec<Resonance> {
        let Some(angle_at) = self.system.angle_at() else {
            return Vec::new();
        };
        let angles = [from, to].map(|orbit| orbit.orbit.unknowns[angle_at]);
        [3, 4]
            .into_iter()
            .filter_map(|q| {
                let angle = TAU / f64::from(q);
                let passes = (angles[0] < angle) != (angles[1] < angle);
                let orbit = passes.then(|| self.at(from, to, angle_at, angle))??;
                let point = self.point(&orbit);
                Some(Resonance { q, point })
            })
            .collect()
    }

    pub(super) fn point(&self, orbit: &CurveOrbit) -> CurvePoint {
        let system = self.system;
        let setting = system.setting_of(&orbit.orbit.unknowns);
        let angle = system.angle_of(&orbit.orbit.unknowns).0;
        let per_tooth = angle / TAU;
        CurvePoint {
            rotation: (per_tooth * system.base.linear.teeth as f64).fract(),
            rotation_per_tooth: per_tooth,
            amplitude_mm: system.base.amplitude_mm(&orbit.orbit.states),
            outside: self.outside(orbit),
            setting,
        }
    }

    /// Number of multipliers outside the unit circle, other than the critical ones; −1 if they cannot be computed.
    fn outside(&self, orbit: &CurveOrbit) -> i32 {
        let others = self.others(orbit);
        others.map_or(-1, |others| {
            others.iter().filter(|other| other.norm() > 1.0).count() as i32
        })
    }

    /// See [`Curve::error`].
    fn error(&self, orbits: &[CurveRecord]) -> [f64; 2] {
        let finer = self.system.finer();
        let corrector = Corrector {
            system: &finer,
            units: self.corrector.units.clone(),
        };
        let by_speed =
            |a: &&CurveRecord, b: &&CurveRecord| a.point.setting.rpm.total_cmp(&b.point.setting.rpm);
        let checked = [orbits.first(), orbits.iter().min_by(by_speed), orbits.last()];
        let mut error = [0.0_f64; 2];
        for record in checked.into_iter().flatten() {
            let own = DVector::from_vec(record.unknowns.clone());
            let normal = DVector::from_vec(record.along.clone());
            let guess = finer.of_unknowns(own.clone());
            let phase = DVector::from_vec(record.phase.clone());
            let there = guess.and_then(|guess| corrector.correct(&guess, &phase, &normal));
            let first = self.system.first_parameter();
            for (index, error) in error.iter_mut().enumerate() {
                let here = own[first + index];
                let change = there.as_ref().map_or(f64::INFINITY, |there| {
                    ORBIT_ROOM * (there.orbit.unknowns[first + index] - here).abs()
                });
                let least = LEAST_ERROR * here.abs();
                *error = error.max(self.plane.parameters[index].in_results(change.max(least)));
            }
        }
        error
    }
}
