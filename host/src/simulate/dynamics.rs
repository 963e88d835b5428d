//! The structure, ready to be integrated: first-order form and cubic terms.

use nalgebra::DMatrix;

use super::dormand_prince::Quartic;
use crate::structure::{FirstOrder, Form, Matrices, Structure, StructureError};

/// ẋ = A x + B F − f₃(x), u = C x: [`FirstOrder`] with the cubic terms of the structure, if it has any.
///
/// Axes are the machine's x, y, z; SI units: m, m/s, N. Velocity and acceleration of the tool are u̇ = C ẋ and
/// ü = C A ẋ. The latter holds where C B = 0, as for all matrices. Complex modes whose residues do not sum to zero have
/// C B ≠ 0: there a jump of the force is a jump of the *velocity*, and the acceleration has an impulse.
#[derive(Clone, Debug)]
pub struct Dynamics {
    order: usize,
    /// A, row by row.
    a: Vec<f64>,
    /// B, one row of three per state.
    b: Vec<[f64; 3]>,
    c: [Vec<f64>; 3],
    ca: [Vec<f64>; 3],
    cubic: Option<Cubic>,
    sizes: Vec<f64>,
    velocity_jumps: bool,
}

/// f₃ in the second half of the states: damping·v∘³ + stiffness·q∘³ with q the first and v the second half.
#[derive(Clone, Debug)]
struct Cubic {
    damping: Vec<f64>,
    stiffness: Vec<f64>,
}

impl Dynamics {
    /// The equations of `structure`.
    ///
    /// # Errors
    /// Mass, damping or stiffness is indefinite.
    pub fn new(structure: &Structure) -> Result<Self, StructureError> {
        let FirstOrder { a, b, c } = structure.first_order()?;
        let order = a.nrows();
        let row = |matrix: &DMatrix<f64>, axis: usize| matrix.row(axis).iter().copied().collect::<Vec<_>>();
        let c = DMatrix::from_fn(3, order, |axis, state| c[(axis, state)]);
        let ca = &c * &a;
        let jump = &c * &b;
        // The modes of real matrices cancel but for rounding and for the digits that a file gives them; less than a
        // millionth of what does not cancel is below any sensor.
        let velocity_jumps = jump.amax() > 1e-6 * c.amax() * b.amax() * order as f64;
        let cubic = match &structure.form {
            Form::Matrices(matrices) if structure.is_nonlinear() => Some(cubic(matrices, &a)?),
            _ => None,
        };
        // States of modes move the tool by up to |C| each; states of matrices are displacements already.
        let size = |state: usize| {
            let moved = c.column(state).amax();
            match &structure.form {
                Form::Modes(_) if moved > 0.0 => 1.0 / moved,
                _ => 1.0,
            }
        };
        Ok(Self {
            order,
            a: a.transpose().as_slice().to_vec(),
            b: b.row_iter().map(|row| [row[0], row[1], row[2]]).collect(),
            c: std::array::from_fn(|axis| row(&c, axis)),
            ca: std::array::from_fn(|axis| row(&ca, axis)),
            cubic,
            sizes: (0..order).map(size).collect(),
            velocity_jumps,
        })
    }

    /// Number of states.
    pub fn order(&self) -> usize {
        self.order
    }

    /// About the size of each state while the tool is displaced by one meter: what error control measures by.
    pub fn sizes(&self) -> &[f64] {
        &self.sizes
    }

    /// True where a jump of the force makes the velocity jump: then there is no acceleration at that instant.
    pub fn velocity_jumps(&self) -> bool {
        self.velocity_jumps
    }

    /// Displacement of the tool, m.
    pub fn displacement(&self, x: &[f64]) -> [f64; 3] {
        std::array::from_fn(|axis| dot(&self.c[axis], x))
    }

    /// Displacement of the tool, m, from the interpolants of the states.
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

    /// Velocity of the tool, m/s, from the rate of the states.
    pub fn velocity(&self, rate: &[f64]) -> [f64; 3] {
        std::array::from_fn(|axis| dot(&self.c[axis], rate))
    }

    /// Acceleration of the tool, m/s², from the rate of the states; `None` where the velocity may jump.
    pub fn acceleration(&self, rate: &[f64]) -> Option<[f64; 3]> {
        (!self.velocity_jumps).then(|| std::array::from_fn(|axis| dot(&self.ca[axis], rate)))
    }

    /// ẋ under the force in N.
    pub fn rate(&self, x: &[f64], force: [f64; 3], rate: &mut [f64]) {
        for ((rate, a), b) in rate.iter_mut().zip(self.a.chunks_exact(self.order)).zip(&self.b) {
            *rate = dot(a, x) + b[0] * force[0] + b[1] * force[1] + b[2] * force[2];
        }
        if let Some(cubic) = &self.cubic {
            let half = self.order / 2;
            let (q, v) = x.split_at(half);
            for ((rate, damping), stiffness) in rate[half..]
                .iter_mut()
                .zip(cubic.damping.chunks_exact(half))
                .zip(cubic.stiffness.chunks_exact(half))
            {
                *rate -= dot_cubes(damping, v) + dot_cubes(stiffness, q);
            }
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn dot_cubes(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b * b * b).sum()
}

/// C₃ and K₃ for the states (q, q̇/s): M⁻¹C₃ s² and M⁻¹K₃/s.
fn cubic(matrices: &Matrices, a: &DMatrix<f64>) -> Result<Cubic, StructureError> {
    let freedoms = matrices.mass.nrows();
    let scale = a[(0, freedoms)];
    let mass = matrices.mass.clone().lu();
    let of = |matrix: &Option<DMatrix<f64>>, factor: f64| -> Result<Vec<f64>, StructureError> {
        let Some(matrix) = matrix else {
            return Ok(vec![0.0; freedoms * freedoms]);
        };
        let divided = mass.solve(matrix).ok_or(StructureError::SingularMass)?;
        Ok((divided.transpose() * factor).as_slice().to_vec())
    };
    Ok(Cubic {
        damping: of(&matrices.cubic_damping, scale * scale)?,
        stiffness: of(&matrices.cubic_stiffness, scale.recip())?,
    })
}
