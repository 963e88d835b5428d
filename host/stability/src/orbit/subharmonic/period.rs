//! Map of a forced problem whose fixed points are orbits of several tooth periods.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use crate::error::Breakdown;
use crate::orbit::collocated::Linearized;
use crate::orbit::explicit::{AtNode, Explicit};
use crate::orbit::forced::ForcedProblem;
use crate::orbit::parameter::Parameter;
use crate::orbit::periodic_orbit::{Orbit, PeriodIntegration, PeriodMap, SubintervalNodes};
use crate::orbit::tooth_period::{Subinterval, ToothPeriod, jacobians, rates};
use crate::orbit::variation;
use crate::orbit::varied_period::VariedPeriod;
use crate::spectrum::period_map;

/// Tooth period with the states x_0…x_{q−1} of q successive tooth periods, of which one parameter varies.
///
/// The start of an orbit of this map holds x_0(0)…x_{q−1}(0), one after the other. Its subintervals are those of all
/// tooth periods in order of time.
pub(super) struct SubharmonicPeriod<'a> {
    varied: VariedPeriod<'a>,
    periods: usize,
}

/// Right-hand sides of the coupled equations at the nodes of a subinterval.
struct Coupled {
    rates: Vec<DVector<f64>>,
    jacobians: Vec<DMatrix<f64>>,
    forces: Vec<DMatrix<f64>>,
}

impl<'a> SubharmonicPeriod<'a> {
    /// Map over `periods` tooth periods.
    pub(super) fn new(varied: VariedPeriod<'a>, periods: usize) -> Self {
        Self { varied, periods }
    }

    /// Index of the tooth period before the k-th one.
    fn before(&self, k: usize) -> usize {
        (k + self.periods - 1) % self.periods
    }

    /// The coupled equations at the nodes of a subinterval, with its states in each tooth period.
    fn coupled(
        &self,
        (period, subinterval): (&ToothPeriod<'_>, &Subinterval),
        states: &[&DMatrix<f64>],
        depth_m: f64,
    ) -> Coupled {
        let (order, nodes) = states[0].shape();
        let size = order * self.periods;
        let mut coupled = Coupled {
            rates: vec![DVector::zeros(size); nodes],
            jacobians: vec![DMatrix::zeros(size, size); nodes],
            forces: vec![DMatrix::zeros(size, size + 1); nodes],
        };
        let chips: Vec<DMatrix<f64>> = (0..nodes)
            .map(|node| period.chip_per_depth(subinterval, node))
            .collect();
        for (k, own) in states.iter().enumerate() {
            let (row, column) = (k * order, self.before(k) * order);
            let own_rates = rates(period.problem, subinterval, own, depth_m);
            let own_jacobians = jacobians(period.problem, subinterval, own, depth_m);
            for (node, (mut rate, jacobian)) in own_rates.into_iter().zip(own_jacobians).enumerate() {
                let wave = own.column(node) - states[self.before(k)].column(node);
                let push_per_depth = &chips[node] * wave;
                rate.axpy(depth_m, &push_per_depth, 1.0);
                let at = AtNode {
                    subinterval,
                    node,
                    state: &own.as_slice()[node * order..(node + 1) * order],
                    rate: &rate,
                    depth_m,
                };
                let by = self.by_parameter(period, &at, &push_per_depth);
                coupled.forces[node]
                    .view_mut((row, size), (order, 1))
                    .copy_from(&by);
                coupled.rates[node].rows_mut(row, order).copy_from(&rate);
                let chip = &chips[node] * depth_m;
                let whole = &mut coupled.jacobians[node];
                let mut own_part = whole.view_mut((row, row), (order, order));
                own_part += jacobian + &chip;
                let mut delayed_part = whole.view_mut((row, column), (order, order));
                delayed_part -= chip;
            }
        }
        coupled
    }

    /// Derivative of the time derivative of a state with respect to the varied parameter, with the regenerative force, per
    /// depth, on that state.
    fn by_parameter(
        &self,
        period: &ToothPeriod<'_>,
        at: &AtNode<'_>,
        push_per_depth: &DVector<f64>,
    ) -> DVector<f64> {
        let explicit = Explicit {
            base: self.varied.base(),
            parameters: &[self.varied.parameter()],
        };
        let mut by = explicit.columns(period, at).column(0).into_owned();
        if self.varied.parameter() == Parameter::Depth {
            by += push_per_depth;
        }
        by
    }

    /// Integration of the coupled states as that of one orbit: the states of each tooth period after one another, and the
    /// end of each as the start of the next.
    fn unstacked(&self, whole: PeriodIntegration) -> PeriodIntegration {
        let order = self.problem().order();
        let (periods, columns) = (self.periods, whole.by.ncols());
        let mut unstacked = PeriodIntegration::from(whole.end.clone(), columns);
        unstacked.moved = whole.moved;
        for k in 0..periods {
            let (from, to) = (k * order, (k + 1) % periods * order);
            unstacked
                .end
                .rows_mut(to, order)
                .copy_from(&whole.end.rows(from, order));
            unstacked
                .by
                .rows_mut(to, order)
                .copy_from(&whole.by.rows(from, order));
            for (states, values) in whole.states.iter().zip(&whole.values) {
                let nodes = states.ncols();
                unstacked.states.push(states.rows(from, order).into_owned());
                unstacked
                    .values
                    .push(DMatrix::from_fn(order * nodes, columns, |row, column| {
                        let (node, state) = (row / order, row % order);
                        values[(node * order * periods + from + state, column)]
                    }));
            }
        }
        unstacked
    }

    /// Smallest chip thickness on an orbit, m, over all cutting teeth at the nodes: feed plus vibration less that of the
    /// preceding tooth, along the chip normal. Below 0 a tooth would leave the surface.
    pub(super) fn smallest_chip_m(&self, orbit: &Orbit) -> f64 {
        let setting = self.varied.at(orbit.value);
        let problem = self.varied.problem_at(&setting);
        let period = self.varied.period(&problem, &setting);
        let process = &problem.linear.process;
        let count = period.subintervals.len();
        let mut smallest = f64::INFINITY;
        for (index, states) in orbit.states.iter().enumerate() {
            let subinterval = &period.subintervals[index % count];
            let before = &orbit.states[self.before(index / count) * count + index % count];
            let wave = &problem.linear.structure.c * (states - before);
            for (node, wave) in period.gauss.nodes.iter().zip(wave.column_iter()) {
                let phase = subinterval.phase + subinterval.turn * node;
                for tooth in 0..subinterval.teeth {
                    let normal = process.force.normal.at(process.engagement.angle(tooth, phase));
                    smallest = smallest.min(normal.x * process.feed_per_tooth_m + normal.dot(&wave));
                }
            }
        }
        smallest
    }

    /// Displacement of the tool at the start of each tooth period, as in
    /// [`BranchPoint::displacement_mm`](crate::orbit::BranchPoint::displacement_mm).
    pub(super) fn displacements_mm(&self, orbit: &Orbit) -> Vec<[f64; 3]> {
        let order = self.problem().order();
        let starts = orbit.start.as_slice().chunks_exact(order);
        starts
            .map(|start| self.problem().displacement_mm(&DVector::from_column_slice(start)))
            .collect()
    }

    /// Difference between the starts of the first two tooth periods.
    fn difference(&self, orbit: &Orbit) -> DVector<f64> {
        let order = self.problem().order();
        orbit.start.rows(0, order) - orbit.start.rows(order, order)
    }
}

impl PeriodMap for SubharmonicPeriod<'_> {
    fn parameter(&self) -> Parameter {
        self.varied.parameter()
    }

    fn problem(&self) -> &ForcedProblem {
        self.varied.problem()
    }

    fn size(&self) -> usize {
        self.periods * self.problem().order()
    }

    fn subinterval_nodes(&self) -> Vec<SubintervalNodes<'_>> {
        let one = self.varied.subinterval_nodes();
        let period_s = one.last().map_or(0.0, |last| last.start_s + last.duration_s);
        let later = |k: usize| {
            one.iter().map(move |nodes| SubintervalNodes {
                start_s: nodes.start_s + k as f64 * period_s,
                ..*nodes
            })
        };
        (0..self.periods).flat_map(later).collect()
    }

    fn integrate(
        &self,
        start: &DVector<f64>,
        value: f64,
        guess: &[DMatrix<f64>],
    ) -> Option<PeriodIntegration> {
        let setting = self.varied.at(value);
        let problem = self.varied.problem_at(&setting);
        let period = self.varied.period(&problem, &setting);
        let count = period.subintervals.len();
        let mut whole = PeriodIntegration::from(start.clone(), self.size() + 1);
        for (index, subinterval) in period.subintervals.iter().enumerate() {
            let states: Vec<&DMatrix<f64>> = guess.iter().skip(index).step_by(count).collect();
            let coupled = self.coupled((&period, subinterval), &states, setting.depth_m());
            let linearized = Linearized::new(&period.gauss, subinterval.duration, coupled.jacobians);
            whole.take(linearized.advance(
                &whole.end,
                &whole.by,
                &stacked(&states),
                &coupled.rates,
                &coupled.forces,
            )?);
        }
        Some(self.unstacked(whole))
    }

    fn start_of(&self, state: DVector<f64>, states: &[DMatrix<f64>]) -> DVector<f64> {
        let order = state.len();
        let count = states.len() / self.periods;
        let nodes = self.varied.subinterval_nodes();
        let mut start = state.resize_vertically(self.size(), 0.0);
        for k in 1..self.periods {
            // The polynomial through the nodes of the last subinterval before, at its end.
            let weights = nodes[count - 1].gauss.lagrange(1.0);
            let end = &states[k * count - 1] * DVector::from_vec(weights);
            start.rows_mut(k * order, order).copy_from(&end);
        }
        start
    }

    fn multipliers(&self, orbit: &Orbit) -> Result<Vec<Complex64>, Breakdown> {
        let setting = self.varied.at(orbit.value);
        let problem = self.varied.problem_at(&setting);
        let period = self.varied.period(&problem, &setting);
        let mut product: Option<DMatrix<f64>> = None;
        for states in orbit.states.chunks(period.subintervals.len()) {
            let about = variation::about(&period, states, setting.depth_m()).ok_or(Breakdown::NoSolution)?;
            let map = period_map::monodromy(&about, setting.depth_m()).ok_or(Breakdown::NoSolution)?;
            product = Some(match product {
                Some(earlier) => map * earlier,
                None => map,
            });
        }
        period_map::of_matrix(product.ok_or(Breakdown::NoSolution)?)
    }

    /// Not computed: the frequencies of an orbit of several tooth periods are those of its own harmonics.
    fn chatter_hz(&self, _orbit: &Orbit, _multiplier: Complex64) -> Option<f64> {
        None
    }

    fn finer(&self) -> Option<Self> {
        Some(Self::new(self.varied.finer()?, self.periods))
    }

    fn has_rejoined(&self, from: &Orbit, to: &Orbit) -> bool {
        self.difference(from).dot(&self.difference(to)) < 0.0
    }
}

/// States of all tooth periods at the nodes of a subinterval, one below the other.
fn stacked(states: &[&DMatrix<f64>]) -> DMatrix<f64> {
    let (order, nodes) = states[0].shape();
    let mut stacked = DMatrix::zeros(order * states.len(), nodes);
    for (k, own) in states.iter().enumerate() {
        stacked.rows_mut(k * order, order).copy_from(own);
    }
    stacked
}
