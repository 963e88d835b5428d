//! A smooth stretch of the motion, and the tool within it.

use super::model::{Model, Stretch};
use quietcut_model::Dynamics;
use quietcut_numerics::dormand_prince::{Quartic, at};

/// A stretch of the motion, to be read while it is the newest one.
pub struct Segment<'a> {
    pub(super) model: &'a Model,
    pub(super) stretch: Stretch<'a>,
    pub(super) quartics: &'a [Quartic],
    pub(super) displacement: &'a [Quartic; 3],
    pub(super) from_s: f64,
    pub(super) to_s: f64,
}

/// The tool at one instant, in the machine's x, y, z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// m.
    pub displacement_m: [f64; 3],
    /// m/s.
    pub velocity_m_per_s: [f64; 3],
    /// m/s²; `None` where the structure has none at an instant, see [`super::Dynamics::velocity_jumps`].
    pub acceleration_m_per_s2: Option<[f64; 3]>,
    /// Force on the tool, N.
    pub force_n: [f64; 3],
}

/// Buffers in which a [`Motion`] is computed.
#[derive(Clone, Debug, Default)]
pub struct Workspace {
    pub(super) state: Vec<f64>,
    pub(super) rate: Vec<f64>,
    /// The equations as they are seen from where the modes have other shapes than at the tool.
    pub(super) seen: Option<Dynamics>,
}

impl Workspace {
    /// Buffers for the states of `model`.
    pub fn new(model: &Model) -> Self {
        let zeros = vec![0.0; model.order()];
        Self {
            state: zeros.clone(),
            rate: zeros,
            seen: None,
        }
    }

    /// Buffers for the motion that a sensor sees, where each mode of `model`'s structure has so many times its shape at the tool; with no
    /// modes said, the tool's.
    pub fn seeing(model: &Model, modes: &[f64]) -> Self {
        Self {
            seen: (!modes.is_empty()).then(|| model.dynamics.seen(modes)),
            ..Self::new(model)
        }
    }
}

impl Segment<'_> {
    /// Where it begins, s.
    pub fn from_s(&self) -> f64 {
        self.from_s
    }

    /// Where it ends, s.
    pub fn to_s(&self) -> f64 {
        self.to_s
    }

    /// The motion at `t` within the stretch.
    pub fn motion(&self, t: f64, workspace: &mut Workspace) -> Motion {
        let u = (t - self.from_s) / (self.to_s - self.from_s);
        for (state, quartic) in workspace.state.iter_mut().zip(self.quartics) {
            *state = at(quartic, u);
        }
        let displacement_m = std::array::from_fn(|axis| at(&self.displacement[axis], u));
        let force_n = self.model.rate(
            self.stretch,
            (t, displacement_m),
            &workspace.state,
            &mut workspace.rate,
        );
        let dynamics = workspace.seen.as_ref().unwrap_or(&self.model.dynamics);
        Motion {
            displacement_m: match &workspace.seen {
                Some(seen) => seen.displacement(&workspace.state),
                None => displacement_m,
            },
            velocity_m_per_s: dynamics.velocity(&workspace.rate),
            acceleration_m_per_s2: dynamics.acceleration(&workspace.rate),
            force_n,
        }
    }
}
