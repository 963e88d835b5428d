//! The forced periodic orbit at one speed and depth: Gauss collocation, Newton with an exact Jacobian.
//!
//! On a piece of the period with Gauss nodes c_i, integrals a_ij and weights b_j, of duration h,
//!
//!   Y_i = x₀ + h Σ_j a_ij f(t_j, Y_j),   x₁ = x₀ + h Σ_j b_j f(t_j, Y_j),
//!
//! which has order 2m at the ends. The values Y are solved for within each piece, so that what remains is the map
//! x(0) → x(T) over the period with its exact derivatives in x(0) and in depth. A periodic orbit is its fixed point.
//! Pieces end where teeth enter and leave the cut: no switch lies inside one.

use nalgebra::{DMatrix, DVector, Vector3};

use super::forced::ForcedProblem;
use crate::stability::gauss::Gauss;
use crate::structure::FirstOrder;

/// The largest angle, rad, by which the fastest pole turns within a piece.
pub(super) const PIECE_ANGLE: f64 = 4.0;

/// Nodes per piece. With the angle above the local error (m!)² z^{2m+1}/((2m)!(2m+1)!) is 5e-11; halving the angle
/// moves the limits of the robot of chapter 6, with cubic terms, by less than 1e-10.
const NODES: usize = 9;

/// Newton stops at steps below this, relative to the size of the orbit.
const TOLERANCE: f64 = 1e-12;

/// Why there is no orbit.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum OrbitError {
    /// Newton did not settle.
    #[error("no periodic orbit was found near the guess at {depth_mm} mm: the iteration does not settle")]
    NoConvergence {
        /// Axial depth, mm.
        depth_mm: f64,
    },
    /// The branch turns back before the depth is reached.
    #[error("the forced orbit is lost in a fold at {depth_mm} mm")]
    Lost {
        /// Axial depth of the fold, mm.
        depth_mm: f64,
    },
    /// The equations are singular: a fold or a branch point.
    #[error("the equations of the periodic orbit are singular at {depth_mm} mm")]
    Singular {
        /// Axial depth, mm.
        depth_mm: f64,
    },
}

/// A part of the tooth period without a switch.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    /// Phase where it begins, rad.
    pub(super) phase: f64,
    /// Angle by which the tool turns, rad.
    pub(super) turn: f64,
    /// Duration, s.
    pub(super) duration: f64,
    /// Number of cutting teeth.
    pub(super) teeth: usize,
    /// Force per depth at the nodes, N/m.
    pub(super) forces: Vec<Vector3<f64>>,
    /// B D C A per depth of the damping of the flank at the nodes; empty where there is none.
    pub(super) damping: Vec<DMatrix<f64>>,
}

/// The tooth period at one speed, cut into pieces.
#[derive(Clone, Debug)]
pub(super) struct Mesh {
    pub(super) gauss: Gauss,
    pub(super) pieces: Vec<Piece>,
}

/// A state of the orbit at the start of the tooth period, where a tooth enters, with what follows from it.
#[derive(Clone, Debug)]
pub struct Orbit {
    /// Axial depth, m.
    pub depth_m: f64,
    /// State at the start.
    pub start: DVector<f64>,
    /// For each piece the states at its nodes, n × m.
    pub(super) states: Vec<DMatrix<f64>>,
}

/// The map over the period at a start and a depth.
pub(super) struct Passage {
    pub(super) end: DVector<f64>,
    /// ∂end/∂start.
    pub(super) by_start: DMatrix<f64>,
    /// ∂end/∂depth, 1/m.
    pub(super) by_depth: DVector<f64>,
    states: Vec<DMatrix<f64>>,
}

impl Mesh {
    /// The period of a problem at a speed, in pieces over which nothing turns by more than an angle, rad.
    pub(super) fn new(problem: &ForcedProblem, rpm: f64, piece_angle: f64) -> Self {
        let linear = &problem.linear;
        let engagement = &linear.process.engagement;
        let seconds_per_radian = linear.tooth_period_s(rpm) / engagement.pitch;
        let fastest = linear
            .structure
            .poles()
            .iter()
            .map(|pole| pole.norm())
            .fold(0.0, f64::max);
        let gauss = Gauss::new(NODES);
        let speed_rad_per_s = problem.speed_rad_per_s(linear.tooth_period_s(rpm));
        let mut pieces = Vec::new();
        for interval in engagement.intervals() {
            let length = interval.to - interval.from;
            // Coefficients turn with twice the angle of the tool.
            let angle = fastest * length * seconds_per_radian + 2.0 * length;
            let count = (angle / piece_angle).ceil().max(1.0);
            let turn = length / count;
            for index in 0..count as usize {
                let phase = interval.from + turn * index as f64;
                pieces.push(Piece {
                    phase,
                    turn,
                    duration: turn * seconds_per_radian,
                    teeth: interval.teeth,
                    damping: gauss
                        .nodes
                        .iter()
                        .filter_map(|node| {
                            let at = problem.damping_per_depth(
                                interval.teeth,
                                phase + turn * node,
                                speed_rad_per_s,
                            )?;
                            Some(problem.damped(&at))
                        })
                        .collect(),
                    forces: gauss
                        .nodes
                        .iter()
                        .map(|node| problem.force_per_depth(interval.teeth, phase + turn * node))
                        .collect(),
                });
            }
        }
        Self { gauss, pieces }
    }
}

/// A piece linearized about the states at its nodes.
pub(super) struct Linearized {
    /// Jacobian at each node.
    pub(super) jacobians: Vec<DMatrix<f64>>,
    /// (I − h a⊗J), factored.
    factored: nalgebra::LU<f64, nalgebra::Dyn, nalgebra::Dyn>,
}

impl Linearized {
    pub(super) fn new(
        problem: &ForcedProblem,
        gauss: &Gauss,
        piece: &Piece,
        states: &DMatrix<f64>,
        depth_m: f64,
    ) -> Self {
        let (order, nodes) = (problem.order(), gauss.nodes.len());
        let jacobians: Vec<DMatrix<f64>> = (0..nodes)
            .map(|j| {
                let jacobian = problem.jacobian(states.column(j).as_slice(), &piece.forces[j]);
                match piece.damping.get(j) {
                    Some(damping) => jacobian - damping * depth_m,
                    None => jacobian,
                }
            })
            .collect();
        let mut matrix = DMatrix::identity(order * nodes, order * nodes);
        for i in 0..nodes {
            for (j, jacobian) in jacobians.iter().enumerate() {
                let weight = piece.duration * gauss.integrals[(i, j)];
                let mut block = matrix.view_mut((i * order, j * order), (order, order));
                block.zip_apply(jacobian, |entry, value| *entry -= weight * value);
            }
        }
        Self {
            jacobians,
            factored: matrix.lu(),
        }
    }

    /// The values at the nodes that a right-hand side makes, (n m) × anything; `None` where the piece is singular.
    pub(super) fn solve(&self, right: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        self.factored.solve(right)
    }

    /// x₁ for values at the nodes: h Σ b_j J_j Y_j.
    pub(super) fn gather(&self, gauss: &Gauss, piece: &Piece, values: &DMatrix<f64>) -> DMatrix<f64> {
        let order = self.jacobians[0].nrows();
        let mut sum = DMatrix::zeros(order, values.ncols());
        for (j, jacobian) in self.jacobians.iter().enumerate() {
            sum += jacobian * values.rows(j * order, order) * (piece.duration * gauss.weights[j]);
        }
        sum
    }
}

/// f(t_j, Y_j) at the nodes of a piece.
fn rates(problem: &ForcedProblem, piece: &Piece, states: &DMatrix<f64>, depth_m: f64) -> Vec<DVector<f64>> {
    let structure = &problem.linear.structure;
    let modulated = problem.linear.process.axial_depth_modulation;
    piece
        .forces
        .iter()
        .enumerate()
        .map(|(j, force)| {
            let state = states.column(j);
            let axial = if modulated {
                (structure.c.row(2) * state)[0]
            } else {
                0.0
            };
            let mut rate = &structure.a * state + &structure.b * (force * (depth_m - axial));
            problem.subtract_smooth(state.as_slice(), &mut rate);
            if let Some(damping) = piece.damping.get(j) {
                rate -= damping * state * depth_m;
            }
            rate
        })
        .collect()
}

/// What a meter more of depth adds to the rate at a node.
fn per_depth(structure: &FirstOrder, piece: &Piece, states: &DMatrix<f64>, node: usize) -> DVector<f64> {
    let push: DVector<f64> = &structure.b * piece.forces[node];
    match piece.damping.get(node) {
        Some(damping) => push - damping * states.column(node),
        None => push,
    }
}

/// Solves for the states at the nodes of a piece by Newton from a guess.
fn settle(
    problem: &ForcedProblem,
    gauss: &Gauss,
    piece: &Piece,
    start: &DVector<f64>,
    depth_m: f64,
    guess: &DMatrix<f64>,
) -> Option<(DMatrix<f64>, Linearized)> {
    let (order, nodes) = (problem.order(), gauss.nodes.len());
    let mut states = guess.clone();
    for _ in 0..12 {
        let rates = rates(problem, piece, &states, depth_m);
        let linearized = Linearized::new(problem, gauss, piece, &states, depth_m);
        let mut residual = DMatrix::zeros(order * nodes, 1);
        for i in 0..nodes {
            let mut row = start - states.column(i);
            for (j, rate) in rates.iter().enumerate() {
                row.axpy(piece.duration * gauss.integrals[(i, j)], rate, 1.0);
            }
            residual.view_mut((i * order, 0), (order, 1)).copy_from(&row);
        }
        let step = linearized.solve(&residual)?;
        states += DMatrix::from_column_slice(order, nodes, step.as_slice());
        if !step.iter().all(|entry| entry.is_finite()) {
            return None;
        }
        // Where the structure is linear one step is exact.
        if problem.is_linear() || step.amax() <= TOLERANCE * states.amax() {
            let linearized = Linearized::new(problem, gauss, piece, &states, depth_m);
            return Some((states, linearized));
        }
    }
    None
}

/// The map over the period, with derivatives; `guess` holds states at the nodes to begin with.
pub(super) fn pass(
    problem: &ForcedProblem,
    mesh: &Mesh,
    start: &DVector<f64>,
    depth_m: f64,
    guess: &[DMatrix<f64>],
) -> Option<Passage> {
    let (order, nodes) = (problem.order(), mesh.gauss.nodes.len());
    let structure = &problem.linear.structure;
    let mut end = start.clone();
    let mut by_start = DMatrix::identity(order, order);
    let mut by_depth = DVector::zeros(order);
    let mut all_states = Vec::with_capacity(mesh.pieces.len());
    for (piece, guess) in mesh.pieces.iter().zip(guess) {
        let (states, linearized) = settle(problem, &mesh.gauss, piece, &end, depth_m, guess)?;
        // Columns: the derivatives in the start of the piece, then that in depth.
        let mut right = DMatrix::zeros(order * nodes, order + 1);
        for i in 0..nodes {
            right
                .view_mut((i * order, 0), (order, order))
                .fill_with_identity();
            let mut push = DVector::zeros(order);
            for j in 0..nodes {
                push +=
                    per_depth(structure, piece, &states, j) * (piece.duration * mesh.gauss.integrals[(i, j)]);
            }
            right.view_mut((i * order, order), (order, 1)).copy_from(&push);
        }
        let values = linearized.solve(&right)?;
        let mut gathered = linearized.gather(&mesh.gauss, piece, &values);
        for j in 0..nodes {
            let push = per_depth(structure, piece, &states, j) * (piece.duration * mesh.gauss.weights[j]);
            let mut column = gathered.column_mut(order);
            column += push;
        }
        for i in 0..order {
            gathered[(i, i)] += 1.0;
        }
        let flow = gathered.columns(0, order);
        by_depth = flow * by_depth + gathered.column(order);
        by_start = flow * by_start;
        for (j, rate) in rates(problem, piece, &states, depth_m).iter().enumerate() {
            end.axpy(piece.duration * mesh.gauss.weights[j], rate, 1.0);
        }
        all_states.push(states);
    }
    end.iter().all(|entry| entry.is_finite()).then_some(Passage {
        end,
        by_start,
        by_depth,
        states: all_states,
    })
}

impl Orbit {
    /// Rest: the orbit at no depth.
    pub(super) fn rest(problem: &ForcedProblem, mesh: &Mesh) -> Self {
        let (order, nodes) = (problem.order(), mesh.gauss.nodes.len());
        Self {
            depth_m: 0.0,
            start: DVector::zeros(order),
            states: vec![DMatrix::zeros(order, nodes); mesh.pieces.len()],
        }
    }

    /// Corrects a guess to the orbit on the hyperplane ⟨normal, (start/size, depth/depth_size) − guess⟩ = 0.
    ///
    /// With a normal along depth alone this is Newton at fixed depth; with the tangent it passes folds. Returns
    /// the orbit and the unit tangent there, oriented along `normal`.
    pub(super) fn correct(
        problem: &ForcedProblem,
        mesh: &Mesh,
        guess: &Self,
        scale: Scale,
        normal: &DVector<f64>,
    ) -> Result<(Self, DVector<f64>), OrbitError> {
        let order = problem.order();
        let mut orbit = guess.clone();
        let mut distance = 0.0;
        let mut last = f64::INFINITY;
        for iteration in 0..25 {
            let depth_mm = orbit.depth_m * 1e3;
            let passage = pass(problem, mesh, &orbit.start, orbit.depth_m, &orbit.states)
                .ok_or(OrbitError::NoConvergence { depth_mm })?;
            orbit.states = passage.states;
            let mut matrix = DMatrix::zeros(order + 1, order + 1);
            let mut periodic = passage.by_start;
            for i in 0..order {
                periodic[(i, i)] -= 1.0;
            }
            matrix.view_mut((0, 0), (order, order)).copy_from(&periodic);
            matrix
                .view_mut((0, order), (order, 1))
                .copy_from(&(passage.by_depth * (scale.depth_m / scale.state)));
            matrix.row_mut(order).copy_from(&normal.transpose());
            let lu = matrix.lu();
            let mut residual = DVector::zeros(order + 1);
            residual
                .rows_mut(0, order)
                .copy_from(&((&orbit.start - passage.end) / scale.state));
            residual[order] = -distance;
            let step = lu.solve(&residual).ok_or(OrbitError::Singular { depth_mm })?;
            orbit.start += step.rows(0, order) * scale.state;
            orbit.depth_m += step[order] * scale.depth_m;
            distance += normal.dot(&step);
            let size = step.norm();
            if !size.is_finite() || (iteration > 4 && size > 2.0 * last) {
                return Err(OrbitError::NoConvergence { depth_mm });
            }
            last = size;
            if size < TOLERANCE.max(1e-13) {
                let mut along = DVector::zeros(order + 1);
                along[order] = 1.0;
                let tangent = lu.solve(&along).ok_or(OrbitError::Singular { depth_mm })?;
                return Ok((orbit, tangent.normalize()));
            }
        }
        Err(OrbitError::NoConvergence {
            depth_mm: orbit.depth_m * 1e3,
        })
    }
}

/// What states and depth are divided by before lengths along a branch are taken.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    pub(super) state: f64,
    pub(super) depth_m: f64,
}
