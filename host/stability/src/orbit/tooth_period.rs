//! Forced orbit of equal teeth over one tooth period: Gauss collocation with an analytic Jacobian.
//!
//! On a subinterval with Gauss nodes c_i, integrals a_ij, weights b_j and duration h
//!
//!   Y_i = x₀ + h Σ_j a_ij f(t_j, Y_j),   x₁ = x₀ + h Σ_j b_j f(t_j, Y_j),
//!
//! which has order 2m at the ends. Linearized about values Y, a subinterval gives the Newton step of these values, and
//! of x₁ as a function of x₀ and depth. Composition of all subintervals gives the map x(0) → x(T) over the period with
//! its derivatives. A periodic orbit is its fixed point: on it u = u_τ, and the previously cut surface does not act.
//! Subintervals end where teeth enter and leave the cut.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::coefficients::Coefficients;
use super::collocated::Linearized;
use super::forced::ForcedProblem;
use quietcut_numerics::quadrature::Gauss;

/// Largest phase angle, rad, of the fastest motion over a subinterval: the fastest pole plus the rotating directional
/// coefficients.
pub(super) const SUBINTERVAL_ANGLE: f64 = 4.0;

/// Gauss nodes per subinterval. Over the phase angle z = [`SUBINTERVAL_ANGLE`] the local error (m!)²
/// z^{2m+1}/((2m)!(2m+1)!) is then 5e-11. Halving the angle moves the limits of the thesis' robot (chapter 6), with
/// cubic terms, by less than 1e-10.
const NODES: usize = 9;

/// Subinterval of the tooth period without entry or exit of a tooth.
#[derive(Clone, Debug)]
pub(super) struct Subinterval {
    /// Phase of the tooth period at the start of the subinterval, rad.
    pub(super) phase: f64,
    /// Rotation of the tool over the subinterval, rad.
    pub(super) turn: f64,
    /// Duration, s.
    pub(super) duration: f64,
    /// Number of cutting teeth; of [ports](super::ports::Port) with smoothed or averaged coefficients.
    pub(super) teeth: usize,
    /// Force per axial depth of feed and edges at the nodes of the subinterval, N/m.
    pub(super) forces: Vec<Vector3<f64>>,
    /// Process damping B D C A per axial depth at the nodes of the subinterval; empty without process damping.
    pub(super) damping: Vec<DMatrix<f64>>,
}

/// Mesh of a tooth period at one spindle speed, on which forced orbits are collocated.
#[derive(Clone, Debug)]
pub(super) struct ToothPeriod<'a> {
    pub(super) problem: &'a ForcedProblem,
    pub(super) rpm: f64,
    pub(super) subinterval_angle: f64,
    pub(super) gauss: Gauss,
    pub(super) subintervals: Vec<Subinterval>,
}

impl<'a> ToothPeriod<'a> {
    /// Working mesh of the tooth period of a forced problem at a spindle speed.
    pub(super) fn new(problem: &'a ForcedProblem, rpm: f64) -> Self {
        Self::with_subintervals(problem, rpm, SUBINTERVAL_ANGLE)
    }

    /// The same mesh, with the forces at its nodes, for another problem of the same cut.
    pub(super) fn of<'b>(&self, problem: &'b ForcedProblem) -> ToothPeriod<'b> {
        ToothPeriod {
            problem,
            rpm: self.rpm,
            subinterval_angle: self.subinterval_angle,
            gauss: self.gauss.clone(),
            subintervals: self.subintervals.clone(),
        }
    }

    /// Mesh of the tooth period whose subintervals are so short that the fastest motion rotates by no more than the
    /// phase angle `subinterval_angle`, rad.
    pub(super) fn with_subintervals(problem: &'a ForcedProblem, rpm: f64, subinterval_angle: f64) -> Self {
        Self::on_mesh_of(rpm, problem, rpm, subinterval_angle)
    }

    /// The mesh of [`with_subintervals`](Self::with_subintervals) at the speed `mesh_rpm`, with the durations at the
    /// speed `rpm`: at all speeds from `mesh_rpm` on it is fine enough, with the same number of subintervals.
    pub(super) fn on_mesh_of(
        mesh_rpm: f64,
        problem: &'a ForcedProblem,
        rpm: f64,
        subinterval_angle: f64,
    ) -> Self {
        let linear = &problem.linear;
        let engagement = &linear.process.engagement;
        let seconds_per_radian = linear.tooth_period_s(rpm) / engagement.pitch;
        let seconds_per_radian_of_mesh = linear.tooth_period_s(mesh_rpm) / engagement.pitch;
        let fastest = linear
            .structure
            .poles()
            .iter()
            .map(|pole| pole.norm())
            .fold(0.0, f64::max);
        let gauss = Gauss::new(NODES);
        let speed_rad_per_s = problem.speed_rad_per_s(linear.tooth_period_s(rpm));
        let mut subintervals = Vec::new();
        for interval in problem.parts() {
            let length = interval.to - interval.from;
            // Phase angle over the whole interval between entry and exit of teeth: that of the fastest pole, plus that
            // of the directional coefficients, which oscillate at twice the rotation of the tool.
            let angle = fastest * length * seconds_per_radian_of_mesh + 2.0 * length;
            // A finer mesh divides the short parts at a smooth entry and exit too.
            let least = match problem.coefficients {
                Coefficients::Smoothed(_) => (SUBINTERVAL_ANGLE / subinterval_angle).floor().max(1.0),
                Coefficients::Exact | Coefficients::Averaged => 1.0,
            };
            let count = (angle / subinterval_angle).ceil().max(least);
            let turn = length / count;
            for index in 0..count as usize {
                let phase = interval.from + turn * index as f64;
                subintervals.push(Subinterval {
                    phase,
                    turn,
                    duration: turn * seconds_per_radian,
                    teeth: interval.ports,
                    damping: gauss
                        .nodes
                        .iter()
                        .filter_map(|node| {
                            let angles =
                                (0..interval.ports).map(|tooth| engagement.angle(tooth, phase + turn * node));
                            let at = problem.damping_per_depth(angles, speed_rad_per_s)?;
                            Some(problem.damped(&at))
                        })
                        .collect(),
                    forces: gauss
                        .nodes
                        .iter()
                        .map(|node| problem.force_per_depth(interval.ports, phase + turn * node))
                        .collect(),
                });
            }
        }
        Self {
            problem,
            rpm,
            subinterval_angle,
            gauss,
            subintervals,
        }
    }
}

/// Time derivatives f(t_j, Y_j) of the states at the nodes of a subinterval.
pub(super) fn rates(
    problem: &ForcedProblem,
    subinterval: &Subinterval,
    states: &DMatrix<f64>,
    depth_m: f64,
) -> Vec<DVector<f64>> {
    let structure = &problem.linear.structure;
    let modulated = problem.linear.process.axial_depth_modulation;
    subinterval
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
            if let Some(damping) = subinterval.damping.get(j) {
                rate -= damping * state * depth_m;
            }
            rate
        })
        .collect()
}

/// Jacobians ∂f/∂x of the equation of motion at the nodes of a subinterval.
pub(super) fn jacobians(
    problem: &ForcedProblem,
    subinterval: &Subinterval,
    states: &DMatrix<f64>,
    depth_m: f64,
) -> Vec<DMatrix<f64>> {
    let nodes = states.column_iter().zip(&subinterval.forces).enumerate();
    nodes
        .map(|(j, (state, force))| {
            let jacobian = problem.jacobian(state.as_slice(), force);
            match subinterval.damping.get(j) {
                Some(damping) => jacobian - damping * depth_m,
                None => jacobian,
            }
        })
        .collect()
}

impl ToothPeriod<'_> {
    /// Regenerative matrix per axial depth at a node of a subinterval, B Σ_teeth s·cutting·nᵀ C.
    pub(super) fn chip_per_depth(&self, subinterval: &Subinterval, node: usize) -> DMatrix<f64> {
        let problem = self.problem;
        let structure = &problem.linear.structure;
        let phase = subinterval.phase + subinterval.turn * self.gauss.nodes[node];
        let mut directional = Matrix3::zeros();
        for port in 0..subinterval.teeth {
            let port = problem.port(port, phase);
            directional += port.force * port.normal.transpose();
        }
        &structure.b * directional * &structure.c
    }

    /// Collocation of a subinterval, linearized about the states at its nodes.
    pub(super) fn linearized(
        &self,
        subinterval: &Subinterval,
        states: &DMatrix<f64>,
        depth_m: f64,
    ) -> Linearized<'_> {
        let jacobians = jacobians(self.problem, subinterval, states, depth_m);
        Linearized::new(&self.gauss, subinterval.duration, jacobians)
    }
}
