//! The linear structure in first-order form, from matrices, modes or joints.

use nalgebra::{DMatrix, Matrix3, Matrix3xX, MatrixXx3};
use num_complex::Complex64;

use crate::criteria::VELOCITY_JUMP;

use super::{Direction, Form, Matrices, Mode, Structure, StructureError, feed_axes};
use quietcut_numerics::eigenvalues::{EigenvalueError, of_real};

/// First-order form ẋ = A x + B F, u = C x; F is the force on the tool centre point and u the displacement of that
/// point, along x, y, z.
///
/// All n states are real. From matrices and joints, x = (q, q̇/s) with the constant s, 1/s, the larger of √‖M⁻¹K‖ and
/// ‖M⁻¹C‖, or 1 if both are zero. From complex modes, x holds real and imaginary part of each modal coordinate,
/// η̇ = λη + Ψᴸᵀ F, and u = 2 Re(Ψᴿ η). This form needs no mass matrix: the residues need not sum to zero. Along an
/// axis that is not a direction of the structure, the structure is rigid: a zero column of B, a zero row of C.
#[derive(Clone, Debug, PartialEq)]
pub struct FirstOrder {
    /// A, n × n, 1/s.
    pub a: DMatrix<f64>,
    /// Input matrix B, n × 3: effect of a force of 1 N along x, y, z on the time derivatives of the states.
    pub b: MatrixXx3<f64>,
    /// Output matrix C, 3 × n: displacement of the tool along x, y, z, m, per state.
    pub c: Matrix3xX<f64>,
}

impl FirstOrder {
    /// Number of states.
    pub fn order(&self) -> usize {
        self.a.nrows()
    }

    /// Receptance H(iω), m/N, rows displacement, columns force; ω in rad/s.
    ///
    /// `None` if iω − A is singular, as where iω is a pole.
    pub fn receptance(&self, omega: f64) -> Option<Matrix3<Complex64>> {
        self.transfer(Complex64::new(0.0, omega))
    }

    /// H(s) = C (s − A)⁻¹ B, m/N, rows displacement, columns force; s in rad/s.
    ///
    /// `None` if s − A is singular, as where s is a pole.
    pub fn transfer(&self, s: Complex64) -> Option<Matrix3<Complex64>> {
        let mut dynamic = self.a.map(|entry| Complex64::new(-entry, 0.0));
        for i in 0..self.order() {
            dynamic[(i, i)] += s;
        }
        let states = dynamic.lu().solve(&self.b.map(Complex64::from))?;
        let h = self.c.map(Complex64::from) * states;
        Some(Matrix3::from_fn(|i, j| h[(i, j)]))
    }

    /// This structure in the axes of a feed direction at `angle_deg` from x towards y, degrees.
    ///
    /// Force and displacement are then in feed, normal and axial direction.
    pub fn rotated(&self, angle_deg: f64) -> Self {
        let machine_from_feed = feed_axes(angle_deg);
        Self {
            a: self.a.clone(),
            b: &self.b * machine_from_feed,
            c: machine_from_feed.transpose() * &self.c,
        }
    }

    /// This structure with the motion of a sensor away from the tool as output u: `modes[r]` is the shape of mode r at
    /// the sensor divided by its shape at the tool, 1 for modes beyond the list. Only for structures given by modes,
    /// whose two states per mode are adjacent.
    #[must_use]
    pub fn at_sensor(&self, modes: &[f64]) -> Self {
        let mut at_sensor = self.clone();
        for (mode, factor) in modes.iter().enumerate().take(self.order() / 2) {
            let mut shape = at_sensor.c.columns_mut(2 * mode, 2);
            shape *= *factor;
        }
        at_sensor
    }

    /// True if a jump of the force makes the velocity of u jump: an entry of C B is above 1e-6·n·max|C|·max|B|.
    ///
    /// Modes of a structure with a mass matrix have C B = 0, except for rounding and the digits of the case file.
    pub fn velocity_jumps(&self) -> bool {
        let jump = &self.c * &self.b;
        jump.amax() > VELOCITY_JUMP * self.c.amax() * self.b.amax() * self.order() as f64
    }

    /// Poles of the structure (eigenvalues of A), rad/s, sorted by imaginary part.
    ///
    /// Empty if they cannot be computed; [`Structure::first_order`] refuses such a structure.
    pub fn poles(&self) -> Vec<Complex64> {
        self.try_poles().unwrap_or_default()
    }

    fn try_poles(&self) -> Result<Vec<Complex64>, EigenvalueError> {
        let mut poles = of_real(self.a.clone())?;
        poles.sort_by(|p, q| p.im.total_cmp(&q.im).then(p.re.total_cmp(&q.re)));
        Ok(poles)
    }
}

impl Structure {
    /// The structure in first-order form, in the machine's directions, without cubic terms.
    ///
    /// # Errors
    /// Mass, damping or stiffness is indefinite, the mass matrix has no inverse, or the poles cannot be computed.
    pub fn first_order(&self) -> Result<FirstOrder, StructureError> {
        self.check()?;
        let first_order = match &self.form {
            Form::Matrices(matrices) => from_matrices(matrices, &self.directions)?,
            Form::Modes(modes) => from_modes(modes, &self.directions),
            Form::Joints(robot) => from_second_order(&robot.matrices(), &robot.jacobian())?,
        };
        first_order.try_poles().map_err(StructureError::Poles)?;
        Ok(first_order)
    }
}

fn from_matrices(matrices: &Matrices, directions: &[Direction]) -> Result<FirstOrder, StructureError> {
    let mut at_sensor = Matrix3xX::zeros(directions.len());
    for (index, direction) in directions.iter().enumerate() {
        if let Some(axis) = direction.axis() {
            at_sensor[(axis, index)] = 1.0;
        }
    }
    from_second_order(matrices, &at_sensor)
}

/// First-order form of M q̈ + C q̇ + K q = Jᵀ F, u = J q.
fn from_second_order(matrices: &Matrices, jacobian: &Matrix3xX<f64>) -> Result<FirstOrder, StructureError> {
    let size = jacobian.ncols();
    let inverse_mass = matrices
        .mass
        .clone()
        .try_inverse()
        .ok_or(StructureError::SingularMass)?;
    let stiffness = &inverse_mass * &matrices.stiffness;
    let damping = &inverse_mass * &matrices.damping;
    // Scale s of the velocity states q̇/s, see [`FirstOrder`].
    let scale = match stiffness.norm().sqrt().max(damping.norm()) {
        scale if scale > 0.0 => scale,
        _ => 1.0,
    };
    let mut a = DMatrix::zeros(2 * size, 2 * size);
    a.view_mut((0, size), (size, size)).fill_with_identity();
    let mut top = a.view_mut((0, size), (size, size));
    top *= scale;
    a.view_mut((size, 0), (size, size))
        .copy_from(&(stiffness * (-1.0 / scale)));
    a.view_mut((size, size), (size, size)).copy_from(&(-damping));
    let mut b = MatrixXx3::zeros(2 * size);
    b.rows_mut(size, size)
        .copy_from(&(&inverse_mass * jacobian.transpose() * (1.0 / scale)));
    let mut c = Matrix3xX::zeros(2 * size);
    c.columns_mut(0, size).copy_from(jacobian);
    Ok(FirstOrder { a, b, c })
}

fn from_modes(modes: &[Mode], directions: &[Direction]) -> FirstOrder {
    let order = 2 * modes.len();
    let mut a = DMatrix::zeros(order, order);
    let mut b = MatrixXx3::zeros(order);
    let mut c = Matrix3xX::zeros(order);
    for (r, mode) in modes.iter().enumerate() {
        let pole = mode.pole();
        let (re, im) = (2 * r, 2 * r + 1);
        a[(re, re)] = pole.re;
        a[(re, im)] = -pole.im;
        a[(im, re)] = pole.im;
        a[(im, im)] = pole.re;
        for ((direction, left), right) in directions.iter().zip(&mode.left).zip(&mode.right) {
            let Some(axis) = direction.axis() else { continue };
            b[(re, axis)] = left.re;
            b[(im, axis)] = left.im;
            c[(axis, re)] = 2.0 * right.re;
            c[(axis, im)] = -2.0 * right.im;
        }
    }
    FirstOrder { a, b, c }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::tests::case;
    use std::f64::consts::TAU;

    #[test]
    fn the_acetal_robot_peaks_at_15_2_micrometers_per_newton() {
        let structure = case("kuka-kr90-acetal");
        let first_order = structure.structure().unwrap().first_order().unwrap();
        let peak = (1000..2500)
            .map(|f| first_order.receptance(TAU * f64::from(f) * 0.01).unwrap()[(1, 1)].norm())
            .fold(0.0, f64::max);
        assert!((peak - 15.2e-6).abs() < 0.05e-6, "{peak}");
    }

    #[test]
    fn first_order_receptance_is_that_of_the_modes() {
        let case = case("kuka-kr90-acetal");
        let structure = case.structure().unwrap();
        let Form::Modes(modes) = &structure.form else {
            panic!("no modes")
        };
        let first_order = structure.first_order().unwrap();
        for frequency_hz in [0.0, 5.0, 16.99, 18.0, 100.0] {
            let s = Complex64::new(0.0, TAU * frequency_hz);
            let h = first_order.receptance(s.im).unwrap();
            for i in 0..3 {
                for j in 0..3 {
                    let direct: Complex64 = modes
                        .iter()
                        .map(|mode| {
                            let residue = mode.right[i] * mode.left[j];
                            residue / (s - mode.pole()) + residue.conj() / (s - mode.pole().conj())
                        })
                        .sum();
                    // Error by rounding in the linear solve, whose condition is small: the poles differ by a factor of
                    // ten at most.
                    assert!((h[(i, j)] - direct).norm() < 1e-12 * direct.norm().max(1e-7));
                }
            }
        }
    }

    #[test]
    fn first_order_receptance_is_that_of_the_matrices() {
        let case = case("staubli-tx200");
        let structure = case.structure().unwrap();
        let Form::Matrices(m) = &structure.form else {
            panic!("no matrices")
        };
        let first_order = structure.first_order().unwrap();
        for omega in [0.0, 10.0, 100.0, 1000.0] {
            let dynamic = (&m.stiffness - &m.mass * (omega * omega)).map(Complex64::from)
                + m.damping.map(|entry| Complex64::new(0.0, entry * omega));
            let direct = dynamic.try_inverse().unwrap();
            let h = first_order.receptance(omega).unwrap();
            for i in 0..3 {
                for j in 0..3 {
                    // Error by rounding: the condition number of K is about 1e5.
                    assert!((h[(i, j)] - direct[(i, j)]).norm() < 1e-9 * direct.norm());
                }
            }
        }
    }

    #[test]
    fn rotating_the_feed_by_a_right_angle_swaps_the_directions() {
        let case = case("kuka-kr90-full");
        let first_order = case.structure().unwrap().first_order().unwrap();
        let machine = first_order.receptance(100.0).unwrap();
        let rotated = first_order.rotated(90.0).receptance(100.0).unwrap();
        let close = |p: Complex64, q: Complex64| (p - q).norm() < 1e-12 * machine.norm();
        // The feed is the machine's y, the normal its −x.
        assert!(close(rotated[(0, 0)], machine[(1, 1)]));
        assert!(close(rotated[(1, 1)], machine[(0, 0)]));
        assert!(close(rotated[(0, 1)], -machine[(1, 0)]));
    }

    #[test]
    fn an_overflow_of_the_poles_reaches_the_caller() {
        // Positive definite, but ω² = 1e400 (rad/s)².
        let mut structure = case("staubli-tx200").structure().unwrap().clone();
        let Form::Matrices(matrices) = &mut structure.form else {
            panic!("no matrices")
        };
        matrices.mass *= 1e-200;
        matrices.stiffness *= 1e200;
        let error = structure.first_order().unwrap_err();
        assert!(matches!(error, StructureError::Poles(_)), "{error}");
        // The equation of motion passes this error on, with the remedy.
        let error = crate::dynamics::Dynamics::new(&structure).unwrap_err();
        assert!(error.to_string().contains("check their units"), "{error}");
    }

    #[test]
    fn poles_of_the_benchmark_are_922_hz_and_1_1_percent() {
        let case = case("insperger-1dof-ad1");
        let poles = case.structure().unwrap().first_order().unwrap().poles();
        assert_eq!(poles.len(), 2);
        // The case file holds 922 Hz and 0.011 to machine precision.
        assert!((poles[1].norm() / TAU - 922.0).abs() < 1e-6);
        assert!((-poles[1].re / poles[1].norm() - 0.011).abs() < 1e-9);
    }
}
