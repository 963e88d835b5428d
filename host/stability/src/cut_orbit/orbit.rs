//! The forced periodic orbit of a cut.

use quietcut_numerics::quadrature::Gauss;

use super::events::Events;
use super::mesh::{Contact, EngagedTooth, Mesh, Stretches};
use super::model::{CutModel, Ports};
use super::motion::Motion;
use super::newton::{self, Linearization};
use super::period::{NodeForces, Period};
use super::response::Response;
use super::states;

/// Nodes per subinterval.
const NODES: usize = 8;
/// Largest relative step of the displacement at which Newton's method has converged. Its convergence is quadratic, so
/// that the error left is about the square.
const CONVERGED: f64 = 1e-9;
/// Largest movement of an event at which it counts as found, as a share of the revolution.
const EVENT_FOUND: f64 = 1e-9;
/// Largest relative step of the displacement from which on the instants of events are those of the Newton step; from
/// further away its prediction is no better than a search along the new motion.
const NEAR: f64 = 0.05;
/// Largest number of Newton steps.
const STEPS: usize = 20;
/// Largest relative step of the displacement at the end of a search on a mesh that a finer one may resolve: events that
/// lie in the surface near another event move by as much as the motion between the nodes errs.
const RESOLVABLE: f64 = 1e-3;
/// Largest number of events in a revolution; beyond, a motion counts as far from any orbit. A mode that rings for ten periods
/// after the entry of each of six teeth reverses 120 times. The cost of the dense equations grows with the cube of it.
const MOST_EVENTS: usize = 128;
/// Number of Newton steps without one of half the size of the smallest before, after which a search ends.
const STALLED: usize = 7;
/// Depth of the shallow cut from which an orbit is followed, as a share of that of the cut.
const SHALLOW: f64 = 0.01;
/// Smallest step of a natural continuation, as a share of its way.
const LEAST_STEP: f64 = 1e-3;
/// Largest share of the force in the two highest Legendre polynomials of a subinterval: the error of the orbit is of
/// this order.
const TAIL: f64 = 1e-5;
/// Shortest subinterval, as a share of a revolution: a power law of the chip is not smooth where a chip begins.
const SHORTEST: f64 = 1e-4;
/// Largest number of splits of the mesh.
const SPLITS: usize = 32;

/// Why an orbit is not found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CutOrbitError {
    /// The structure has no periodic response at this speed.
    #[error(
        "the structure has no periodic motion at {rpm:.1} rev/min: it has an undamped mode at a multiple of the spindle frequency, or is free to drift away"
    )]
    NoPeriodicResponse {
        /// Spindle speed, rev/min.
        rpm: f64,
    },
    /// Newton's method does not converge.
    #[error(
        "no forced periodic orbit of the revolution is found at {rpm:.1} rev/min and {depth_mm:.3} mm: after {steps} Newton steps the motion still changes by {change:.1e} of itself"
    )]
    NotConverged {
        /// Spindle speed, rev/min.
        rpm: f64,
        /// Axial depth, mm.
        depth_mm: f64,
        /// Number of Newton steps.
        steps: usize,
        /// Relative change of the motion in the last step.
        change: f64,
    },
}

/// The forced periodic orbit of a cut over one revolution: the motion at which regeneration repeats, with loss of
/// contact, unequal teeth and runout, and the surfaces of all earlier tooth passings.
///
/// The chip of tooth j is h_j = max(0, min over m = 1…N of [f over m teeth + n·(u(t) − u(t − τ_{j,m})) + (r_j − r_{j+m})
/// sin γ]). The structure is linear apart from forces on the tool; its response to forces that are polynomials between
/// the instants at which they are not smooth is exact, and these instants (entry, exit, loss of contact, stick) are
/// found as unknowns. Newton's method with exact derivatives.
pub struct CutOrbit {
    pub(super) ports: Ports,
    pub(super) mesh: Mesh,
    pub(super) motion: Motion,
    pub(super) forces: NodeForces,
    pub(super) linearized: Linearization,
    splits: Vec<f64>,
    /// Number of Newton steps that were taken.
    pub steps: usize,
}

/// The end of a search on one mesh.
struct Settled {
    orbit: CutOrbit,
    /// Relative change of the motion in the last full Newton step.
    change: f64,
}

impl CutOrbitError {
    fn not_converged(model: &CutModel, steps: usize, change: f64) -> Self {
        Self::NotConverged {
            rpm: model.rad_per_s * 60.0 / std::f64::consts::TAU,
            depth_mm: 1e3 * model.cutter.depth_m,
            steps,
            change,
        }
    }
}

/// A mesh, and a motion to start from.
struct Start {
    /// Instants within stretches at which the mesh is split, s, in the order of time.
    splits: Vec<f64>,
    mesh: Mesh,
    motion: Motion,
    events: Events,
}

impl CutOrbit {
    /// The orbit of `model`, from the tool at rest.
    ///
    /// # Errors
    /// See [`CutOrbitError`].
    pub fn new(model: &CutModel) -> Result<Self, CutOrbitError> {
        Self::from(model, None)
    }

    /// The orbit of `model` near that of a similar one.
    ///
    /// # Errors
    /// See [`CutOrbitError`].
    pub fn near(model: &CutModel, other: &Self) -> Result<Self, CutOrbitError> {
        Self::from(model, Some(other))
    }

    /// The orbit of `model(1)`, followed from that of `model(0)` by natural continuation: in steps of the argument from
    /// 0 to 1 that are halved where Newton's method does not converge and doubled where it does. For models far from
    /// any known orbit, such as one whose dry friction holds the tool for a part of the revolution.
    ///
    /// # Errors
    /// See [`CutOrbitError`].
    pub fn continued(model: &dyn Fn(f64) -> CutModel) -> Result<Self, CutOrbitError> {
        Self::new(&model(0.0))?.followed(|share, orbit| Self::near(&model(share), orbit))
    }

    /// The orbit of `model`, from the tool at rest; where it is not found there, followed from that of a shallow cut, in
    /// which the motion is small against the chips and the teeth are in contact as those of a rigid tool.
    ///
    /// # Errors
    /// See [`CutOrbitError`].
    pub fn along_depth(model: &mut CutModel) -> Result<Self, CutOrbitError> {
        Self::new(model).or_else(|_| {
            let depth_m = model.cutter.depth_m;
            model.cutter.depth_m = SHALLOW * depth_m;
            let found = Self::new(model).and_then(|shallow| {
                shallow.followed(|share, orbit| {
                    model.cutter.depth_m = (SHALLOW + (1.0 - SHALLOW) * share) * depth_m;
                    Self::near(model, orbit)
                })
            });
            model.cutter.depth_m = depth_m;
            found
        })
    }

    /// Natural continuation from this orbit at 0 to 1: `near` is the orbit at a share of the way near another.
    fn followed(
        self,
        mut near: impl FnMut(f64, &Self) -> Result<Self, CutOrbitError>,
    ) -> Result<Self, CutOrbitError> {
        let mut orbit = self;
        let (mut share, mut step) = (0.0, 0.25);
        while share < 1.0 {
            let next = f64::min(share + step, 1.0);
            match near(next, &orbit) {
                Ok(found) => {
                    (orbit, share) = (found, next);
                    step *= 2.0;
                }
                Err(error) if step < LEAST_STEP => return Err(error),
                Err(_) => step *= 0.5,
            }
        }
        Ok(orbit)
    }

    fn from(model: &CutModel, known: Option<&Self>) -> Result<Self, CutOrbitError> {
        let ports = model.ports();
        let stretches = Stretches::new(&model.cutter, model.rad_per_s);
        let known = known.filter(|known| {
            known.ports.axes == ports.axes
                && (known.mesh.revolution_s / stretches.revolution_s - 1.0).abs() < 1e-12
        });
        let mut start = Start::new(model, &ports, &stretches, known);
        let mut steps = 0;
        loop {
            let Settled { orbit, change } = start.converge(model, &ports, &stretches, &mut steps)?;
            if !start.refine(&orbit) {
                return if change < TAIL {
                    Ok(orbit)
                } else {
                    Err(CutOrbitError::not_converged(model, steps, change))
                };
            }
            let finer = Mesh::new(
                &stretches,
                &start.splits,
                &start.events.starts,
                &start.events.events,
                Gauss::shared(NODES),
            );
            start.motion = start.motion.on(&start.mesh, &finer);
            start.mesh = finer;
        }
    }

    /// Displacement of the tool along x, y, z, m, at any time, s; 0 is the immersion angle −ψ_1 of the first tooth.
    pub fn displacement_m(&self, time_s: f64) -> [f64; 3] {
        self.motion.displacement(&self.mesh, &self.ports, time_s)
    }

    /// Half the range of the displacement, m, and of the velocity, m/s, of the tool along x, y, z.
    pub fn half_ranges(&self) -> [[f64; 3]; 2] {
        let mut ranges = [[[f64::INFINITY, f64::NEG_INFINITY]; 3]; 2];
        for point in 0..self.mesh.points() {
            let outputs = self.motion.at_point(point);
            let values = [self.ports.displacement(outputs), self.ports.velocity(outputs)];
            for (range, value) in ranges.as_flattened_mut().iter_mut().zip(values.as_flattened()) {
                *range = [range[0].min(*value), range[1].max(*value)];
            }
        }
        ranges.map(|kind| kind.map(|[low, high]| 0.5 * (high - low)))
    }

    /// Numbers of subintervals, and of events at which contact or a regime changes.
    pub fn size(&self) -> [usize; 2] {
        [self.mesh.subintervals.len(), self.mesh.events]
    }
}

impl Start {
    fn new(model: &CutModel, ports: &Ports, stretches: &Stretches, known: Option<&CutOrbit>) -> Self {
        let teeth = |teeth: &Vec<usize>| Contact {
            teeth: teeth
                .iter()
                .map(|tooth| EngagedTooth {
                    tooth: *tooth,
                    passings: Some(1),
                })
                .collect(),
            regimes: vec![0; model.restoring_forces.len()],
        };
        let contacts: Vec<Contact> = stretches.teeth.iter().map(teeth).collect();
        let gauss = Gauss::shared(NODES);
        let mut splits = Vec::new();
        let (mesh, mut motion) = if let Some(known) = known {
            splits.clone_from(&known.splits);
            (known.mesh.clone(), known.motion.of(&known.ports, ports))
        } else {
            let mesh = Mesh::new(stretches, &splits, &contacts, &[], gauss);
            let rest = Motion::at_rest(&mesh, ports);
            // At rest dry friction would hold the tool, and internal states would have no sign: the force of a rigid
            // tool tells where it moves.
            let moved = (model.may_hold() || ports.internal > 0)
                .then(|| rigid(model, ports, &mesh, &rest))
                .flatten();
            (mesh, moved.unwrap_or(rest))
        };
        if known.is_none_or(|known| known.ports.internal != ports.internal) {
            states::follow(model, ports, &mesh, &mut motion);
        }
        let events = newton::events(model, ports, stretches, &mesh, &motion);
        let own = Mesh::new(stretches, &splits, &events.starts, &events.events, gauss);
        let motion = motion.on(&mesh, &own);
        Self {
            splits,
            mesh: own,
            motion,
            events,
        }
    }

    fn converge(
        &mut self,
        model: &CutModel,
        ports: &Ports,
        stretches: &Stretches,
        steps: &mut usize,
    ) -> Result<Settled, CutOrbitError> {
        let rpm = model.rad_per_s * 60.0 / std::f64::consts::TAU;
        let not_periodic = CutOrbitError::NoPeriodicResponse { rpm };
        let (mut last, mut share) = (f64::INFINITY, 1.0);
        let (mut least, mut since) = (f64::INFINITY, 0);
        let mut linearized = None;
        for _ in 0..STEPS {
            *steps += 1;
            let step = newton::step(model, ports, &self.mesh, &self.motion, share)
                .ok_or_else(|| not_periodic.clone())?;
            let mut events = newton::events(model, ports, stretches, &self.mesh, &step.motion);
            if events.events.len() > MOST_EVENTS {
                return Err(CutOrbitError::not_converged(model, *steps, step.moved));
            }
            let alike = events.are_like(&self.events);
            if alike && step.moved < NEAR {
                // At a jump of the force the velocity has a kink, which is exact only with the instant of the step.
                for (event, time_s) in &step.instants_s {
                    events.events[*event].time_s = *time_s;
                }
                events.sort(&self.events);
            }
            let events_moved = if alike {
                events.moved_s(&self.events) / stretches.revolution_s
            } else {
                1.0
            };
            let moved = step.moved;
            let full = moved / share;
            self.motion = step.motion;
            if alike && moved < CONVERGED && events_moved < EVENT_FOUND {
                last = full;
                // About a motion that is this one but for [`CONVERGED`].
                linearized = Some(step.linearized);
                break;
            }
            if !alike || events_moved > 0.0 {
                let gauss = self.mesh.gauss;
                let mesh = Mesh::new(stretches, &self.splits, &events.starts, &events.events, gauss);
                self.motion = self.motion.on(&self.mesh, &mesh);
                (self.mesh, self.events) = (mesh, events);
            }
            // Where contact comes and goes, full steps may alternate between two contacts.
            share = if full < (1.0 - 0.3 * share) * last {
                (2.0 * share).min(1.0)
            } else {
                (0.5 * share).max(0.1)
            };
            last = full;
            // Steps that do not become smaller lead to no orbit.
            since = if moved < 0.5 * least { 0 } else { since + 1 };
            least = least.min(moved);
            if since > STALLED {
                break;
            }
        }
        if last > RESOLVABLE {
            return Err(CutOrbitError::not_converged(model, *steps, last));
        }
        let orbit = self.orbit(model, ports, *steps, linearized).ok_or(not_periodic)?;
        Ok(Settled { orbit, change: last })
    }

    /// The orbit of the motion, with its equations if they are known.
    fn orbit(
        &self,
        model: &CutModel,
        ports: &Ports,
        steps: usize,
        linearized: Option<Linearization>,
    ) -> Option<CutOrbit> {
        let period = Period {
            model,
            ports,
            mesh: &self.mesh,
            motion: &self.motion,
        };
        let linearized = match linearized {
            Some(linearized) => linearized,
            None => period.linearized(Response::new(&self.mesh, ports)?)?,
        };
        Some(CutOrbit {
            forces: period.forces(),
            linearized,
            ports: ports.clone(),
            mesh: self.mesh.clone(),
            motion: self.motion.clone(),
            splits: self.splits.clone(),
            steps,
        })
    }

    /// Halves the subintervals whose force is not resolved; false if all are.
    fn refine(&mut self, orbit: &CutOrbit) -> bool {
        let known = self.splits.len();
        let shortest_s = SHORTEST * self.mesh.revolution_s;
        for (index, of) in self.mesh.subintervals.iter().enumerate() {
            if of.duration_s > shortest_s && self.splits.len() < SPLITS && orbit.tail(index) > TAIL {
                self.splits.push(of.start_s + 0.5 * of.duration_s);
            }
        }
        self.splits.sort_by(f64::total_cmp);
        self.splits.len() > known
    }
}

impl CutOrbit {
    /// Share of the inputs of a subinterval in its two highest Legendre polynomials, of the largest over the revolution.
    fn tail(&self, subinterval: usize) -> f64 {
        let (inputs, nodes) = (self.ports.inputs(), self.mesh.nodes());
        let all = &self.forces.inputs;
        let mut most: f64 = 0.0;
        for input in 0..inputs {
            let size = all
                .iter()
                .skip(input)
                .step_by(inputs)
                .fold(0.0_f64, |most, x| most.max(x.abs()));
            if size == 0.0 {
                continue;
            }
            let of = |node: usize| all[(subinterval * nodes + node) * inputs + input];
            for degree in [nodes - 2, nodes - 1] {
                let sum: f64 = (0..nodes)
                    .map(|node| {
                        let gauss = self.mesh.gauss;
                        gauss.weights[node] * legendre(degree, 2.0 * gauss.nodes[node] - 1.0) * of(node)
                    })
                    .sum();
                most = most.max((2 * degree + 1) as f64 * sum.abs() / size);
            }
        }
        most
    }
}

/// Motion of the structure under the cutting force of a tool that does not move.
fn rigid(model: &CutModel, ports: &Ports, mesh: &Mesh, rest: &Motion) -> Option<Motion> {
    let period = Period {
        model,
        ports,
        mesh,
        motion: rest,
    };
    let forces = period.forces();
    let mut inputs = vec![0.0; forces.inputs.len()];
    for (inputs, cutting_n) in inputs.chunks_exact_mut(ports.inputs()).zip(&forces.cutting_n) {
        for (input, axis) in inputs.iter_mut().zip(&ports.axes) {
            *input = cutting_n[*axis];
        }
    }
    Some(Motion {
        values: Response::new(mesh, ports)?.outputs(&inputs),
        per_point: ports.outputs(),
    })
}

fn legendre(degree: usize, x: f64) -> f64 {
    let (mut before, mut value) = (0.0, 1.0);
    for k in 0..degree {
        let k = k as f64;
        (before, value) = (value, ((2.0 * k + 1.0) * x * value - k * before) / (k + 1.0));
    }
    value
}
