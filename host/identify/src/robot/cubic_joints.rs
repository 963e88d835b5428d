//! Joints of a robot with cubic terms, from steady tones at several postures and force levels, by harmonic balance.
//!
//! With the deviations q of the joint angles from a posture q₀, M(q₀) q̈ + C q̇ + K q + C₃ q̇∘³ + K₃ q∘³ = J(q₀)ᵀ F and
//! u = J(q₀) q. A cubic term of one joint couples all directions of the tool, differently at every posture. Joint
//! angles are not measured: harmonic balance gives the periodic joint angles under the measured force. The predicted
//! motion of the tool is fitted to the measured one, with the weights of [`steady_fit`](crate::nonlinear::steady_fit).
//! The first guess comes from the receptances at the lowest force of every frequency. The equivalent linearization of
//! the joints at the measured amplitudes a_j of their angles, k_j + ¾ k₃_j a_j² and c_j + ¾ c₃_j ω² a_j², then improves
//! this guess.

use std::f64::consts::TAU;
use std::path::Path;

use nalgebra::{DMatrix, DVector, Vector3};
use num_complex::Complex64;
use rayon::prelude::*;

use crate::criteria::{LINEARIZATION_ERROR, SAME_STEP};
use crate::dwells::differentiation::derivative;
use crate::dwells::dwell::Dwell;
use crate::least_squares::{Normal, Spread, minimum, nearer};
use crate::nonlinear::harmonic_balance::Problem;
use crate::nonlinear::law::NonlinearTerm;
use crate::robot::cubic_model::{AXES, Model, PostureMatrices};
use crate::robot::joints::{self, JointFitError, JointParameter, PostureFrf};
use quietcut_frf::{Frf, FrfTable};
use quietcut_model::structure::{Direction, Robot};

/// Steady tones at one posture.
#[derive(Clone, Debug)]
pub struct PostureDwells {
    /// Joint angles of the posture in the order of the joints, rad.
    pub angles_rad: Vec<f64>,
    /// The steady tones measured at the posture.
    pub dwells: Vec<Dwell>,
}

/// Result of a fit to steady tones: a robot with identified stiffness, damping and cubic terms of its joints.
#[derive(Clone, Debug)]
pub struct CubicJointFit {
    /// The robot with the fitted joint parameters, at the posture of the robot from which the fit started.
    pub robot: Robot,
    /// The joint parameters that were fitted, in the order of the rows of `covariance`.
    pub parameters: Vec<JointParameter>,
    /// Covariance of the fitted parameters.
    pub covariance: DMatrix<f64>,
    /// χ² per degree of freedom of the tool's predicted motion: near 1 if the residual is within the noise.
    pub misfit: f64,
    /// NRMSE of the fundamental of the tool's predicted motion over the tones for which the fitted robot gives a
    /// prediction.
    pub relative_error: f64,
    /// True if the covariance of the parameters comes from the scatter between tones (sandwich covariance), not from
    /// the noise.
    pub robust: bool,
    harmonics: usize,
}

/// Fits the joints of a robot, with `start` as the first guess, to steady tones at several postures.
///
/// `terms` are cubic stiffness, cubic damping or both; with `payload` the mass of the last link is a parameter, too.
/// All dwells must have `harmonics` harmonics.
///
/// # Errors
/// See [`JointFitError`].
pub fn fit(
    start: &Robot,
    postures: &[PostureDwells],
    terms: &[NonlinearTerm],
    payload: bool,
    harmonics: usize,
) -> Result<CubicJointFit, JointFitError> {
    let count = start.joints.len();
    let start = first_guess(start, postures, payload)?;
    let parameters = parameters(count, terms, payload);
    let model = Model::new(count, &parameters, terms, harmonics);
    let placed: Vec<PostureMatrices> = postures
        .iter()
        .map(|posture| PostureMatrices::new(&start.at(&posture.angles_rad), &parameters))
        .collect();
    let all: Vec<(&PostureMatrices, &Dwell)> = placed
        .iter()
        .zip(postures)
        .flat_map(|(placed, posture)| posture.dwells.iter().map(move |dwell| (placed, dwell)))
        .collect();
    let values = DVector::from_iterator(
        parameters.len(),
        parameters.iter().map(|parameter| parameter.value(&start)),
    );
    // In the fit of the equivalent linearization, stiffness, damping and payload are replaced by their logarithms,
    // which keeps them positive.
    let values_of = |sought: &DVector<f64>| {
        DVector::from_fn(sought.len(), |index, _| {
            if parameters[index].is_cubic() {
                sought[index]
            } else {
                sought[index].exp()
            }
        })
    };
    let sought = DVector::from_fn(values.len(), |index, _| {
        if parameters[index].is_cubic() {
            values[index]
        } else {
            values[index].ln()
        }
    });
    let sought = nearer(sought, 1e-2, |sought| {
        let values = values_of(sought);
        sums(&all, values.len(), |placed, dwell| {
            let (residual, mut slope) = model.linearized(placed, dwell, &values)?;
            for (index, mut column) in slope.column_iter_mut().enumerate() {
                if !parameters[index].is_cubic() {
                    column *= values[index];
                }
            }
            Some((residual, slope))
        })
    })?;
    let values = values_of(&sought);
    let (values, normal) = minimum(values, 1e-3, |values| {
        sums(&all, values.len(), |placed, dwell| {
            model.whitened(placed, dwell, values)
        })
    })?;
    let Spread {
        covariance,
        misfit,
        robust,
    } = normal.spread()?;
    let mut robot = start;
    for (parameter, value) in parameters.iter().zip(values.iter()) {
        // A stiffness, damping or payload that is fitted as zero or negative is not significant: the tones do not
        // determine it.
        if *value <= 0.0 && !parameter.is_cubic() {
            return Err(JointFitError::Undetermined(parameter.name()));
        }
        parameter.set(&mut robot, *value);
    }
    let relative_error = model.relative_error(&all, &values);
    Ok(CubicJointFit {
        robot,
        parameters,
        covariance,
        misfit,
        relative_error,
        robust,
        harmonics,
    })
}

/// Normal equations summed over all dwells, always in the same order, so that the number of threads does not change the
/// result.
fn sums(
    all: &[(&PostureMatrices, &Dwell)],
    parameters: usize,
    of: impl Fn(&PostureMatrices, &Dwell) -> Option<(DVector<f64>, DMatrix<f64>)> + Sync,
) -> Normal {
    let found: Vec<_> = all.par_iter().map(|(placed, dwell)| of(placed, dwell)).collect();
    let mut normal = Normal::new(parameters);
    for dwell in found {
        normal.add(dwell);
    }
    normal
}

fn parameters(joints: usize, terms: &[NonlinearTerm], payload: bool) -> Vec<JointParameter> {
    let mut parameters: Vec<JointParameter> = (0..joints).map(JointParameter::Stiffness).collect();
    parameters.extend((0..joints).map(JointParameter::Damping));
    if terms.contains(&NonlinearTerm::CubicStiffness) {
        parameters.extend((0..joints).map(JointParameter::CubicStiffness));
    }
    if terms.contains(&NonlinearTerm::CubicDamping) {
        parameters.extend((0..joints).map(JointParameter::CubicDamping));
    }
    if payload {
        parameters.push(JointParameter::Payload);
    }
    parameters
}

/// The robot `start` with the linear parameters of its joints fitted to the receptances at the lowest force of every
/// frequency.
fn first_guess(start: &Robot, postures: &[PostureDwells], payload: bool) -> Result<Robot, JointFitError> {
    let tables: Vec<PostureFrf> = postures
        .iter()
        .flat_map(|posture| AXES.map(|force| lowest(posture, force)))
        .flatten()
        .collect();
    Ok(joints::fit(start, &tables, payload)?.robot)
}

/// Receptances of the tool under force in direction `force`; at each frequency from the dwell with the smallest force.
/// `None` if they form no valid table.
fn lowest(posture: &PostureDwells, force: Direction) -> Option<PostureFrf> {
    let mut dwells: Vec<&Dwell> = posture
        .dwells
        .iter()
        .filter(|dwell| dwell.force().is_some_and(|line| line.direction == force))
        .collect();
    let amplitude = |dwell: &Dwell| dwell.force().map_or(0.0, |line| line.amplitude(1));
    dwells.sort_by(|a, b| a.omega.total_cmp(&b.omega));
    let mut kept: Vec<&Dwell> = Vec::with_capacity(dwells.len());
    for dwell in dwells {
        match kept.last_mut() {
            // Dwells within 0.1 % in frequency are repetitions of one frequency step.
            Some(last) if dwell.omega < last.omega * (1.0 + SAME_STEP) => {
                if amplitude(dwell) < amplitude(last) {
                    *last = dwell;
                }
            }
            _ => kept.push(dwell),
        }
    }
    let mut entries = Vec::new();
    let mut deviation = Vec::new();
    for response in AXES {
        let of_dwell = |dwell: &&Dwell| {
            let line = dwell.motions.iter().find(|line| line.direction == response)?;
            let per_force = Complex64::new(0.0, dwell.omega).powi(i32::from(derivative(line.quantity)))
                * dwell.force()?.phasor(1);
            let noise = (line.variance * dwell.gram_inverse[(1, 1)]).sqrt() / per_force.norm();
            let receptance = line.phasor(1) / per_force;
            // Even at the smallest force the cubic terms of the joints change the receptance; the relative error of the
            // linearization is added to its noise, as a root of the sum of squares.
            Some((receptance, noise.hypot(LINEARIZATION_ERROR * receptance.norm())))
        };
        if let Some(found) = kept.iter().map(of_dwell).collect::<Option<Vec<_>>>() {
            let (receptance, noise) = found.into_iter().unzip();
            entries.push(Frf {
                response,
                force,
                receptance,
                coherence: None,
                folding: None,
            });
            deviation.push(noise);
        }
    }
    let frequencies = kept.iter().map(|dwell| dwell.omega / TAU).collect();
    let table = FrfTable::new(Path::new("steps"), frequencies, entries).ok()?;
    Some(PostureFrf {
        angles_rad: posture.angles_rad.clone(),
        table,
        deviation,
    })
}

/// Number of equal steps by which the force rises to the given force while the predicted motion of the tool is
/// continued. A choice.
const RISES: u32 = 8;

impl CubicJointFit {
    /// Predicted motion of the tool at a posture under the force F cos ωt, F in N: its fundamental, m, and the standard
    /// deviation of the magnitude of the fundamental in every direction, m.
    ///
    /// The motion is the one reached when the force rises slowly from zero. `None` if the robot without cubic terms is
    /// undamped and at resonance, if Newton's method does not follow that branch to the given force, for example where
    /// it ends in a jump, or if the motion there has no derivatives by the parameters.
    pub fn response(
        &self,
        angles_rad: &[f64],
        frequency_hz: f64,
        force_n: Vector3<f64>,
    ) -> Option<(Vector3<Complex64>, Vector3<f64>)> {
        let robot = self.robot.at(angles_rad);
        let placed = PostureMatrices::new(&robot, &self.parameters);
        let has = |of: fn(usize) -> JointParameter| self.parameters.contains(&of(0));
        let mut terms = Vec::new();
        if has(JointParameter::CubicStiffness) {
            terms.push(NonlinearTerm::CubicStiffness);
        }
        if has(JointParameter::CubicDamping) {
            terms.push(NonlinearTerm::CubicDamping);
        }
        let model = Model::new(robot.joints.len(), &self.parameters, &terms, self.harmonics);
        let values = DVector::from_iterator(
            self.parameters.len(),
            self.parameters.iter().map(|parameter| parameter.value(&robot)),
        );
        let theta = model.theta(&placed, &values);
        let omega = TAU * frequency_hz;
        let on_joints = placed
            .jacobian
            .tr_mul(&DVector::from_column_slice(force_n.as_slice()));
        let whole = model.fundamental(&on_joints.map(Complex64::from));
        let linear = model.linear(&placed, &theta, omega)?;
        let by_force = DVector::from_column_slice(force_n.as_slice()).map(Complex64::from);
        let mut x = model.fundamental(&(linear * by_force)) / f64::from(RISES);
        let mut last = None;
        for rise in 1..=RISES {
            let force = &whole * (f64::from(rise) / f64::from(RISES));
            let problem = Problem {
                law: &model.law,
                theta: theta.as_slice(),
                omega,
                force: &force,
            };
            let solution = model.grid.solve(problem, &x).ok()?;
            x = &solution.x * (f64::from(rise + 1) / f64::from(rise));
            last = Some(solution);
        }
        let solution = last?;
        let u = model.tool(&placed, &solution.x);
        let by_values = solution.sensitivities(0..0)?.0 * model.chain(&placed);
        let mut deviation = Vector3::zeros();
        for axis in 0..3 {
            // The magnitude of the tool's displacement u has the derivative d|u| = Re(u* du)/|u|.
            let gradient = DVector::from_iterator(
                values.len(),
                by_values.column_iter().map(|column| {
                    let du = model.tool(&placed, &column.into_owned())[axis];
                    (u[axis].conj() * du).re / u[axis].norm().max(f64::MIN_POSITIVE)
                }),
            );
            deviation[axis] = gradient.dot(&(&self.covariance * &gradient)).max(0.0).sqrt();
        }
        Some((u, deviation))
    }
}
