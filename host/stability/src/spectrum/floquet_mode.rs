//! Floquet mode of a Floquet multiplier (characteristic multiplier) and its adjoint, along one tooth period.
//!
//! With G(t) = A + B M(t) C, M = κ Σ cutting·normalᵀ − β over the cutting teeth, and the complex depth κ = w (1 − 1/μ),
//! the Floquet mode fulfils ẋ = G x with x(τ) = μ x(0). The adjoint fulfils ẏ = −Gᵀ y with y(τ) = l and lᵀΦ = μ lᵀ.
//! With x(0) = r, lᵀ dΦ r = ∫ yᵀ dG x dt for any small change of G: one pair of motions gives the derivatives with
//! respect to all parameters.
//!
//! Mode and adjoint are computed on subintervals of the period with Gauss nodes, as in
//! [`period`](crate::problem::period): the free motion of the structure by matrix exponentials, the force by
//! collocation. The adjoint is the motion of the transposed structure in reversed time, with directions of observation
//! and of force exchanged.

use nalgebra::{DMatrix, DVector, Vector3};
use num_complex::Complex64;

use crate::problem::linear::Problem;
use crate::problem::period::{DECAY_MAX, Rates, degree};
use quietcut_model::structure::FirstOrder;
use quietcut_numerics::eigenvalues::eigenvector;
use quietcut_numerics::quadrature::Gauss;

/// Largest phase angle of the fastest motion over a subinterval, rad. A choice: eleven Gauss nodes then reach
/// [`TOLERANCE`].
const ANGLE: f64 = 3.0;

/// Target for the relative collocation error at the end of a subinterval. At the inner nodes collocation has half the
/// order, so that mode and adjoint, and integrals of yᵀ dG x, are accurate to about 1e-8, the square root of this
/// target.
const TOLERANCE: f64 = 1e-16;

type Matrix = DMatrix<Complex64>;

/// Floquet mode x and its adjoint y at one node of the quadrature over the period.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    /// Quadrature weight of the node, s; 0 for the two instants at which a tooth enters or leaves, which are no nodes
    /// of the quadrature.
    pub(crate) weight_s: f64,
    /// Phase of the tooth period at this node, rad.
    pub(crate) phase: f64,
    /// Number of cutting teeth at this node.
    pub(crate) teeth: usize,
    /// Floquet mode x (right).
    pub(crate) right: DVector<Complex64>,
    /// Adjoint mode y (left).
    pub(crate) left: DVector<Complex64>,
}

/// Floquet mode and its adjoint over a tooth period.
#[derive(Clone, Debug)]
pub(crate) struct FloquetMode {
    /// Nodes of the quadrature over the tooth period, in order of time.
    pub(crate) nodes: Vec<Node>,
    /// Floquet mode and its adjoint at the entry of a tooth, which is the start of the period.
    pub(crate) entry: Node,
    /// Floquet mode and its adjoint at the exit of a tooth.
    pub(crate) exit: Node,
    /// Inner product lᵀ r of left and right eigenvector of the transition matrix over the period.
    pub(crate) overlap: Complex64,
}

/// Subinterval of the tooth period.
struct Subinterval {
    basis: usize,
    teeth: usize,
    phase: f64,
    turn: f64,
}

/// Matrix exponentials of the free structure that all subintervals of one duration share.
struct Basis {
    gauss: Gauss,
    duration: f64,
    flow: DMatrix<f64>,
    /// Matrix exponentials e^{A t_i}.
    forward: Vec<DMatrix<f64>>,
    /// Matrix exponentials e^{−A t_i}.
    backward: Vec<DMatrix<f64>>,
}

/// Ports at one node: direction in which each observes the displacement, and the force per observed displacement.
type Ports = Vec<(Vector3<Complex64>, Vector3<Complex64>)>;

impl FloquetMode {
    /// Floquet mode and adjoint of a multiplier at an axial depth; `None` if a collocation is singular, or if numbers
    /// leave their range.
    pub(crate) fn new(problem: &Problem, rpm: f64, depth_m: f64, multiplier: Complex64) -> Option<Self> {
        let kappa = (Complex64::ONE - multiplier.inv()) * depth_m;
        let (bases, subintervals) = subintervals(problem, rpm, kappa.norm());
        let ports: Vec<Vec<Ports>> = subintervals
            .iter()
            .map(|subinterval| {
                let nodes = &bases[subinterval.basis].gauss.nodes;
                let at = |node: &f64| {
                    ports(
                        problem,
                        kappa,
                        subinterval.teeth,
                        subinterval.phase + subinterval.turn * node,
                    )
                };
                nodes.iter().map(at).collect()
            })
            .collect();
        let (forward, adjoint) = factors(&problem.structure, &bases, &subintervals, &ports)?;
        let order = problem.structure.order();
        let mut transition = Matrix::identity(order, order);
        for factor in &forward {
            transition = &factor.transition * transition;
        }
        let mut right = eigenvector(&transition, multiplier)?;
        let mut left = eigenvector(&transition.transpose(), multiplier)?;
        let overlap = left.dot(&right);
        let mut rights = vec![right.clone()];
        for factor in &forward {
            right = &factor.transition * right;
            rights.push(right.clone());
        }
        let mut lefts = vec![left.clone()];
        for factor in adjoint.iter().rev() {
            left = &factor.transition * left;
            lefts.push(left.clone());
        }
        lefts.reverse();
        let mut nodes = Vec::new();
        for (index, subinterval) in subintervals.iter().enumerate() {
            let basis = &bases[subinterval.basis];
            let count = basis.gauss.nodes.len();
            for i in 0..count {
                nodes.push(Node {
                    weight_s: basis.gauss.weights[i] * basis.duration,
                    phase: subinterval.phase + subinterval.turn * basis.gauss.nodes[i],
                    teeth: subinterval.teeth,
                    right: &forward[index].states[i] * &rights[index],
                    left: &adjoint[index].states[count - 1 - i] * &lefts[index + 1],
                });
            }
        }
        // In the first part of the period one tooth more cuts than in the second. If there is only one part, a tooth
        // leaves at its end.
        let most = subintervals.first().map_or(0, |subinterval| subinterval.teeth);
        let leaving = subintervals
            .iter()
            .take_while(|subinterval| subinterval.teeth == most)
            .count();
        let end = |at: usize| Node {
            weight_s: 0.0,
            phase: subintervals
                .get(at)
                .map_or(problem.process.engagement.pitch, |subinterval| subinterval.phase),
            teeth: most,
            right: rights[at].clone(),
            left: lefts[at].clone(),
        };
        Some(Self {
            nodes,
            entry: end(0),
            exit: end(leaving),
            overlap,
        })
    }
}

/// Transitions over all subintervals: of the structure, and of the transposed structure in reversed time with
/// directions of observation and of force exchanged. `None` if a collocation is singular.
fn factors(
    structure: &FirstOrder,
    bases: &[Basis],
    subintervals: &[Subinterval],
    ports: &[Vec<Ports>],
) -> Option<(Vec<MapFactor>, Vec<MapFactor>)> {
    let transposed = FirstOrder {
        a: structure.a.transpose(),
        b: structure.c.transpose(),
        c: structure.b.transpose(),
    };
    let mut forward = Vec::with_capacity(subintervals.len());
    let mut adjoint = Vec::with_capacity(subintervals.len());
    let reversed: Vec<Basis> = bases.iter().map(Basis::transposed).collect();
    for (subinterval, ports) in subintervals.iter().zip(ports) {
        forward.push(MapFactor::new(structure, &bases[subinterval.basis], ports)?);
        let exchanged: Vec<Ports> = ports
            .iter()
            .rev()
            .map(|ports| ports.iter().map(|&(seen, force)| (force, seen)).collect())
            .collect();
        adjoint.push(MapFactor::new(
            &transposed,
            &reversed[subinterval.basis],
            &exchanged,
        )?);
    }
    Some((forward, adjoint))
}

/// Divides the period into subintervals over which the estimated phase angle of the fastest motion is at most
/// [`ANGLE`], and the largest decay rate times the duration at most [`DECAY_MAX`].
fn subintervals(problem: &Problem, rpm: f64, kappa_m: f64) -> (Vec<Basis>, Vec<Subinterval>) {
    let engagement = &problem.process.engagement;
    let seconds_per_radian = problem.tooth_period_s(rpm) / engagement.pitch;
    let rates = Rates::new(problem);
    let (mut bases, mut subintervals) = (Vec::new(), Vec::new());
    for interval in engagement.subintervals() {
        let length = interval.to - interval.from;
        let duration = length * seconds_per_radian;
        // Free flight is divided as well: the quadrature of yᵀ dG x needs short subintervals.
        let angle = rates.at(if interval.teeth == 0 { 0.0 } else { kappa_m }) * duration + 2.0 * length;
        let decay = problem.fastest_decay() * duration;
        let count = (angle / ANGLE).max(decay / DECAY_MAX).ceil().max(1.0);
        for index in 0..count as usize {
            subintervals.push(Subinterval {
                basis: bases.len(),
                teeth: interval.teeth,
                phase: interval.from + length * index as f64 / count,
                turn: length / count,
            });
        }
        let gauss = Gauss::new(degree(angle / count, TOLERANCE));
        bases.push(Basis::new(&problem.structure.a, gauss, duration / count));
    }
    (bases, subintervals)
}

fn ports(problem: &Problem, kappa: Complex64, teeth: usize, phase: f64) -> Ports {
    let process = &problem.process;
    let angles = (0..teeth).map(|tooth| process.engagement.angle(tooth, phase));
    let mut ports: Ports = angles
        .clone()
        .map(|angle| {
            let force = process.force.cutting.at(angle).map(|part| kappa * part);
            (process.force.normal.at(angle).map(Complex64::from), force)
        })
        .collect();
    if process.axial_depth_modulation && teeth > 0 {
        let forced: Vector3<f64> = angles
            .map(|angle| process.force.forced(angle, process.feed_per_tooth_m))
            .sum();
        ports.push((
            Vector3::<f64>::z().map(Complex64::from),
            -forced.map(Complex64::from),
        ));
    }
    ports
}

impl Basis {
    fn new(a: &DMatrix<f64>, gauss: Gauss, duration: f64) -> Self {
        let flow_over = |share: f64| (a * (duration * share)).exp();
        Self {
            flow: flow_over(1.0),
            forward: gauss.nodes.iter().map(|&node| flow_over(node)).collect(),
            backward: gauss.nodes.iter().map(|&node| flow_over(-node)).collect(),
            gauss,
            duration,
        }
    }

    /// Matrix exponentials of the transposed structure Aᵀ for the same duration.
    fn transposed(&self) -> Self {
        let transpose = |all: &[DMatrix<f64>]| all.iter().map(DMatrix::transpose).collect();
        Self {
            gauss: self.gauss.clone(),
            duration: self.duration,
            flow: self.flow.transpose(),
            forward: transpose(&self.forward),
            backward: transpose(&self.backward),
        }
    }
}

/// Transition of the Floquet mode, or of its adjoint in reversed time, from the start of a subinterval to its nodes and
/// to its end.
struct MapFactor {
    /// Transition matrix from the start to the end of the subinterval, n × n.
    transition: Matrix,
    /// Transition matrix from the start of the subinterval to each node, n × n.
    states: Vec<Matrix>,
}

impl MapFactor {
    /// Collocates x(t) = e^{At}(x₀ + ∫ e^{−As} B f ds) with f = force·seenᵀ C x at the nodes; `None` if the collocation
    /// is singular.
    fn new(structure: &FirstOrder, basis: &Basis, ports: &[Ports]) -> Option<Self> {
        let order = structure.order();
        let nodes = basis.gauss.nodes.len();
        let per_node = ports.first().map_or(0, Vec::len);
        let complex = |matrix: &DMatrix<f64>| matrix.map(Complex64::from);
        // Rows seenᵀ C e^{A t_i} that observe the displacement and columns e^{−A t_j} B force that act on the state,
        // port by port within each node.
        let mut rows = Matrix::zeros(nodes * per_node, order);
        let mut columns = Matrix::zeros(order, nodes * per_node);
        for (i, ports) in ports.iter().enumerate() {
            let observed = (&structure.c * &basis.forward[i]).map(Complex64::from);
            let pushed = (&basis.backward[i] * &structure.b).map(Complex64::from);
            for (p, (seen, force)) in ports.iter().enumerate() {
                rows.row_mut(i * per_node + p)
                    .copy_from(&(seen.transpose() * &observed));
                columns.column_mut(i * per_node + p).copy_from(&(&pushed * force));
            }
        }
        let mut implicit = -(&rows * &columns);
        for i in 0..nodes * per_node {
            for j in 0..nodes * per_node {
                let weight = basis.gauss.integrals[(i / per_node, j / per_node)] * basis.duration;
                implicit[(i, j)] *= weight;
            }
            implicit[(i, i)] += 1.0;
        }
        let seen = if per_node == 0 {
            rows
        } else {
            implicit.lu().solve(&rows)?
        };
        // States at the nodes from the start state, x_i = e^{A t_i} (1 + Σ_j S_ij h column_j seen_j) x₀, with the Gauss
        // integrals S_ij and the duration h.
        let pushes: Vec<Matrix> = (0..nodes)
            .map(|j| {
                let ports = j * per_node;
                columns.columns(ports, per_node)
                    * seen.rows(ports, per_node)
                    * Complex64::from(basis.duration)
            })
            .collect();
        let carried = |flow: &DMatrix<f64>, weight: &dyn Fn(usize) -> f64| {
            let mut sum = Matrix::identity(order, order);
            for (j, push) in pushes.iter().enumerate() {
                sum += push * Complex64::from(weight(j));
            }
            complex(flow) * sum
        };
        Some(Self {
            transition: carried(&basis.flow, &|j| basis.gauss.weights[j]),
            states: (0..nodes)
                .map(|i| carried(&basis.forward[i], &|j| basis.gauss.integrals[(i, j)]))
                .collect(),
        })
    }
}
