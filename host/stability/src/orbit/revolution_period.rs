//! Forced orbit of unequal teeth over one revolution, with several delays, by collocation.
//!
//! Teeth with unequal pitch or radii cut unequal chips: on an orbit of the revolution u ≠ u(t − τ_j), and the
//! surface that tooth j + 1, the preceding one, has cut acts. With p_j = n_jᵀ u along the chip of tooth j, w − z the
//! depth, and c_j the chip due to feed and runout,
//!
//!   ẋ = A x + B Σ_j ((w − z)(cutting_j (c_j + p_j − p_{j+1}(t − τ_j)) + edge_j)) − N(x).
//!
//! The state of the map over the revolution is x and those p of the preceding revolution whose surface is still to be
//! cut, as in the linear problem. Its fixed points are the orbits; the eigenvalues of its derivative there are their
//! Floquet multipliers (characteristic multipliers).

use nalgebra::{DMatrix, DVector, RowDVector, Vector3};
use num_complex::Complex64;

use super::collocated::Linearized;
use super::forced::{ForcedProblem, Uneven};
use super::parameter::Parameter;
use super::periodic_orbit::{Orbit, PeriodIntegration, PeriodMap, SubintervalNodes};
use crate::error::Breakdown;
use crate::problem::revolution_mesh::{Fineness, Flight, RevolutionMesh, Source, Subinterval};
use crate::spectrum::chatter_frequency::dominant_frequency_hz;
use crate::spectrum::period_map;
use quietcut_numerics::eigenvalues::eigenvector;

/// Cutting tooth at a node.
struct Tooth {
    /// Cutting force of this tooth per axial depth and chip thickness, Pa.
    cutting: Vector3<f64>,
    /// Edge force of this tooth per axial depth, N/m.
    edge: Vector3<f64>,
    /// Row nᵀ C, by which the states give the displacement along the chip normal of this tooth.
    seen: RowDVector<f64>,
    /// Chip thickness of this tooth due to feed and runout, m.
    chip_m: f64,
}

/// Forces of cutting and process damping at the nodes of a subinterval of the revolution.
struct Forces {
    /// Cutting teeth at all nodes of the subinterval, node by node.
    teeth: Vec<Tooth>,
    /// Process damping B D C A per axial depth at the nodes of the subinterval; empty without process damping.
    damping: Vec<DMatrix<f64>>,
}

/// Mesh of one revolution of the tool at one spindle speed, with the forces at its nodes.
pub(super) struct RevolutionPeriod<'a> {
    problem: &'a ForcedProblem,
    uneven: &'a Uneven,
    rpm: f64,
    depth_m: f64,
    mesh: RevolutionMesh,
    /// Forces in each subinterval of the revolution.
    forces: Vec<Forces>,
}

impl<'a> RevolutionPeriod<'a> {
    /// Mesh of a revolution for depths up to `depth_m`; `None` if no preceding tooth has cut the surface in front of
    /// some tooth.
    pub(super) fn new(
        problem: &'a ForcedProblem,
        uneven: &'a Uneven,
        rpm: f64,
        depth_m: f64,
    ) -> Option<Self> {
        Self::cut(problem, uneven, (rpm, depth_m), Fineness::WORKING)
    }

    fn cut(
        problem: &'a ForcedProblem,
        uneven: &'a Uneven,
        (rpm, depth_m): (f64, f64),
        fineness: Fineness,
    ) -> Option<Self> {
        let mesh = RevolutionMesh::new(&uneven.pitched, rpm, depth_m, fineness, Flight::Cut)?;
        let forces = mesh.subintervals.iter();
        Some(Self {
            forces: forces
                .map(|subinterval| Forces::new(problem, uneven, &mesh, subinterval))
                .collect(),
            problem,
            uneven,
            rpm,
            depth_m,
            mesh,
        })
    }

    /// Delayed displacement at every port (cutting tooth at a node) of a subinterval, ports × 1, with its derivatives
    /// with respect to the map's state at the start of the revolution and the depth, ports × (size + 1); `None` if a
    /// delayed time lies in this subinterval.
    fn past(
        &self,
        subinterval: &Subinterval,
        start: &DVector<f64>,
        seen: &[(DVector<f64>, DMatrix<f64>)],
    ) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let ports = subinterval.pasts.len();
        let mut past = DVector::zeros(ports);
        let mut by = DMatrix::zeros(ports, self.mesh.size + 1);
        for (port, of) in subinterval.pasts.iter().enumerate() {
            for (node, weight) in of.weights.iter().enumerate() {
                match of.source {
                    Source::Earlier(first) => {
                        past[port] += weight * start[first + node];
                        by[(port, first + node)] += weight;
                    }
                    Source::Own(series) => {
                        // No value is known yet if a delay is shorter than a subinterval, so that the delayed time lies
                        // in the subinterval itself.
                        let (values, derivatives) = seen.get(series.subinterval)?;
                        let teeth = self.mesh.subintervals[series.subinterval].cutting.len();
                        let row = node * teeth + series.tooth;
                        past[port] += weight * values[row];
                        let mut sum = by.row_mut(port);
                        sum += derivatives.row(row) * *weight;
                    }
                }
            }
        }
        Some((past, by))
    }
}

impl Forces {
    fn new(
        problem: &ForcedProblem,
        uneven: &Uneven,
        mesh: &RevolutionMesh,
        subinterval: &Subinterval,
    ) -> Self {
        let process = &problem.linear.process;
        let passages = &mesh.passages;
        let mut teeth = Vec::with_capacity(subinterval.cutting.len() * subinterval.gauss.nodes.len());
        let mut damping = Vec::new();
        for node in &subinterval.gauss.nodes {
            let time_s = subinterval.start_s + subinterval.duration_s * node;
            let angle = |passage| passages.angle(&uneven.pitched, passage, time_s);
            for passage in &subinterval.cutting {
                let angle = angle(passage);
                let normal = process.force.normal.at(angle);
                teeth.push(Tooth {
                    cutting: process.force.cutting.at(angle),
                    edge: process.force.edge.at(angle),
                    seen: RowDVector::from_row_slice(
                        (normal.transpose() * &problem.linear.structure.c).as_slice(),
                    ),
                    chip_m: normal.x * passage.feed_m + uneven.runout_m[passage.tooth],
                });
            }
            let angles = subinterval.cutting.iter().map(angle);
            let of_flank = problem.damping_per_depth(angles, passages.rad_per_s);
            damping.extend(of_flank.map(|damping| problem.damped(&damping)));
        }
        Self { teeth, damping }
    }

    /// Cutting teeth at a node of the subinterval, each with the index of its port.
    fn teeth_at(&self, node: usize, nodes: usize) -> impl Iterator<Item = (usize, &Tooth)> {
        let count = self.teeth.len() / nodes;
        self.teeth.iter().enumerate().skip(node * count).take(count)
    }

    /// Force per axial depth of all cutting teeth at a node, N/m, from chip thickness and edges.
    fn push(&self, node: usize, nodes: usize, past: &DVector<f64>, state: &DVector<f64>) -> Vector3<f64> {
        self.teeth_at(node, nodes)
            .map(|(port, tooth)| {
                let chip_m = tooth.chip_m + (&tooth.seen * state)[0] - past[port];
                tooth.cutting * chip_m + tooth.edge
            })
            .sum()
    }

    /// Time derivatives f(t_j, Y_j) of the states at the nodes of a subinterval.
    fn rates(
        &self,
        problem: &ForcedProblem,
        past: &DVector<f64>,
        states: &DMatrix<f64>,
        depth_m: f64,
    ) -> Vec<DVector<f64>> {
        let structure = &problem.linear.structure;
        let nodes = states.ncols();
        let at = |node: usize| {
            let state = states.column(node).into_owned();
            let push = self.push(node, nodes, past, &state);
            let depth_here_m = problem.depth_at(&state, depth_m);
            let mut rate = &structure.a * &state + &structure.b * (push * depth_here_m);
            problem.subtract_smooth(state.as_slice(), &mut rate);
            if let Some(damping) = self.damping.get(node) {
                rate -= damping * &state * depth_m;
            }
            rate
        };
        (0..nodes).map(at).collect()
    }

    /// Jacobians ∂f/∂x of the equation of motion at the nodes of a subinterval.
    fn jacobians(
        &self,
        problem: &ForcedProblem,
        past: &DVector<f64>,
        states: &DMatrix<f64>,
        depth_m: f64,
    ) -> Vec<DMatrix<f64>> {
        let b = &problem.linear.structure.b;
        let nodes = states.ncols();
        let at = |node: usize| {
            let state = states.column(node).into_owned();
            let push = self.push(node, nodes, past, &state);
            let mut jacobian = problem.jacobian(state.as_slice(), &push);
            let depth_here_m = problem.depth_at(&state, depth_m);
            for (_, tooth) in self.teeth_at(node, nodes) {
                jacobian += (b * tooth.cutting) * &tooth.seen * depth_here_m;
            }
            if let Some(damping) = self.damping.get(node) {
                jacobian -= damping * depth_m;
            }
            jacobian
        };
        (0..nodes).map(at).collect()
    }

    /// Derivatives of the states' time derivatives at the nodes, through the delayed displacements and the depth (not
    /// through the states themselves), n × (size + 1) each.
    fn pushes(
        &self,
        problem: &ForcedProblem,
        past: &DVector<f64>,
        past_by: &DMatrix<f64>,
        states: &DMatrix<f64>,
        depth_m: f64,
    ) -> Vec<DMatrix<f64>> {
        let b = &problem.linear.structure.b;
        let (nodes, columns) = (states.ncols(), past_by.ncols());
        let at = |node: usize| {
            let state = states.column(node).into_owned();
            let depth_here_m = problem.depth_at(&state, depth_m);
            let mut force = DMatrix::zeros(state.len(), columns);
            for (port, tooth) in self.teeth_at(node, nodes) {
                let unit: DVector<f64> = b * (tooth.cutting * -depth_here_m);
                force.ger(1.0, &unit, &past_by.row(port).transpose(), 1.0);
            }
            let mut by_depth: DVector<f64> = b * self.push(node, nodes, past, &state);
            if let Some(damping) = self.damping.get(node) {
                by_depth -= damping * &state;
            }
            let mut last = force.column_mut(columns - 1);
            last += by_depth;
            force
        };
        (0..nodes).map(at).collect()
    }

    /// Displacement p along the chip normal at every port (cutting tooth at a node) of a subinterval, with its
    /// derivatives with respect to the map's state at the start of the revolution and the depth.
    fn seen(&self, states: &DMatrix<f64>, values: &DMatrix<f64>) -> (DVector<f64>, DMatrix<f64>) {
        let (order, nodes) = states.shape();
        let mut seen = DVector::zeros(self.teeth.len());
        let mut by = DMatrix::zeros(self.teeth.len(), values.ncols());
        for node in 0..nodes {
            for (port, tooth) in self.teeth_at(node, nodes) {
                seen[port] = tooth.seen.dot(&states.column(node).transpose());
                by.row_mut(port)
                    .copy_from(&(&tooth.seen * values.rows(node * order, order)));
            }
        }
        (seen, by)
    }
}

impl PeriodMap for RevolutionPeriod<'_> {
    fn parameter(&self) -> Parameter {
        Parameter::Depth
    }

    fn problem(&self) -> &ForcedProblem {
        self.problem
    }

    fn size(&self) -> usize {
        self.mesh.size
    }

    fn subinterval_nodes(&self) -> Vec<SubintervalNodes<'_>> {
        let subintervals = self.mesh.subintervals.iter();
        subintervals
            .map(|subinterval| SubintervalNodes {
                start_s: subinterval.start_s,
                duration_s: subinterval.duration_s,
                gauss: subinterval.gauss,
            })
            .collect()
    }

    fn integrate(
        &self,
        start: &DVector<f64>,
        depth_m: f64,
        guess: &[DMatrix<f64>],
    ) -> Option<PeriodIntegration> {
        let (order, size) = (self.problem.order(), self.mesh.size);
        let mut integration = PeriodIntegration::from(start.rows(0, order).into_owned(), size + 1);
        let mut seen: Vec<(DVector<f64>, DMatrix<f64>)> = Vec::with_capacity(self.forces.len());
        for ((subinterval, forces), states) in self.mesh.subintervals.iter().zip(&self.forces).zip(guess) {
            let (past, past_by) = self.past(subinterval, start, &seen)?;
            let pushes = forces.pushes(self.problem, &past, &past_by, states, depth_m);
            let rates = forces.rates(self.problem, &past, states, depth_m);
            let jacobians = forces.jacobians(self.problem, &past, states, depth_m);
            let linearized = Linearized::new(subinterval.gauss, subinterval.duration_s, jacobians);
            let advanced = linearized.advance(&integration.end, &integration.by, states, &rates, &pushes)?;
            seen.push(forces.seen(&advanced.states, &advanced.values));
            integration.take(advanced);
        }
        let mut image = DVector::zeros(size);
        let mut image_by = DMatrix::zeros(size, size + 1);
        image.rows_mut(0, order).copy_from(&integration.end);
        image_by.rows_mut(0, order).copy_from(&integration.by);
        for (series, first) in &self.mesh.kept {
            let subinterval = &self.mesh.subintervals[series.subinterval];
            let (values, derivatives) = &seen[series.subinterval];
            for node in 0..subinterval.gauss.nodes.len() {
                let row = node * subinterval.cutting.len() + series.tooth;
                image[first + node] = values[row];
                image_by.row_mut(first + node).copy_from(&derivatives.row(row));
            }
        }
        (integration.end, integration.by) = (image, image_by);
        Some(integration)
    }

    fn start_of(&self, state: DVector<f64>, states: &[DMatrix<f64>]) -> DVector<f64> {
        let mut start = state.resize_vertically(self.mesh.size, 0.0);
        for (series, first) in &self.mesh.kept {
            let (states, forces) = (&states[series.subinterval], &self.forces[series.subinterval]);
            for node in 0..states.ncols() {
                let mut teeth = forces.teeth_at(node, states.ncols());
                let tooth = teeth.nth(series.tooth);
                start[first + node] =
                    tooth.map_or(0.0, |(_, tooth)| tooth.seen.dot(&states.column(node).transpose()));
            }
        }
        start
    }

    fn multipliers(&self, orbit: &Orbit) -> Result<Vec<Complex64>, Breakdown> {
        let integration = self.integrate(&orbit.start, orbit.value, &orbit.states);
        let integration = integration.ok_or(Breakdown::NoSolution)?;
        period_map::of_matrix(integration.by.columns(0, self.mesh.size).into_owned())
    }

    fn chatter_hz(&self, orbit: &Orbit, multiplier: Complex64) -> Option<f64> {
        let integration = self.integrate(&orbit.start, orbit.value, &orbit.states)?;
        let (size, order) = (self.mesh.size, self.problem.order());
        let by_start = integration.by.columns(0, size);
        let vector = eigenvector(&by_start.map(Complex64::from), multiplier)?;
        let c = self.problem.linear.structure.c.map(Complex64::from);
        // Tool displacement of the Floquet mode at every node, with time and quadrature weight.
        let mut motion: Vec<(f64, Vector3<Complex64>)> = Vec::new();
        for (subinterval, values) in self.mesh.subintervals.iter().zip(&integration.values) {
            let states = values.columns(0, size).map(Complex64::from) * &vector;
            for (node, (place, weight)) in subinterval
                .gauss
                .nodes
                .iter()
                .zip(&subinterval.gauss.weights)
                .enumerate()
            {
                let displacement = &c * states.rows(node * order, order);
                let weight = Complex64::from(weight * subinterval.duration_s);
                motion.push((
                    subinterval.start_s + subinterval.duration_s * place,
                    displacement * weight,
                ));
            }
        }
        let period_s = self.mesh.passages.period_s;
        let linear = &self.problem.linear;
        dominant_frequency_hz(linear, orbit.value, period_s, multiplier, |s| {
            let mut harmonic = Vector3::<Complex64>::zeros();
            for (time_s, displacement) in &motion {
                harmonic += displacement * (-s * *time_s).exp();
            }
            Some(harmonic.norm())
        })
    }

    fn finer(&self) -> Option<Self> {
        Self::cut(
            self.problem,
            self.uneven,
            (self.rpm, self.depth_m),
            Fineness::FINE,
        )
    }
}
