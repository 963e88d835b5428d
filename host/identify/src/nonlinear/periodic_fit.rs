//! Coefficients of a nonlinear equation of motion from whole periods of a periodic test (a multisine), by harmonic
//! balance of all spectral lines of a period.
//!
//! The balance Σ θ φ(x) = F, with the coefficients θ of the terms φ, is solved for the periodic displacement x at the
//! samples of a period, at twice the measured sample rate, so that cubes of the measured band do not alias into it.
//! Newton's method solves its linear systems iteratively (GMRES, preconditioned by the linear part and the mean slopes
//! of the nonlinear terms). The predicted motion is fitted to the measured one with exact derivatives.

use std::f64::consts::TAU;
use std::sync::Arc;

use crate::criteria::{FORCE_BAND_SHARE, LEAST_PERIOD_SAMPLES};
use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use quietcut_numerics::Stop;
use quietcut_numerics::least_squares::LinearProblem;
use quietcut_numerics::newton::Newton;
use rustfft::{Fft, FftPlanner};

use crate::nonlinear::restoring_force::{ForceTerm, deviations};

/// Force and displacement in one period of a periodic test.
#[derive(Clone, Copy, Debug)]
pub struct Period<'a> {
    /// Force, N.
    pub force: &'a [f64],
    /// Measured displacement, m; its mean is subtracted before the fit.
    pub displacement: &'a [f64],
}

/// An equation of motion fitted to the periods of a periodic test.
#[derive(Clone, Debug)]
pub struct PeriodicFit {
    /// The terms of the equation of motion with their coefficients, SI units.
    pub law: Vec<(ForceTerm, f64)>,
    /// Standard deviations of the coefficients.
    pub deviations: Vec<f64>,
    /// NRMSE of the predicted displacement over all periods.
    pub relative_error: f64,
}

/// Reason why the fit of an equation of motion to periods gives no result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PeriodicError {
    /// A term of the equation of motion is Coulomb friction, which is not smooth, or a constant force.
    #[error(
        "{0} is not smooth: harmonic balance of a multisine takes springs and dampers; use restoring-force"
    )]
    NotSmooth(&'static str),
    /// There is no period, the signals differ in their number of samples, or the periods are too short.
    #[error("periods of one length, at least 16 samples, are needed")]
    Length,
    /// The terms lack mass, damping or stiffness; all three are required.
    #[error("mass, damping and stiffness are needed among the terms")]
    NoOscillator,
    /// The harmonic balance or the fit of its coefficients does not converge.
    #[error("the balance does not converge: the law has no periodic motion near the measured one")]
    NotConverged,
    /// The measured periods do not determine the coefficients of all terms.
    #[error("the periods do not determine all terms")]
    Undetermined,
}

/// Ratio of the sample rate at which the harmonic balance is solved to that of the measured periods.
const DENSER: usize = 2;

struct Balance {
    terms: Vec<ForceTerm>,
    rate_hz: f64,
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
    /// Angular frequencies of the lines of the transform, rad/s; negative in the upper half of the lines.
    omega: Vec<f64>,
}

impl Balance {
    fn new(terms: &[ForceTerm], samples: usize, rate_hz: f64) -> Self {
        let size = DENSER * samples;
        let mut planner = FftPlanner::new();
        let omega = (0..size)
            .map(|line| {
                let signed = if 2 * line > size {
                    line as f64 - size as f64
                } else {
                    line as f64
                };
                TAU * signed * rate_hz / samples as f64
            })
            .collect();
        Self {
            terms: terms.to_vec(),
            rate_hz,
            forward: planner.plan_fft_forward(size),
            inverse: planner.plan_fft_inverse(size),
            omega,
        }
    }

    /// Real samples of a period, filtered with the frequency response `filter`(ω), ω in rad/s.
    fn filtered(&self, samples: &[f64], filter: impl Fn(f64) -> Complex64) -> Vec<f64> {
        let mut line: Vec<Complex64> = samples.iter().map(|x| Complex64::new(*x, 0.0)).collect();
        self.forward.process(&mut line);
        let half = line.len() / 2;
        for (index, (value, omega)) in line.iter_mut().zip(&self.omega).enumerate() {
            // At half the sample rate only the real part of a filter acts on real samples.
            let through = filter(*omega);
            *value *= if index == half {
                Complex64::new(through.re, 0.0)
            } else {
                through
            };
        }
        self.inverse.process(&mut line);
        let scale = 1.0 / samples.len() as f64;
        line.into_iter().map(|x| x.re * scale).collect()
    }

    /// The samples of a period interpolated to the sample rate of the harmonic balance, with unchanged spectrum.
    fn dense(&self, samples: &[f64]) -> Vec<f64> {
        let count = samples.len();
        let mut planner = FftPlanner::new();
        let mut spectrum: Vec<Complex64> = samples.iter().map(|x| Complex64::new(*x, 0.0)).collect();
        planner.plan_fft_forward(count).process(&mut spectrum);
        let mut wide = vec![Complex64::ZERO; DENSER * count];
        let half = count.div_ceil(2);
        let end = wide.len();
        wide[..half].copy_from_slice(&spectrum[..half]);
        wide[end - (count - half)..].copy_from_slice(&spectrum[half..]);
        planner.plan_fft_inverse(end).process(&mut wide);
        wide.into_iter().map(|x| x.re / count as f64).collect()
    }

    fn derivative(&self, x: &[f64], order: i32) -> Vec<f64> {
        self.filtered(x, |omega| Complex64::new(0.0, omega).powi(order))
    }

    /// Regressor φ of every term of the equation of motion at every sample, for the periodic displacement x.
    fn features(&self, x: &[f64]) -> Vec<Vec<f64>> {
        let (v, a) = (self.derivative(x, 1), self.derivative(x, 2));
        self.terms
            .iter()
            .map(|term| (0..x.len()).map(|i| term.value(x[i], v[i], a[i])).collect())
            .collect()
    }

    fn of(&self, theta: &DVector<f64>, wanted: ForceTerm) -> f64 {
        let place = self.terms.iter().position(|term| *term == wanted);
        place.map_or(0.0, |index| theta[index])
    }

    /// Derivatives of the nonlinear terms of the equation of motion at every sample of a period: by the displacement x,
    /// then by the velocity v.
    fn slopes(&self, theta: &DVector<f64>, x: &[f64]) -> [Vec<f64>; 2] {
        let v = self.derivative(x, 1);
        let (k2, k3) = (
            self.of(theta, ForceTerm::QuadraticStiffness),
            self.of(theta, ForceTerm::CubicStiffness),
        );
        let (k5, c3) = (
            self.of(theta, ForceTerm::QuinticStiffness),
            self.of(theta, ForceTerm::CubicDamping),
        );
        let by_x = x
            .iter()
            .map(|x| 2.0 * k2 * x + 3.0 * k3 * x * x + 5.0 * k5 * x.powi(4))
            .collect();
        [by_x, v.iter().map(|v| 3.0 * c3 * v * v).collect()]
    }

    fn linear(&self, theta: &DVector<f64>, more: [f64; 2]) -> impl Fn(f64) -> Complex64 + use<> {
        let (m, c, k) = (
            self.of(theta, ForceTerm::Mass),
            self.of(theta, ForceTerm::Damping),
            self.of(theta, ForceTerm::Stiffness),
        );
        move |omega: f64| Complex64::new(k + more[0] - m * omega * omega, (c + more[1]) * omega)
    }

    /// Solves J δ = `right` for the change δ of the displacement, with J the derivative of the harmonic balance by the
    /// displacement; `None` as for [`gmres`].
    fn solve_linear(&self, theta: &DVector<f64>, slopes: &[Vec<f64>; 2], right: &[f64]) -> Option<Vec<f64>> {
        let mean = |values: &Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
        let near = self.linear(theta, [mean(&slopes[0]), mean(&slopes[1])]);
        let plain = self.linear(theta, [0.0, 0.0]);
        let precondition = |y: &[f64]| self.filtered(y, |omega| near(omega).inv());
        let apply = |y: &[f64]| {
            let delta = precondition(y);
            let rate = self.derivative(&delta, 1);
            let mut out = self.filtered(&delta, &plain);
            for i in 0..out.len() {
                out[i] += slopes[0][i] * delta[i] + slopes[1][i] * rate[i];
            }
            out
        };
        gmres(apply, right).map(|y| precondition(&y))
    }

    /// Periodic displacement under `force`, by Newton's method from `start`; `None` without convergence.
    fn solve(&self, theta: &DVector<f64>, force: &[f64], start: Vec<f64>) -> Option<Vec<f64>> {
        // GMRES solves each Newton step to a residual of 1e-9 of the right-hand side. What it leaves of a step of 1e-9 of
        // the motion is of the size of rounding.
        let newton = Newton::new(25, 1e-9);
        let found = newton.solve(start, |x: &Vec<f64>| {
            let mut residual: Vec<f64> = force.iter().map(|f| -f).collect();
            for (feature, theta) in self.features(x).iter().zip(theta.iter()) {
                for (sum, value) in residual.iter_mut().zip(feature) {
                    *sum += theta * value;
                }
            }
            self.solve_linear(theta, &self.slopes(theta, x), &residual)
                .ok_or(Stop::Singular)
        });
        found.converged()
    }
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Solves A y = b by GMRES without restart; `None` if a hundred iterations do not reduce the residual to 1e-9 of b, or
/// if the least-squares problem of one is singular.
fn gmres(apply: impl Fn(&[f64]) -> Vec<f64>, right: &[f64]) -> Option<Vec<f64>> {
    let size = norm(right);
    if size == 0.0 {
        return Some(vec![0.0; right.len()]);
    }
    let mut basis: Vec<Vec<f64>> = vec![right.iter().map(|x| x / size).collect()];
    let mut columns: Vec<Vec<f64>> = Vec::new();
    for step in 0..100 {
        let mut next = apply(&basis[step]);
        let mut column = Vec::with_capacity(step + 2);
        for known in &basis {
            let share = dot(known, &next);
            column.push(share);
            for (next, known) in next.iter_mut().zip(known) {
                *next -= share * known;
            }
        }
        let length = norm(&next);
        column.push(length);
        columns.push(column);
        let hessenberg = DMatrix::from_fn(step + 2, step + 1, |i, j| {
            columns[j].get(i).copied().unwrap_or(0.0)
        });
        let mut target = DVector::zeros(step + 2);
        target[0] = size;
        let fit = LinearProblem::new(&hessenberg, &target).solve().ok()?;
        if fit.sum_of_squares.sqrt() <= 1e-9 * size || length <= 1e-14 * size {
            let mut solution = vec![0.0; right.len()];
            for (direction, y) in basis.iter().zip(fit.parameters.iter()) {
                for (sum, value) in solution.iter_mut().zip(direction) {
                    *sum += y * value;
                }
            }
            return Some(solution);
        }
        basis.push(next.into_iter().map(|x| x / length).collect());
    }
    None
}

/// Fits the coefficients of the given terms of an equation of motion to the periods of a periodic test.
///
/// # Errors
/// See [`PeriodicError`].
pub fn fit(periods: &[Period<'_>], rate_hz: f64, terms: &[ForceTerm]) -> Result<PeriodicFit, PeriodicError> {
    if let Some(term) = terms
        .iter()
        .find(|term| matches!(term, ForceTerm::CoulombFriction | ForceTerm::Offset))
    {
        return Err(PeriodicError::NotSmooth(term.key()));
    }
    if [ForceTerm::Mass, ForceTerm::Damping, ForceTerm::Stiffness]
        .iter()
        .any(|term| !terms.contains(term))
    {
        return Err(PeriodicError::NoOscillator);
    }
    let samples = periods.first().map_or(0, |period| period.force.len());
    let even = |period: &Period<'_>| period.force.len() == samples && period.displacement.len() == samples;
    if samples < LEAST_PERIOD_SAMPLES || !periods.iter().all(even) {
        return Err(PeriodicError::Length);
    }
    let balance = Balance::new(terms, samples, rate_hz);
    let without_mean = |x: &[f64]| -> Vec<f64> {
        let mean = x.iter().sum::<f64>() / x.len() as f64;
        x.iter().map(|x| x - mean).collect()
    };
    let measured: Vec<Vec<f64>> = periods
        .iter()
        .map(|period| without_mean(period.displacement))
        .collect();
    let forces: Vec<Vec<f64>> = periods.iter().map(|period| balance.dense(period.force)).collect();
    let mut motions: Vec<Vec<f64>> = measured.iter().map(|y| balance.dense(y)).collect();
    let mut theta = first_guess(&balance, &forces, &motions).ok_or(PeriodicError::Undetermined)?;
    for _ in 0..12 {
        let (slope, left) = balance.linearized(&theta, &forces, &measured, &mut motions)?;
        let fit = LinearProblem::new(&slope, &left)
            .solve()
            .map_err(|_| PeriodicError::Undetermined)?;
        theta += &fit.parameters;
        let moved = fit.parameters.component_div(&theta).amax();
        // The fit has converged if the relative change of every coefficient is below a millionth, far below any
        // interval.
        if moved < 1e-6 {
            let (slope, left) = balance.linearized(&theta, &forces, &measured, &mut motions)?;
            let all: f64 = measured.iter().map(|y| dot(y, y)).sum();
            let deviations = deviations(&slope, &left).ok_or(PeriodicError::Undetermined)?;
            return Ok(PeriodicFit {
                law: terms.iter().copied().zip(theta.iter().copied()).collect(),
                deviations: deviations.iter().copied().collect(),
                relative_error: left.norm() / all.sqrt(),
            });
        }
    }
    Err(PeriodicError::NotConverged)
}

/// First guess of the coefficients, by linear least squares on the balance Σ θ φ(x) = F of the measured motion, within
/// the frequency band of the force. `None` if the equations are singular.
fn first_guess(balance: &Balance, forces: &[Vec<f64>], motions: &[Vec<f64>]) -> Option<DVector<f64>> {
    // Above the frequency band of the force the derivatives of the measured motion consist of noise.
    let limit = force_band(balance, forces);
    let keep = |x: &[f64]| {
        balance.filtered(x, |omega| {
            Complex64::new(f64::from(u8::from(omega.abs() <= limit)), 0.0)
        })
    };
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); balance.terms.len()];
    let mut right = Vec::new();
    for (force, x) in forces.iter().zip(motions) {
        for (column, feature) in columns.iter_mut().zip(balance.features(&keep(x))) {
            column.extend(keep(&feature));
        }
        right.extend(keep(force));
    }
    let columns: Vec<DVector<f64>> = columns.into_iter().map(DVector::from_vec).collect();
    let (matrix, right) = (DMatrix::from_columns(&columns), DVector::from_vec(right));
    let fit = LinearProblem::new(&matrix, &right).solve().ok()?;
    Some(fit.parameters)
}

/// Angular frequency up to which at least the share [`FORCE_BAND_SHARE`] of the force power lies, rad/s.
fn force_band(balance: &Balance, forces: &[Vec<f64>]) -> f64 {
    let mut power = vec![0.0; balance.omega.len() / 2];
    for force in forces {
        let mut line: Vec<Complex64> = force.iter().map(|x| Complex64::new(*x, 0.0)).collect();
        balance.forward.process(&mut line);
        for (sum, value) in power.iter_mut().zip(&line) {
            *sum += value.norm_sqr();
        }
    }
    let all: f64 = power.iter().sum();
    let mut sum = 0.0;
    for (power, omega) in power.iter().zip(&balance.omega) {
        sum += power;
        if sum >= FORCE_BAND_SHARE * all {
            return *omega;
        }
    }
    TAU * balance.rate_hz
}

impl Balance {
    /// Derivative of the predicted motion by the coefficients θ at the measured samples of all periods, and measured
    /// minus predicted motion. Replaces `motions` by the predicted motion.
    fn linearized(
        &self,
        theta: &DVector<f64>,
        forces: &[Vec<f64>],
        measured: &[Vec<f64>],
        motions: &mut [Vec<f64>],
    ) -> Result<(DMatrix<f64>, DVector<f64>), PeriodicError> {
        let mut columns: Vec<Vec<f64>> = vec![Vec::new(); self.terms.len()];
        let mut left = Vec::new();
        let thinned = |x: &[f64]| -> Vec<f64> {
            let kept: Vec<f64> = x.iter().step_by(DENSER).copied().collect();
            let mean = kept.iter().sum::<f64>() / kept.len() as f64;
            kept.into_iter().map(|x| x - mean).collect()
        };
        for ((force, y), motion) in forces.iter().zip(measured).zip(motions) {
            let x = self
                .solve(theta, force, motion.clone())
                .ok_or(PeriodicError::NotConverged)?;
            let slopes = self.slopes(theta, &x);
            for (column, feature) in columns.iter_mut().zip(self.features(&x)) {
                let derived = self
                    .solve_linear(theta, &slopes, &feature)
                    .ok_or(PeriodicError::NotConverged)?;
                column.extend(thinned(&derived).iter().map(|x| -x));
            }
            left.extend(thinned(&x).iter().zip(y).map(|(x, y)| y - x));
            *motion = x;
        }
        let columns: Vec<DVector<f64>> = columns.into_iter().map(DVector::from_vec).collect();
        Ok((DMatrix::from_columns(&columns), DVector::from_vec(left)))
    }
}
