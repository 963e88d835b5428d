//! Errors by aliasing in the covariance of identified modes.

use nalgebra::DVector;
use num_complex::Complex64;
use quietcut_numerics::statistics::NINETY_PERCENT;

use super::model::ModalModel;
use super::receptances::Receptances;

/// Records that are made apart, each with an error by aliasing of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MadeApart {
    /// One record for each force, with all responses: usual hammer tests, and a roving hammer.
    Forces,
    /// One record for each response: a roving sensor.
    Responses,
}

impl ModalModel {
    /// Adds the errors by aliasing of the receptances to the covariance and the standard deviations of the modes.
    ///
    /// Content above half the sample rate folds into a record and multiplies its receptances by 1 + ε, with a complex ε
    /// that is smooth over the frequency: a delay of a part of a sample is usual. With a record for each force it multiplies
    /// the entry of this force in the left shape of each mode, by its value at the natural frequency; with a record for each
    /// response, the entry of this response in the right shape. The poles stay where they are to first order. The stated
    /// error |ε| at a line is the half width of a 90 % interval of the real and of the imaginary part; both are independent,
    /// and each is common to all modes. The receptances of one record have that of the largest among them.
    pub fn add_folding_errors(&mut self, data: &Receptances, apart: MadeApart) {
        let (lefts, rights) = (self.forces.len(), self.responses.len());
        let width = 2 + 2 * (lefts + rights);
        let records = match apart {
            MadeApart::Forces => lefts,
            MadeApart::Responses => rights,
        };
        for record in 0..records {
            // Changes of all parameters by one standard deviation of the real, and of the imaginary part of ε.
            let mut changes = [(); 2].map(|()| DVector::<f64>::zeros(self.covariance.nrows()));
            for (index, found) in self.modes.iter_mut().enumerate() {
                let (entry, std, first) = match apart {
                    MadeApart::Forces => (found.mode.left[record], &mut found.left_std[record], 2),
                    MadeApart::Responses => (
                        found.mode.right[record],
                        &mut found.right_std[record],
                        2 + 2 * lefts,
                    ),
                };
                let at = width * index + first + 2 * record;
                let by = entry * data.folding_of(record, apart, found.mode.frequency_hz) / NINETY_PERCENT;
                for (change, by) in changes.iter_mut().zip([by, by * Complex64::I]) {
                    change[at] = by.re;
                    change[at + 1] = by.im;
                    std[0] = std[0].hypot(by.re);
                    std[1] = std[1].hypot(by.im);
                }
            }
            for change in &changes {
                self.covariance.ger(1.0, change, change, 1.0);
            }
        }
    }
}

impl Receptances {
    /// Relative error by aliasing of the largest receptance of a record at the line nearest to a frequency; 0 if none is
    /// stated. A smaller receptance, to a direction that the force hardly moves, is mostly noise near half the sample rate,
    /// and its error says nothing about the content that folds.
    fn folding_of(&self, record: usize, apart: MadeApart, frequency_hz: f64) -> f64 {
        let off = |line: &usize| (self.frequency_hz[*line] - frequency_hz).abs();
        let Some(nearest) = (0..self.frequency_hz.len()).min_by(|a, b| off(a).total_cmp(&off(b))) else {
            return 0.0;
        };
        let of_record = (0..self.places.len()).filter(|&index| match apart {
            MadeApart::Forces => self.places[index].1 == record,
            MadeApart::Responses => self.places[index].0 == record,
        });
        let size = |index: &usize| self.values[*index][nearest].norm();
        let largest = of_record.max_by(|a, b| size(a).total_cmp(&size(b)));
        let folding = largest.and_then(|index| self.folding.get(index)?.get(nearest));
        folding.copied().unwrap_or(0.0)
    }
}
