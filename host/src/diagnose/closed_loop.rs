//! The extended case in closed loop: what it reads of its own motion under the measured forces.

use std::sync::Arc;

use rayon::prelude::*;

use super::grid::Grid;
use super::record::Record;
use super::scene::{Domain, Scene};
use crate::recording::{Kind, Quantity};
use crate::simulate::{At, Drive, Effects, Model, Room, Settings};

/// Instants between two samples at which a force is interpolated without changing its band; between these by cubics.
const FINER: usize = 8;
/// Measured forces as a drive.
struct Measured {
    rate_hz: f64,
    /// Along x, y, z; empty where none acts.
    force_n: [Vec<f64>; 3],
}

impl Measured {
    fn new(record: &Record) -> Self {
        let grid = Grid::new(record.grid.count(), record.grid.rate_hz(), 0.0, FINER);
        Self {
            rate_hz: FINER as f64 * record.grid.rate_hz(),
            force_n: std::array::from_fn(|axis| {
                let force = &record.force_n[axis];
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
}

/// A cubic through the two samples beside `place` with the slopes of their neighbours.
fn catmull_rom(samples: &[f64], place: f64) -> f64 {
    let Some(last) = samples.len().checked_sub(1) else {
        return 0.0;
    };
    let index = (place.max(0.0) as usize).min(last);
    let u = (place - index as f64).clamp(0.0, 1.0);
    let at = |offset: isize| samples[index.saturating_add_signed(offset).min(last)];
    let (a, b, c, d) = (at(-1), at(0), at(1), at(2));
    b + 0.5 * u * (c - a + u * (2.0 * a - 5.0 * b + 4.0 * c - d + u * (3.0 * (b - c) + d - a)))
}

impl Drive for Shared {
    fn force_n(&self, t: f64) -> [f64; 3] {
        self.0.force_n(t)
    }
}

/// A drive that many simulations use.
struct Shared(Arc<Measured>);

/// Error allowed per step as a share of the amplitude: a thousandth of the noise of the best sensor.
const STEP_ERROR: f64 = 1e-7;

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

/// The drives of all records.
pub(super) struct ClosedLoop {
    drives: Vec<Arc<Measured>>,
}

/// True of a record whose start nobody knows: a structure that is let go.
pub(super) fn starts_anywhere(record: &Record) -> bool {
    record.kind == Some(Kind::FreeDecay)
}

/// True where a record can be simulated: driven by its forces from rest, or let go.
fn can(record: &Record) -> bool {
    let driven = record.force_n.iter().any(|force| !force.is_empty());
    record.domain == Domain::Response
        && !matches!(record.kind, Some(Kind::Cutting | Kind::Idle))
        && (driven || starts_anywhere(record))
}

impl ClosedLoop {
    /// `None` where some record cannot be simulated.
    pub(super) fn new(scene: &Scene<'_>) -> Option<Self> {
        scene.records.iter().all(can).then(|| Self {
            drives: scene
                .records
                .par_iter()
                .map(|record| Arc::new(Measured::new(record)))
                .collect(),
        })
    }

    fn model(&self, scene: &Scene<'_>, record: usize, effects: &Effects) -> Option<Model> {
        let all = scene.baseline.effects.clone().and(effects);
        let (dynamics, terms) = all.dynamics(scene.baseline.structure).ok()?;
        Some(Model {
            dynamics,
            cutting: None,
            drive: Some(Box::new(Shared(self.drives[record].clone()))),
            terms,
        })
    }

    /// True where a term can hold an axis, as dry friction does.
    pub(super) fn holds(&self, scene: &Scene<'_>, effects: &Effects) -> Option<bool> {
        let model = self.model(scene, 0, effects)?;
        Some(model.terms.iter().any(|term| term.holds().is_some()))
    }

    /// The states of the extended case where those of the baseline are `structure`: what it has more begins at rest, states of
    /// terms where they are found going on. Beside them about the size of each, for a displacement of one meter.
    pub(super) fn begin(
        &self,
        scene: &Scene<'_>,
        record: usize,
        effects: &Effects,
        structure: &[f64],
    ) -> Option<(Vec<f64>, Vec<f64>)> {
        let model = self.model(scene, record, effects)?;
        let order = model.dynamics.order();
        let mut states = structure.to_vec();
        states.resize(order, 0.0);
        let at = At {
            t: 0.0,
            x: model.dynamics.displacement(&states),
            v: model.dynamics.velocity_under(&states, [0.0; 3]),
        };
        for term in &model.terms {
            let from = states.len();
            states.resize(from + term.states(), 0.0);
            term.begin(&at, &mut states[from..]);
        }
        let mut sizes = model.dynamics.sizes().to_vec();
        sizes.resize(states.len(), 1.0);
        Some((states, sizes))
    }

    /// What each channel reads in the first `length` samples, zero behind them, while the case with `effects` moves under
    /// the forces of the record; from rest where `start` is empty.
    pub(super) fn simulate(
        &self,
        scene: &Scene<'_>,
        index: usize,
        effects: &Effects,
        start: &[f64],
        length: usize,
    ) -> Option<Vec<Vec<f64>>> {
        let record = &scene.records[index];
        let model = self.model(scene, index, effects)?;
        let count = record.grid.count();
        let pickups: Vec<_> = record
            .channels
            .iter()
            .map(|channel| effects.pickup(channel.pickup.clone()))
            .collect();
        let mut samples: Vec<Vec<f64>> = vec![Vec::with_capacity(count); pickups.len()];
        let mut room = Room::new(&model);
        let settings = Settings {
            relative: STEP_ERROR,
            // Records may be in other units than meters: what is far beyond the measured motion has run away.
            largest_m: AWAY * largest_m(record),
            steps_max: STEPS_PER_SAMPLE * count as u64,
            ..Settings::default()
        };
        let rate_hz = record.grid.rate_hz();
        let mut states = start.to_vec();
        if states.is_empty() {
            states.resize(model.dynamics.order(), 0.0);
            // Where a term's own state and the velocity are both exactly zero, no branch of it holds.
            states.resize(model.order(), AT_REST * largest_m(record));
        }
        states.resize(model.order(), 0.0);
        let end_s = (length.max(2) - 1) as f64 / rate_hz;
        model
            .run_from(states, end_s, settings, |segment| {
                for (pickup, samples) in pickups.iter().zip(&mut samples) {
                    while samples.len() < length {
                        let t = samples.len() as f64 / rate_hz - pickup.delay_s;
                        if t > segment.to_s() {
                            break;
                        }
                        if t < 0.0 {
                            samples.push(0.0);
                            continue;
                        }
                        let motion = segment.motion(t, &mut room);
                        samples.push(pickup.read(match pickup.quantity {
                            Quantity::Velocity => motion.velocity_m_per_s,
                            Quantity::Acceleration => motion.acceleration_m_per_s2.unwrap_or([0.0; 3]),
                            _ => motion.displacement_m,
                        }));
                    }
                }
            })
            .ok()?;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubics_go_through_their_samples_and_are_exact_for_lines() {
        let samples = [0.0, 1.0, 2.0, 3.0, 4.0];
        for place in [0.0, 0.7, 1.5, 2.0, 2.9, 4.0] {
            if (1.0..=3.0).contains(&place) {
                assert!((catmull_rom(&samples, place) - place).abs() < 1e-12);
            }
        }
        assert_eq!(catmull_rom(&[], 1.0), 0.0);
        assert_eq!(catmull_rom(&samples, 9.0), 4.0);
    }
}
