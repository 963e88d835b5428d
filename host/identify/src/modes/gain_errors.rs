//! Errors of sensor gains in the covariance of identified modes.

use nalgebra::DVector;
use num_complex::Complex64;

use super::model::ModalModel;

impl ModalModel {
    /// Adds the errors of calibrations to the covariance and the standard deviations of the modes: the gain of every
    /// sensor has the relative standard deviation `relative`.
    ///
    /// A relative error g of the gain of the force sensor, which is one for all directions, multiplies all left shapes
    /// by 1 + g; that of the sensor of a response multiplies the entry of this response in all right shapes. The errors
    /// are common to all modes. Frequencies and damping ratios have none.
    pub fn add_gain_errors(&mut self, relative: f64) {
        self.gain_error = Some(relative);
        let (lefts, rights) = (self.forces.len(), self.responses.len());
        let width = 2 + 2 * (lefts + rights);
        let size = self.covariance.nrows();
        // One vector for each sensor, that of the force first: the change of all parameters by one standard deviation
        // of the gain of the sensor.
        let mut changes = vec![DVector::<f64>::zeros(size); 1 + rights];
        for (index, found) in self.modes.iter_mut().enumerate() {
            let mut put = |change: usize, at: usize, value: Complex64, std: &mut [f64; 2]| {
                for (part, value) in [value.re, value.im].into_iter().enumerate() {
                    let by = relative * value;
                    changes[change][width * index + at + part] = by;
                    std[part] = std[part].hypot(by);
                }
            };
            let left = found.mode.left.iter().zip(&mut found.left_std);
            for (q, (value, std)) in left.enumerate() {
                put(0, 2 + 2 * q, *value, std);
            }
            let right = found.mode.right.iter().zip(&mut found.right_std);
            for (p, (value, std)) in right.enumerate() {
                put(1 + p, 2 + 2 * (lefts + p), *value, std);
            }
        }
        for change in &changes {
            self.covariance.ger(1.0, change, change, 1.0);
        }
    }
}
