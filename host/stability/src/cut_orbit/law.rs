//! Forces on the tool at one instant, and their derivatives with respect to its motion.

use nalgebra::{DMatrix, Matrix3, Vector3};

use quietcut_model::cutter::Immersion;
use quietcut_model::{MotionState, Tooth};

use super::mesh::Contact;
use super::model::{CutModel, Ports};

/// Step of a difference of a restoring force, as a share of the size of each output: the error of a central difference
/// is this squared times the curvature, and rounding over this.
const DIFFERENCE: f64 = 1e-6;

/// Displacement of the tool along x, y, z, m, at an instant of the revolution, s.
pub(super) type Path<'a> = dyn Fn(f64) -> [f64; 3] + 'a;

/// Instant at which forces are evaluated.
pub(super) struct Instant<'a> {
    pub(super) time_s: f64,
    pub(super) contact: &'a Contact,
    /// Outputs of the structure at this instant.
    pub(super) outputs: &'a [f64],
    /// The motion at earlier instants.
    pub(super) path: &'a Path<'a>,
}

/// Forces at one instant.
#[derive(Clone, Debug)]
pub(super) struct Forces {
    /// Cutting force on the tool along x, y, z, N.
    pub(super) cutting_n: [f64; 3],
    /// Inputs of the structure.
    pub(super) inputs: Vec<f64>,
}

/// Derivatives of the forces at one instant.
pub(super) struct Slopes {
    /// Cutting force by outputs at the same instant, 3 × outputs.
    pub(super) cutting: DMatrix<f64>,
    /// Inputs by outputs at the same instant, through the restoring forces only.
    pub(super) inputs: DMatrix<f64>,
    /// Inputs by cutting force, inputs × 3.
    pub(super) by_cutting: DMatrix<f64>,
    /// Cutting force by the displacement at earlier instants, N/m.
    pub(super) earlier: Vec<(f64, Matrix3<f64>)>,
}

/// What a restoring force sees at an instant.
pub(super) struct RegimeView {
    pub(super) state: MotionState,
    /// Internal states of the force.
    pub(super) own: Vec<f64>,
    /// Force that holds, or would hold, the axis of the force at rest, N.
    pub(super) would_hold_n: f64,
    /// Negative where the regime ends.
    pub(super) margin: f64,
}

/// A tooth in front of a surface that another tooth has cut.
struct Passing<'a> {
    at: Immersion,
    tooth: &'a Tooth,
    before: &'a Tooth,
    /// Time at which the surface was cut, s.
    earlier_s: f64,
    feed_m: f64,
}

impl CutModel {
    /// The tooth `index` in front of the surface that was cut `passings` tooth passings before.
    fn passing(&self, index: usize, passings: usize, time_s: f64) -> Passing<'_> {
        let tooth = &self.cutter.teeth[index];
        let (mut before, mut pitch_rad, mut feed_m) = (tooth, 0.0, 0.0);
        for _ in 0..passings {
            pitch_rad += before.pitch_rad;
            feed_m += before.feed_m;
            before = &self.cutter.teeth[before.ahead];
        }
        Passing {
            at: self.cutter.immersion(self.rad_per_s * time_s + tooth.angle_rad),
            tooth,
            before,
            earlier_s: time_s - pitch_rad / self.rad_per_s,
            feed_m,
        }
    }

    /// Distance of the edge of a tooth from the surface that was cut `passings` tooth passings before, m:
    /// n·(u(t) − u(t − τ)) + (r_j − r_{j+m}) sin γ + f sin φ sin γ, with τ and f the sums of delays and feeds of these
    /// passings.
    pub(super) fn gap_m(
        &self,
        index: usize,
        passings: usize,
        time_s: f64,
        x: [f64; 3],
        path: &Path<'_>,
    ) -> f64 {
        let passing = self.passing(index, passings, time_s);
        // The surface of a whole revolution ago is that of the same motion: see `passing_slope`.
        let past = if passings == self.cutter.teeth.len() {
            x
        } else {
            path(passing.earlier_s)
        };
        self.cutter.reach_m(passing.tooth, passing.at, x)
            - self.cutter.reach_m(passing.before, passing.at, past)
            + self.cutter.recession_m(passing.at, passing.feed_m)
    }

    /// Gradient n of the gap with respect to the displacement of the tool; −n is that with respect to the earlier
    /// displacement.
    pub(super) fn normal(&self, index: usize, time_s: f64) -> Vector3<f64> {
        let passing = self.passing(index, 1, time_s);
        let reach = |x| self.cutter.reach_m(passing.tooth, passing.at, x);
        let rest = reach([0.0; 3]);
        Vector3::from_fn(|axis, _| {
            let mut unit = [0.0; 3];
            unit[axis] = 1.0;
            reach(unit) - rest
        })
    }

    /// Time at which the surface of `passings` tooth passings before was cut, s; `None` for a whole revolution, where
    /// the motion is the same.
    pub(super) fn earlier_s(&self, index: usize, passings: usize, time_s: f64) -> Option<f64> {
        (passings < self.cutter.teeth.len()).then(|| self.passing(index, passings, time_s).earlier_s)
    }

    fn speed_m_per_s(&self) -> f64 {
        self.cutter.radius_m.unwrap_or(f64::INFINITY) * self.rad_per_s
    }

    fn damping(&self, index: usize, time_s: f64, depth_m: f64) -> Option<Matrix3<f64>> {
        self.cutter.force.process_damping?;
        let at = self.passing(index, 1, time_s).at;
        let damping = self
            .cutter
            .force
            .damping_ns_per_m(at, depth_m, self.speed_m_per_s());
        Some(Matrix3::from_fn(|i, j| damping[i][j]))
    }

    /// Cutting force of all teeth in contact, N.
    fn cutting_n(&self, ports: &Ports, at: &Instant<'_>) -> Vector3<f64> {
        let x = ports.displacement(at.outputs);
        let v = Vector3::from(ports.velocity(at.outputs));
        let depth_m = self.cutter.depth_at_m(self.cutter.depth_m, x[2]);
        let mut sum = Vector3::zeros();
        for engaged in &at.contact.teeth {
            let Some(passings) = engaged.passings else {
                continue;
            };
            let thickness_m = self.gap_m(engaged.tooth, passings, at.time_s, x, at.path);
            let immersion = self.passing(engaged.tooth, passings, at.time_s).at;
            sum += Vector3::from(self.cutter.force.force_n(immersion, thickness_m, depth_m));
            if let Some(damping) = self.damping(engaged.tooth, at.time_s, depth_m) {
                sum -= damping * v;
            }
        }
        sum * self.cutter.force.wear(self.time_s)
    }

    /// Forces at one instant.
    pub(super) fn forces(&self, ports: &Ports, at: &Instant<'_>) -> Forces {
        let cutting = self.cutting_n(ports, at);
        Forces {
            cutting_n: cutting.into(),
            inputs: self.inputs(ports, at, cutting),
        }
    }

    /// Inputs of the structure under a cutting force, N: the restoring forces are subtracted, and an axis that is held
    /// has no acceleration.
    fn inputs(&self, ports: &Ports, at: &Instant<'_>, cutting_n: Vector3<f64>) -> Vec<f64> {
        self.inputs_of(ports, at, cutting_n, None)
    }

    /// [`Self::inputs`] without the restoring force `left_out`.
    fn inputs_of(
        &self,
        ports: &Ports,
        at: &Instant<'_>,
        cutting_n: Vector3<f64>,
        left_out: Option<usize>,
    ) -> Vec<f64> {
        let mut inputs: Vec<f64> = ports.axes.iter().map(|axis| cutting_n[*axis]).collect();
        let state = MotionState {
            t: self.time_s,
            x: ports.displacement(at.outputs),
            v: ports.velocity(at.outputs),
        };
        let own = ports.own(at.outputs);
        let mut place = 0;
        let mut held = Vec::new();
        let mut rates = vec![0.0; ports.internal];
        for (index, force) in self.restoring_forces.iter().enumerate() {
            let states = place..place + force.states();
            place = states.end;
            // A force that is added to an orbit has the regime that the motion gives it.
            let known = at.contact.regimes.get(index).copied();
            let regime = known.unwrap_or_else(|| force.next(None, &state, &own[states.clone()], 0.0));
            force.rate(regime, &state, &own[states.clone()], &mut rates[states.clone()]);
            if left_out == Some(index) {
                continue;
            }
            if force.locked(regime) {
                held.extend(
                    force
                        .holds()
                        .and_then(|axis| ports.axes.iter().position(|other| *other == axis)),
                );
                continue;
            }
            let restoring = force.restoring_n(regime, &state, &own[states]);
            for (input, axis) in inputs.iter_mut().zip(&ports.axes) {
                *input -= restoring[*axis];
            }
        }
        self.hold(ports, at, &held, &mut inputs);
        inputs.extend(
            rates
                .iter()
                .zip(own)
                .map(|(rate, own)| rate + ports.forgetting * own),
        );
        inputs
    }

    /// Adds the forces that keep the axes `held` (positions among the moving ones) without acceleration.
    fn hold(&self, ports: &Ports, at: &Instant<'_>, held: &[usize], inputs: &mut [f64]) {
        let (Some(first), Some(per_force)) = (ports.accelerations, &ports.acceleration_per_force) else {
            return;
        };
        if held.is_empty() {
            return;
        }
        let count = ports.axes.len();
        let mobility = DMatrix::from_fn(held.len(), held.len(), |i, j| per_force[(held[i], held[j])]);
        let free = nalgebra::DVector::from_fn(held.len(), |i, _| {
            let by_forces: f64 = (0..count).map(|j| per_force[(held[i], j)] * inputs[j]).sum();
            at.outputs[first + held[i]] + by_forces
        });
        if let Some(holding) = mobility.lu().solve(&free) {
            for (axis, holding) in held.iter().zip(&holding) {
                inputs[*axis] -= holding;
            }
        }
    }

    /// What the restoring force `index` sees, in the regime that the contact of the instant gives it.
    pub(super) fn regime_view(&self, ports: &Ports, at: &Instant<'_>, index: usize) -> RegimeView {
        let force = &self.restoring_forces[index];
        let regime = at.contact.regimes[index];
        let first: usize = self.restoring_forces[..index]
            .iter()
            .map(|force| force.states())
            .sum();
        let own = ports.own(at.outputs)[first..first + force.states()].to_vec();
        let state = MotionState {
            t: self.time_s,
            x: ports.displacement(at.outputs),
            v: ports.velocity(at.outputs),
        };
        let would_hold_n = self.would_hold_n(ports, at, index);
        let holding_n = if force.locked(regime) { would_hold_n } else { 0.0 };
        RegimeView {
            margin: force.margin(regime, &state, &own, holding_n),
            state,
            own,
            would_hold_n,
        }
    }

    /// Force f_r, N, by which the restoring force `index` keeps, or would keep, its axis at rest; 0 if it cannot.
    fn would_hold_n(&self, ports: &Ports, at: &Instant<'_>, index: usize) -> f64 {
        let held = self.restoring_forces[index]
            .holds()
            .and_then(|axis| ports.axes.iter().position(|other| *other == axis));
        let (Some(held), Some(first), Some(per_force)) =
            (held, ports.accelerations, &ports.acceleration_per_force)
        else {
            return 0.0;
        };
        let free = self.inputs_of(ports, at, self.cutting_n(ports, at), Some(index));
        let by_forces: f64 = (0..ports.axes.len())
            .map(|axis| per_force[(held, axis)] * free[axis])
            .sum();
        (at.outputs[first + held] + by_forces) / per_force[(held, held)]
    }

    /// Derivatives of [`Self::forces`]; `sizes` are the sizes of the outputs over the revolution.
    pub(super) fn slopes(&self, ports: &Ports, at: &Instant<'_>, sizes: &[f64]) -> Slopes {
        let (outputs, inputs) = (ports.outputs(), ports.inputs());
        let (cutting, earlier) = self.cutting_slopes(ports, at);
        let mut of_inputs = DMatrix::zeros(inputs, outputs);
        let mut by_cutting = DMatrix::zeros(inputs, 3);
        for (index, axis) in ports.axes.iter().enumerate() {
            by_cutting[(index, *axis)] = 1.0;
        }
        if !self.restoring_forces.is_empty() {
            let force = self.cutting_n(ports, at);
            let difference = |moved: &dyn Fn(f64) -> Vec<f64>, step: f64| {
                let (plus, minus) = (moved(step), moved(-step));
                nalgebra::DVector::from_fn(inputs, |i, _| (plus[i] - minus[i]) / (2.0 * step))
            };
            for output in 0..outputs {
                let step = DIFFERENCE * sizes[output].max(f64::MIN_POSITIVE.sqrt());
                let moved = |step: f64| {
                    let mut moved = at.outputs.to_vec();
                    moved[output] += step;
                    self.inputs(
                        ports,
                        &Instant {
                            outputs: &moved,
                            ..*at
                        },
                        force,
                    )
                };
                of_inputs.set_column(output, &difference(&moved, step));
            }
            for axis in 0..3 {
                // Linear in the cutting force.
                let moved = |step: f64| {
                    let mut moved = force;
                    moved[axis] += step;
                    self.inputs(ports, at, moved)
                };
                by_cutting.set_column(axis, &difference(&moved, force.norm().max(1.0)));
            }
        }
        Slopes {
            cutting,
            inputs: of_inputs,
            by_cutting,
            earlier,
        }
    }

    fn cutting_slopes(&self, ports: &Ports, at: &Instant<'_>) -> (DMatrix<f64>, Vec<(f64, Matrix3<f64>)>) {
        let x = ports.displacement(at.outputs);
        let v = Vector3::from(ports.velocity(at.outputs));
        let cutter = &self.cutter;
        let depth_m = cutter.depth_at_m(cutter.depth_m, x[2]);
        let follows_depth = cutter.axial_depth_modulation && depth_m > 0.0;
        let wear = cutter.force.wear(self.time_s);
        let mut by_x = Matrix3::<f64>::zeros();
        let mut by_v = Matrix3::<f64>::zeros();
        let mut earlier = Vec::new();
        for engaged in &at.contact.teeth {
            let Some(passings) = engaged.passings else {
                continue;
            };
            let immersion = self.passing(engaged.tooth, passings, at.time_s).at;
            let thickness_m = self.gap_m(engaged.tooth, passings, at.time_s, x, at.path);
            let normal = self.normal(engaged.tooth, at.time_s);
            let slope = wear * Vector3::from(cutter.force.slope_n_per_m(immersion, thickness_m, depth_m));
            let by_gap = slope * normal.transpose();
            if let Some(earlier_s) = self.earlier_s(engaged.tooth, passings, at.time_s) {
                by_x += by_gap;
                earlier.push((earlier_s, -by_gap));
            }
            if let Some(damping) = self.damping(engaged.tooth, at.time_s, depth_m) {
                by_v -= wear * damping;
            }
            if follows_depth {
                let per_depth = Vector3::from(cutter.force.force_n(immersion, thickness_m, 1.0));
                let damped = self
                    .damping(engaged.tooth, at.time_s, 1.0)
                    .map_or_else(Vector3::zeros, |damping| damping * v);
                let mut column = by_x.column_mut(2);
                column -= wear * (per_depth - damped);
            }
        }
        let mut by_outputs = DMatrix::zeros(3, ports.outputs());
        for (index, axis) in ports.axes.iter().enumerate() {
            by_outputs.column_mut(index).copy_from(&by_x.column(*axis));
            let velocity = ports.axes.len() + index;
            by_outputs.column_mut(velocity).copy_from(&by_v.column(*axis));
        }
        (by_outputs, earlier)
    }
}
