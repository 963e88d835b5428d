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
pub(super) struct Response<'a> {
    mesh: &'a Mesh,
    ports: &'a Ports,
    parts: Vec<Arc<Part>>,
    /// Factors of I − Φ, with the map Φ of the states over the revolution.
    closure: LU<f64, Dyn, Dyn>,
}

struct Part {
    states: SubintervalResponse,
    /// Outputs at the nodes: C E and C W + D.
    outputs: Vec<(DMatrix<f64>, DMatrix<f64>)>,
}

impl Part {
    fn new(ports: &Ports, mesh: &Mesh, duration_s: f64) -> Self {
        let states = SubintervalResponse::new(&ports.a, &ports.b, mesh.gauss, duration_s);
        let inputs = ports.inputs();
        let outputs = states.at_nodes.iter().enumerate().map(|(node, (e, w))| {
            let mut by_inputs = &ports.output * w;
            let mut own = by_inputs.columns_mut(node * inputs, inputs);
            own += &ports.direct;
            (&ports.output * e, by_inputs)
        });
        Self {
            outputs: outputs.collect(),
            states,
        }
    }
}

impl<'a> Response<'a> {
    /// `None` if the structure has no periodic response: it has an undamped mode at a multiple of the spindle
    /// frequency, or can drift away.
    pub(super) fn new(mesh: &'a Mesh, ports: &'a Ports) -> Option<Self> {
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
        is_regular.iter().all(|x| x.is_finite()).then_some(Self {
            mesh,
            ports,
            parts,
            closure,
        })
    }

    /// Outputs at all points, point by point, under the inputs `inputs` at all nodes, node by node.
    pub(super) fn outputs(&self, inputs: &[f64]) -> Vec<f64> {
        let per_subinterval = self.mesh.nodes() * self.ports.inputs();
        let columns = |subinterval: usize| {
            DVector::from_column_slice(
                &inputs[subinterval * per_subinterval..(subinterval + 1) * per_subinterval],
            )
        };
        let mut state = DVector::zeros(self.ports.a.nrows());
        for (index, part) in self.parts.iter().enumerate() {
            let (e, w) = &part.states.at_end;
            state = e * state + w * columns(index);
        }
        // The closure was seen to be regular.
        state = self.closure.solve(&state).unwrap_or(state);
        let mut outputs = Vec::with_capacity(self.mesh.points() * self.ports.outputs());
        for (index, part) in self.parts.iter().enumerate() {
            let forces = columns(index);
            outputs.extend((&self.ports.output * &state).iter());
            for (e, w) in &part.outputs {
                outputs.extend((e * &state + w * &forces).iter());
            }
            let (e, w) = &part.states.at_end;
            state = e * state + w * forces;
        }
        outputs
    }

    /// Matrix from unknowns to outputs, (points · outputs) × unknowns. An unknown is an input at a node of a subinterval
    /// whose first column is in `first_column`, or the amount of an impulse: `impulses` holds for each the subinterval
    /// at whose start it acts and its direction, and follow after `count` inputs.
    pub(super) fn matrix(
        &self,
        first_column: &[Option<usize>],
        count: usize,
        impulses: &[(usize, DVector<f64>)],
    ) -> DMatrix<f64> {
        let size = self.ports.a.nrows();
        let columns = count + impulses.len();
        let advance = |states: &mut DMatrix<f64>, index: usize| {
            let (e, w) = &self.parts[index].states.at_end;
            let mut next = e * &*states;
            if let Some(first) = first_column[index] {
                let mut own = next.columns_mut(first, w.ncols());
                own += w;
            }
            *states = next;
        };
        let strike = |states: &mut DMatrix<f64>, index: usize| {
            for (number, (subinterval, direction)) in impulses.iter().enumerate() {
                if *subinterval == index {
                    let mut own = states.column_mut(count + number);
                    own += &self.ports.b * direction;
                }
            }
        };
        let mut states = DMatrix::zeros(size, columns);
        for index in 0..self.parts.len() {
            strike(&mut states, index);
            advance(&mut states, index);
        }
        self.closure.solve_mut(&mut states);
        let per_point = self.ports.outputs();
        let mut matrix = DMatrix::zeros(self.mesh.points() * per_point, columns);
        for (index, part) in self.parts.iter().enumerate() {
            strike(&mut states, index);
            let first_row = self.mesh.point(index, 0) * per_point;
            matrix
                .rows_mut(first_row, per_point)
                .gemm(1.0, &self.ports.output, &states, 0.0);
            for (node, (e, w)) in part.outputs.iter().enumerate() {
                let first_row = self.mesh.point(index, node + 1) * per_point;
                let mut rows = matrix.rows_mut(first_row, per_point);
                rows.gemm(1.0, e, &states, 0.0);
                if let Some(first) = first_column[index] {
                    let mut own = rows.columns_mut(first, w.ncols());
                    own += w;
                }
            }
            advance(&mut states, index);
        }
        matrix
    }
}
