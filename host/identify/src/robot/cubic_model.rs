//! The motion of a robot whose joints have cubic terms, at a posture under a force on the tool.

use nalgebra::{DMatrix, DVector, Matrix3xX, Vector3};
use num_complex::Complex64;

use crate::criteria::LINEARIZATION_ERROR;
use crate::dwells::differentiation::derivative;
use crate::dwells::dwell::{Dwell, FourierSeries};
use crate::nonlinear::harmonic_balance::{Grid, Problem, Solution};
use crate::nonlinear::law::{Law, NonlinearTerm, Role};
use crate::nonlinear::whitening::OutputMap;
use crate::robot::joint_parameter::JointParameter;
use quietcut_model::structure::{Direction, Robot};

pub(super) const AXES: [Direction; 3] = [Direction::X, Direction::Y, Direction::Z];

/// Equation of motion of a robot, the fitted joint parameters, and the harmonic-balance grid.
pub(super) struct Model<'a> {
    pub(super) parameters: &'a [JointParameter],
    pub(super) law: Law,
    pub(super) grid: Grid,
}

/// Matrices of a robot at one posture that do not depend on the fitted parameters.
pub(super) struct PostureMatrices {
    /// Jacobian of the tool center point by the joint angles, m/rad: 3 rows (x, y, z), a column per joint.
    pub(super) jacobian: DMatrix<f64>,
    /// Mass matrices by the joint angles: without the mass of the last link if that mass is fitted, kg m², and per
    /// kilogram of the last link, m².
    pub(super) mass: [DMatrix<f64>; 2],
}

impl PostureMatrices {
    /// The matrices of `robot` at its posture; the mass of the last link counts as given unless it is among
    /// `parameters`.
    pub(super) fn new(robot: &Robot, parameters: &[JointParameter]) -> Self {
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

    pub(super) fn output_map(&self) -> OutputMap<'_> {
        OutputMap {
            directions: &AXES,
            shape: &self.jacobian,
        }
    }
}

fn dynamic(matrix: &Matrix3xX<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(3, matrix.ncols(), |i, j| matrix[(i, j)])
}

/// For every motion channel of a dwell along x, y or z: the index of its axis, the fundamental of its displacement, m,
/// and the standard deviation of the real or imaginary part of this fundamental, m.
pub(super) fn displacements(dwell: &Dwell) -> Vec<(usize, Complex64, f64)> {
    let of = |line: &FourierSeries| {
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
    pub(super) fn new(
        joints: usize,
        parameters: &'a [JointParameter],
        terms: &[NonlinearTerm],
        harmonics: usize,
    ) -> Self {
        let mut law = Law::new(joints, terms);
        // Each joint has its own stiffness and damping, without coupling to other joints, so that off-diagonal entries
        // are removed.
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

    /// Coefficients θ of the equation of motion at a posture, from the values of the joint parameters.
    pub(super) fn theta(&self, placed: &PostureMatrices, values: &DVector<f64>) -> DVector<f64> {
        let mut theta = self.chain(placed) * values;
        let mass = self.law.parameters.iter().zip(theta.iter_mut());
        for (parameter, theta) in mass {
            if let Role::Mass(i, j) = parameter.role {
                *theta += placed.mass[0][(i, j)];
            }
        }
        theta
    }

    /// Derivative of the coefficients θ of the equation of motion by the joint parameters; it does not depend on their
    /// values.
    pub(super) fn chain(&self, placed: &PostureMatrices) -> DMatrix<f64> {
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

    /// Joint angles per unit force on the tool in x, y and z, without the cubic terms: Z⁻¹ Jᵀ, rad/N, with the dynamic
    /// stiffness Z of the joints and the Jacobian J of the tool. `None` if Z is singular.
    pub(super) fn linear(
        &self,
        placed: &PostureMatrices,
        theta: &DVector<f64>,
        omega: f64,
    ) -> Option<DMatrix<Complex64>> {
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

    /// Fourier coefficients of quantities of the joints that consist of the fundamental `q` alone.
    pub(super) fn fundamental(&self, q: &DVector<Complex64>) -> DVector<f64> {
        let width = self.grid.width();
        let mut x = DVector::zeros(q.len() * width);
        for (dof, q) in q.iter().enumerate() {
            (x[dof * width + 1], x[dof * width + 2]) = (q.re, -q.im);
        }
        x
    }

    /// Joint angles that belong to the measured motion u of the tool, if it is due to a force on the tool: Z⁻¹Jᵀ(J
    /// Z⁻¹Jᵀ)⁻¹ u in the measured directions, with the dynamic stiffness Z of the joints and the Jacobian J of the
    /// tool; `linear` is Z⁻¹Jᵀ. `None` if the matrix in parentheses is singular.
    pub(super) fn measured(
        &self,
        placed: &PostureMatrices,
        dwell: &Dwell,
        linear: &DMatrix<Complex64>,
    ) -> Option<DVector<Complex64>> {
        let mut seen = displacements(dwell);
        // Of several motion channels in one direction only the first is used.
        seen.sort_by_key(|(axis, ..)| *axis);
        seen.dedup_by_key(|(axis, ..)| *axis);
        let by_force = DMatrix::from_fn(linear.nrows(), seen.len(), |i, j| linear[(i, seen[j].0)]);
        let rows = DMatrix::from_fn(seen.len(), linear.nrows(), |i, j| {
            Complex64::from(placed.jacobian[(seen[i].0, j)])
        });
        let moved = DVector::from_iterator(seen.len(), seen.iter().map(|(_, moved, _)| *moved));
        Some(&by_force * (rows * &by_force).lu().solve(&moved)?)
    }

    /// Periodic joint angles under the measured force, found by Newton's method from those of the measured motion;
    /// `None` if Newton's method finds no solution, or if a matrix for its start is singular.
    pub(super) fn solve(
        &self,
        placed: &PostureMatrices,
        dwell: &Dwell,
        theta: &DVector<f64>,
    ) -> Option<Solution> {
        let force = placed.output_map().force(dwell, self.grid.width());
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

    /// Residual of the tool's motion in a dwell, predicted by the equivalent linearization of the joints at the
    /// measured amplitudes, and the derivative of the predicted motion by the joint parameters at these amplitudes.
    /// Both are divided by the noise and the error of this linearization, added as a root of the sum of squares. This
    /// error is relative, so off-resonance lines weigh about as much as peaks, and the fit converges from a distant
    /// start. `None` if [`Model::linear`] or [`Model::measured`] is `None`.
    pub(super) fn linearized(
        &self,
        placed: &PostureMatrices,
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
            let weight = 1.0 / noise.hypot(LINEARIZATION_ERROR * measured.norm());
            let left = (measured - moved) * weight;
            (residual[2 * row], residual[2 * row + 1]) = (left.re, left.im);
            for (column, parameter) in self.law.parameters.iter().enumerate() {
                // Derivative of the tool's displacement u by the dynamic stiffness Z of the joints: du = −(Z⁻¹Jᵀ)ᵀ dZ
                // q, with the joint angles q.
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

    pub(super) fn whitened(
        &self,
        placed: &PostureMatrices,
        dwell: &Dwell,
        values: &DVector<f64>,
    ) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let solution = self.solve(placed, dwell, &self.theta(placed, values))?;
        let (residual, slope) = placed
            .output_map()
            .whitened(dwell, &solution, self.grid.width())?;
        Some((residual, slope * self.chain(placed)))
    }

    pub(super) fn relative_error(&self, all: &[(&PostureMatrices, &Dwell)], values: &DVector<f64>) -> f64 {
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

    /// Fundamental of the motion of the tool, m, from the Fourier coefficients `x` of the joint angles.
    pub(super) fn tool(&self, placed: &PostureMatrices, x: &DVector<f64>) -> Vector3<Complex64> {
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
