//! One element of the period: the four matrices of its collocation.

use nalgebra::{DMatrix, Matrix3xX, MatrixXx3, Vector3};

use super::exponential::Exponential;
use super::gauss::Gauss;
use super::linear::Problem;

/// One element: p = E x + Q f, x⁺ = G x + T f.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    /// G, n × n.
    pub(crate) flow: DMatrix<f64>,
    /// E, ports × n.
    pub(crate) observe: DMatrix<f64>,
    /// Q, ports × ports, per meter of depth.
    pub(crate) kernel: DMatrix<f64>,
    /// T, n × ports, per meter of depth.
    pub(crate) drive: DMatrix<f64>,
    /// What each port is, in the order of the rows of E.
    pub(crate) ports: Vec<Port>,
    /// The axial displacement, where edge and feed forces depend on it.
    pub(crate) axial: Option<Axial>,
}

/// The axial displacement at the nodes, z = E_z x + Q_z f, and the force that it makes by itself.
#[derive(Clone, Debug)]
pub(crate) struct Axial {
    /// E_z, nodes × n.
    pub(crate) observe: DMatrix<f64>,
    /// Q_z, nodes × ports, per meter of depth.
    pub(crate) kernel: DMatrix<f64>,
    /// The forces, N/m.
    pub(crate) ports: Vec<Port>,
}

/// One cutting tooth at one node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Port {
    /// Time from the start of the period, s.
    pub(crate) time_s: f64,
    /// Quadrature weight, s.
    pub(crate) weight_s: f64,
    /// Force on the tool per depth and displacement along the chip normal, Pa; per axial displacement, N/m, of [`Axial`].
    pub(crate) force: Vector3<f64>,
}

/// A tooth that cuts throughout an element.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CuttingTooth {
    /// Its immersion angle at phase 0, rad.
    pub(crate) immersion: f64,
    /// How far the tool feeds between the tooth before and this one, m.
    pub(crate) feed_m: f64,
}

/// What all elements of one duration share: the structure between the nodes.
pub(crate) struct Step<'a> {
    gauss: &'a Gauss,
    duration: f64,
    /// e^{A h}.
    flow: DMatrix<f64>,
    /// C e^{A t_i}.
    observe: Vec<Matrix3xX<f64>>,
    /// e^{−A t_j} B.
    backward: Vec<MatrixXx3<f64>>,
    /// e^{A (h − t_j)} B.
    drive: Vec<MatrixXx3<f64>>,
}

impl<'a> Step<'a> {
    pub(crate) fn new(problem: &Problem, exponential: &Exponential, gauss: &'a Gauss, duration: f64) -> Self {
        let structure = &problem.structure;
        let forward: Vec<DMatrix<f64>> = gauss
            .nodes
            .iter()
            .map(|&node| exponential.at(duration * node))
            .collect();
        // Gauss nodes are symmetric: h − t_j is the node counted from the other end.
        let drive: Vec<MatrixXx3<f64>> = forward.iter().rev().map(|flow| flow * &structure.b).collect();
        // e^{−A t} = e^{−A h} e^{A (h − t)}
        let back = exponential.at(-duration);
        Self {
            gauss,
            duration,
            flow: exponential.at(duration),
            observe: forward.iter().map(|flow| &structure.c * flow).collect(),
            backward: drive.iter().map(|drive| &back * drive).collect(),
            drive,
        }
    }

    /// The element of a tooth period that begins at `phase` and turns by `turn`, rad, while `teeth` teeth cut.
    pub(crate) fn element(&self, problem: &Problem, teeth: usize, phase: f64, turn: f64) -> Element {
        let process = &problem.process;
        let cutting: Vec<CuttingTooth> = (0..teeth)
            .map(|tooth| CuttingTooth {
                immersion: process.engagement.angle(tooth, 0.0),
                feed_m: process.feed_per_tooth_m,
            })
            .collect();
        self.element_of(problem, &cutting, phase, turn)
    }

    /// The element that begins at `phase` and turns by `turn`, rad, while these teeth cut.
    pub(crate) fn element_of(
        &self,
        problem: &Problem,
        teeth: &[CuttingTooth],
        phase: f64,
        turn: f64,
    ) -> Element {
        let seconds_per_radian = self.duration / turn;
        let process = &problem.process;
        let nodes = self.gauss.nodes.len();
        let ports = Ports::new(problem, self.gauss, teeth, phase, turn);
        let (count, size) = (ports.per_node, nodes * ports.per_node);
        let order = self.flow.nrows();
        let mut observe = DMatrix::zeros(size, order);
        let mut backward = DMatrix::zeros(order, size);
        let mut drive = DMatrix::zeros(order, size);
        for port in 0..size {
            let (node, seen, force) = (port / count, ports.seen[port], ports.force[port]);
            for (entry, column) in observe
                .row_mut(port)
                .iter_mut()
                .zip(self.observe[node].column_iter())
            {
                *entry = seen.dot(&column);
            }
            backward
                .column_mut(port)
                .gemv(1.0, &self.backward[node], &force, 0.0);
            let weight = self.gauss.weights[node] * self.duration;
            drive
                .column_mut(port)
                .gemv(weight, &self.drive[node], &force, 0.0);
        }
        let mut kernel = &observe * backward;
        for (index, entry) in kernel.iter_mut().enumerate() {
            // By columns.
            let (i, j) = (index % size / count, index / size / count);
            *entry *= self.gauss.integrals[(i, j)] * self.duration;
        }
        let whole = Element {
            flow: self.flow.clone(),
            observe,
            kernel,
            drive,
            ports: (0..size)
                .map(|port| Port {
                    time_s: phase * seconds_per_radian + self.gauss.nodes[port / count] * self.duration,
                    weight_s: self.gauss.weights[port / count] * self.duration,
                    force: ports.force[port],
                })
                .collect(),
            axial: None,
        };
        if process.axial_depth_modulation {
            without_modulation(&whole, nodes, count)
        } else {
            whole
        }
    }
}

/// Where forces act and displacements are seen, at every node: first the cutting teeth, then, with axial depth
/// modulation, the axial displacement.
struct Ports {
    per_node: usize,
    /// What of the displacement a port sees.
    seen: Vec<Vector3<f64>>,
    /// The force that a port makes, per what it sees (and per depth, for teeth).
    force: Vec<Vector3<f64>>,
}

impl Ports {
    fn new(problem: &Problem, gauss: &Gauss, teeth: &[CuttingTooth], phase: f64, turn: f64) -> Self {
        let process = &problem.process;
        let per_node = teeth.len() + usize::from(process.axial_depth_modulation);
        let mut ports = Self {
            per_node,
            seen: Vec::with_capacity(per_node * gauss.nodes.len()),
            force: Vec::with_capacity(per_node * gauss.nodes.len()),
        };
        for node in &gauss.nodes {
            let angle = |tooth: &CuttingTooth| tooth.immersion + (phase + turn * node);
            for tooth in teeth {
                let angle = angle(tooth);
                ports.seen.push(process.force.normal.at(angle));
                ports.force.push(process.force.cutting.at(angle));
            }
            if process.axial_depth_modulation {
                ports.seen.push(Vector3::z());
                let forced: Vector3<f64> = teeth
                    .iter()
                    .map(|tooth| process.force.forced(angle(tooth), tooth.feed_m))
                    .sum();
                ports.force.push(-forced);
            }
        }
        ports
    }
}

/// Solves for the axial displacement at the nodes, so that only ports of teeth remain.
///
/// With o all that is seen and z its axial part: o = E x + Q_t f + Q_z z is solved for o.
fn without_modulation(whole: &Element, nodes: usize, per_node: usize) -> Element {
    let axial: Vec<usize> = (0..nodes).map(|node| node * per_node + per_node - 1).collect();
    let teeth: Vec<usize> = (0..nodes * per_node)
        .filter(|port| !axial.contains(port))
        .collect();
    let mut implicit = DMatrix::identity(nodes * per_node, nodes * per_node);
    for &column in &axial {
        let change = implicit.column(column) - whole.kernel.column(column);
        implicit.set_column(column, &change);
    }
    let lu = implicit.lu();
    // The matrix is the identity plus a Volterra kernel over a short element: it is regular.
    let solve = |right: &DMatrix<f64>| lu.solve(right).unwrap_or_else(|| right.clone());
    let observe = solve(&whole.observe);
    let kernel = solve(&whole.kernel.select_columns(&teeth));
    let push = whole.drive.select_columns(&axial);
    let of = |ports: &[usize]| ports.iter().map(|&port| whole.ports[port]).collect();
    let seen = Axial {
        observe: observe.select_rows(&axial),
        kernel: kernel.select_rows(&axial),
        ports: of(&axial),
    };
    Element {
        flow: &whole.flow + &push * &seen.observe,
        observe: observe.select_rows(&teeth),
        drive: whole.drive.select_columns(&teeth) + &push * &seen.kernel,
        kernel: kernel.select_rows(&teeth),
        ports: of(&teeth),
        axial: Some(seen),
    }
}
