//! The extended case in closed loop: what it reads of its own motion under the measured forces.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;

use crate::records::domain::Domain;
use crate::records::record::Record;
use crate::records::study::Study;
use crate::signal::grid::{Grid, catmull_rom};
use quietcut_model::structure::{FirstOrder, Structure};
use quietcut_recording::TestKind;
use quietcut_simulate::{Drive, Dynamics, Effects, Model, MotionState, Reading, Settings};

/// Instants between two samples at which a force is interpolated without changing its band; between these by cubics.
const FINER: usize = 8;
/// Measured forces as a drive.
struct Measured {
    rate_hz: f64,
    /// Along x, y, z; empty where none acts.
    force_n: [Vec<f64>; 3],
}

impl Measured {
    /// Forces at the samples of a record.
    fn new(record: &Record, force_n: &[Vec<f64>; 3]) -> Self {
        let grid = Grid::new(record.grid.count(), record.grid.rate_hz(), 0.0, FINER);
        Self {
            rate_hz: FINER as f64 * record.grid.rate_hz(),
            force_n: std::array::from_fn(|axis| {
                let force = &force_n[axis];
                if force.is_empty() {
                    Vec::new()
                } else {
                    grid.fine_samples(&grid.continued_spectrum(force))
                }
            }),
        }
    }
}

impl Drive for Measured {
    fn force_n(&self, t: f64) -> [f64; 3] {
        let place = t * self.rate_hz;
        self.force_n.each_ref().map(|force| catmull_rom(force, place))
    }

    /// From sample to sample of the record.
    fn longest_step_s(&self) -> f64 {
        FINER as f64 / self.rate_hz
    }
}

impl Drive for Shared {
    fn force_n(&self, t: f64) -> [f64; 3] {
        self.0.force_n(t)
    }

    fn longest_step_s(&self) -> f64 {
        self.0.longest_step_s()
    }
}

/// A drive that many simulations use.
struct Shared(Arc<Measured>);

/// Error allowed per step as a share of the amplitude: thousands of steps add up to less than the noise of the best sensor, 90 dB
/// below what it reads.
const STEP_ERROR: f64 = 1e-7;

/// Error allowed per step as a share of the largest amplitude of the record, where that of the moment is small.
const STEP_ERROR_AT_REST: f64 = 1e-9;

/// Largest displacement of a simulation over that of the record.
const AWAY: f64 = 100.0;

/// Steps for each sample of a record, in the mean, beyond which a simulation is given up: smooth motion needs one or two, and dry
/// friction a few for each reversal.
const STEPS_PER_SAMPLE: u64 = 25;

/// What a term's own state is at rest, as a share of the largest displacement: nothing that could be seen.
const AT_REST: f64 = 1e-9;

fn largest_m(record: &Record) -> f64 {
    (0..3)
        .map(|axis| record.motion.largest_m(axis))
        .fold(f64::MIN_POSITIVE, f64::max)
}

/// What is simulated: effects beside those of the baseline, on its structure or another.
pub(crate) struct Extended {
    /// The further effects.
    pub effects: Effects,
    /// The structure without effects; `None` for that of the baseline.
    pub structure: Option<Structure>,
}

/// The drives of all records.
pub(crate) struct ClosedLoop {
    drives: Vec<Arc<Measured>>,
}

/// True of a record whose start nobody knows: a structure that is let go.
pub(crate) fn starts_anywhere(record: &Record) -> bool {
    record.kind == Some(TestKind::FreeDecay)
}

/// True where a record can be simulated: driven by its forces from rest, or let go.
fn can(record: &Record) -> bool {
    let driven = record.force_n.iter().any(|force| !force.is_empty());
    record.domain == Domain::Response
        && !matches!(record.kind, Some(TestKind::Cutting | TestKind::Idle))
        && (driven || starts_anywhere(record))
}

/// The static force that holds the structure of the first `own` states of `first_order` where they have the tool, N along the axes
/// of the scene: F = H(0)⁻¹ u with H(0) = −C A⁻¹ B; `None` where a force is not held.
pub(crate) fn holding_force_n(
    study: &Study<'_>,
    first_order: &FirstOrder,
    states: &[f64],
) -> Option<Vector3<f64>> {
    let own = states.len();
    let (a, b) = (first_order.a.view((0, 0), (own, own)), first_order.b.rows(0, own));
    let c = first_order.c.columns(0, own);
    let compliance = -(c * a.lu().solve(&b)?);
    let moved = c * DVector::from_column_slice(states);
    let axes = &study.baseline.axes;
    let compliance = DMatrix::from_fn(axes.len(), axes.len(), |i, j| compliance[(axes[i], axes[j])]);
    let force = compliance
        .lu()
        .solve(&DVector::from_fn(axes.len(), |i, _| moved[axes[i]]))?;
    let mut along = Vector3::zeros();
    for (axis, force) in axes.iter().zip(force.iter()) {
        along[*axis] = *force;
    }
    along.iter().all(|force| force.is_finite()).then_some(along)
}

/// Modes that the extended case has more than the baseline begin where the static force has them that holds the rest where it
/// begins: what was let go was pulled as a whole. Without such a force they begin at rest.
fn let_go(study: &Study<'_>, dynamics: &Dynamics, states: &mut [f64]) {
    let (own, all) = (study.baseline.first_order.order(), dynamics.order());
    if own >= all {
        return;
    }
    let first_order = dynamics.first_order();
    let Some(force) = holding_force_n(study, &first_order, &states[..own]) else {
        return;
    };
    let more = all - own;
    let pulled = first_order.b.rows(own, more) * force;
    if let Some(held) = first_order
        .a
        .view((own, own), (more, more))
        .clone_owned()
        .lu()
        .solve(&pulled)
    {
        for (state, held) in states[own..all].iter_mut().zip(held.iter()) {
            *state = -held;
        }
    }
}

/// Forces that remember their path begin where the structure does.
fn remember(model: &Model, states: &mut [f64]) {
    let (structure, own) = states.split_at_mut(model.dynamics.order());
    let at = MotionState {
        t: 0.0,
        x: model.dynamics.displacement(structure),
        v: model.dynamics.velocity_under(structure, [0.0; 3]),
    };
    let mut from = 0;
    for term in &model.restoring_forces {
        let to = from + term.states();
        if term.remembers() {
            term.begin(&at, &mut own[from..to]);
        }
        from = to;
    }
}

impl ClosedLoop {
    /// `None` where some record cannot be simulated.
    pub(crate) fn new(study: &Study<'_>) -> Option<Self> {
        study.records.iter().all(can).then(|| Self {
            drives: study
                .records
                .par_iter()
                .map(|record| Arc::new(Measured::new(record, &record.force_n)))
                .collect(),
        })
    }

    /// The same records, driven by other forces: by record, at its samples.
    pub(crate) fn driven_by(study: &Study<'_>, forces_n: &[[Vec<f64>; 3]]) -> Self {
        let records = study.records.par_iter().zip(forces_n);
        Self {
            drives: records
                .map(|(record, force_n)| Arc::new(Measured::new(record, force_n)))
                .collect(),
        }
    }

    fn model(&self, study: &Study<'_>, record: usize, extended: &Extended) -> Option<Model> {
        let all = study.baseline.effects.clone().and(&extended.effects);
        let structure = extended.structure.as_ref().unwrap_or(study.baseline.structure);
        let (dynamics, restoring_forces) = all.dynamics(structure).ok()?;
        Some(Model {
            dynamics,
            cutting: None,
            drive: Some(Box::new(Shared(self.drives[record].clone()))),
            restoring_forces,
        })
    }

    /// True where a term can hold an axis, as dry friction does.
    pub(crate) fn holds(&self, study: &Study<'_>, extended: &Extended) -> Option<bool> {
        let model = self.model(study, 0, extended)?;
        Some(model.restoring_forces.iter().any(|term| term.holds().is_some()))
    }

    /// True where the extended case has terms of its own beside the linear structure.
    pub(crate) fn is_nonlinear(&self, study: &Study<'_>, extended: &Extended) -> bool {
        self.model(study, 0, extended)
            .is_some_and(|model| !model.restoring_forces.is_empty())
    }

    /// The states of the extended case where those of the baseline are `structure`: what it has more is let go with it
    /// ([`let_go`]), states of terms are where they are found going on. Beside them about the size of each, for a displacement of
    /// one meter; `None` for those that follow from others.
    pub(crate) fn begin(
        &self,
        study: &Study<'_>,
        record: usize,
        extended: &Extended,
        structure: &[f64],
    ) -> Option<(Vec<f64>, Vec<Option<f64>>)> {
        let model = self.model(study, record, extended)?;
        let order = model.dynamics.order();
        let mut states = structure.to_vec();
        states.resize(order, 0.0);
        let_go(study, &model.dynamics, &mut states);
        let at = MotionState {
            t: 0.0,
            x: model.dynamics.displacement(&states),
            v: model.dynamics.velocity_under(&states, [0.0; 3]),
        };
        for term in &model.restoring_forces {
            let from = states.len();
            states.resize(from + term.states(), 0.0);
            term.begin(&at, &mut states[from..]);
        }
        let mut sizes: Vec<Option<f64>> = model.dynamics.sizes().iter().map(|size| Some(*size)).collect();
        sizes[structure.len()..].fill(None);
        for term in &model.restoring_forces {
            let size = (!term.remembers()).then_some(1.0);
            sizes.resize(sizes.len() + term.states(), size);
        }
        Some((states, sizes))
    }

    /// What each channel reads in the first `length` samples, zero behind them, while the case that is `extended` moves under
    /// the forces of the record; from rest where `start` is empty.
    pub(crate) fn simulate(
        &self,
        study: &Study<'_>,
        index: usize,
        extended: &Extended,
        start: &[f64],
        length: usize,
    ) -> Option<Vec<Vec<f64>>> {
        let record = &study.records[index];
        let model = self.model(study, index, extended)?;
        let count = record.grid.count();
        let rate_hz = record.grid.rate_hz();
        let mut readings: Vec<Reading> = record
            .channels
            .iter()
            .map(|channel| extended.effects.pickup(channel.pickup.clone()))
            .map(|pickup| Reading::new(&model, pickup, rate_hz, length))
            .collect();
        let settings = Settings {
            relative: STEP_ERROR,
            absolute_m: STEP_ERROR_AT_REST * largest_m(record),
            // Records may be in other units than meters: what is far beyond the measured motion has run away.
            largest_m: AWAY * largest_m(record),
            steps_max: STEPS_PER_SAMPLE * count as u64,
        };
        let mut states = start.to_vec();
        if states.is_empty() {
            states.resize(model.dynamics.order(), 0.0);
            // Where a term's own state and the velocity are both exactly zero, no branch of it holds.
            states.resize(model.order(), AT_REST * largest_m(record));
        }
        states.resize(model.order(), 0.0);
        if starts_anywhere(record) {
            let_go(study, &model.dynamics, &mut states);
            remember(&model, &mut states);
        }
        // The mean over the last sample ends half a sample later.
        let later = if model.dynamics.velocity_jumps() { 0.5 } else { 0.0 };
        let end_s = ((length.max(2) - 1) as f64 + later) / rate_hz;
        model
            .run_from(states, end_s, settings, |segment| {
                readings.iter_mut().for_each(|reading| reading.observe(segment));
            })
            .ok()?;
        let mut samples: Vec<Vec<f64>> = readings.into_iter().map(|reading| reading.samples().1).collect();
        for samples in &mut samples {
            // Rounding of the last instant may leave it out.
            let last = samples.last().copied().unwrap_or(0.0);
            samples.resize(length, last);
            samples.resize(count, 0.0);
        }
        samples
            .iter()
            .flatten()
            .all(|sample| sample.is_finite())
            .then_some(samples)
    }
}
