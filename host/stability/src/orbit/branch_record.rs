//! Records of the orbits of a branch, from which an interrupted computation of the branch goes on.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::branch::{BranchPoint, Event};
use super::periodic_orbit::{Orbit, Tangent};
use crate::spectrum::stability_loss::StabilityLoss;

/// Orbit on a branch with what is needed to go on from it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BranchRecord {
    orbit: OrbitRecord,
    along: Vec<f64>,
    along_states: Vec<Vec<f64>>,
    /// Length of the step that led to this orbit.
    pub(super) step: f64,
    /// Length of the next step.
    pub(super) next_step: f64,
    /// Result at this orbit.
    pub(super) point: BranchPoint,
    events: Vec<EventRecord>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct OrbitRecord {
    value: f64,
    start: Vec<f64>,
    states: Vec<Vec<f64>>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct EventRecord {
    value: f64,
    error: f64,
    kind: StabilityLoss,
    gain: bool,
    after: usize,
    multiplier: [f64; 2],
    orbit: OrbitRecord,
    amplitude_mm: [f64; 3],
    displacement_mm: [f64; 3],
    chatter_hz: Option<f64>,
}

/// Where the orbits of a branch are recorded while it is followed, so that an interrupted computation can go on.
pub trait BranchJournal {
    /// Orbits of an earlier computation of the same branch after its first one, in their order.
    fn recorded(&mut self) -> Vec<BranchRecord>;

    /// Records the next orbit; false if the record cannot be kept. The computation then stops.
    fn record(&mut self, record: &BranchRecord) -> bool;
}

/// Branch that is not recorded.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unrecorded;

impl BranchJournal for Unrecorded {
    fn recorded(&mut self) -> Vec<BranchRecord> {
        Vec::new()
    }

    fn record(&mut self, _record: &BranchRecord) -> bool {
        true
    }
}

impl BranchRecord {
    pub(super) fn new(
        (orbit, tangent): (&Orbit, &Tangent),
        [step, next_step]: [f64; 2],
        point: &BranchPoint,
        events: &[Event],
    ) -> Self {
        Self {
            orbit: OrbitRecord::of(orbit),
            along: tangent.along.as_slice().to_vec(),
            along_states: columns(&tangent.states),
            step,
            next_step,
            point: point.clone(),
            events: events.iter().map(EventRecord::of).collect(),
        }
    }

    /// The orbit with its tangent, for states of `order` components in as many subintervals as `like` has; `None` if the
    /// record does not fit.
    pub(super) fn restored(&self, order: usize, like: &Orbit) -> Option<(Orbit, Tangent)> {
        let orbit = self.orbit.restored(order)?;
        let states = matrices(&self.along_states, order)?;
        let fits = orbit.has_form_of(like) && self.along.len() == orbit.start.len() + 1;
        let same = states.len() == orbit.states.len();
        (fits && same).then(|| {
            let along = DVector::from_vec(self.along.clone());
            (orbit, Tangent { along, states })
        })
    }

    /// The orbit, of states of `order` components; `None` if the record does not fit.
    pub(super) fn orbit(&self, order: usize) -> Option<Orbit> {
        self.orbit.restored(order)
    }

    /// Bifurcations on the step that led to this orbit; `None` if the record does not fit.
    pub(super) fn restored_events(&self, order: usize) -> Option<Vec<Event>> {
        self.events.iter().map(|event| event.restored(order)).collect()
    }
}

impl OrbitRecord {
    fn of(orbit: &Orbit) -> Self {
        Self {
            value: orbit.value,
            start: orbit.start.as_slice().to_vec(),
            states: columns(&orbit.states),
        }
    }

    fn restored(&self, order: usize) -> Option<Orbit> {
        Some(Orbit {
            value: self.value,
            start: DVector::from_vec(self.start.clone()),
            states: matrices(&self.states, order)?,
        })
    }
}

impl EventRecord {
    fn of(event: &Event) -> Self {
        Self {
            value: event.value,
            error: event.error,
            kind: event.kind,
            gain: event.gain,
            after: event.after,
            multiplier: [event.multiplier.re, event.multiplier.im],
            orbit: OrbitRecord::of(&event.orbit),
            amplitude_mm: event.amplitude_mm,
            displacement_mm: event.displacement_mm,
            chatter_hz: event.chatter_hz,
        }
    }

    fn restored(&self, order: usize) -> Option<Event> {
        let [re, im] = self.multiplier;
        Some(Event {
            value: self.value,
            error: self.error,
            kind: self.kind,
            gain: self.gain,
            after: self.after,
            multiplier: Complex64::new(re, im),
            orbit: self.orbit.restored(order)?,
            amplitude_mm: self.amplitude_mm,
            displacement_mm: self.displacement_mm,
            chatter_hz: self.chatter_hz,
        })
    }
}

fn columns(matrices: &[DMatrix<f64>]) -> Vec<Vec<f64>> {
    matrices.iter().map(|matrix| matrix.as_slice().to_vec()).collect()
}

/// Matrices of `order` rows; `None` if a length is no multiple of it.
fn matrices(columns: &[Vec<f64>], order: usize) -> Option<Vec<DMatrix<f64>>> {
    let matrix = |values: &Vec<f64>| {
        (order > 0 && values.len().is_multiple_of(order))
            .then(|| DMatrix::from_column_slice(order, values.len() / order, values))
    };
    columns.iter().map(matrix).collect()
}
