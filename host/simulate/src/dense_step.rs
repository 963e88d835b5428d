//! One integration step with dense output, and the motion of the tool within it.

use super::model::{Model, StepContext};
use quietcut_model::Dynamics;
use quietcut_numerics::dormand_prince::{Quartic, at};

/// The newest integration step: the motion of the tool at any instant between its two ends (dense output).
pub struct DenseStep<'a> {
    pub(super) model: &'a Model,
    pub(super) context: StepContext<'a>,
    pub(super) quartics: &'a [Quartic],
    pub(super) displacement: &'a [Quartic; 3],
    pub(super) from_s: f64,
    pub(super) to_s: f64,
}

/// Motion of the tool, or at a sensor away from the tool tip, and force on the tool at one instant, in the machine's x,
/// y, z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Displacement of the tool or at the sensor, m.
    pub displacement_m: [f64; 3],
    /// Velocity of the tool or at the sensor, m/s.
    pub velocity_m_per_s: [f64; 3],
    /// Acceleration of the tool or at the sensor, m/s²; `None` if a step of the force makes the velocity jump, see
    /// [`super::Dynamics::velocity_jumps`].
    pub acceleration_m_per_s2: Option<[f64; 3]>,
    /// Force on the tool, N: cutting force plus external excitation, without restoring forces.
    pub force_n: [f64; 3],
}

/// Buffers for the evaluation of a [`Motion`].
#[derive(Clone, Debug, Default)]
pub struct Workspace {
    pub(super) state: Vec<f64>,
    pub(super) rate: Vec<f64>,
    /// Equations of motion with the motion at a sensor away from the tool tip as output; `None` for a sensor at the
    /// tool.
    pub(super) sensor_dynamics: Option<Dynamics>,
}

impl Workspace {
    /// Buffers for the motion of the tool of `model`.
    pub fn new(model: &Model) -> Self {
        let zeros = vec![0.0; model.order()];
        Self {
            state: zeros.clone(),
            rate: zeros,
            sensor_dynamics: None,
        }
    }

    /// Buffers for the motion at a sensor: `modes[r]` is the shape of mode r at the sensor divided by its shape at the
    /// tool. An empty list means a sensor at the tool.
    pub fn at_sensor(model: &Model, modes: &[f64]) -> Self {
        Self {
            sensor_dynamics: (!modes.is_empty()).then(|| model.dynamics.at_sensor(modes)),
            ..Self::new(model)
        }
    }

    /// Equations of motion with the motion of the tool, or at the sensor, as output.
    pub(super) fn dynamics<'a>(&'a self, model: &'a Model) -> &'a Dynamics {
        self.sensor_dynamics.as_ref().unwrap_or(&model.dynamics)
    }
}

impl DenseStep<'_> {
    /// Start time of the integration step, s.
    pub fn from_s(&self) -> f64 {
        self.from_s
    }

    /// End time of the integration step, s.
    pub fn to_s(&self) -> f64 {
        self.to_s
    }

    /// The motion of the tool, or at the sensor of `workspace`, at the time `t`, s, within the integration step.
    pub fn motion(&self, t: f64, workspace: &mut Workspace) -> Motion {
        let u = (t - self.from_s) / (self.to_s - self.from_s);
        for (state, quartic) in workspace.state.iter_mut().zip(self.quartics) {
            *state = at(quartic, u);
        }
        let displacement_m = std::array::from_fn(|axis| at(&self.displacement[axis], u));
        let force_n = self.model.rate(
            self.context,
            (t, displacement_m),
            &workspace.state,
            &mut workspace.rate,
        );
        let dynamics = workspace.dynamics(self.model);
        Motion {
            displacement_m: match &workspace.sensor_dynamics {
                Some(sensor_dynamics) => sensor_dynamics.displacement(&workspace.state),
                None => displacement_m,
            },
            velocity_m_per_s: dynamics.velocity(&workspace.rate),
            acceleration_m_per_s2: dynamics.acceleration(&workspace.rate),
            force_n,
        }
    }
}
