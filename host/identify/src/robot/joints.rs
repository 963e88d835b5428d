//! Stiffness and damping of a robot's joints from receptances at several postures.
//!
//! The geometry and inertia of the links are given (drawings, CAD). The mass of the last link, including tool and
//! payload, may be a parameter. The receptance at a posture q₀ is H(ω) = J Z⁻¹ Jᵀ with Z = K + iωC − ω²M(q₀) (thesis
//! eqs 3.14, 3.15, without the inverse of J). The fit determines the logarithms of the parameters and weights each
//! measured receptance by the inverse of its standard deviation. The first guess of the stiffnesses comes from the
//! lowest frequencies, where H = Σ J_j J_jᵀ/k_j is linear in the compliances 1/k_j. Cubic terms require tests at
//! several force levels: [`cubic_joints`](crate::robot::cubic_joints).

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector, Matrix3, Matrix3xX};
use num_complex::Complex64;
use quietcut_numerics::Stop;
use quietcut_numerics::least_squares::{
    Damping, Idle, LevenbergMarquardt, LinearProblem, NormalSums, Objective, invert_normal_equations,
};
use rayon::prelude::*;

pub use super::joint_parameter::JointParameter;
use super::receptance_model::Model;
use crate::criteria::{GUESSED_STIFFNESS_RATIO, LEAST_RELATIVE_ERROR, NEARLY_STATIC};
use crate::least_squares::FitError;
use quietcut_frf::FrfTable;
use quietcut_model::structure::Robot;
use quietcut_numerics::statistics::{NINETY_PERCENT, student_ninety_percent};

/// Receptances at one posture.
#[derive(Clone, Debug)]
pub struct PostureFrf {
    /// Joint angles of the posture in the order of the joints, rad.
    pub angles_rad: Vec<f64>,
    /// The receptances measured at the posture.
    pub table: FrfTable,
    /// Standard deviation of the magnitude of the receptance, by entry of the table, then by frequency, m/N.
    pub deviation: Vec<Vec<f64>>,
}

/// Result of a fit to receptances: a robot with identified stiffness and damping of its joints.
#[derive(Clone, Debug)]
pub struct JointFit {
    /// The robot with the fitted joint parameters, at the posture of the robot from which the fit started.
    pub robot: Robot,
    /// The joint parameters that were fitted, in the order of the rows of `covariance`.
    pub parameters: Vec<JointParameter>,
    /// Covariance of the logarithms of the joint parameters, from the scatter between receptances and from an assumed
    /// error of calibration and of delay that all receptances have in common.
    pub covariance: DMatrix<f64>,
    /// χ² per degree of freedom: near 1 if the residual is within the standard deviations of the receptances.
    pub misfit: f64,
    /// NRMSE of the fitted receptances.
    pub relative_error: f64,
}

/// Reason why the fit of joints gives no result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum JointFitError {
    /// The number of joint angles of a posture differs from the number of joints.
    #[error("a posture has {found} joint angles; the robot has {joints} joints")]
    Angles {
        /// Number of joint angles of the posture.
        found: usize,
        /// Number of joints of the robot.
        joints: usize,
    },
    /// The measurements do not determine this joint parameter, or all parameters together.
    #[error(
        "the receptances do not determine {0}; postures in which that joint moves the tool, and frequencies up to the modes that it has a part in, are needed"
    )]
    Undetermined(String),
    /// The iteration found no minimum of the weighted sum of squared residuals of the receptances.
    #[error(
        "the fit does not converge; its sum of squares over degrees of freedom is {0:.3e}: geometry or inertia of the links may be wrong"
    )]
    NotConverged(f64),
    /// The fit of the cubic terms to steady tones failed.
    #[error(transparent)]
    Tones(#[from] FitError),
}

/// Matrices of a robot at one posture that do not depend on the joint parameters, with the receptances measured there.
struct PostureMatrices<'a> {
    frf: &'a PostureFrf,
    jacobian: Matrix3xX<f64>,
    payload: Matrix3xX<f64>,
    /// Mass matrix by the joint angles without the mass of the last link, kg m².
    mass: DMatrix<f64>,
    /// Weights of the receptances, see [`weights`], by entry of the table, then by frequency, N/m.
    weights: Vec<Vec<f64>>,
}

struct Normal {
    sums: NormalSums,
    /// Σ g gᵀ over the receptances of all postures, with g the gradient that one receptance contributes; the sandwich
    /// covariance uses it. The errors of one receptance at different lines count as correlated, those of different
    /// receptances as independent.
    scatter: DMatrix<f64>,
    /// Gradient by the parameters that a delay of all receptances causes; it is one radian at the highest frequency of
    /// each table.
    delay: DVector<f64>,
    entries: usize,
    sum: f64,
    left: f64,
    all: f64,
    rows: usize,
}

/// Fits the joints of a robot to receptances at several postures. The stiffnesses start from nearly static receptances,
/// or from those of `start` where the receptances give no plausible ones; the dampings start from those of `start`.
/// With `payload` the mass of the last link is a parameter, too.
///
/// # Errors
/// See [`JointFitError`].
pub fn fit(start: &Robot, postures: &[PostureFrf], payload: bool) -> Result<JointFit, JointFitError> {
    let joints = start.joints.len();
    if let Some(other) = postures.iter().find(|frf| frf.angles_rad.len() != joints) {
        return Err(JointFitError::Angles {
            found: other.angles_rad.len(),
            joints,
        });
    }
    let mut parameters: Vec<JointParameter> = (0..joints).map(JointParameter::Stiffness).collect();
    parameters.extend((0..joints).map(JointParameter::Damping));
    if payload {
        parameters.push(JointParameter::Payload);
    }
    let placed: Vec<PostureMatrices<'_>> = postures.iter().map(|frf| place(start, frf)).collect();
    let mut robot = start.clone();
    first_guess(&mut robot, &placed);
    let mut fit = ReceptanceFit {
        placed: &placed,
        parameters: &parameters,
    };
    let at_start = sums(&robot, &placed, &parameters);
    for (index, parameter) in parameters.iter().enumerate() {
        if at_start.sums.matrix[(index, index)] <= 0.0 {
            return Err(JointFitError::Undetermined(parameter.name()));
        }
    }
    let undetermined = || JointFitError::Undetermined("all parameters".into());
    let found = SEARCH.minimize(&mut fit, robot).ok_or_else(undetermined)?;
    match found.stop {
        // If no step, however short, reduces the sum of squared residuals any more, the search has ended at rounding
        // errors and counts as converged.
        Stop::Converged | Stop::Stagnated => finish(found.point, parameters, &found.value),
        Stop::Singular => Err(undetermined()),
        _ => Err(JointFitError::NotConverged(
            found.value.sum / found.value.rows.max(1) as f64,
        )),
    }
}

/// Levenberg–Marquardt settings of the fit of joints. The start may be far away; the damping of the steps falls slowly,
/// and never to zero, since damping ratios of single joints are hardly determined.
const SEARCH: LevenbergMarquardt = LevenbergMarquardt {
    damping: Damping {
        first: 1e-2,
        shrink: 0.2,
        growth: 8.0,
        least: 1e-12,
        least_retried: 0.0,
    },
    iterations_max: 200,
    // λ from 1e-12 to 1e14.
    trials_max: 30,
    ridge: 0.0,
    idle: Idle::Refuse,
};

/// Length of the step, in standard deviations of the parameters, below which the fit of joints has converged: far below
/// the width of any interval.
const LAST_STEP: f64 = 1e-3;

/// Largest change of the logarithm of a joint parameter in one step of the fit: no parameter changes by more than a
/// factor of about two.
const LARGEST_STEP: f64 = 0.7;

/// Weighted sum of squared residuals of all receptances as a function of the robot's joint parameters.
struct ReceptanceFit<'a> {
    placed: &'a [PostureMatrices<'a>],
    parameters: &'a [JointParameter],
}

impl Objective for ReceptanceFit<'_> {
    type Point = Robot;
    type Value = Normal;

    fn value(&mut self, robot: &Robot) -> Option<Normal> {
        Some(sums(robot, self.placed, self.parameters))
    }

    fn linearize(&mut self, _: &Robot, value: &Normal) -> Option<NormalSums> {
        Some(value.sums.clone())
    }

    fn moved(&self, robot: &Robot, step: &DVector<f64>) -> Robot {
        moved(robot, self.parameters, step)
    }

    fn limited(&self, step: DVector<f64>) -> DVector<f64> {
        let share = LARGEST_STEP / step.amax().max(LARGEST_STEP);
        step * share
    }

    fn is_no_worse(&self, next: &Normal, now: &Normal) -> bool {
        // Rounding of the sum.
        next.sum <= now.sum * (1.0 + 1e-12)
    }

    fn has_converged(&self, length: f64, next: &Normal, now: &Normal) -> bool {
        length < LAST_STEP && self.is_no_worse(next, now)
    }
}

impl JointFit {
    /// Predicted receptance of the tool at a posture and frequency, and the standard deviation of the magnitude of each
    /// entry, m/N.
    ///
    /// `None` where an undamped robot is at resonance and its dynamic stiffness Z is singular.
    pub fn receptance(
        &self,
        angles_rad: &[f64],
        frequency_hz: f64,
    ) -> Option<(Matrix3<Complex64>, Matrix3<f64>)> {
        let robot = self.robot.at(angles_rad);
        let model = Model::new(&robot, &robot.mass(), TAU * frequency_hz)?;
        let payload = robot.payload_jacobian();
        let slopes: Vec<Matrix3<Complex64>> = self
            .parameters
            .iter()
            .map(|parameter| model.slope(*parameter, &robot, &payload))
            .collect();
        let deviation = Matrix3::from_fn(|i, j| {
            let h = model.receptance[(i, j)];
            // The magnitude of an entry H of the receptance has the derivative d|H| = Re(H* dH)/|H|.
            let gradient = DVector::from_iterator(
                slopes.len(),
                slopes
                    .iter()
                    .map(|slope| (h.conj() * slope[(i, j)]).re / h.norm().max(f64::MIN_POSITIVE)),
            );
            let scatter = gradient.dot(&(&self.covariance * &gradient)).max(0.0);
            (scatter + (LEAST_RELATIVE_ERROR * h.norm()).powi(2)).sqrt()
        });
        Some((model.receptance, deviation))
    }
}

fn place<'a>(robot: &Robot, frf: &'a PostureFrf) -> PostureMatrices<'a> {
    let robot = robot.at(&frf.angles_rad);
    let payload = robot.payload_jacobian();
    let carried = robot.joints.last().map_or(0.0, |joint| joint.mass_kg);
    PostureMatrices {
        jacobian: robot.jacobian(),
        mass: robot.mass() - payload.tr_mul(&payload) * carried,
        payload,
        weights: frf
            .table
            .entries()
            .iter()
            .zip(&frf.deviation)
            .map(|(entry, deviation)| weights(&entry.receptance, deviation))
            .collect(),
        frf,
    }
}

/// Weights 1/σ of the lines of one receptance, with its standard deviation σ of at least [`LEAST_RELATIVE_ERROR`] of
/// its magnitude; 0 where σ is 0. A variance estimated from few averages is inaccurate but smooth over frequency, so it
/// is averaged over eight lines on either side.
fn weights(receptance: &[Complex64], deviation: &[f64]) -> Vec<f64> {
    const NEIGHBOURS: usize = 8;
    (0..deviation.len())
        .map(|line| {
            let around =
                &deviation[line.saturating_sub(NEIGHBOURS)..deviation.len().min(line + NEIGHBOURS + 1)];
            let variance = around.iter().map(|error| error * error).sum::<f64>() / around.len() as f64;
            let error = variance
                .sqrt()
                .max(LEAST_RELATIVE_ERROR * receptance[line].norm());
            if error > 0.0 { 1.0 / error } else { 0.0 }
        })
        .collect()
}

/// Sets the joint stiffnesses of the first guess from nearly static receptances. Joint dampings stay those of `robot`.
fn first_guess(robot: &mut Robot, placed: &[PostureMatrices<'_>]) {
    let joints = robot.joints.len();
    let (mut rows, mut right) = (Vec::new(), Vec::new());
    for posture in placed {
        let table = &posture.frf.table;
        let size = |line: usize| -> f64 {
            table
                .entries()
                .iter()
                .map(|entry| entry.receptance[line].norm_sqr())
                .sum()
        };
        let frequencies = table.frequency_hz();
        let peak = (0..frequencies.len()).max_by(|&a, &b| size(a).total_cmp(&size(b)));
        let Some(last) = peak.map(|peak| NEARLY_STATIC * frequencies[peak]) else {
            continue;
        };
        for (line, frequency) in frequencies.iter().enumerate().filter(|(_, f)| **f <= last) {
            // Below a resonance a receptance exceeds the static one by the factor 1/(1 − r²), with the ratio r of the
            // frequency to the resonance.
            let grown = 1.0 / (1.0 - (NEARLY_STATIC * frequency / last).powi(2));
            for (entry, deviation) in table.entries().iter().zip(&posture.frf.deviation) {
                let (Some(i), Some(j)) = (entry.response.axis(), entry.force.axis()) else {
                    continue;
                };
                let weight = 1.0 / (deviation[line] + 0.05 * size(line).sqrt());
                rows.extend(
                    posture
                        .jacobian
                        .column_iter()
                        .map(|column| weight * grown * column[i] * column[j]),
                );
                right.push(weight * entry.receptance[line].re);
            }
        }
    }
    if right.len() < joints {
        return;
    }
    let matrix = DMatrix::from_row_slice(right.len(), joints, &rows);
    if let Ok(fit) = LinearProblem::new(&matrix, &DVector::from_vec(right)).solve() {
        for (joint, compliance) in robot.joints.iter_mut().zip(fit.parameters.iter()) {
            let guess = 1.0 / compliance;
            // The compliance of a joint with little effect on the receptances may come out negative, or its inverse far
            // from the given stiffness; then the given stiffness stays.
            let known = joint.stiffness_nm_per_rad;
            let [least, most] = GUESSED_STIFFNESS_RATIO;
            if guess > least * known && guess < most * known {
                joint.stiffness_nm_per_rad = guess;
            }
        }
    }
}

fn moved(robot: &Robot, parameters: &[JointParameter], step: &DVector<f64>) -> Robot {
    let mut moved = robot.clone();
    for (parameter, step) in parameters.iter().zip(step.iter()) {
        if let Some(value) = parameter.slot(&mut moved) {
            *value *= step.exp();
        }
    }
    moved
}

fn finish(robot: Robot, parameters: Vec<JointParameter>, normal: &Normal) -> Result<JointFit, JointFitError> {
    let misfit = normal.sum / normal.rows.saturating_sub(parameters.len()).max(1) as f64;
    let inverse = invert_normal_equations(&normal.sums.matrix)
        .ok_or_else(|| JointFitError::Undetermined("all parameters".into()))?;
    let count = normal.entries as f64;
    let few = student_ninety_percent(normal.entries.saturating_sub(1)) / NINETY_PERCENT;
    let taken = count / (count - parameters.len() as f64).max(1.0);
    let scatter = &inverse * &normal.scatter * &inverse * (taken * few * few);
    // A delay common to all receptances, from filters, folding and the interpolation between samples, changes the
    // dampings most.
    let delayed = &inverse * &normal.delay * LEAST_RELATIVE_ERROR;
    Ok(JointFit {
        robot,
        // A calibration error common to all receptances changes all joint parameters by the same factor; its variance
        // is added to every entry.
        covariance: scatter.add_scalar(LEAST_RELATIVE_ERROR * LEAST_RELATIVE_ERROR)
            + &delayed * delayed.transpose(),
        parameters,
        misfit,
        relative_error: (normal.left / normal.all.max(f64::MIN_POSITIVE)).sqrt(),
    })
}

fn sums(robot: &Robot, placed: &[PostureMatrices<'_>], parameters: &[JointParameter]) -> Normal {
    let of_postures: Vec<Normal> = placed
        .par_iter()
        .map(|posture| sums_of(robot, posture, parameters))
        .collect();
    let size = parameters.len();
    of_postures.into_iter().fold(empty(size), |mut all, part| {
        all.sums.matrix += part.sums.matrix;
        all.sums.gradient += part.sums.gradient;
        all.scatter += part.scatter;
        all.delay += part.delay;
        all.entries += part.entries;
        all.sum += part.sum;
        all.left += part.left;
        all.all += part.all;
        all.rows += part.rows;
        all
    })
}

fn empty(size: usize) -> Normal {
    Normal {
        sums: NormalSums {
            matrix: DMatrix::zeros(size, size),
            gradient: DVector::zeros(size),
        },
        scatter: DMatrix::zeros(size, size),
        delay: DVector::zeros(size),
        entries: 0,
        sum: 0.0,
        left: 0.0,
        all: 0.0,
        rows: 0,
    }
}

fn sums_of(robot: &Robot, posture: &PostureMatrices<'_>, parameters: &[JointParameter]) -> Normal {
    let table = &posture.frf.table;
    let mut normal = empty(parameters.len());
    let carried = robot.joints.last().map_or(0.0, |joint| joint.mass_kg);
    let mass = &posture.mass + posture.payload.tr_mul(&posture.payload) * carried;
    let mut row = DVector::zeros(parameters.len());
    let mut gradients = vec![row.clone(); table.entries().len()];
    let highest_hz = table.frequency_hz().last().copied().unwrap_or(1.0);
    for (line, frequency) in table.frequency_hz().iter().enumerate() {
        let Some(model) = Model::with(robot, &posture.jacobian, &mass, TAU * frequency) else {
            continue;
        };
        let slopes: Vec<Matrix3<Complex64>> = parameters
            .iter()
            .map(|parameter| model.slope(*parameter, robot, &posture.payload))
            .collect();
        for ((entry, weights), gradient) in table.entries().iter().zip(&posture.weights).zip(&mut gradients) {
            let (Some(i), Some(j)) = (entry.response.axis(), entry.force.axis()) else {
                continue;
            };
            let measured = entry.receptance[line];
            let left = measured - model.receptance[(i, j)];
            let delayed = Complex64::new(0.0, frequency / highest_hz) * model.receptance[(i, j)];
            let weight = weights[line];
            normal.left += left.norm_sqr();
            normal.all += measured.norm_sqr();
            normal.sum += left.norm_sqr() * weight * weight;
            normal.rows += 2;
            for part in [|value: Complex64| value.re, |value: Complex64| value.im] {
                for (row, slope) in row.iter_mut().zip(&slopes) {
                    *row = weight * part(slope[(i, j)]);
                }
                normal.sums.matrix.ger(1.0, &row, &row, 1.0);
                gradient.axpy(weight * part(left), &row, 1.0);
                normal.delay.axpy(weight * part(delayed), &row, 1.0);
            }
        }
    }
    for gradient in &gradients {
        normal.scatter.ger(1.0, gradient, gradient, 1.0);
        normal.sums.gradient += gradient;
        normal.entries += 1;
    }
    normal
}
