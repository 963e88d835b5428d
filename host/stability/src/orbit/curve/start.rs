//! Critical orbits from few numbers: the first orbit of a curve, from a bifurcation on a branch, and an orbit that was
//! recorded.

use nalgebra::{DMatrix, DVector};

use super::super::explicit::Explicit;
use super::extended::{CriticalOrbit, ExtendedSystem, LinearizedSystem};

/// Largest number of Newton steps of the states at the nodes from a given start; a choice.
const STEPS_MAX: usize = 40;

/// Change of a node value, relative to the largest in its subinterval, from which on Newton's method on the whole
/// system takes over. A choice.
const NEAR: f64 = 1e-6;

impl ExtendedSystem<'_> {
    /// Guess of a critical orbit from its state at the start of the period, the values of both parameters in the unit of
    /// computations, and the angle of the critical multiplier: the states follow by Newton's method on the initial value
    /// problem, the mode as the singular vector of the smallest singular value of Φ(μ)/μ − I, with the transition matrix
    /// Φ(μ) of the mode equation.
    ///
    /// `None` if a subinterval is singular.
    pub(super) fn guess(&self, start: &DVector<f64>, values: [f64; 2], angle: f64) -> Option<CriticalOrbit> {
        let order = self.order();
        let mode_at = self.first_of_mode();
        let mut unknowns = DVector::zeros(self.size());
        unknowns.rows_mut(0, order).copy_from(start);
        unknowns[order] = values[0];
        unknowns[order + 1] = values[1];
        if let Some(angle_at) = self.angle_at() {
            unknowns[angle_at] = angle;
        }
        let (mut guess, linear) = self.without_mode(unknowns)?;
        let of_mode = linear
            .jacobian
            .view((order, mode_at), (self.layout.size(), self.layout.size()));
        let factors = of_mode.into_owned().svd(false, true);
        let rows = factors.v_t?;
        let smallest = factors.singular_values.imin();
        let mode = rows.row(smallest).transpose();
        guess.unknowns.rows_mut(mode_at, mode.len()).copy_from(&mode);
        guess.modes = self.modes_of(&linear, &mode);
        Some(guess)
    }

    /// Critical orbit from its unknowns, with node values of orbit and mode from the equations. `None` if a subinterval
    /// is singular.
    pub(super) fn of_unknowns(&self, unknowns: DVector<f64>) -> Option<CriticalOrbit> {
        let mode = unknowns
            .rows(self.first_of_mode(), self.layout.size())
            .into_owned();
        let (mut orbit, linear) = self.without_mode(unknowns)?;
        orbit.modes = self.modes_of(&linear, &mode);
        Some(orbit)
    }

    /// Orbit from its start and parameters, with a mode of zero at the nodes, and the system linearized about it.
    fn without_mode(&self, unknowns: DVector<f64>) -> Option<(CriticalOrbit, LinearizedSystem)> {
        let states = self.states_from(&unknowns)?;
        let modes = states
            .iter()
            .map(|states| DMatrix::zeros(self.layout.size(), states.ncols()))
            .collect();
        let mut orbit = CriticalOrbit {
            unknowns: unknowns.clone(),
            states,
            modes,
        };
        orbit
            .unknowns
            .rows_mut(self.first_of_mode(), self.layout.size())
            .fill(0.0);
        let phase = DVector::zeros(self.layout.size());
        let linear = self.linearize(&orbit, &phase)?;
        orbit.unknowns = unknowns;
        Some((orbit, linear))
    }

    /// Mode at the nodes of each subinterval, from the mode at the start of the period.
    fn modes_of(&self, linear: &LinearizedSystem, mode: &DVector<f64>) -> Vec<DMatrix<f64>> {
        linear
            .modes_by
            .iter()
            .map(|by| {
                let values = by.columns(self.first_of_mode(), mode.len()) * mode;
                DMatrix::from_column_slice(mode.len(), values.len() / mode.len(), values.as_slice())
            })
            .collect()
    }

    /// States of the orbit at the nodes, from its start and parameters.
    fn states_from(&self, unknowns: &DVector<f64>) -> Option<Vec<DMatrix<f64>>> {
        let setting = self.setting_of(unknowns);
        let problem = self.base.at(&setting);
        let map = self.period(&problem, setting.rpm);
        let explicit = Explicit {
            base: self.base,
            parameters: &[],
        };
        let start = unknowns.rows(0, self.order()).into_owned();
        let nodes = map.gauss.nodes.len();
        let constant = DMatrix::from_fn(self.order(), nodes, |row, _| start[row]);
        let mut states = vec![constant; map.subintervals.len()];
        for _ in 0..STEPS_MAX {
            let integration = map.integrate_by(&explicit, &start, setting.depth_m(), &states)?;
            states = integration.states;
            if integration.moved < NEAR {
                return Some(states);
            }
        }
        None
    }
}
