//! The period of a Floquet multiplier (characteristic multiplier) in parts, for its Floquet mode and the adjoint mode.
//!
//! With the complex depth κ = w (1 − 1/μ), the displacements p along the chip normals at the ports of an element and the
//! state x₁ at its end follow from the state x₀ at its start,
//!
//!   (I − κQ) p = E x₀,   x₁ = G x₀ + κ T p.

use nalgebra::linalg::LU;
use nalgebra::{DMatrix, DVector, Dyn};
use num_complex::Complex64;

use crate::problem::period::Period;
use quietcut_numerics::eigenvalues::eigenvector;

/// Growth of a motion over a part of the period, as a factor on the growth of the Floquet mode over that part, beyond
/// which the next part begins. The linear system of all parts then loses about three digits.
const GROWTH: f64 = 1e3;

/// Largest number of unknowns (parts of a period times states) in the linear system for the states at the start of all
/// parts: a limit on computing time. A choice.
const CYCLIC_MAX: usize = 256;

/// Period in parts, each with its own state at the start.
pub(super) struct PeriodParts {
    /// Transition matrix of each part.
    matrices: Vec<DMatrix<Complex64>>,
    /// Elements of the period, in order of time.
    pub(super) elements: Vec<PartElement>,
}

/// Element of a period, expressed by the state at the start of its part.
pub(super) struct PartElement {
    /// Index of the part that contains this element.
    pub(super) part: usize,
    /// Factors of I − κQ.
    pub(super) implicit: LU<Complex64, Dyn, Dyn>,
    /// Displacements along the chip normals at the ports, per state at the start of the part.
    pub(super) chips: DMatrix<Complex64>,
    /// Axial displacements at the nodes, per state at the start of the part; `None` without axial-depth modulation.
    pub(super) axial: Option<DMatrix<Complex64>>,
}

impl PeriodParts {
    /// Divides a period into parts for a multiplier at an axial depth; `None` if an element is singular.
    pub(super) fn new(period: &Period, multiplier: Complex64, depth_m: f64) -> Option<Self> {
        let kappa = (Complex64::ONE - multiplier.inv()) * depth_m;
        let complex = |matrix: &DMatrix<f64>| matrix.map(Complex64::from);
        let identity = DMatrix::<Complex64>::identity(period.order(), period.order());
        let mut matrices = Vec::new();
        let mut part = identity.clone();
        let mut elements = Vec::with_capacity(period.elements.len());
        let (mut length, share) = (0.0, 1.0 / period.elements.len().max(1) as f64);
        for element in &period.elements {
            // Ends the part of the period once some motion has grown by the factor `GROWTH` more than the Floquet mode.
            // Over a much longer part the share of the mode would be rounding.
            if part.norm() > GROWTH * multiplier.norm().powf(length) {
                matrices.push(std::mem::replace(&mut part, identity.clone()));
                length = 0.0;
            }
            let ports = element.kernel.nrows();
            let implicit = (DMatrix::identity(ports, ports) - complex(&element.kernel) * kappa).lu();
            let chips = implicit.solve(&(complex(&element.observe) * &part))?;
            let axial = element
                .axial
                .as_ref()
                .map(|axial| complex(&axial.observe) * &part + complex(&axial.kernel) * &chips * kappa);
            part = complex(&element.flow) * &part + complex(&element.drive) * &chips * kappa;
            elements.push(PartElement {
                part: matrices.len(),
                implicit,
                chips,
                axial,
            });
            length += share;
        }
        matrices.push(complex(&period.flight) * part);
        Some(Self { matrices, elements })
    }

    /// States of the Floquet mode at the start of each part; `None` as by [`cyclic_vector`].
    pub(super) fn starts(&self, multiplier: Complex64) -> Option<Vec<DVector<Complex64>>> {
        cyclic_vector(&self.matrices, multiplier)
    }

    /// Adjoint mode at the end of each part; `None` as by [`cyclic_vector`].
    ///
    /// With the transition matrices T_g, T_gᵀ l_g is the adjoint at the start of part g, which is l_{g−1}, or μ times
    /// that at the end of the period for the first part.
    pub(super) fn ends(&self, multiplier: Complex64) -> Option<Vec<DVector<Complex64>>> {
        let reversed: Vec<_> = self.matrices.iter().rev().map(DMatrix::transpose).collect();
        let mut ends = cyclic_vector(&reversed, multiplier)?;
        ends.reverse();
        Some(ends)
    }
}

/// Solves for the states x_g of a Floquet mode at the start of each part of the period: T_g x_g = x_{g+1}, and μ x_0
/// after the last part, with the transition matrices T_g of the parts. `None` if there are more unknowns than
/// [`CYCLIC_MAX`], or if the matrix is not finite or singular after the shift.
///
/// All states are solved for at once. Integration from a start that is exact to rounding would fail if the parts
/// together grow by far more than μ.
fn cyclic_vector(parts: &[DMatrix<Complex64>], multiplier: Complex64) -> Option<Vec<DVector<Complex64>>> {
    let [single] = parts else {
        let (order, count) = (parts.first()?.nrows(), parts.len());
        if order * count > CYCLIC_MAX {
            return None;
        }
        let mut whole = DMatrix::zeros(order * count, order * count);
        for (g, part) in parts.iter().enumerate() {
            whole
                .view_mut((g * order, g * order), (order, order))
                .copy_from(part);
            let (to, factor) = if g + 1 < count {
                ((g + 1) * order, Complex64::ONE)
            } else {
                (0, multiplier)
            };
            for i in 0..order {
                whole[(g * order + i, to + i)] -= factor;
            }
        }
        let vector = eigenvector(&whole, Complex64::ZERO)?;
        return Some(
            (0..count)
                .map(|g| vector.rows(g * order, order).into_owned())
                .collect(),
        );
    };
    Some(vec![eigenvector(single, multiplier)?])
}
