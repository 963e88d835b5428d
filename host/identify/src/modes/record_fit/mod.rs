//! Maximum likelihood fit of modes to the transforms of whole records, with noise in forces and responses, and with the
//! transient of each record as unknown parameters.
//!
//! At each line of the transform of a whole record, without a window,
//!
//!   X(k) = sⁿ H(s) F(k) + T(s) + noise, s = i2πk/duration,
//!
//! with n = 0 for a displacement, 1 for a velocity, 2 for an acceleration. The transient T has the poles of H and a
//! polynomial in s. It models the initial and final state of the record, so that neither leakage nor frequency
//! averaging biases the resonances (Pintelon and Schoukens, System Identification, 2nd ed. 2012, chapters 6 and 9).
//! Averaged receptances (thesis eqs 7.7–7.12) have both errors. Besides, H1 takes noise of the forces for force, which
//! biases it most where the forces of a cut are nearly dependent.
//!
//! The residual e = X − sⁿ H F − T has the covariance C = V_x + sⁿ H (V_f + V_d) Hᴴ s̄ⁿ: noise of the responses (V_x),
//! noise of the measured forces (V_f), and unmeasured forces (V_d), such as nonlinear restoring forces of the
//! structure. The parameters minimise Σ eᴴ C⁻¹ e, where the part of V_f in C depends on the parameters; this is maximum
//! likelihood with the true forces as further unknowns. Noise is white within the band, one variance per channel and
//! record, estimated from the residual ([`noise`]).

mod data;
mod equations;
mod line;
mod noise;
mod unknowns;
mod variances;

#[cfg(test)]
mod tests;

use nalgebra::{DMatrix, DVector};
use quietcut_numerics::Stop;
use quietcut_numerics::least_squares::{NormalSums, Objective};

pub use variances::ChannelNoise;

use super::covariance::constrained_inverse;
use super::error::ModesError;
use super::model::{ModalModel, warnings};
use super::refinement::{Refined, search};
use super::shape;
use data::Data;
use equations::{Equations, equations};
use line::Line;
use quietcut_frf::RecordSpectra;
use unknowns::{Transient, Unknowns};
use variances::Variances;

/// Largest number of rounds of a modal fit to whole records that alternate between the parameters and the noise
/// variances. A choice.
const ROUNDS: usize = 30;
/// Relative change of the residual's covariance, from one round of noise variances to the next, below which the rounds
/// have converged. A choice.
const SAME_NOISE: f64 = 1e-3;

const STEPS_MAX: usize = 100;

/// Relative decrease of the cost Σ eᴴ C⁻¹ e in a Levenberg–Marquardt step below which the fit to whole records has
/// converged. A choice.
const SETTLED: f64 = 1e-9;

/// Refines the modes of `model`, estimated from averaged receptances, by a maximum likelihood fit to the records.
///
/// # Errors
/// The records have other directions than the model, or too few or too many lines; the fit does not converge.
pub fn refine_by_records(
    model: &ModalModel,
    records: &[RecordSpectra],
) -> Result<(ModalModel, Vec<ChannelNoise>), ModesError> {
    let data = Data::new(model, records)?;
    let broke = || ModesError::NotConverged(model.modes.len());
    let mut unknowns = data.start(model);
    let mut variances: Vec<Variances> = (0..records.len())
        .map(|record| noise::start(&data, record, &unknowns))
        .collect();
    for _ in 0..ROUNDS {
        unknowns = least_squares(&data, &variances, unknowns).ok_or_else(broke)?;
        let mut change = 0.0_f64;
        for (record, variances) in variances.iter_mut().enumerate() {
            change = change.max(noise::update(&data, record, &unknowns, variances));
        }
        if change < SAME_NOISE {
            break;
        }
    }
    let unknowns = least_squares(&data, &variances, unknowns).ok_or_else(broke)?;
    let refined = finished(&data, &variances, unknowns).ok_or_else(broke)?;
    Ok((updated(&data, model, &refined), data.found(&variances)))
}

/// Cost Σ eᴴ C⁻¹ e over all lines and records, with the residual e of the responses and its covariance C.
fn squares(data: &Data<'_>, variances: &[Variances], unknowns: &Unknowns) -> f64 {
    let of_record = |record: usize| -> f64 {
        (0..data.records[record].frequency_hz.len())
            .map(|k| {
                let line = Line::of(data, record, unknowns, &variances[record], k);
                line.map_or(f64::INFINITY, |line| line.square)
            })
            .sum()
    };
    (0..data.records.len()).map(of_record).sum()
}

/// The cost Σ eᴴ C⁻¹ e as a function of modes and transients. The transient of each record is eliminated from the
/// normal equations.
struct RecordFit<'a> {
    data: &'a Data<'a>,
    variances: &'a [Variances],
    /// Normal equations of each record at the last linearization, from which the steps of the transients follow.
    equations: Vec<Equations>,
}

impl Objective for RecordFit<'_> {
    type Point = Unknowns;
    type Value = f64;

    fn value(&mut self, unknowns: &Unknowns) -> Option<f64> {
        let cost = squares(self.data, self.variances, unknowns);
        cost.is_finite().then_some(cost)
    }

    fn linearize(&mut self, unknowns: &Unknowns, _: &f64) -> Option<NormalSums> {
        self.equations = (0..self.data.records.len())
            .map(|record| equations(self.data, record, unknowns, &self.variances[record]))
            .collect::<Option<_>>()?;
        let size = unknowns.structure.parameters().len();
        let mut sums = NormalSums {
            matrix: DMatrix::zeros(size, size),
            gradient: DVector::zeros(size),
        };
        for of_record in &self.equations {
            sums.matrix += &of_record.normal;
            sums.gradient += &of_record.gradient;
        }
        Some(sums)
    }

    fn moved(&self, unknowns: &Unknowns, step: &DVector<f64>) -> Unknowns {
        let of_records = self.equations.iter();
        let transients: Vec<DVector<f64>> = of_records.map(|of_record| of_record.transient(step)).collect();
        unknowns.moved(step, &transients)
    }

    fn is_no_worse(&self, next: &f64, now: &f64) -> bool {
        next <= now
    }

    fn has_converged(&self, _: f64, next: &f64, now: &f64) -> bool {
        next <= now && now - next <= SETTLED * now
    }
}

/// Levenberg–Marquardt iteration for modes and transients with given noise variances; `None` if it does not end within
/// `STEPS_MAX` steps, cannot be evaluated at the start or linearized, or ends at a singular normal matrix.
fn least_squares(data: &Data<'_>, variances: &[Variances], unknowns: Unknowns) -> Option<Unknowns> {
    let mut fit = RecordFit {
        data,
        variances,
        equations: Vec::new(),
    };
    let found = search(STEPS_MAX).minimize(&mut fit, unknowns)?;
    matches!(found.stop, Stop::Converged | Stop::Stagnated).then_some(found.point)
}

/// Result of the fit with its covariance B⁻¹ M B⁻¹. M is the covariance of the gradient of half the cost Σ eᴴ C⁻¹ e,
/// and B is the curvature of half the cost; the uncertainty of the estimated forces makes M larger than B/2. `None` if
/// a covariance is not positive definite or normal equations are singular.
fn finished(data: &Data<'_>, variances: &[Variances], mut unknowns: Unknowns) -> Option<Refined> {
    let directions = unknowns
        .structure
        .modes
        .first()
        .map_or((0, 0), |mode| (mode.right.len(), mode.left.len()));
    let shared = data.shared(directions);
    for mode in &mut unknowns.structure.modes {
        shape::normalize(&mut mode.right, &mut mode.left, &shared);
    }
    let size = unknowns.structure.parameters().len();
    let mut of_gradient = DMatrix::<f64>::zeros(size, size);
    let mut curvature = DMatrix::<f64>::zeros(size, size);
    for (record, variances) in variances.iter().enumerate() {
        let equations = equations(data, record, &unknowns, variances)?;
        of_gradient += &equations.normal;
        curvature += &equations.normal;
        curvature -= equations::of_force_noise(data, record, &unknowns, variances)?;
    }
    let bread = constrained_inverse(&unknowns.structure, &shared, &curvature)?;
    // A complex number of unit variance has variance ½ along any direction.
    let covariance = &bread * (0.5 * of_gradient) * &bread;
    let (mut rest, mut all, mut values) = (0.0, 0.0, 0);
    for (record, spectra) in data.records.iter().enumerate() {
        for k in 0..spectra.frequency_hz.len() {
            let line = Line::of(data, record, &unknowns, &variances[record], k)?;
            let sizes = data.sizes(record);
            for (p, size) in sizes.iter().enumerate() {
                rest += line.left[p].norm_sqr() / size;
                all += 1.0;
                values += 2;
            }
        }
    }
    let unknown = size + unknowns.transients.iter().map(Transient::width).sum::<usize>();
    let freedom = values - unknown.min(values - 1);
    Some(Refined {
        misfit: 2.0 * squares(data, variances, &unknowns) / freedom as f64,
        relative_error: (rest / all).sqrt(),
        fit: unknowns.structure,
        covariance,
    })
}

fn updated(data: &Data<'_>, model: &ModalModel, refined: &Refined) -> ModalModel {
    let mut updated = model.clone();
    (updated.modes, updated.covariance) = refined.sorted();
    for (k, &(p, q)) in data.places.iter().enumerate() {
        updated.outside[k] = (model.responses[p], model.forces[q], refined.fit.outside[k]);
    }
    updated.fit_error = refined.relative_error;
    updated.misfit = Some(refined.misfit);
    let longest_s = data
        .records
        .iter()
        .map(|record| record.seconds)
        .fold(0.0, f64::max);
    updated.warnings = warnings(longest_s.recip(), &updated);
    updated
}
