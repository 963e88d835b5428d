//! What noise of the forces does to the parameters of a machine that is not linear.
//!
//! The simulation goes under the measured force f, the machine under f − n. What that leaves is weighed by the receptance of the
//! baseline, S = diag(σ²) + Σ σ_f² h hᴴ (`whitening`). A machine with a fold near its resonance, or one that friction holds, answers to n
//! otherwise: when it jumps, or lets go, hangs on n as it hangs on the parameters, which then seem to be known far better than they
//! are. With J the slopes in units of the noise and N = JᵀJ, what is left by n, e, moves the parameters by δ = N⁻¹ Jᵀ e. Noise n_k is
//! drawn, and of e_k = y(f + n_k) − y(f) the part that N has already, e'_k = H n_k, is taken off:
//! C = D N⁻¹ D, D_i² = max(1, 1 + mean_k(δ_ki² − δ'_ki²) / (N⁻¹)_ii), the parametric bootstrap with one step of the search (Efron and Tibshirani,
//! An Introduction to the Bootstrap, 1993, ch. 6) with the linear machine as control variate. Intervals only become wider.

use std::ops::Range;

use nalgebra::DVector;
use num_complex::Complex64;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use crate::candidates::closed_loop::ClosedLoop;
use crate::criteria::LEAST_FORCE_NOISE_VARIANCE;
use crate::fit::candidate_model::CandidateModel;
use crate::fit::library::Library;
use crate::fit::output_error::{OutputError, projected};
use crate::fit::segment::{Segment, Subset};
use crate::fit::unknowns::{FreeParameter, at_bounds, covariance};

/// How often noise is drawn: by 16 a deviation is known to a fifth, by 4 to a third. Of long records as often as so many samples are
/// simulated.
const DRAWS: [usize; 2] = [4, 16];
const SIMULATED: usize = 400_000;
/// Half of the draws, and four at least, tell whether there is anything to it, which is this share of what is known already.
const FIRST: usize = 4;
/// A stream of random numbers of its own: a record of a simulation may have noise of the same seed.
const STREAM: u64 = 0x666f_7263_6573;

/// Forces along the axes, at the samples of a record.
type Forces = [Vec<f64>; 3];

impl OutputError<'_> {
    /// See the head of the file; `None` where no force has noise, or nothing but the linear structure answers to it.
    pub(crate) fn spread(&self, library: &Library, model: &CandidateModel) -> Option<CandidateModel> {
        let simulated = model.simulated.as_ref()?;
        let mut deviations = self
            .study
            .records
            .iter()
            .flat_map(|record| record.force_deviation_n);
        if deviations.all(|deviation| deviation == 0.0) {
            return None;
        }
        let (mut problem, mut point) = self.problem(library, model)?;
        point.starts.clone_from(&simulated.starts);
        let effects = problem.effects(self.study, &point)?;
        if !self.closed.is_nonlinear(self.study, &effects) {
            return None;
        }
        for (slot, step) in &mut problem.slots {
            if let FreeParameter::Inner { choice, index, .. } = *slot {
                let known = simulated.covariance[choice][(index, index)].sqrt();
                let least = problem.least_step * point.inner[choice][index].abs();
                *step = known.clamp(1e-3 * *step, *step).max(least);
            }
        }
        let whole = self.of_subset(Subset::Whole);
        let left = self.residuals(&problem, &whole, &point)?;
        let columns = self.columns(&problem, &whole, &point, &left)?;
        let (mut normal, mut gradient) = self.normal(&mut problem, &columns, &point, &left);
        at_bounds(&problem, &point, &mut normal, &mut gradient);
        let covariance = covariance(&normal)?;
        let size = problem.slots.len();
        // δ² − δ'² of one draw.
        let more_of = |draw: usize| {
            let noise = self.drawn(draw as u64);
            let closed = ClosedLoop::driven_by(self.study, &self.with(&noise));
            let mut shaken = self.residuals_by(&closed, &problem, &whole, &point)?;
            for (shaken, left) in shaken.iter_mut().zip(&left) {
                shaken
                    .iter_mut()
                    .zip(left)
                    .for_each(|(shaken, left)| *shaken -= left);
            }
            let step = &covariance * projected(&columns, size, &shaken);
            let linear = &covariance * projected(&columns, size, &self.by_baseline(&noise, &whole));
            Some(step.component_mul(&step) - linear.component_mul(&linear))
        };
        let draws = |range: Range<usize>| -> Vec<Option<DVector<f64>>> {
            range.into_par_iter().map(more_of).collect()
        };
        let samples: usize = self.study.records.iter().map(|record| record.grid.count()).sum();
        let most = (SIMULATED / samples.max(1)).clamp(DRAWS[0], DRAWS[1]);
        let first = FIRST.max(most / 2);
        let mut drawn = draws(0..first);
        let is_worth = |more: &DVector<f64>| {
            let inner = problem.slots.iter().enumerate();
            inner
                .filter(|(_, (slot, _))| matches!(slot, FreeParameter::Inner { .. }))
                .any(|(slot, _)| more[slot] > LEAST_FORCE_NOISE_VARIANCE * covariance[(slot, slot)])
        };
        if !is_worth(&mean(&drawn)?) {
            return None;
        }
        drawn.extend(draws(first..most));
        // What a few draws tell of a variance makes of a normal distribution one of Student's, with the variance ν/(ν − 2).
        let degrees = drawn.iter().flatten().count().max(3) as f64;
        let more = mean(&drawn)? * (degrees / (degrees - 2.0));
        let mut spread = model.clone();
        let by_choice = &mut spread.simulated.as_mut()?.covariance;
        for (index, (slot, _)) in problem.slots.iter().enumerate() {
            let FreeParameter::Inner {
                choice, index: inner, ..
            } = *slot
            else {
                continue;
            };
            let known = covariance[(index, index)];
            let factor = if known > 0.0 && more[index].is_finite() {
                (1.0 + more[index] / known).max(1.0).sqrt()
            } else {
                1.0
            };
            by_choice[choice].row_mut(inner).scale_mut(factor);
            by_choice[choice].column_mut(inner).scale_mut(factor);
        }
        Some(spread)
    }

    /// Noise as that of the sensors of force is, by record.
    fn drawn(&self, draw: u64) -> Vec<Forces> {
        let mut random = ChaCha8Rng::seed_from_u64(draw);
        random.set_stream(STREAM);
        let records = self.study.records.iter();
        records
            .map(|record| {
                std::array::from_fn(|axis| {
                    let deviation_n = record.force_deviation_n[axis];
                    record.force_n[axis]
                        .iter()
                        .map(|_| -> f64 {
                            let normal: f64 = StandardNormal.sample(&mut random);
                            deviation_n * normal
                        })
                        .collect()
                })
            })
            .collect()
    }

    /// The measured forces with `noise`.
    fn with(&self, noise: &[Forces]) -> Vec<Forces> {
        let records = self.study.records.iter().zip(noise);
        records
            .map(|(record, noise)| {
                std::array::from_fn(|axis| {
                    let forces = record.force_n[axis].iter().zip(&noise[axis]);
                    forces.map(|(force, noise)| force + noise).collect()
                })
            })
            .collect()
    }

    /// What is left by record where the baseline answers to `noise`, in units of the noise.
    fn by_baseline(&self, noise: &[Forces], segments: &[&Segment]) -> Vec<Vec<f64>> {
        let records = self.study.records.iter().zip(noise).enumerate();
        records
            .map(|(index, (record, noise))| {
                let spectra: [Option<Vec<Complex64>>; 3] = std::array::from_fn(|axis| {
                    (!noise[axis].is_empty()).then(|| record.grid.spectrum(&noise[axis]))
                });
                let read: Vec<Vec<f64>> = (0..record.channels.len())
                    .map(|channel| record.read_response(&spectra, channel))
                    .collect();
                let mine = segments.iter().filter(|segment| segment.record == index);
                mine.flat_map(|segment| segment.whiten(&read)).collect()
            })
            .collect()
    }
}

/// The mean of draws. One that could not be simulated, since the machine ran away, moved at least as far as the one that moved
/// farthest; `None` where none could.
fn mean(drawn: &[Option<DVector<f64>>]) -> Option<DVector<f64>> {
    let farthest = drawn.iter().flatten().cloned().reduce(|a, b| a.sup(&b))?;
    let sum: DVector<f64> = drawn.iter().map(|draw| draw.as_ref().unwrap_or(&farthest)).sum();
    Some(sum / drawn.len() as f64)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::tests::structure::believed;
    use crate::{Options, diagnose};
    use quietcut_model::structure::Direction;
    use quietcut_recording::Recording;
    use quietcut_simulate::Effects;
    use quietcut_simulate::rig::{Noise, Rig, Signal};

    const K3_N_PER_M3: f64 = -5e10;

    /// A sweep through the fold of a softening spring, with 1 % of noise on force and displacement.
    fn record(seed: u64) -> Recording {
        let signal = Signal::Sweep {
            first_hz: 10.0,
            last_hz: 25.0,
            amplitude_n: 100.0,
            seconds: 30.0,
        };
        let spring = format!("cubic-stiffness={K3_N_PER_M3}");
        let rig = Rig {
            effects: Effects::parse([spring.as_str()]).unwrap(),
            ..Rig::new(Direction::X, signal, 256.0)
        };
        let path = format!("sweep-{seed}.csv");
        let (mut record, _) = rig
            .record(believed().structure().unwrap(), Path::new(&path))
            .unwrap();
        let noise = Noise {
            relative: 0.01,
            ..Noise::default()
        };
        noise.add(&mut record, seed);
        record
    }

    #[test]
    fn a_spring_is_known_no_better_than_noise_of_the_force_lets_its_jump_be() {
        let seeds = 1..=6;
        let count = seeds.clone().count() as f64;
        let squares: f64 = seeds
            .map(|seed| {
                let diagnosis = diagnose(&believed(), &[record(seed)], &Options::default()).unwrap();
                assert_eq!(diagnosis.names(), ["cubic-stiffness"], "seed {seed}");
                let k3 = &diagnosis.causes[0].parameters["k3_n_per_m3"];
                let [low, high] = k3.ci90;
                println!("seed {seed}: {:e} ± {:e}", k3.value, 0.5 * (high - low));
                ((k3.value - K3_N_PER_M3) / (0.5 * (high - low))).powi(2)
            })
            .sum();
        // Of a normal distribution 1/1.645; twice that has six draws of it one time in a thousand. By the receptance alone it is three.
        let scatter = (squares / count).sqrt();
        assert!(scatter < 1.2, "{scatter} half-widths");
    }

    #[test]
    fn a_wrong_unit_is_said_of_what_looks_nothing_like_the_case() {
        let mut record = record(1);
        let displacement = record.channels.iter_mut().find(|channel| channel.name == "x");
        displacement.unwrap().samples.iter_mut().for_each(|x| *x *= 1e3);
        let said = diagnose(&believed(), &[record], &Options::default())
            .unwrap_err()
            .to_string();
        assert!(
            said.contains("x is") && said.contains("It is about a thousand"),
            "{said}"
        );
    }
}
