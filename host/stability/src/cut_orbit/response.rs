//! Periodic response of the structure to the forces at the nodes of a mesh.

use std::collections::HashMap;

use nalgebra::linalg::LU;
use nalgebra::{DMatrix, DVector, Dyn};
use std::sync::Arc;

use super::mesh::Mesh;
use super::model::Ports;
use super::propagator::SubintervalResponse;

/// The linear map from the inputs at the nodes of a mesh to the outputs at its points, over a revolution after which
/// the states repeat. Between nodes the inputs are polynomials; the response to these is exact.
pub(super) struct Response {
    nodes: usize,
    inputs: usize,
    /// Number of outputs at a point.
    outputs: usize,
    /// Input matrix of the structure.
    b: DMatrix<f64>,
    parts: Vec<Arc<Part>>,
    /// Factors of I − Φ, with the map Φ of the states over the revolution.
    closure: LU<f64, Dyn, Dyn>,
}

struct Part {
    states: SubintervalResponse,
    /// Outputs at the start and the nodes, point by point: C and 0, C E and C W + D.
    outputs: (DMatrix<f64>, DMatrix<f64>),
}

impl Part {
    fn new(ports: &Ports, mesh: &Mesh, duration_s: f64) -> Self {
        let states = SubintervalResponse::new(&ports.a, &ports.b, mesh.gauss, duration_s);
        let (inputs, count) = (ports.inputs(), ports.outputs());
        let points = mesh.nodes() + 1;
        let mut by_states = DMatrix::zeros(points * count, ports.a.nrows());
        let mut by_inputs = DMatrix::zeros(points * count, mesh.nodes() * inputs);
        by_states.rows_mut(0, count).copy_from(&ports.output);
        for (node, (e, w)) in states.at_nodes.iter().enumerate() {
            let first_row = (node + 1) * count;
            by_states
                .rows_mut(first_row, count)
                .copy_from(&(&ports.output * e));
            by_inputs
                .rows_mut(first_row, count)
                .copy_from(&(&ports.output * w));
            let mut own = by_inputs.view_mut((first_row, node * inputs), (count, inputs));
            own += &ports.direct;
        }
        Self {
            outputs: (by_states, by_inputs),
            states,
        }
    }
}

/// What the unknowns of a subinterval do: their first column, and the inputs at its nodes by them, node by node.
pub(super) struct Driven {
    pub(super) first_column: usize,
    pub(super) basis: DMatrix<f64>,
}

impl Response {
    /// `None` if the structure has no periodic response: it has an undamped mode at a multiple of the spindle
    /// frequency, or can drift away.
    pub(super) fn new(mesh: &Mesh, ports: &Ports) -> Option<Self> {
        // Stretches of equal length differ by rounding only.
        let unit_s = mesh.revolution_s * super::mesh::SAME_TIME;
        let mut known: HashMap<u64, Arc<Part>> = HashMap::new();
        let parts: Vec<Arc<Part>> = mesh
            .subintervals
            .iter()
            .map(|subinterval| {
                let key = (subinterval.duration_s / unit_s).round() as u64;
                known
                    .entry(key)
                    .or_insert_with(|| Arc::new(Part::new(ports, mesh, subinterval.duration_s)))
                    .clone()
            })
            .collect();
        let size = ports.a.nrows();
        let mut map = DMatrix::identity(size, size);
        for part in &parts {
            map = &part.states.at_end.0 * map;
        }
        let closure = (DMatrix::identity(size, size) - map).lu();
        let is_regular = closure.solve(&DVector::from_element(size, 1.0))?;
        is_regular.iter().all(|x| x.is_finite()).then(|| Self {
            nodes: mesh.nodes(),
            inputs: ports.inputs(),
            outputs: ports.outputs(),
            b: ports.b.clone(),
            parts,
            closure,
        })
    }

    /// Outputs at all points, point by point, under the inputs `inputs` at all nodes, node by node.
    pub(super) fn outputs(&self, inputs: &[f64]) -> Vec<f64> {
        let per_subinterval = self.inputs_of_subinterval();
        let columns = |subinterval: usize| {
            DVector::from_column_slice(
                &inputs[subinterval * per_subinterval..(subinterval + 1) * per_subinterval],
            )
        };
        let mut state = DVector::zeros(self.b.nrows());
        for (index, part) in self.parts.iter().enumerate() {
            let (e, w) = &part.states.at_end;
            state = e * state + w * columns(index);
        }
        // The closure was seen to be regular.
        state = self.closure.solve(&state).unwrap_or(state);
        let rows = (self.nodes + 1) * self.outputs;
        let mut outputs = DVector::zeros(self.parts.len() * rows);
        for (index, part) in self.parts.iter().enumerate() {
            let forces = columns(index);
            let (by_states, by_inputs) = &part.outputs;
            let mut own = outputs.rows_mut(index * rows, rows);
            own.gemv(1.0, by_states, &state, 0.0);
            own.gemv(1.0, by_inputs, &forces, 1.0);
            let (e, w) = &part.states.at_end;
            state = e * state + w * forces;
        }
        outputs.data.into()
    }

    /// Number of inputs at the nodes of a subinterval.
    pub(super) fn inputs_of_subinterval(&self) -> usize {
        self.nodes * self.inputs
    }

    /// Matrix from unknowns to outputs, (points · outputs) × unknowns. `driven` says what the unknowns of each subinterval
    /// do, `count` in all; `impulses` holds for each further unknown, the amount of an impulse, the subinterval at whose
    /// start it acts and its direction.
    pub(super) fn matrix(
        &self,
        driven: &[Option<Driven>],
        count: usize,
        impulses: &[(usize, DVector<f64>)],
    ) -> DMatrix<f64> {
        let columns = count + impulses.len();
        let advance = |states: &mut DMatrix<f64>, index: usize| {
            let (e, w) = &self.parts[index].states.at_end;
            let mut next = e * &*states;
            if let Some(Driven { first_column, basis }) = &driven[index] {
                next.columns_mut(*first_column, basis.ncols())
                    .gemm(1.0, w, basis, 1.0);
            }
            *states = next;
        };
        let strike = |states: &mut DMatrix<f64>, index: usize| {
            for (number, (subinterval, direction)) in impulses.iter().enumerate() {
                if *subinterval == index {
                    let mut own = states.column_mut(count + number);
                    own += &self.b * direction;
                }
            }
        };
        let mut states = DMatrix::zeros(self.b.nrows(), columns);
        for index in 0..self.parts.len() {
            strike(&mut states, index);
            advance(&mut states, index);
        }
        self.closure.solve_mut(&mut states);
        let rows = (self.nodes + 1) * self.outputs;
        let mut matrix = DMatrix::zeros(self.parts.len() * rows, columns);
        for (index, part) in self.parts.iter().enumerate() {
            strike(&mut states, index);
            let (by_states, by_inputs) = &part.outputs;
            let mut own = matrix.rows_mut(index * rows, rows);
            own.gemm(1.0, by_states, &states, 0.0);
            if let Some(Driven { first_column, basis }) = &driven[index] {
                own.columns_mut(*first_column, basis.ncols())
                    .gemm(1.0, by_inputs, basis, 1.0);
            }
            advance(&mut states, index);
        }
        matrix
    }
}
