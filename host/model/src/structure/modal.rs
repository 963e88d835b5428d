//! Modes of a structure in first-order form, and the change of the matrix A with a pole at constant mode shapes.

use nalgebra::{DMatrix, Matrix3};
use num_complex::Complex64;

use crate::criteria::{DEFECTIVE, SAME_POLE};

use super::FirstOrder;

/// Modal part of A for one pole pair λ = −ζω + iω√(1 − ζ²).
///
/// Without real and defective poles, A = Σ_r λ_r P_r + conjugates, with projectors P_r. A change by [`Self::moved`]
/// leaves P_r unchanged, and thus the residue C P_r B of the receptance. Repeated poles, as of a round tool, form one
/// modal part.
#[derive(Clone, Debug)]
pub struct ModalPart {
    /// Pole λ, rad/s, with positive imaginary part; the mean of repeated poles.
    pub pole: Complex64,
    /// Projector P, n × n.
    projector: DMatrix<Complex64>,
}

impl ModalPart {
    /// Natural frequency ω = |λ|, rad/s.
    pub fn omega(&self) -> f64 {
        self.pole.norm()
    }

    /// Damping ratio ζ = −Re λ/|λ|.
    pub fn damping_ratio(&self) -> f64 {
        -self.pole.re / self.pole.norm()
    }

    /// ∂A/∂ω, without unit, at constant damping ratio ζ and mode shapes: ∂λ/∂ω = λ/ω.
    pub fn by_omega(&self) -> DMatrix<f64> {
        self.moved(self.pole / self.omega())
    }

    /// ∂A/∂ζ, rad/s, at constant natural frequency ω and mode shapes: ∂λ/∂ζ = −ω − iωζ/√(1 − ζ²).
    pub fn by_damping_ratio(&self) -> DMatrix<f64> {
        let (omega, zeta) = (self.omega(), self.damping_ratio());
        self.moved(Complex64::new(-omega, -omega * zeta / (1.0 - zeta * zeta).sqrt()))
    }

    /// Residue C P B of the receptance at the pole λ, m/(N s), for the `structure` of which this is a part; rows are
    /// displacements, columns forces.
    pub fn residue(&self, structure: &FirstOrder) -> Matrix3<Complex64> {
        let complex = |entry: f64| Complex64::new(entry, 0.0);
        let residue = structure.c.map(complex) * &self.projector * structure.b.map(complex);
        Matrix3::from_fn(|i, j| residue[(i, j)])
    }

    /// Change of A for a change δλ = `by` of the pole, rad/s, at constant mode shapes: 2 Re(δλ P).
    pub fn moved(&self, by: Complex64) -> DMatrix<f64> {
        self.projector.map(|entry| 2.0 * (entry * by).re)
    }
}

impl FirstOrder {
    /// The oscillatory modes in the order of increasing natural frequency; real poles are excluded.
    ///
    /// A defective pole is also excluded: it has fewer mode shapes than its multiplicity.
    pub fn modal_parts(&self) -> Vec<ModalPart> {
        let mut groups: Vec<Vec<Complex64>> = Vec::new();
        for pole in self.poles().into_iter().filter(|pole| pole.im > 0.0) {
            match groups
                .iter_mut()
                .find(|group| (group[0] - pole).norm() < SAME_POLE * pole.norm())
            {
                Some(group) => group.push(pole),
                None => groups.push(vec![pole]),
            }
        }
        let mut parts: Vec<ModalPart> = groups.iter().filter_map(|group| self.part(group)).collect();
        parts.sort_by(|a, b| a.omega().total_cmp(&b.omega()));
        parts
    }

    fn part(&self, group: &[Complex64]) -> Option<ModalPart> {
        let pole = group.iter().sum::<Complex64>() / group.len() as f64;
        let right = invariant(&self.a, pole, group.len())?;
        let left = invariant(&self.a.transpose(), pole, group.len())?;
        let projector = &right * (left.transpose() * &right).try_inverse()? * left.transpose();
        // P is a projector (P² = P) by construction. A P = λ P holds only for a pole λ that has as many mode shapes as
        // its multiplicity; other poles are excluded.
        let miss = self.a.map(Complex64::from) * &projector - &projector * pole;
        (miss.norm() < DEFECTIVE * pole.norm() * projector.norm()).then_some(ModalPart { pole, projector })
    }
}

/// Orthonormal basis of the invariant subspace of `matrix` at the eigenvalue `pole`, from inverse iteration with
/// `count` vectors. `None` if the shifted matrix is singular or the result is not finite.
fn invariant(matrix: &DMatrix<f64>, pole: Complex64, count: usize) -> Option<DMatrix<Complex64>> {
    let size = matrix.nrows();
    // The shift lies 1e-7·|λ| away from the pole λ, at which the matrix of the inverse iteration is singular. Each of
    // the three iterations then reduces the parts of eigenvectors whose poles differ from λ by about |λ| by a factor of
    // about 1e7.
    let shift = pole * (1.0 + 1e-7);
    let lu = (matrix.map(Complex64::from) - DMatrix::identity(size, size) * shift).lu();
    let start =
        |i: usize, j: usize| Complex64::new((1.0 + i as f64 * (1.7 + j as f64)).sin(), 0.3 * j as f64);
    let mut basis = DMatrix::from_fn(size, count, start);
    for _ in 0..3 {
        basis = lu.solve(&basis)?.qr().q();
    }
    basis.iter().all(|entry| entry.is_finite()).then_some(basis)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::tests::case;

    fn first_order(name: &str) -> FirstOrder {
        case(name).structure().unwrap().first_order().unwrap()
    }

    #[test]
    fn derivatives_of_a_mode_are_those_of_its_file_entry() {
        use crate::structure::Form;

        let case = case("kuka-kr90-acetal");
        let structure = case.structure().unwrap();
        let parts = structure.first_order().unwrap().modal_parts();
        assert_eq!(parts.len(), 2);
        for (index, part) in parts.iter().enumerate() {
            let moved = |frequency: f64, damping: f64| {
                let mut structure = structure.clone();
                let Form::Modes(modes) = &mut structure.form else {
                    panic!("no modes")
                };
                modes[index].frequency_hz += frequency;
                modes[index].damping_ratio += damping;
                structure.first_order().unwrap().a
            };
            let h = 1e-4;
            let by_omega = (moved(h, 0.0) - moved(-h, 0.0)) / (2.0 * h * std::f64::consts::TAU);
            let by_damping = (moved(0.0, h) - moved(0.0, -h)) / (2.0 * h);
            // Error of central differences of smooth functions with steps of 1e-4: about 1e-8 and rounding.
            assert!((part.by_omega() - &by_omega).norm() < 1e-7 * by_omega.norm());
            assert!((part.by_damping_ratio() - &by_damping).norm() < 1e-6 * by_damping.norm());
        }
    }

    #[test]
    fn a_change_of_one_pole_of_matrices_leaves_the_others_unchanged() {
        for name in ["staubli-tx200", "kuka-kr90-full", "insperger-2dof-ad1"] {
            let structure = first_order(name);
            let parts = structure.modal_parts();
            assert_eq!(
                parts.len(),
                if name.starts_with("insperger") {
                    1
                } else {
                    structure.order() / 2
                }
            );
            for part in &parts {
                let h = 1e-4 * part.omega();
                let mut moved = structure.clone();
                moved.a += part.by_omega() * h;
                let expected = part.pole * (1.0 + 1e-4);
                let near = |poles: &[Complex64], to: Complex64| {
                    poles
                        .iter()
                        .map(|pole| (pole - to).norm())
                        .fold(f64::INFINITY, f64::min)
                };
                // A is linear in λ at constant mode shapes: the error is rounding times the condition number of the
                // shapes.
                assert!(near(&moved.poles(), expected) < 1e-8 * part.omega(), "{name}");
                for other in structure.poles() {
                    if other.im > 0.0 && (other - part.pole).norm() > 1e-3 {
                        assert!(near(&moved.poles(), other) < 1e-7 * other.norm(), "{name}");
                    }
                }
            }
        }
    }
}
