//! The extended case in closed loop: its own motion under the measured forces, and what it misses.
//!
//! Regression along the measured motion is biased by the noise in that motion and by what sampling hides between samples.
//! The simulation has neither: with r(θ) = y − y_simulated(θ), θ is moved until r is orthogonal to the regressors, which then
//! are instruments (Söderström and Stoica, System Identification, 1989, chapter 8).

use rayon::prelude::*;

use super::evidence::{Explanation, Library};
use super::grid::Grid;
use super::named::extensions;
use super::record::Record;
use super::regression::{Fit, Regression, Share};
use super::scene::{Domain, Scene};
use crate::recording::{Kind, Quantity};
use crate::simulate::{Drive, Effects, Model, Room, Settings};

/// Instants between two samples at which a force is interpolated without changing its band; between these by cubics.
const FINER: usize = 8;
/// Rounds of correction.
const ROUNDS: usize = 3;

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

/// True where a record can be simulated: driven by its forces, from rest.
fn can(record: &Record) -> bool {
    record.domain == Domain::Response
        && !matches!(record.kind, Some(Kind::FreeDecay | Kind::Cutting | Kind::Idle))
        && record.force_n.iter().any(|force| !force.is_empty())
}

/// What each channel of a record reads while the extended case moves under the forces of the record, from rest.
fn simulate(scene: &Scene<'_>, record: &Record, effects: &Effects) -> Option<Vec<Vec<f64>>> {
    let all = scene.baseline.effects.clone().and(effects);
    let (dynamics, terms) = all.dynamics(scene.baseline.structure).ok()?;
    let model = Model {
        dynamics,
        cutting: None,
        drive: Some(Box::new(Measured::new(record))),
        terms,
    };
    let count = record.grid.count();
    let pickups: Vec<_> = record
        .channels
        .iter()
        .map(|channel| effects.pickup(channel.pickup.clone()))
        .collect();
    let mut samples: Vec<Vec<f64>> = vec![Vec::with_capacity(count); pickups.len()];
    let mut room = Room::new(&model);
    let settings = Settings {
        relative: 1e-7,
        ..Settings::default()
    };
    let rate_hz = record.grid.rate_hz();
    model
        .run((count - 1) as f64 / rate_hz, settings, |segment| {
            for (pickup, samples) in pickups.iter().zip(&mut samples) {
                while samples.len() < count {
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
        let last = samples.last().copied().unwrap_or(0.0);
        samples.resize(count, last);
    }
    Some(samples)
}

/// The explanation after correction by simulation, where that leaves less; else as it is.
pub(super) fn corrected(
    scene: &Scene<'_>,
    library: &mut Library,
    regression: &mut Regression,
    explanation: &Explanation,
) -> Explanation {
    if !scene.records.iter().all(can) {
        return explanation.clone();
    }
    let mut best: Option<Explanation> = None;
    let mut tried = explanation.clone();
    for _ in 0..ROUNDS {
        let Some(left) = left_in_closed_loop(scene, library, &tried) else {
            break;
        };
        let target = regression.add(scene, &left);
        let energy = regression.energy(target);
        let better = best.as_ref().is_none_or(|best| energy < best.fit.left - 1.0);
        if better {
            let mut kept = tried.clone();
            kept.fit.left = energy;
            best = Some(kept);
        } else {
            break;
        }
        let Some(next) = step(scene, library, regression, &tried, target) else {
            break;
        };
        tried = next;
    }
    // Bias gone is worth a little more noise fitted; a simulation that went elsewhere is not.
    match best {
        Some(best) if best.fit.left < 1.02 * explanation.fit.left + 10.0 => best,
        _ => explanation.clone(),
    }
}

/// What the baseline alone leaves in closed loop, in units of the noise; `None` where it cannot be simulated.
pub(super) fn left_by_baseline(
    scene: &Scene<'_>,
    library: &Library,
    regression: &mut Regression,
) -> Option<f64> {
    if !scene.records.iter().all(can) {
        return None;
    }
    let nothing = Explanation {
        choices: Vec::new(),
        fit: Fit {
            coefficients: Vec::new(),
            covariance: nalgebra::DMatrix::zeros(0, 0),
            left: 0.0,
        },
        freedoms: 0,
    };
    let left = left_in_closed_loop(scene, library, &nothing)?;
    let column = regression.add(scene, &left);
    Some(regression.energy(column))
}

/// Measured less simulated, by record and channel.
fn left_in_closed_loop(
    scene: &Scene<'_>,
    library: &Library,
    explanation: &Explanation,
) -> Option<Vec<Vec<Vec<f64>>>> {
    let mut effects = Effects::default();
    for (name, table) in extensions(scene, library, explanation)? {
        effects = effects.and(&Effects::of_extension(name, &table).ok()?);
    }
    scene
        .records
        .par_iter()
        .map(|record| {
            let simulated = simulate(scene, record, &effects)?;
            let left = record
                .channels
                .iter()
                .zip(simulated)
                .map(|(channel, simulated)| {
                    channel
                        .measured
                        .iter()
                        .zip(simulated)
                        .map(|(measured, simulated)| measured - simulated)
                        .collect()
                })
                .collect();
            Some(left)
        })
        .collect()
}

/// Coefficients and shapes moved by what the regressors see in the column `target`.
fn step(
    scene: &Scene<'_>,
    library: &mut Library,
    regression: &mut Regression,
    explanation: &Explanation,
    target: usize,
) -> Option<Explanation> {
    let mut columns = library.columns_of(explanation);
    let own = columns.len();
    let mut moving: Vec<(usize, usize)> = Vec::new();
    for place in 0..explanation.choices.len() {
        let choice = explanation.choices[place];
        let coefficients = library.coefficients(explanation, place);
        let shape = &library.candidates[choice.candidate].shapes[choice.shape].0;
        if shape.is_empty()
            || library
                .cause(choice.candidate)
                .settled(shape, &coefficients)
                .is_some()
        {
            continue;
        }
        let slopes = library.slopes(scene, regression, choice, &coefficients)?;
        moving.extend((0..slopes.len()).map(|parameter| (place, parameter)));
        columns.extend(slopes);
    }
    let change = regression.fit_column(Share::Whole, &columns, target)?;
    let mut next = explanation.clone();
    for (place, choice) in explanation.choices.iter().enumerate() {
        let mine: Vec<(usize, f64)> = moving
            .iter()
            .enumerate()
            .filter(|(_, (other, _))| *other == place)
            .map(|(index, (_, parameter))| (*parameter, change[own + index]))
            .collect();
        if mine.is_empty() {
            continue;
        }
        let bounds = library
            .cause(choice.candidate)
            .bounds(scene, &library.candidates[choice.candidate].place);
        let mut shape = library.candidates[choice.candidate].shapes[choice.shape]
            .0
            .clone();
        for (parameter, step) in mine {
            let [low, high] = bounds[parameter];
            shape[parameter] = (shape[parameter] + step).clamp(low, high);
        }
        next.choices[place] = library.add_shape(scene, regression, choice.candidate, shape)?;
    }
    for (coefficient, change) in next.fit.coefficients.iter_mut().zip(&change) {
        *coefficient += change;
    }
    library.parameters(scene, &next).map(|_| next)
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
