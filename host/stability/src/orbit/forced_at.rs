//! The forced problem at other parameters, and the derivatives of its equation that their variation needs.

use nalgebra::{DMatrix, DVector, Vector3};

use super::forced::ForcedProblem;
use super::parameter::{Parameter, Setting};

impl ForcedProblem {
    /// Half the peak-to-peak displacement of the tool over states at the nodes of an orbit, in feed, normal and axial
    /// direction, mm.
    pub(super) fn amplitude_mm(&self, states: &[DMatrix<f64>]) -> [f64; 3] {
        let c = &self.linear.structure.c;
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        for states in states {
            for state in states.column_iter() {
                let displacement = c * state;
                for axis in 0..3 {
                    low[axis] = low[axis].min(displacement[axis]);
                    high[axis] = high[axis].max(displacement[axis]);
                }
            }
        }
        std::array::from_fn(|axis| 0.5e3 * (high[axis] - low[axis]))
    }

    /// Displacement of the tool in a state, in feed, normal and axial direction, mm.
    pub(super) fn displacement_mm(&self, state: &DVector<f64>) -> [f64; 3] {
        let structure = &self.linear.structure;
        let displacement = &structure.c * state.rows(0, structure.order());
        std::array::from_fn(|axis| 1e3 * displacement[axis])
    }

    /// Derivative of [`force_per_depth`](Self::force_per_depth) with respect to the feed per tooth, N/m².
    pub(super) fn force_per_depth_and_feed(&self, teeth: usize, phase: f64) -> Vector3<f64> {
        (0..teeth)
            .map(|tooth| {
                let port = self.port(tooth, phase);
                port.force * port.normal.x
            })
            .sum()
    }

    /// The same problem at other parameters: with the feed per tooth of a setting, and with the cubic stiffness and
    /// damping times its factors κ and ν.
    pub(super) fn at(&self, setting: &Setting) -> Self {
        let mut changed = self.clone();
        changed.linear.process.feed_per_tooth_m = setting.feed_m();
        changed.cubic = self
            .cubic
            .as_ref()
            .map(|cubic| cubic.scaled(setting.nu, setting.kappa));
        changed
    }

    /// The setting of the case at a speed and an axial depth.
    pub fn setting(&self, rpm: f64, depth_mm: f64) -> Setting {
        Setting {
            depth_mm,
            rpm,
            feed_mm: Parameter::Feed.in_results(self.linear.process.feed_per_tooth_m),
            kappa: 1.0,
            nu: 1.0,
        }
    }

    /// The cubic terms N(x) of the stiffness, for [`Parameter::Kappa`], or of the damping, in all states; zero without
    /// cubic terms.
    pub(super) fn cubic_part(&self, parameter: Parameter, state: &[f64]) -> DVector<f64> {
        let mut part = DVector::zeros(state.len());
        if let Some(cubic) = &self.cubic {
            let size = cubic.size();
            let zero = vec![0.0; size];
            let (q, v) = match parameter {
                Parameter::Kappa => (&state[..size], &zero[..]),
                _ => (&zero[..], &state[size..2 * size]),
            };
            for (entry, force) in part.as_mut_slice()[size..].iter_mut().zip(cubic.at(q, v)) {
                *entry = force;
            }
        }
        part
    }

    /// Derivative of [`cubic_part`](Self::cubic_part) with respect to the state.
    pub(super) fn cubic_slopes(&self, parameter: Parameter, state: &[f64]) -> DMatrix<f64> {
        let mut slopes = DMatrix::zeros(state.len(), state.len());
        if let Some(cubic) = &self.cubic {
            let size = cubic.size();
            let (q, v) = (&state[..size], &state[size..2 * size]);
            for (i, j) in (0..size).flat_map(|i| (0..size).map(move |j| (i, j))) {
                let [by_q, by_v] = cubic.slopes((i, j), q, v);
                if parameter == Parameter::Kappa {
                    slopes[(size + i, j)] = by_q;
                } else {
                    slopes[(size + i, size + j)] = by_v;
                }
            }
        }
        slopes
    }

    /// True if smooth restoring forces act whose second derivatives are not known.
    pub(super) fn has_smooth_forces(&self) -> bool {
        self.smooth.is_some()
    }

    /// Exponent of the chip law; `None` if the cutting force is proportional to the chip thickness.
    pub(super) fn chip_exponent(&self) -> Option<f64> {
        self.chip.map(|chip| chip.exponent)
    }
}
