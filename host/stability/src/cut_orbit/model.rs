//! The machine in a cut at constant spindle speed: structure, restoring forces, tool.

use nalgebra::DMatrix;

use crate::criteria::VELOCITY_JUMP;
use quietcut_model::structure::FirstOrder;
use quietcut_model::{Cutter, RestoringForce};

/// A structure under the cutting force at constant spindle speed:
///
///   ẋ = A x + B (F − f_r),   u = C x,
///
/// with the cutting force F of all teeth on the tool and the restoring forces f_r. Forces and displacements are along
/// the machine's axes. Tooth j is at the immersion angle Ωt + ψ_j.
#[derive(Debug)]
pub struct CutModel {
    /// Linear structure.
    pub structure: FirstOrder,
    /// Restoring forces besides those of the linear structure: nonlinear springs and dampers, friction, backlash,
    /// hysteresis.
    pub restoring_forces: Vec<Box<dyn RestoringForce>>,
    /// Teeth, engagement and force law.
    pub cutter: Cutter,
    /// Spindle speed Ω, rad/s.
    pub rad_per_s: f64,
    /// Time, s, at which what changes slowly (wear, drift) is taken as constant.
    pub time_s: f64,
}

impl CutModel {
    /// Duration of a revolution, s.
    pub fn revolution_s(&self) -> f64 {
        std::f64::consts::TAU / self.rad_per_s
    }

    /// The machine's axes along which the tool moves.
    pub(super) fn axes(&self) -> Vec<usize> {
        let moves = |axis: &usize| self.structure.c.row(*axis).iter().any(|entry| *entry != 0.0);
        (0..3).filter(moves).collect()
    }

    /// Number of internal states of the restoring forces.
    pub(super) fn internal_states(&self) -> usize {
        quietcut_model::restoring_force::states(&self.restoring_forces)
    }

    /// True if a restoring force may hold the tool at rest along an axis.
    pub(super) fn may_hold(&self) -> bool {
        self.restoring_forces.iter().any(|force| force.holds().is_some())
    }

    /// Linear system of the tool and the internal states of the restoring forces.
    pub(super) fn ports(&self) -> Ports {
        self.ports_with(self.may_hold())
    }

    /// [`Self::ports`], with the accelerations that a hold needs only if `may_hold`.
    pub(super) fn ports_with(&self, may_hold: bool) -> Ports {
        let axes = self.axes();
        let (order, internal) = (self.structure.order(), self.internal_states());
        let (size, inputs) = (order + internal, axes.len() + internal);
        let mut a = DMatrix::zeros(size, size);
        a.view_mut((0, 0), (order, order)).copy_from(&self.structure.a);
        let mut b = DMatrix::zeros(size, inputs);
        let mut c = DMatrix::zeros(axes.len(), size);
        for (index, axis) in axes.iter().enumerate() {
            b.view_mut((0, index), (order, 1))
                .copy_from(&self.structure.b.column(*axis));
            c.view_mut((index, 0), (1, order))
                .copy_from(&self.structure.c.row(*axis));
        }
        // ż = g is written as ż = −z/T + (g + z/T): without the first term the periodic response has no inverse.
        let forgetting = 1.0 / self.revolution_s();
        for state in 0..internal {
            a[(order + state, order + state)] = -forgetting;
            b[(order + state, axes.len() + state)] = 1.0;
        }
        let ca = &c * &a;
        let count = axes.len();
        // Rounding of C B of a structure with mass is no jump of the velocity.
        let rounding = VELOCITY_JUMP * c.amax() * b.amax() * size as f64;
        let jumps = (&c * &b).map(|entry| if entry.abs() > rounding { entry } else { 0.0 });
        let acceleration_per_force = may_hold.then(|| &ca * &b);
        let mut of_states = DMatrix::zeros(internal, size);
        of_states
            .view_mut((0, order), (internal, internal))
            .fill_diagonal(1.0);
        let mut parts = vec![(c, DMatrix::zeros(count, inputs))];
        parts.push((ca.clone(), jumps));
        if may_hold {
            parts.push((&ca * &a, DMatrix::zeros(count, inputs)));
        }
        parts.push((of_states, DMatrix::zeros(internal, inputs)));
        let outputs = parts.iter().map(|(rows, _)| rows.nrows()).sum();
        let (mut output, mut direct) = (DMatrix::zeros(outputs, size), DMatrix::zeros(outputs, inputs));
        let mut first = 0;
        for (rows, at_once) in &parts {
            output.rows_mut(first, rows.nrows()).copy_from(rows);
            direct.rows_mut(first, rows.nrows()).copy_from(at_once);
            first += rows.nrows();
        }
        Ports {
            a,
            b,
            output,
            direct,
            accelerations: may_hold.then_some(2 * count),
            states: outputs - internal,
            internal,
            forgetting,
            acceleration_per_force,
            axes,
        }
    }
}

/// Linear system ẋ = A x + B f, y = C x + D f of a [`CutModel`], extended by the internal states z of its restoring
/// forces.
///
/// Inputs f: the force on the tool along the moving axes, and ż + z/T for each internal state. Outputs y: displacements
/// and velocities along the moving axes; where something can hold the tool, accelerations without those that forces
/// cause at once; then the internal states.
#[derive(Clone, Debug)]
pub(super) struct Ports {
    /// A, 1/s.
    pub(super) a: DMatrix<f64>,
    /// B.
    pub(super) b: DMatrix<f64>,
    /// C.
    pub(super) output: DMatrix<f64>,
    /// D: what an input changes at once in an output.
    pub(super) direct: DMatrix<f64>,
    /// The machine's axes along which the tool moves.
    pub(super) axes: Vec<usize>,
    /// First output of the accelerations; `None` if nothing can hold the tool.
    pub(super) accelerations: Option<usize>,
    /// First output of the internal states.
    pub(super) states: usize,
    /// Number of internal states.
    pub(super) internal: usize,
    /// 1/T of the internal states, 1/s.
    pub(super) forgetting: f64,
    /// C A B: acceleration along the moving axes per input; `None` if nothing can hold the tool.
    pub(super) acceleration_per_force: Option<DMatrix<f64>>,
}

impl Ports {
    pub(super) fn inputs(&self) -> usize {
        self.b.ncols()
    }

    pub(super) fn outputs(&self) -> usize {
        self.output.nrows()
    }

    /// Displacement of the tool along x, y, z, m, from the outputs.
    pub(super) fn displacement(&self, outputs: &[f64]) -> [f64; 3] {
        self.along_axes(&outputs[..self.axes.len()])
    }

    /// Velocity of the tool along x, y, z, m/s, from the outputs.
    pub(super) fn velocity(&self, outputs: &[f64]) -> [f64; 3] {
        let count = self.axes.len();
        self.along_axes(&outputs[count..2 * count])
    }

    /// Internal states from the outputs.
    pub(super) fn own<'a>(&self, outputs: &'a [f64]) -> &'a [f64] {
        &outputs[self.states..]
    }

    fn along_axes(&self, values: &[f64]) -> [f64; 3] {
        let mut all = [0.0; 3];
        for (axis, value) in self.axes.iter().zip(values) {
            all[*axis] = *value;
        }
        all
    }
}
