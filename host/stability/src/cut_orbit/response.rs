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
    /// Input and output matrix of the structure.
    b: DMatrix<f64>,
    output: DMatrix<f64>,
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
            b: ports.b.clone(),
            output: ports.output.clone(),
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
        let mut outputs = Vec::with_capacity(self.points() * self.output.nrows());
        for (index, part) in self.parts.iter().enumerate() {
            let forces = columns(index);
            outputs.extend((&self.output * &state).iter());
            for (e, w) in &part.outputs {
                outputs.extend((e * &state + w * &forces).iter());
            }
            let (e, w) = &part.states.at_end;
            state = e * state + w * forces;
        }
        outputs
    }

    /// Number of inputs at the nodes of a subinterval.
    pub(super) fn inputs_of_subinterval(&self) -> usize {
        self.nodes * self.inputs
    }

    /// Number of points: the start and the nodes of every subinterval.
    fn points(&self) -> usize {
        self.parts.len() * (self.nodes + 1)
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
        let add = |rows: &mut nalgebra::DMatrixViewMut<'_, f64>, by_inputs: &DMatrix<f64>, index: usize| {
            if let Some(Driven { first_column, basis }) = &driven[index] {
                rows.columns_mut(*first_column, basis.ncols())
                    .gemm(1.0, by_inputs, basis, 1.0);
            }
        };
        let advance = |states: &mut DMatrix<f64>, index: usize| {
            let (e, w) = &self.parts[index].states.at_end;
            let mut next = e * &*states;
            add(&mut next.as_view_mut(), w, index);
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
        let per_point = self.output.nrows();
        let mut matrix = DMatrix::zeros(self.points() * per_point, columns);
        let mut first_row = 0;
        for (index, part) in self.parts.iter().enumerate() {
            strike(&mut states, index);
            matrix
                .rows_mut(first_row, per_point)
                .gemm(1.0, &self.output, &states, 0.0);
            first_row += per_point;
            for (e, w) in &part.outputs {
                // Views of some rows only: their columns are apart.
                let mut rows = e * &states;
                add(&mut rows.as_view_mut(), w, index);
                matrix.rows_mut(first_row, per_point).copy_from(&rows);
                first_row += per_point;
            }
            advance(&mut states, index);
        }
        matrix
    }
}
