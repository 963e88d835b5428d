//! One tooth period, cut into elements on which collocation is exact to rounding.
//!
//! A chip sees displacement only along its normal: tooth k at immersion φ_k sees the number p_k = n(φ_k)ᵀ u, and the
//! tooth before it saw p_k one period earlier. So the state of the delay equation is x at the start of the period and
//! the numbers p while teeth cut: not the whole history of all displacements.
//!
//! On an element with Gauss nodes t_i, from x(t) = e^{At} x₀ + ∫ e^{A(t−s)} B D(s) f(s) ds with f = w (p − p_τ):
//!
//!   p = E x₀ + Q f,   x₁ = G x₀ + T f,
//!
//! with p and f the values of all cutting teeth at all nodes. The structure's own motion is exact (matrix
//! exponentials), and only the product of motion and turning coefficients is interpolated. Edge and feed terms
//! −β(φ) u are solved for within the element, so that the same four matrices describe it. In free flight G = e^{Ah}.

use nalgebra::{DMatrix, Vector3};

use super::Problem;
use super::gauss::Gauss;

/// How finely a period is cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Resolution {
    /// The largest angle, rad, by which the fastest motion turns within an element.
    pub(crate) angle: f64,
    /// Collocation error per element, relative, that is aimed at.
    pub(crate) tolerance: f64,
}

impl Resolution {
    /// For following all multipliers along a line: few nodes, since all eigenvalues of the map are computed.
    pub(crate) const SCAN: Self = Self {
        angle: 20.0,
        tolerance: 1e-8,
    };
    /// For the characteristic matrix, whose polynomials want short elements: limits are computed with this one.
    pub(crate) const WORKING: Self = Self {
        angle: 5.0,
        tolerance: 1e-13,
    };
    /// A second one: what changes from the working one to this is an estimate of the error of the former.
    pub(crate) const FINE: Self = Self {
        angle: 3.0,
        tolerance: 1e-16,
    };
}

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
}

/// One cutting tooth at one node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Port {
    /// Time from the start of the period, s.
    pub(crate) time_s: f64,
    /// Quadrature weight, s.
    pub(crate) weight_s: f64,
    /// Force on the tool per depth and displacement along the chip normal, Pa.
    pub(crate) force: Vector3<f64>,
}

/// The most e-folds by which a mode may decay within an element: e^{−A t} appears in it, and its size is lost in digits.
pub(super) const DECAY_MAX: f64 = 5.0;

/// The most nodes of an element.
const NODES_MAX: u32 = 40;

/// One tooth period at one speed.
#[derive(Clone, Debug)]
pub(crate) struct Period {
    /// The elements while teeth cut, in order.
    pub(crate) elements: Vec<Element>,
    /// The flow of free flight after them; the identity where there is none.
    pub(crate) flight: DMatrix<f64>,
}

impl Period {
    /// Cuts the period of a problem at a speed; `depth_m` is the largest |w (1 − 1/μ)| that it will be used for.
    pub(crate) fn new(problem: &Problem, rpm: f64, depth_m: f64, resolution: Resolution) -> Self {
        let structure = &problem.structure;
        let engagement = &problem.process.engagement;
        let seconds_per_radian = problem.tooth_period_s(rpm) / engagement.pitch;
        let rate = Rates::new(problem).at(depth_m);
        let mut elements = Vec::new();
        let mut flight = DMatrix::identity(structure.order(), structure.order());
        for interval in engagement.intervals() {
            let length = interval.to - interval.from;
            let duration = length * seconds_per_radian;
            if interval.teeth == 0 {
                flight = (&structure.a * duration).exp();
                continue;
            }
            // The coefficients turn as products of two sines: twice the angle of the tool.
            let angle = rate * duration + 2.0 * length;
            let decay = problem.fastest_decay() * duration;
            let count = (angle / resolution.angle).max(decay / DECAY_MAX).ceil().max(1.0);
            let gauss = Gauss::new(degree(angle / count, resolution.tolerance));
            let step = Step::new(problem, &gauss, duration / count);
            // The count is small: a few elements for each vibration in the period.
            for index in 0..count as usize {
                let phase = interval.from + length * index as f64 / count;
                elements.push(step.element(problem, interval.teeth, phase, length / count));
            }
        }
        Self { elements, flight }
    }

    /// Number of states.
    pub(crate) fn order(&self) -> usize {
        self.flight.nrows()
    }
}

/// How fast things move: the structure by itself, and under the stiffness of the cut.
pub(super) struct Rates {
    /// Fastest pole, rad/s.
    poles: f64,
    /// nᵀ C B D, 1/s per meter of depth: velocity along the chip normal that the chip's own force makes at once.
    direct: f64,
    /// nᵀ C A B D, 1/s² per meter of depth: acceleration along the chip normal that the chip's own force makes at once.
    inertial: f64,
    /// The depth, m, to which edge and feed forces amount.
    modulation_m: f64,
}

impl Rates {
    pub(super) fn new(problem: &Problem) -> Self {
        let structure = &problem.structure;
        let process = &problem.process;
        let engagement = &process.engagement;
        let response = &structure.c * &structure.b;
        let response_rate = &structure.c * &structure.a * &structure.b;
        let (mut direct, mut inertial, mut force, mut forced) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
        // All of it varies slowly with the angle; seventeen angles find the largest to a percent or so.
        for i in 0..=16 {
            let share = f64::from(i) / 16.0;
            let angle = engagement.start + (engagement.exit - engagement.start) * share;
            let (normal, cutting) = (process.force.normal.at(angle), process.force.cutting.at(angle));
            direct = direct.max(normal.dot(&(response * cutting)).abs());
            inertial = inertial.max(normal.dot(&(response_rate * cutting)).abs());
            force = force.max(process.force.directional(angle).norm());
            forced = forced.max(process.force.forced(angle, process.feed_per_tooth_m).norm());
        }
        let teeth = engagement.mean_teeth().ceil();
        Self {
            poles: structure
                .poles()
                .iter()
                .map(|pole| pole.norm())
                .fold(0.0, f64::max),
            direct: direct * teeth,
            inertial: inertial * teeth,
            modulation_m: if process.axial_depth_modulation && force > 0.0 {
                forced / force
            } else {
                0.0
            },
        }
    }

    /// An estimate, rad/s, of how fast the solution turns or grows at a depth.
    pub(super) fn at(&self, depth_m: f64) -> f64 {
        let depth_m = depth_m + self.modulation_m;
        self.poles + (self.inertial * depth_m).sqrt() + self.direct * depth_m
    }
}

/// The fewest nodes, from 4 to 40, with which a step over `angle` has a relative error below `tolerance`:
/// (m!)² z^{2m+1} / ((2m)! (2m+1)!), that of the Padé approximant to e^{iz}.
pub(super) fn degree(angle: f64, tolerance: f64) -> usize {
    // For m = 0 the expression is z; each further node multiplies it by z² m² / ((2m)² (4m² − 1)).
    let mut error = angle;
    for m in 1..=NODES_MAX {
        let m_f = f64::from(m);
        error *= angle * angle / (4.0 * (2.0 * m_f - 1.0) * (2.0 * m_f + 1.0));
        if error < tolerance && m >= 4 {
            return m as usize;
        }
    }
    NODES_MAX as usize
}

/// What all elements of one duration share: the structure between the nodes.
struct Step<'a> {
    gauss: &'a Gauss,
    duration: f64,
    /// e^{A h}.
    flow: DMatrix<f64>,
    /// C e^{A t_i}, 3 × n.
    observe: Vec<DMatrix<f64>>,
    /// e^{−A t_j} B, n × 3.
    backward: Vec<DMatrix<f64>>,
    /// e^{A (h − t_j)} B, n × 3.
    drive: Vec<DMatrix<f64>>,
}

impl<'a> Step<'a> {
    fn new(problem: &Problem, gauss: &'a Gauss, duration: f64) -> Self {
        let structure = &problem.structure;
        let flow_over = |share: f64| (&structure.a * (duration * share)).exp();
        let forward: Vec<DMatrix<f64>> = gauss.nodes.iter().map(|&node| flow_over(node)).collect();
        Self {
            gauss,
            duration,
            flow: flow_over(1.0),
            observe: forward
                .iter()
                .map(|flow| to_dynamic(&(&structure.c * flow)))
                .collect(),
            backward: gauss
                .nodes
                .iter()
                .map(|&node| to_dynamic(&(flow_over(-node) * &structure.b)))
                .collect(),
            // Gauss nodes are symmetric: h − t_j is the node counted from the other end.
            drive: forward
                .iter()
                .rev()
                .map(|flow| to_dynamic(&(flow * &structure.b)))
                .collect(),
        }
    }

    /// The element that begins at `phase` and turns by `turn`, rad.
    fn element(&self, problem: &Problem, teeth: usize, phase: f64, turn: f64) -> Element {
        let seconds_per_radian = self.duration / turn;
        let process = &problem.process;
        let nodes = self.gauss.nodes.len();
        let ports = Ports::new(problem, self.gauss, teeth, phase, turn);
        let (count, size) = (ports.per_node, nodes * ports.per_node);
        let order = self.flow.nrows();
        let mut observe = DMatrix::zeros(size, order);
        let mut kernel = DMatrix::zeros(size, size);
        let mut drive = DMatrix::zeros(order, size);
        for i in 0..nodes {
            for p in 0..count {
                let row = i * count + p;
                let seen = ports.seen[row].transpose() * &self.observe[i];
                observe.row_mut(row).copy_from(&seen);
                for j in 0..nodes {
                    let response = &seen * &self.backward[j];
                    let weight = self.gauss.integrals[(i, j)] * self.duration;
                    for q in 0..count {
                        let column = j * count + q;
                        kernel[(row, column)] = weight * (&response * ports.force[column])[(0, 0)];
                    }
                }
            }
        }
        for j in 0..nodes {
            for q in 0..count {
                let column = j * count + q;
                let push = &self.drive[j] * ports.force[column] * (self.gauss.weights[j] * self.duration);
                drive.column_mut(column).copy_from(&push);
            }
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
    fn new(problem: &Problem, gauss: &Gauss, teeth: usize, phase: f64, turn: f64) -> Self {
        let process = &problem.process;
        let per_node = teeth + usize::from(process.axial_depth_modulation);
        let mut ports = Self {
            per_node,
            seen: Vec::with_capacity(per_node * gauss.nodes.len()),
            force: Vec::with_capacity(per_node * gauss.nodes.len()),
        };
        for node in &gauss.nodes {
            let angles = (0..teeth).map(|tooth| process.engagement.angle(tooth, phase + turn * node));
            for angle in angles.clone() {
                ports.seen.push(process.force.normal.at(angle));
                ports.force.push(process.force.cutting.at(angle));
            }
            if process.axial_depth_modulation {
                ports.seen.push(Vector3::z());
                let forced: Vector3<f64> = angles
                    .map(|angle| process.force.forced(angle, process.feed_per_tooth_m))
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
    Element {
        flow: &whole.flow + &push * observe.select_rows(&axial),
        observe: observe.select_rows(&teeth),
        drive: whole.drive.select_columns(&teeth) + &push * kernel.select_rows(&axial),
        kernel: kernel.select_rows(&teeth),
        ports: teeth.iter().map(|&port| whole.ports[port]).collect(),
    }
}

/// A matrix with sizes known at run time only.
fn to_dynamic<R: nalgebra::Dim, C: nalgebra::Dim, S: nalgebra::RawStorage<f64, R, C>>(
    matrix: &nalgebra::Matrix<f64, R, C, S>,
) -> DMatrix<f64> {
    DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)])
}
