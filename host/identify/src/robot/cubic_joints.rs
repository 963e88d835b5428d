//! Joints of a robot with cubic terms, from steady tones at several postures and force levels, by harmonic balance.
//!
//! In deviations q of the joint angles from a posture q₀, M(q₀) q̈ + C q̇ + K q + C₃ q̇∘³ + K₃ q∘³ = J(q₀)ᵀ F and u = J(q₀) q: a cubic
//! term of one joint couples all directions of the tool, differently at every posture. Joint angles are not measured: they are
//! those of the periodic motion that the parameters give under the measured force. What the tool then does is fitted to what
//! it did, weighed as in [`steady_fit`](crate::nonlinear::steady_fit). A first guess comes from the receptances at the lowest force of every
//! frequency, and then from the equivalent linearization of the joints at the measured amplitudes a_j of their angles:
//! k_j + ¾ k₃_j a_j² and c_j + ¾ c₃_j ω² a_j².

use std::f64::consts::TAU;
use std::path::Path;

use nalgebra::{DMatrix, DVector, Matrix3xX, Vector3};
use num_complex::Complex64;
use rayon::prelude::*;

use crate::dwells::differentiation::derivative;
use crate::dwells::dwell::{Dwell, Line};
use crate::least_squares::{Normal, Spread, minimum, nearer};
use crate::nonlinear::harmonic_balance::{Grid, Problem, Solution};
use crate::nonlinear::law::{Extra, Law, Role};
use crate::nonlinear::whitening::Seen;
use crate::robot::joints::{self, JointFitError, JointParameter, PostureFrf};
use quietcut_frf::{Frf, FrfTable};
use quietcut_model::structure::{Direction, Robot};

const AXES: [Direction; 3] = [Direction::X, Direction::Y, Direction::Z];

/// Steady tones at one posture.
#[derive(Clone, Debug)]
pub struct PostureDwells {
    /// Joint angles, rad.
    pub angles_rad: Vec<f64>,
    /// The tones.
    pub dwells: Vec<Dwell>,
}

/// A robot whose joints were identified with their cubic terms.
#[derive(Clone, Debug)]
pub struct CubicJointFit {
    /// The robot; its posture is that of the start.
    pub robot: Robot,
    /// What was fitted.
    pub parameters: Vec<JointParameter>,
    /// Covariance of the parameters.
    pub covariance: DMatrix<f64>,
    /// Sum of squares over degrees of freedom, in units of the noise.
    pub misfit: f64,
    /// Root mean square of what is left over that of the motion, at the fundamental.
    pub relative_error: f64,
    /// True where the covariance is that of the scatter between dwells.
    pub robust: bool,
    harmonics: usize,
}

/// The equation of motion, and where its parameters come from.
struct Model<'a> {
    parameters: &'a [JointParameter],
    law: Law,
    grid: Grid,
}

/// A posture with what does not depend on the parameters.
struct Placed {
    /// 3 × n.
    jacobian: DMatrix<f64>,
    /// Mass matrix of what is known, and that of a payload of 1 kg.
    mass: [DMatrix<f64>; 2],
}

impl Placed {
    /// A robot at its posture; its payload is known where it is no parameter.
    fn new(robot: &Robot, parameters: &[JointParameter]) -> Self {
        let payload = robot.payload_jacobian();
        let payload = payload.tr_mul(&payload);
        let sought = match robot.joints.last() {
            Some(joint) if parameters.contains(&JointParameter::Payload) => joint.mass_kg,
            _ => 0.0,
        };
        Self {
            jacobian: dynamic(&robot.jacobian()),
            mass: [robot.mass() - &payload * sought, payload],
        }
    }

    fn seen(&self) -> Seen<'_> {
        Seen {
            directions: &AXES,
            shape: &self.jacobian,
        }
    }
}

fn dynamic(matrix: &Matrix3xX<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(3, matrix.ncols(), |i, j| matrix[(i, j)])
}

/// Fits a robot, whose joints are a first guess, to steady tones at several postures.
///
/// `terms` are cubic stiffness, cubic damping or both; all dwells have `harmonics` harmonics.
///
/// # Errors
/// See [`JointFitError`].
pub fn fit(
    start: &Robot,
    postures: &[PostureDwells],
    terms: &[Extra],
    payload: bool,
    harmonics: usize,
) -> Result<CubicJointFit, JointFitError> {
    let count = start.joints.len();
    let start = first_guess(start, postures, payload)?;
    let parameters = parameters(count, terms, payload);
    let model = Model::new(count, &parameters, terms, harmonics);
    let placed: Vec<Placed> = postures
        .iter()
        .map(|posture| Placed::new(&start.at(&posture.angles_rad), &parameters))
        .collect();
    let all: Vec<(&Placed, &Dwell)> = placed
        .iter()
        .zip(postures)
        .flat_map(|(placed, posture)| posture.dwells.iter().map(move |dwell| (placed, dwell)))
        .collect();
    let values = DVector::from_iterator(
        parameters.len(),
        parameters.iter().map(|parameter| parameter.value(&start)),
    );
    // Far from the minimum, what is positive must stay so: its logarithm is sought.
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
        // Stiffness, damping and mass that come out below zero are lost in the noise.
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

/// Sums over all dwells, in their order for any number of threads.
fn sums(
    all: &[(&Placed, &Dwell)],
    parameters: usize,
    of: impl Fn(&Placed, &Dwell) -> Option<(DVector<f64>, DMatrix<f64>)> + Sync,
) -> Normal {
    let found: Vec<_> = all.par_iter().map(|(placed, dwell)| of(placed, dwell)).collect();
    let mut normal = Normal::new(parameters);
    for dwell in found {
        normal.add(dwell);
    }
    normal
}

fn parameters(joints: usize, terms: &[Extra], payload: bool) -> Vec<JointParameter> {
    let mut parameters: Vec<JointParameter> = (0..joints).map(JointParameter::Stiffness).collect();
    parameters.extend((0..joints).map(JointParameter::Damping));
    if terms.contains(&Extra::CubicStiffness) {
        parameters.extend((0..joints).map(JointParameter::CubicStiffness));
    }
    if terms.contains(&Extra::CubicDamping) {
        parameters.extend((0..joints).map(JointParameter::CubicDamping));
    }
    if payload {
        parameters.push(JointParameter::Payload);
    }
    parameters
}

/// Linear joints through the receptances at the lowest force of every frequency.
fn first_guess(start: &Robot, postures: &[PostureDwells], payload: bool) -> Result<Robot, JointFitError> {
    let tables: Vec<PostureFrf> = postures
        .iter()
        .flat_map(|posture| AXES.map(|force| lowest(posture, force)))
        .flatten()
        .collect();
    Ok(joints::fit(start, &tables, payload)?.robot)
}

/// The receptances for the force in one direction, from the dwell of least force at every frequency.
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
            // Steps of one frequency differ by noise only.
            Some(last) if dwell.omega < last.omega * (1.0 + 1e-3) => {
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
            // At the lowest force, too, joints are not quite linear.
            Some((receptance, noise.hypot(LINEARIZED * receptance.norm())))
        };
        if let Some(found) = kept.iter().map(of_dwell).collect::<Option<Vec<_>>>() {
            let (receptance, noise) = found.into_iter().unzip();
            entries.push(Frf {
                response,
                force,
                receptance,
                coherence: None,
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

/// The equivalent linearization leaves out harmonics and is wrong by about this share.
const LINEARIZED: f64 = 0.1;

/// Axis, fundamental of the displacement, m, and its deviation, of every channel.
fn displacements(dwell: &Dwell) -> Vec<(usize, Complex64, f64)> {
    let of = |line: &Line| {
        let order = i32::from(derivative(line.quantity));
        let factor = Complex64::new(0.0, dwell.omega).powi(order);
        let noise = (line.variance * dwell.gram_inverse[(1, 1)]).sqrt();
        Some((
            line.direction.axis()?,
            line.phasor(1) / factor,
            noise / factor.norm(),
        ))
    };
    dwell.motions.iter().filter_map(of).collect()
}

impl<'a> Model<'a> {
    fn new(joints: usize, parameters: &'a [JointParameter], terms: &[Extra], harmonics: usize) -> Self {
        let mut law = Law::new(joints, terms);
        // Joints give way each by itself.
        law.parameters.retain(|parameter| match parameter.role {
            Role::Damping(i, j) | Role::Stiffness(i, j) => i == j,
            _ => true,
        });
        Self {
            parameters,
            grid: Grid::new(harmonics, law.degree()),
            law,
        }
    }

    /// θ of the law at a posture.
    fn theta(&self, placed: &Placed, values: &DVector<f64>) -> DVector<f64> {
        let mut theta = self.chain(placed) * values;
        let mass = self.law.parameters.iter().zip(theta.iter_mut());
        for (parameter, theta) in mass {
            if let Role::Mass(i, j) = parameter.role {
                *theta += placed.mass[0][(i, j)];
            }
        }
        theta
    }

    /// ∂θ/∂values; θ is linear in them.
    fn chain(&self, placed: &Placed) -> DMatrix<f64> {
        DMatrix::from_fn(
            self.law.parameters.len(),
            self.parameters.len(),
            |row, column| match (self.law.parameters[row].role, self.parameters[column]) {
                (Role::Mass(i, j), JointParameter::Payload) => placed.mass[1][(i, j)],
                (Role::Stiffness(i, _), JointParameter::Stiffness(joint))
                | (Role::Damping(i, _), JointParameter::Damping(joint))
                | (Role::CubicStiffness(i), JointParameter::CubicStiffness(joint))
                | (Role::CubicDamping(i), JointParameter::CubicDamping(joint)) => {
                    f64::from(u8::from(i == joint))
                }
                _ => 0.0,
            },
        )
    }

    /// Joint angles per force in x, y and z without the cubic terms: Z⁻¹ Jᵀ, rad/N.
    fn linear(&self, placed: &Placed, theta: &DVector<f64>, omega: f64) -> Option<DMatrix<Complex64>> {
        let joints = self.law.dofs;
        let mut dynamic = DMatrix::<Complex64>::zeros(joints, joints);
        for (parameter, theta) in self.law.parameters.iter().zip(theta.iter()) {
            match parameter.role {
                Role::Mass(i, j) => {
                    dynamic[(i, j)] -= omega * omega * theta;
                    if i != j {
                        dynamic[(j, i)] -= omega * omega * theta;
                    }
                }
                Role::Damping(i, _) => dynamic[(i, i)].im += omega * theta,
                Role::Stiffness(i, _) => dynamic[(i, i)].re += theta,
                _ => {}
            }
        }
        dynamic
            .lu()
            .solve(&placed.jacobian.transpose().map(Complex64::from))
    }

    /// Fourier coefficients of a motion with the fundamental alone.
    fn fundamental(&self, q: &DVector<Complex64>) -> DVector<f64> {
        let width = self.grid.width();
        let mut x = DVector::zeros(q.len() * width);
        for (dof, q) in q.iter().enumerate() {
            (x[dof * width + 1], x[dof * width + 2]) = (q.re, -q.im);
        }
        x
    }

    /// Joint angles that give the tool its measured motion and come from a force on the tool: Z⁻¹Jᵀ(J Z⁻¹Jᵀ)⁻¹ u, in the
    /// directions that were measured.
    fn measured(
        &self,
        placed: &Placed,
        dwell: &Dwell,
        linear: &DMatrix<Complex64>,
    ) -> Option<DVector<Complex64>> {
        let mut seen = displacements(dwell);
        // Several channels of one direction say the same.
        seen.sort_by_key(|(axis, ..)| *axis);
        seen.dedup_by_key(|(axis, ..)| *axis);
        let by_force = DMatrix::from_fn(linear.nrows(), seen.len(), |i, j| linear[(i, seen[j].0)]);
        let rows = DMatrix::from_fn(seen.len(), linear.nrows(), |i, j| {
            Complex64::from(placed.jacobian[(seen[i].0, j)])
        });
        let moved = DVector::from_iterator(seen.len(), seen.iter().map(|(_, moved, _)| *moved));
        Some(&by_force * (rows * &by_force).lu().solve(&moved)?)
    }

    /// The periodic motion under the measured force near the measured one.
    fn solve(&self, placed: &Placed, dwell: &Dwell, theta: &DVector<f64>) -> Option<Solution> {
        let force = placed.seen().force(dwell, self.grid.width());
        let linear = self.linear(placed, theta, dwell.omega)?;
        let problem = Problem {
            law: &self.law,
            theta: theta.as_slice(),
            omega: dwell.omega,
            force: &force,
        };
        let start = self.measured(placed, dwell, &linear)?;
        self.grid.solve(problem, &self.fundamental(&start)).ok()
    }

    /// What the equivalent linearization at the measured amplitudes leaves of the measured motion, and the derivative of what it
    /// predicts, by about as much as it may be wrong: flanks then count as much as peaks, and it is found from far away.
    fn linearized(
        &self,
        placed: &Placed,
        dwell: &Dwell,
        values: &DVector<f64>,
    ) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let omega = dwell.omega;
        let mut theta = self.theta(placed, values);
        let amplitude = self
            .measured(placed, dwell, &self.linear(placed, &theta, omega)?)?
            .map(|q| 0.75 * q.norm_sqr());
        for index in 0..theta.len() {
            let (part, joint) = match self.law.parameters[index].role {
                Role::CubicStiffness(joint) => (amplitude[joint], joint),
                Role::CubicDamping(joint) => (omega * omega * amplitude[joint], joint),
                _ => continue,
            };
            let to = match self.law.parameters[index].role {
                Role::CubicStiffness(_) => Role::Stiffness(joint, joint),
                _ => Role::Damping(joint, joint),
            };
            let to = self.law.index(to)?;
            theta[to] += part * theta[index];
        }
        let linear = self.linear(placed, &theta, omega)?;
        let force = DVector::from_fn(3, |axis, _| {
            let line = dwell.forces.iter().find(|line| line.direction == AXES[axis]);
            line.map_or(Complex64::ZERO, |line| line.phasor(1))
        });
        let q = &linear * force;
        let seen = displacements(dwell);
        let mut residual = DVector::zeros(2 * seen.len());
        let mut slope = DMatrix::zeros(2 * seen.len(), theta.len());
        for (row, (axis, measured, noise)) in seen.into_iter().enumerate() {
            let moved: Complex64 = (0..q.len())
                .map(|joint| q[joint] * placed.jacobian[(axis, joint)])
                .sum();
            let weight = 1.0 / noise.hypot(LINEARIZED * measured.norm());
            let left = (measured - moved) * weight;
            (residual[2 * row], residual[2 * row + 1]) = (left.re, left.im);
            for (column, parameter) in self.law.parameters.iter().enumerate() {
                // du = −(Z⁻¹Jᵀ)ᵀ dZ q.
                let at = |i: usize, j: usize| -linear[(i, axis)] * q[j];
                let by = match parameter.role {
                    Role::Mass(i, j) if i == j => -at(i, i) * (omega * omega),
                    Role::Mass(i, j) => -(at(i, j) + at(j, i)) * (omega * omega),
                    Role::Stiffness(i, _) => at(i, i),
                    Role::Damping(i, _) => at(i, i) * Complex64::new(0.0, omega),
                    Role::CubicStiffness(i) => at(i, i) * amplitude[i],
                    Role::CubicDamping(i) => at(i, i) * Complex64::new(0.0, omega.powi(3) * amplitude[i]),
                    _ => Complex64::ZERO,
                } * weight;
                (slope[(2 * row, column)], slope[(2 * row + 1, column)]) = (by.re, by.im);
            }
        }
        Some((residual, slope * self.chain(placed)))
    }

    fn whitened(
        &self,
        placed: &Placed,
        dwell: &Dwell,
        values: &DVector<f64>,
    ) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let solution = self.solve(placed, dwell, &self.theta(placed, values))?;
        let (residual, slope) = placed.seen().whitened(dwell, &solution, self.grid.width())?;
        Some((residual, slope * self.chain(placed)))
    }

    fn relative_error(&self, all: &[(&Placed, &Dwell)], values: &DVector<f64>) -> f64 {
        let (mut left, mut whole) = (0.0, 0.0);
        for (placed, dwell) in all {
            let Some(solution) = self.solve(placed, dwell, &self.theta(placed, values)) else {
                continue;
            };
            let u = self.tool(placed, &solution.x);
            for (axis, measured, _) in displacements(dwell) {
                left += (measured - u[axis]).norm_sqr();
                whole += measured.norm_sqr();
            }
        }
        if whole > 0.0 { (left / whole).sqrt() } else { 0.0 }
    }

    /// Fundamental of the tool's motion, m.
    fn tool(&self, placed: &Placed, x: &DVector<f64>) -> Vector3<Complex64> {
        let width = self.grid.width();
        Vector3::from_fn(|axis, _| {
            placed
                .jacobian
                .row(axis)
                .iter()
                .enumerate()
                .map(|(dof, share)| Complex64::new(x[dof * width + 1], -x[dof * width + 2]) * *share)
                .sum()
        })
    }
}

/// Forces by which the motion at a force is reached from that of small forces.
const RISES: u32 = 8;

impl CubicJointFit {
    /// What the tool does at a posture under the force F cos ωt, F in N: the fundamental of its motion, m, and the standard
    /// deviation of the absolute value in every direction.
    ///
    /// The motion that is reached by a force that rises slowly. `None` where it ends before: a jump.
    pub fn response(
        &self,
        angles_rad: &[f64],
        frequency_hz: f64,
        force_n: Vector3<f64>,
    ) -> Option<(Vector3<Complex64>, Vector3<f64>)> {
        let robot = self.robot.at(angles_rad);
        let placed = Placed::new(&robot, &self.parameters);
        let has = |of: fn(usize) -> JointParameter| self.parameters.contains(&of(0));
        let mut terms = Vec::new();
        if has(JointParameter::CubicStiffness) {
            terms.push(Extra::CubicStiffness);
        }
        if has(JointParameter::CubicDamping) {
            terms.push(Extra::CubicDamping);
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
            // d|u| = Re(u* du)/|u|.
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
