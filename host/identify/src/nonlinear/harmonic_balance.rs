//! Periodic motion under a periodic force by harmonic balance, with its exact derivatives.
//!
//! q(t) = a₀ + Σ_h (a_h cos hωt + b_h sin hωt). The residual of the equation of motion ([`Law`]) is evaluated at N
//! instants of a period and projected onto the H harmonics. With N > (p + 1)·H, where p is the polynomial degree of the
//! equation, products of p series of H harmonics alias onto none of the first H harmonics, so residual and Jacobian are
//! those of the exact (Galerkin) balance.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector, Dyn, LU};
use quietcut_numerics::Stop;
use quietcut_numerics::newton::Newton;

use crate::nonlinear::law::Law;

/// Collocation instants of a period, and the values of the harmonic functions at them.
#[derive(Clone, Debug)]
pub struct Grid {
    harmonics: usize,
    /// Values of the functions 1, cos, sin, cos 2 … up to harmonic H at the N instants: N × (2H + 1).
    value: DMatrix<f64>,
    /// First derivatives of the harmonic functions by the phase ωt at the instants.
    rate: DMatrix<f64>,
    /// Second derivatives of the harmonic functions by the phase ωt at the instants.
    second: DMatrix<f64>,
    /// Projection from values at the N instants to Fourier coefficients up to harmonic H: (2H + 1) × N.
    project: DMatrix<f64>,
}

/// A harmonic-balance problem: equation of motion, its parameters, frequency and force.
#[derive(Clone, Copy, Debug)]
pub struct Problem<'a> {
    /// The equation of motion.
    pub law: &'a Law,
    /// Parameters θ of the law.
    pub theta: &'a [f64],
    /// Fundamental frequency, rad/s.
    pub omega: f64,
    /// Fourier coefficients of the force, one degree of freedom after the other.
    pub force: &'a DVector<f64>,
}

/// A periodic motion that satisfies the harmonic balance.
pub struct Solution {
    /// Fourier coefficients of the motion, one degree of freedom after the other.
    pub x: DVector<f64>,
    jacobian: LU<f64, Dyn, Dyn>,
    by_theta: DMatrix<f64>,
    by_omega: DVector<f64>,
}

/// Newton's method for the harmonic balance did not converge from the start, or its Jacobian is singular.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("harmonic balance at {frequency_hz:.4} Hz does not converge")]
pub struct NotConverged {
    /// Fundamental frequency of the problem, Hz.
    pub frequency_hz: f64,
}

impl Grid {
    /// Grid for `harmonics` harmonics and equations of motion up to the polynomial degree `degree`.
    pub fn new(harmonics: usize, degree: usize) -> Self {
        let samples = (degree + 1) * harmonics + 2;
        let width = 2 * harmonics + 1;
        let angle = |row: usize, h: usize| TAU * (row * h % samples) as f64 / samples as f64;
        let entry = |row: usize, column: usize, derivative: u8| {
            let h = column.div_ceil(2);
            let (sin, cos) = angle(row, h).sin_cos();
            let n = h as f64;
            match (derivative, column == 0, column % 2 == 1) {
                (0, true, _) => 1.0,
                (_, true, _) => 0.0,
                (0, _, true) => cos,
                (0, _, false) => sin,
                (1, _, true) => -n * sin,
                (1, _, false) => n * cos,
                (_, _, true) => -n * n * cos,
                (_, _, false) => -n * n * sin,
            }
        };
        let value = DMatrix::from_fn(samples, width, |i, j| entry(i, j, 0));
        let mut project = value.transpose() * (2.0 / samples as f64);
        project.row_mut(0).scale_mut(0.5);
        Self {
            harmonics,
            rate: DMatrix::from_fn(samples, width, |i, j| entry(i, j, 1)),
            second: DMatrix::from_fn(samples, width, |i, j| entry(i, j, 2)),
            value,
            project,
        }
    }

    /// Number of Fourier coefficients of one degree of freedom: 2H + 1.
    pub fn width(&self) -> usize {
        2 * self.harmonics + 1
    }

    /// Number of harmonics H.
    pub fn harmonics(&self) -> usize {
        self.harmonics
    }

    fn samples(&self) -> usize {
        self.value.nrows()
    }

    /// Displacement, velocity and acceleration u = (q, q̇, q̈) at every instant: 3n × N for n degrees of freedom and N
    /// instants.
    fn motion(&self, dofs: usize, omega: f64, x: &DVector<f64>) -> DMatrix<f64> {
        let width = self.width();
        let mut u = DMatrix::zeros(3 * dofs, self.samples());
        for dof in 0..dofs {
            let own = x.rows(dof * width, width);
            let tables = [
                (&self.value, 1.0),
                (&self.rate, omega),
                (&self.second, omega * omega),
            ];
            for (derivative, (table, factor)) in tables.into_iter().enumerate() {
                let values = table * own * factor;
                u.row_mut(derivative * dofs + dof).copy_from(&values.transpose());
            }
        }
        u
    }

    /// Fourier coefficients of the regressors φ_p of the equation of motion at the motion `x`: one column per
    /// parameter, one degree of freedom after the other.
    pub fn features(&self, law: &Law, omega: f64, x: &DVector<f64>) -> DMatrix<f64> {
        let u = self.motion(law.dofs, omega, x);
        let width = self.width();
        let mut features = DMatrix::zeros(law.dofs * width, law.parameters.len());
        let mut values = DVector::zeros(self.samples());
        for (p, parameter) in law.parameters.iter().enumerate() {
            for term in &parameter.terms {
                for (value, u) in values.iter_mut().zip(u.column_iter()) {
                    *value = term.value(u.as_slice());
                }
                let mut block = features.view_mut((term.row * width, p), (width, 1));
                block += &self.project * &values;
            }
        }
        features
    }

    /// Derivatives of the harmonic balance's residual by the Fourier coefficients x of the motion and by the frequency
    /// ω.
    fn jacobian(&self, problem: Problem<'_>, x: &DVector<f64>) -> (DMatrix<f64>, DVector<f64>) {
        let Problem {
            law, theta, omega, ..
        } = problem;
        let (width, samples, size) = (self.width(), self.samples(), 3 * law.dofs);
        let u = self.motion(law.dofs, omega, x);
        let mut jacobian = DMatrix::zeros(law.dofs * width, law.dofs * width);
        let mut by_omega = DVector::zeros(law.dofs * width);
        let mut weighted = DMatrix::zeros(samples, width);
        for row in 0..law.dofs {
            // Derivatives of one row of the equation of motion by u = (q, q̇, q̈), at every instant.
            let mut partials = DMatrix::zeros(size, samples);
            for (parameter, &theta) in law.parameters.iter().zip(theta) {
                for term in parameter.terms.iter().filter(|term| term.row == row) {
                    for (at, mut partial) in u.column_iter().zip(partials.column_iter_mut()) {
                        term.add_partials(theta, at.as_slice(), partial.as_mut_slice());
                    }
                }
            }
            for dof in 0..law.dofs {
                for t in 0..samples {
                    let (q, v, a) = (
                        partials[(dof, t)],
                        omega * partials[(law.dofs + dof, t)],
                        omega * omega * partials[(2 * law.dofs + dof, t)],
                    );
                    for column in 0..width {
                        weighted[(t, column)] = q * self.value[(t, column)]
                            + v * self.rate[(t, column)]
                            + a * self.second[(t, column)];
                    }
                }
                jacobian
                    .view_mut((row * width, dof * width), (width, width))
                    .gemm(1.0, &self.project, &weighted, 0.0);
            }
            let slope = DVector::from_fn(samples, |t, _| {
                (0..law.dofs)
                    .map(|dof| {
                        let (v, a) = (law.dofs + dof, 2 * law.dofs + dof);
                        (partials[(v, t)] * u[(v, t)] + 2.0 * partials[(a, t)] * u[(a, t)]) / omega
                    })
                    .sum()
            });
            by_omega
                .rows_mut(row * width, width)
                .copy_from(&(&self.project * slope));
        }
        (jacobian, by_omega)
    }

    /// The periodic motion that satisfies the harmonic balance, by Newton's method from the Fourier coefficients
    /// `start`.
    ///
    /// # Errors
    /// Newton's method does not converge, or its Jacobian is singular.
    pub fn solve(&self, problem: Problem<'_>, start: &DVector<f64>) -> Result<Solution, NotConverged> {
        let failed = NotConverged {
            frequency_hz: problem.omega / TAU,
        };
        let theta = DVector::from_column_slice(problem.theta);
        let mut linearized = None;
        // Newton's method converges quadratically: after a relative step of 1e-8 the next one is rounding.
        let newton = Newton::new(30, 1e-8).with_growth(2.0);
        let found = newton.solve(start.clone(), |x: &DVector<f64>| {
            let features = self.features(problem.law, problem.omega, x);
            let residual = &features * &theta - problem.force;
            let (jacobian, by_omega) = self.jacobian(problem, x);
            let jacobian = jacobian.lu();
            let step = jacobian.solve(&residual).ok_or(Stop::Singular)?;
            linearized = Some((jacobian, features, by_omega));
            Ok(step)
        });
        let x = found.converged().ok_or(failed)?;
        let (jacobian, by_theta, by_omega) = linearized.ok_or(failed)?;
        Ok(Solution {
            x,
            jacobian,
            by_theta,
            by_omega,
        })
    }
}

impl Solution {
    /// Derivatives of the Fourier coefficients of the motion by the parameters θ of the equation of motion, by the
    /// Fourier coefficients of the force with the indices `of_force`, and by the frequency ω. `None` if the Jacobian is
    /// singular.
    pub fn sensitivities(
        &self,
        of_force: std::ops::Range<usize>,
    ) -> Option<(DMatrix<f64>, DMatrix<f64>, DVector<f64>)> {
        let by_theta = self.jacobian.solve(&(-&self.by_theta))?;
        let mut unit = DMatrix::zeros(self.x.len(), of_force.len());
        for (column, row) in of_force.enumerate() {
            unit[(row, column)] = 1.0;
        }
        Some((
            by_theta,
            self.jacobian.solve(&unit)?,
            self.jacobian.solve(&(-&self.by_omega))?,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nonlinear::law::{NonlinearTerm, Role};

    fn duffing() -> (Law, Vec<f64>) {
        let law = Law::new(1, &[NonlinearTerm::CubicStiffness, NonlinearTerm::CubicDamping]);
        let mut theta = vec![0.0; law.parameters.len()];
        for (role, value) in [
            (Role::Mass(0, 0), 188.0),
            (Role::Damping(0, 0), 305.0),
            (Role::Stiffness(0, 0), 2.26e6),
            (Role::CubicStiffness(0), -5.05e12),
            (Role::CubicDamping(0), 2.53e6),
        ] {
            theta[law.index(role).unwrap()] = value;
        }
        (law, theta)
    }

    fn solution(theta: &[f64], law: &Law, omega: f64, force_n: f64, harmonics: usize) -> Solution {
        let grid = Grid::new(harmonics, law.degree());
        let mut force = DVector::zeros(grid.width());
        force[1] = force_n;
        let problem = Problem {
            law,
            theta,
            omega,
            force: &force,
        };
        grid.solve(problem, &DVector::zeros(grid.width())).unwrap()
    }

    #[test]
    fn the_motion_is_that_of_the_integrator() {
        use quietcut_model::structure::Direction;
        use quietcut_simulate::rig::{Rig, Signal};
        let (law, theta) = duffing();
        let (frequency, force) = (17.3, 9.5);
        let found = solution(&theta, &law, TAU * frequency, force, 7).x;
        let case = quietcut_testkit::case("kuka-kr90-y17-low");
        let tone = Signal::Tones {
            tones: vec![(frequency, 0.0)],
            first_n: force,
            last_n: force,
            seconds: 40.0,
        };
        let recording = Rig::new(Direction::Y, tone, 400.0)
            .record(case.structure.as_ref().unwrap(), std::path::Path::new("a.csv"))
            .unwrap()
            .0;
        let y = &recording.channel("y").unwrap().samples;
        for (k, y) in y.iter().enumerate().skip(15_600) {
            let phase = TAU * frequency * k as f64 / 400.0;
            let wanted: f64 = (0_i32..15)
                .map(|i| {
                    let h = f64::from((i + 1) / 2);
                    let of = if i % 2 == 0 {
                        (h * phase).sin()
                    } else {
                        (h * phase).cos()
                    };
                    found[i as usize] * if i == 0 { 1.0 } else { of }
                })
                .sum();
            // 39 s are 32 time constants of the decay; the integrator has a relative error of 1e-8 per step.
            assert!((y - wanted).abs() < 1e-6 * found.norm(), "{k}: {y} {wanted}");
        }
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let (law, theta) = duffing();
        let omega = TAU * 17.2;
        let base = solution(&theta, &law, omega, 9.5, 5);
        let (by_theta, by_force, by_omega) = base.sensitivities(0..11).unwrap();
        let close = |exact: DVector<f64>, difference: DVector<f64>, what: &str| {
            // Central differences with a relative step of 1e-5 have a relative error of about 1e-10 times the third
            // derivative.
            assert!(
                (&exact - &difference).norm() < 1e-6 * exact.norm(),
                "{what}: {exact} {difference}"
            );
        };
        for p in 0..theta.len() {
            let moved = |sign: f64| {
                let mut theta = theta.clone();
                theta[p] *= 1.0 + 1e-5 * sign;
                solution(&theta, &law, omega, 9.5, 5).x
            };
            let difference = (moved(1.0) - moved(-1.0)) / (2e-5 * theta[p]);
            close(by_theta.column(p).into(), difference, "theta");
        }
        let moved = |sign: f64| solution(&theta, &law, omega * (1.0 + 1e-6 * sign), 9.5, 5).x;
        close(by_omega, (moved(1.0) - moved(-1.0)) / (2e-6 * omega), "omega");
        let moved = |sign: f64| solution(&theta, &law, omega, 9.5 + 1e-4 * sign, 5).x;
        close(
            by_force.column(1).into(),
            (moved(1.0) - moved(-1.0)) / 2e-4,
            "force",
        );
    }
}
