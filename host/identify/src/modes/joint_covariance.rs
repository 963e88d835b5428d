//! Joint covariance of the parameters of identified modes, with frequency and damping ratio in place of the pole.

use nalgebra::DMatrix;

use super::mode::IdentifiedMode;
use super::pole_derivatives::pole_derivatives;
use super::refinement::Refined;

impl Refined {
    /// The modes in ascending order of frequency, and their joint covariance as in
    /// [`ModalModel::covariance`](super::model::ModalModel::covariance).
    pub(super) fn sorted(&self) -> (Vec<IdentifiedMode>, DMatrix<f64>) {
        let mut order: Vec<usize> = (0..self.fit.modes.len()).collect();
        order.sort_by(|&a, &b| {
            let size = |index: usize| self.fit.modes[index].pole.norm();
            size(a).total_cmp(&size(b))
        });
        let modes = order.iter().map(|&index| self.mode(index)).collect();
        let derivatives = self.derivatives(&order);
        (modes, &derivatives * &self.covariance * derivatives.transpose())
    }

    /// Derivatives of the parameters of the modes as a case has them (rows), in the given order of the modes, by the
    /// parameters of the fit (columns).
    fn derivatives(&self, order: &[usize]) -> DMatrix<f64> {
        let width = self.fit.modes.first().map_or(0, |mode| mode.width());
        let mut derivatives = DMatrix::<f64>::zeros(width * order.len(), self.covariance.nrows());
        for (place, &index) in order.iter().enumerate() {
            let mode = &self.fit.modes[index];
            let (row, column) = (width * place, width * index);
            let (by_frequency, by_damping) = pole_derivatives(mode.pole);
            for part in 0..2 {
                derivatives[(row, column + part)] = by_frequency[part];
                derivatives[(row + 1, column + part)] = by_damping[part];
            }
            // The fit has the right shape first, the case the left one.
            let (rights, lefts) = (2 * mode.right.len(), 2 * mode.left.len());
            for part in 0..lefts {
                derivatives[(row + 2 + part, column + 2 + rights + part)] = 1.0;
            }
            for part in 0..rights {
                derivatives[(row + 2 + lefts + part, column + 2 + part)] = 1.0;
            }
        }
        derivatives
    }
}
