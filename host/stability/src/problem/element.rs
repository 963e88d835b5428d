//! One element of the tooth period: the four matrices of its collocated delay equation.

use nalgebra::{DMatrix, Matrix3xX, MatrixXx3, Vector3};

use super::exponential::Exponential;
use super::linear::Problem;
use quietcut_numerics::quadrature::Gauss;

/// Collocated element: p = E x + Q f and x⁺ = G x + T f, with x and x⁺ the states of the structure at the start and end
/// of the element, p the displacements along the chip normals at the nodes, p_τ those of the preceding tooth, and f = w
/// (p − p_τ) with the axial depth w.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    /// State transition G from the start to the end of the element without regenerative force, n × n.
    pub(crate) flow: DMatrix<f64>,
    /// Matrix E, ports × n: displacements p along the chip normals due to the state at the start of the element.
    pub(crate) observe: DMatrix<f64>,
    /// Response Q of the displacements p along the chip normals to the regenerative chips p − p_τ, ports × ports, per
    /// meter of axial depth.
    pub(crate) kernel: DMatrix<f64>,
    /// Response T of the state at the end of the element to the regenerative chips p − p_τ, n × ports, per meter of
    /// axial depth.
    pub(crate) drive: DMatrix<f64>,
    /// Time, weight and force of each port (cutting tooth at a node), in the order of the rows of E.
    pub(crate) ports: Vec<Port>,
    /// Axial displacement of the tool at the nodes; `Some` where edge and feed forces depend on it (axial-depth
    /// modulation).
    pub(crate) axial: Option<Axial>,
}

/// Axial displacement of the tool at the nodes, z = E_z x + Q_z f, and the edge and feed force that it causes.
#[derive(Clone, Debug)]
pub(crate) struct Axial {
    /// Matrix E_z, nodes × n: axial displacement due to the state at the start of the element.
    pub(crate) observe: DMatrix<f64>,
    /// Response Q_z of the axial displacement to the regenerative chips p − p_τ, nodes × ports, per meter of axial
    /// depth.
    pub(crate) kernel: DMatrix<f64>,
    /// Edge and feed force per axial displacement at each node, N/m.
    pub(crate) ports: Vec<Port>,
}

/// Port of an element: one cutting tooth at one collocation node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Port {
    /// Time of the node from the start of the period, s.
    pub(crate) time_s: f64,
    /// Quadrature weight of the node in integrals over time, s.
    pub(crate) weight_s: f64,
    /// Unit vector along which this port observes the displacement of the tool: the chip normal.
    pub(crate) normal: Vector3<f64>,
    /// Force on the tool, Pa, per axial depth and per displacement along the chip normal. In [`Axial`]: force per axial
    /// displacement, N/m.
    pub(crate) force: Vector3<f64>,
}

/// One tooth that cuts during the whole element.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CuttingTooth {
    /// Immersion angle of this tooth at phase 0 of the period, rad.
    pub(crate) immersion: f64,
    /// Feed of the tool between the passages of the preceding tooth and of this one, m.
    pub(crate) feed_m: f64,
}

/// Response of the free structure at the nodes, shared by all elements of one duration h.
pub(crate) struct Step<'a> {
    gauss: &'a Gauss,
    duration: f64,
    /// State transition e^{A h} of the free structure over the duration h of an element, n × n.
    flow: DMatrix<f64>,
    /// Displacement response C e^{A t_i} at each node to the state at the start of the element, 3 × n.
    observe: Vec<Matrix3xX<f64>>,
    /// Response e^{−A t_j} B to a force at each node, carried back to the start of the element, n × 3.
    backward: Vec<MatrixXx3<f64>>,
    /// Response e^{A (h − t_j)} B of the state at the end of the element to a force at each node, n × 3.
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
        // Gauss nodes are symmetric in the element: h − t_j is the time of the node with the mirrored index.
        let drive: Vec<MatrixXx3<f64>> = forward.iter().rev().map(|flow| flow * &structure.b).collect();
        // Responses carried back to the start follow from the forward ones: e^{−A t} = e^{−A h} e^{A (h − t)}.
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

    /// Element of a tooth period from the phase `phase`, over the rotation `turn` of the tool, both rad, with `teeth`
    /// cutting teeth.
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

    /// Element of a period from the phase `phase`, over the rotation `turn` of the tool, both rad, with these cutting
    /// teeth.
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
            // Entries in column-major order.
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
                    normal: ports.seen[port],
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

/// Directions of observation and of force of all ports, node by node: first the cutting teeth, then, with axial-depth
/// modulation, the axial displacement.
struct Ports {
    per_node: usize,
    /// Unit vector along which each port observes the tool displacement.
    seen: Vec<Vector3<f64>>,
    /// Force of each port per observed displacement; for cutting teeth also per axial depth.
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

/// Eliminates the axial displacement at the nodes, so that only the ports of teeth remain.
///
/// With o all observed displacements, z their axial part, and Q_t and Q_z the columns of Q for teeth and axial
/// displacement, solves o = E x + Q_t f + Q_z z for o.
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
    // The matrix I − Q_z is the identity plus a Volterra kernel over a short element, hence regular.
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
