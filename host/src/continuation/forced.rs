//! The forced problem: a structure with cubic terms under the forces of feed and edges.

use nalgebra::{DMatrix, DVector, Vector3};

use crate::case::Case;
use crate::stability::{CubicTerms, Problem, StabilityError};

/// ẋ = A x + B F(t, x) − N(x), u = C x: eqs 6.1 and 3.6 in first-order form.
///
/// States x as in [`FirstOrder`](crate::structure::FirstOrder): for matrices x = (q, q̇/s). N holds the cubic terms
/// M⁻¹(C₃ q̇∘³ + K₃ q∘³)/s in the lower half. On an orbit of the tooth period
/// F = (w − z)·Σ_teeth (cutting·n_x f_t + edge), with z the axial displacement where the depth follows it, else 0.
#[derive(Clone, Debug)]
pub struct ForcedProblem {
    /// The linear part and the cutting process.
    pub linear: Problem,
    /// The cubic terms; `None` where the structure is linear.
    pub(super) cubic: Option<Cubic>,
}

/// N(x) = stiffness·q∘³ + damping·(q̇/s)∘³ in the lower half of the states.
#[derive(Clone, Debug)]
pub(super) struct Cubic {
    /// M⁻¹ K₃/s.
    stiffness: DMatrix<f64>,
    /// M⁻¹ C₃ s².
    damping: DMatrix<f64>,
}

impl ForcedProblem {
    /// The forced problem of a case.
    ///
    /// # Errors
    /// As [`Problem::new`], but for cubic terms, which are kept.
    pub fn new(case: &Case) -> Result<Self, StabilityError> {
        let linear = Problem::new(case, CubicTerms::LeaveOut)?;
        let structure = case.structure()?;
        let cubic = match structure.equation() {
            Some(matrices) if structure.is_nonlinear() => {
                let size = matrices.mass.nrows();
                // q̇ = s·(lower half): the scale of the first-order form stands in its own upper right corner.
                let scale = linear.structure.a[(0, size)];
                let inverse_mass =
                    matrices
                        .mass
                        .clone()
                        .try_inverse()
                        .ok_or_else(|| StabilityError::Structure {
                            path: case.path.clone(),
                            cause: crate::structure::StructureError::SingularMass,
                        })?;
                let part = |matrix: &Option<DMatrix<f64>>, factor: f64| match matrix {
                    Some(matrix) => &inverse_mass * matrix * factor,
                    None => DMatrix::zeros(size, size),
                };
                Some(Cubic {
                    stiffness: part(&matrices.cubic_stiffness, scale.recip()),
                    damping: part(&matrices.cubic_damping, scale * scale),
                })
            }
            _ => None,
        };
        Ok(Self { linear, cubic })
    }

    /// Number of states.
    pub fn order(&self) -> usize {
        self.linear.structure.order()
    }

    /// Force per depth, N/m, of all cutting teeth at a phase of the tooth period, rad, on an orbit: that of feed and
    /// edges.
    pub(super) fn force_per_depth(&self, teeth: usize, phase: f64) -> Vector3<f64> {
        let process = &self.linear.process;
        (0..teeth)
            .map(|tooth| {
                let angle = process.engagement.angle(tooth, phase);
                process.force.forced(angle, process.feed_per_tooth_m)
            })
            .sum()
    }

    /// N(x), added to `rate` with a minus sign.
    pub(super) fn subtract_cubic(&self, state: &[f64], rate: &mut DVector<f64>) {
        let Some(cubic) = &self.cubic else { return };
        let size = cubic.stiffness.nrows();
        for i in 0..size {
            let mut sum = 0.0;
            for j in 0..size {
                sum += cubic.stiffness[(i, j)] * state[j].powi(3)
                    + cubic.damping[(i, j)] * state[size + j].powi(3);
            }
            rate[size + i] -= sum;
        }
    }

    /// A − ∂N/∂x − (force per depth)·∂z/∂x: the Jacobian of the orbit's equation at a state.
    pub(super) fn jacobian(&self, state: &[f64], force_per_depth: &Vector3<f64>) -> DMatrix<f64> {
        let structure = &self.linear.structure;
        let mut jacobian = structure.a.clone();
        if let Some(cubic) = &self.cubic {
            let size = cubic.stiffness.nrows();
            for i in 0..size {
                for j in 0..size {
                    jacobian[(size + i, j)] -= 3.0 * cubic.stiffness[(i, j)] * state[j] * state[j];
                    jacobian[(size + i, size + j)] -=
                        3.0 * cubic.damping[(i, j)] * state[size + j] * state[size + j];
                }
            }
        }
        if self.linear.process.axial_depth_modulation {
            jacobian -= (&structure.b * force_per_depth) * structure.c.row(2);
        }
        jacobian
    }
}
