//! Equation of motion of the structure in first-order form, with cubic terms.

use nalgebra::{DMatrix, Matrix3xX, MatrixXx3};

use crate::structure::{CubicForce, FirstOrder, Form, Structure, StructureError};
use quietcut_numerics::dormand_prince::Quartic;

/// Equation of motion ẋ = A x + B F − f₃(x), u = C x: [`FirstOrder`] with the cubic terms f₃ of the structure, if it
/// has any.
///
/// Axes are the machine's x, y, z; SI units: m, m/s, N. The velocity of the tool is u̇ = C ẋ. Its acceleration is
/// ü = C A ẋ if C B = 0, as for structures given by matrices or joints. Complex modes whose residues do not sum to zero
/// have C B ≠ 0: a jump of the force is then a jump of the *velocity*, and the acceleration has an impulse.
#[derive(Clone, Debug)]
pub struct Dynamics {
    order: usize,
    /// System matrix A, row by row, 1/s.
    a: Vec<f64>,
    /// Input matrix B, one row of three entries (force along x, y, z) per state.
    b: Vec<[f64; 3]>,
    c: [Vec<f64>; 3],
    ca: [Vec<f64>; 3],
    /// C B, (m/s)/N: jump of the velocity of the tool per jump of the force; zero but for rounding for a structure with
    /// a mass matrix.
    cb: [[f64; 3]; 3],
    /// C A B, 1/kg: acceleration of the tool per force.
    cab: [[f64; 3]; 3],
    cubic: Option<CubicForce>,
    sizes: Vec<f64>,
    velocity_jumps: bool,
}

impl Dynamics {
    /// The equation of motion of `structure`.
    ///
    /// # Errors
    /// Mass, damping or stiffness is indefinite, the mass matrix has no inverse, or the poles cannot be computed.
    pub fn new(structure: &Structure) -> Result<Self, StructureError> {
        let first_order = structure.first_order()?;
        let velocity_jumps = first_order.velocity_jumps();
        let FirstOrder { a, b, c } = first_order;
        let order = a.nrows();
        let row = |matrix: &DMatrix<f64>, axis: usize| matrix.row(axis).iter().copied().collect::<Vec<_>>();
        let c = DMatrix::from_fn(3, order, |axis, state| c[(axis, state)]);
        let ca = &c * &a;
        let cubic = match structure.equation() {
            Some(matrices) if structure.is_nonlinear() => {
                let scale = a[(0, matrices.mass.nrows())];
                Some(CubicForce::in_first_order(&matrices, scale)?)
            }
            _ => None,
        };
        // Magnitude of a state at a tool displacement of 1 m: the inverse of the largest |C| of the state for modes and
        // joints. It is 1 for their states that do not displace the tool, and for matrices, whose states are
        // displacements in m, rotations in rad, and velocities scaled to these units.
        let size = |state: usize| {
            let moved = c.column(state).amax();
            match &structure.form {
                Form::Modes(_) | Form::Joints(_) if moved > 0.0 => 1.0 / moved,
                _ => 1.0,
            }
        };
        let mut dynamics = Self {
            order,
            a: a.transpose().as_slice().to_vec(),
            b: b.row_iter().map(|row| [row[0], row[1], row[2]]).collect(),
            c: std::array::from_fn(|axis| row(&c, axis)),
            cb: [[0.0; 3]; 3],
            cab: [[0.0; 3]; 3],
            ca: std::array::from_fn(|axis| row(&ca, axis)),
            cubic,
            sizes: (0..order).map(size).collect(),
            velocity_jumps,
        };
        dynamics.note_products();
        Ok(dynamics)
    }

    fn note_products(&mut self) {
        let product = |rows: &[Vec<f64>; 3]| -> [[f64; 3]; 3] {
            std::array::from_fn(|i| {
                std::array::from_fn(|j| rows[i].iter().zip(&self.b).map(|(c, b)| c * b[j]).sum())
            })
        };
        (self.cb, self.cab) = (product(&self.c), product(&self.ca));
    }

    /// Appends the two states of a mode, η̈ + 2ζω η̇ + ω² η = F/m, which the force along `axis` excites and which
    /// displaces the tool by η along that axis.
    pub fn add_mode(&mut self, axis: usize, frequency_hz: f64, damping_ratio: f64, modal_mass_kg: f64) {
        let (order, omega) = (self.order, std::f64::consts::TAU * frequency_hz);
        let wider = order + 2;
        let mut a = vec![0.0; wider * wider];
        for (new, old) in a.chunks_exact_mut(wider).zip(self.a.chunks_exact(order)) {
            new[..order].copy_from_slice(old);
        }
        // The two new states are the modal displacement η and its scaled velocity η̇/ω.
        a[order * wider + order + 1] = omega;
        a[(order + 1) * wider + order] = -omega;
        a[(order + 1) * wider + order + 1] = -2.0 * damping_ratio * omega;
        self.a = a;
        let mut force = [0.0; 3];
        force[axis] = 1.0 / (modal_mass_kg * omega);
        self.b.extend([[0.0; 3], force]);
        for (index, (c, ca)) in self.c.iter_mut().zip(&mut self.ca).enumerate() {
            let moved = f64::from(u8::from(index == axis));
            c.extend([moved, 0.0]);
            ca.extend([0.0, moved * omega]);
        }
        self.sizes.extend([1.0, 1.0]);
        self.order = wider;
        self.note_products();
    }

    /// These equations of motion, but with the motion at a sensor away from the tool as output; see
    /// [`FirstOrder::at_sensor`]. Forces still act on the tool.
    #[must_use]
    pub fn at_sensor(&self, modes: &[f64]) -> Self {
        let first_order = self.first_order().at_sensor(modes);
        let mut at_sensor = self.clone();
        at_sensor.velocity_jumps = first_order.velocity_jumps();
        let FirstOrder { a, c, .. } = first_order;
        let ca = &c * &a;
        for axis in 0..3 {
            at_sensor.c[axis] = c.row(axis).iter().copied().collect();
            at_sensor.ca[axis] = ca.row(axis).iter().copied().collect();
        }
        at_sensor.note_products();
        at_sensor
    }

    /// The linear part of the equations, without cubic terms.
    pub fn first_order(&self) -> FirstOrder {
        FirstOrder {
            a: DMatrix::from_row_slice(self.order, self.order, &self.a),
            b: MatrixXx3::from_fn(self.order, |state, axis| self.b[state][axis]),
            c: Matrix3xX::from_fn(self.order, |axis, state| self.c[axis][state]),
        }
    }

    /// Number of states.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Scale of each state for the integrator's error control: for modes and joints the magnitude that displaces the
    /// tool by 1 m, 1 for a state that does not displace it; 1 for all states of matrices.
    pub fn sizes(&self) -> &[f64] {
        &self.sizes
    }

    /// True if a jump of the force makes the velocity of the tool jump (C B ≠ 0): the acceleration then has an impulse
    /// at that instant.
    pub fn velocity_jumps(&self) -> bool {
        self.velocity_jumps
    }

    /// Displacement of the tool, m.
    pub fn displacement(&self, x: &[f64]) -> [f64; 3] {
        std::array::from_fn(|axis| dot(&self.c[axis], x))
    }

    /// Displacement of the tool within an integration step, m: for each axis a quartic polynomial of the time, from the
    /// quartics `x` of the states.
    pub fn displacement_quartics(&self, x: &[Quartic]) -> [Quartic; 3] {
        std::array::from_fn(|axis| {
            let mut sum = [0.0; 5];
            for (weight, quartic) in self.c[axis].iter().zip(x).filter(|(weight, _)| **weight != 0.0) {
                for (sum, coefficient) in sum.iter_mut().zip(quartic) {
                    *sum += weight * coefficient;
                }
            }
            sum
        })
    }

    /// Velocity of the tool, m/s, from the time derivative of the states.
    pub fn velocity(&self, rate: &[f64]) -> [f64; 3] {
        std::array::from_fn(|axis| dot(&self.c[axis], rate))
    }

    /// Acceleration of the tool, m/s², from the time derivative of the states; `None` if the velocity may jump.
    pub fn acceleration(&self, rate: &[f64]) -> Option<[f64; 3]> {
        (!self.velocity_jumps).then(|| std::array::from_fn(|axis| dot(&self.ca[axis], rate)))
    }

    /// Velocity of the tool, m/s, at the states `x` under the `force` F, N: C A x + C B F.
    pub fn velocity_under(&self, x: &[f64], force: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| {
            let jump = if self.velocity_jumps {
                dot(&self.cb[axis], &force)
            } else {
                0.0
            };
            dot(&self.ca[axis], x) + jump
        })
    }

    /// C B, (m/s)/N: jump of the velocity of the tool per jump of the force; zero if the velocity does not jump.
    pub fn velocity_per_force(&self) -> [[f64; 3]; 3] {
        if self.velocity_jumps {
            self.cb
        } else {
            [[0.0; 3]; 3]
        }
    }

    /// C A B, 1/kg: acceleration of the tool per force on the tool, if its velocity does not jump.
    pub fn acceleration_per_force(&self) -> [[f64; 3]; 3] {
        self.cab
    }

    /// Sets the velocity of the tool along one axis to zero by an impulse along that axis, as at the onset of stick.
    /// Nothing changes if an impulse along the axis does not accelerate the tool along it.
    pub fn halt(&self, axis: usize, x: &mut [f64]) {
        let per_impulse = self.cab[axis][axis];
        if per_impulse > 0.0 {
            let impulse = dot(&self.ca[axis], x) / per_impulse;
            for (x, b) in x.iter_mut().zip(&self.b) {
                *x -= impulse * b[axis];
            }
        }
    }

    /// Writes the time derivative ẋ of the states `x` under the `force`, N, on the tool.
    pub fn rate(&self, x: &[f64], force: [f64; 3], rate: &mut [f64]) {
        for ((rate, a), b) in rate.iter_mut().zip(self.a.chunks_exact(self.order)).zip(&self.b) {
            *rate = dot(a, x) + b[0] * force[0] + b[1] * force[1] + b[2] * force[2];
        }
        if let Some(cubic) = &self.cubic {
            let size = cubic.size();
            let (q, v) = (&x[..size], &x[size..2 * size]);
            for (rate, force) in rate[size..].iter_mut().zip(cubic.at(q, v)) {
                *rate -= force;
            }
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;

    use super::*;
    use crate::structure::{Direction, Mode};

    #[test]
    fn the_velocity_may_jump_at_a_sensor_and_not_at_the_tool() {
        // Residues with the real parts 1 and −1: their sum 2 Re(Ψᴿ Ψᴸ) is zero at the tool, but not where one mode has
        // half of its shape.
        let mode = |frequency_hz, real| Mode {
            frequency_hz,
            damping_ratio: 0.02,
            left: vec![Complex64::ONE],
            right: vec![1e-5 * Complex64::new(real, -3.0)],
        };
        let dynamics = Dynamics::new(&Structure {
            directions: vec![Direction::Y],
            form: Form::Modes(vec![mode(17.0, 1.0), mode(30.0, -1.0)]),
        })
        .unwrap();
        assert!(!dynamics.velocity_jumps());
        assert!(!dynamics.at_sensor(&[0.5, 0.5]).velocity_jumps());
        let sensor = dynamics.at_sensor(&[0.5, 1.0]);
        assert!(sensor.velocity_jumps());
        assert!((sensor.velocity_per_force()[1][1] + 1e-5).abs() < 1e-15);
    }
}
