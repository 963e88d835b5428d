//! Virtual cuts: the delay equations of milling integrated in time, and the sensors that hear them.
//!
//! The equations are those of thesis chapters 3 and 6 without any smoothing: teeth enter and leave exactly at their
//! angles, a chip is as thick as the surface left by *all* earlier passes leaves it (eqs 6.20 to 6.27), and a tooth
//! off the surface feels no force.

mod anti_aliasing;
mod contact;
mod error;
mod integrator;
mod passage;
mod pores;
mod reading;
mod record;
pub mod rig;
mod sensor;
mod surface;
mod virtual_cut;

#[cfg(test)]
pub(crate) mod tests;

pub use quietcut_model::effects::{self as effect, Effect, EffectError, Effects};
pub use quietcut_model::{
    At, Branch, ChipLaw, Cutter, Dynamics, Fluctuation, ForceLaw, Immersion, ModelError, ProcessDamping,
    Slopes, Spindle, Term, Tooth, path,
};

pub use error::SimulateError;
pub use integrator::{Motion, Room, Segment, Statistics};
pub use passage::Passage;
pub use pores::Pores;
pub use reading::Reading;
pub use record::Recorder;
pub use sensor::{Accelerometer, STANDARD_GRAVITY, Sampler, TachometerModel};
pub use virtual_cut::{Entry, Heard, VirtualCut, VirtualCutError};

use nalgebra::{Matrix3, Vector3};

use contact::Contact;
use integrator::Integrator;
use quietcut_model::term::{self, Branches};

/// A machine, and what happens to it.
pub struct Model {
    /// The structure.
    pub dynamics: Dynamics,
    /// The cut; `None` where no tool turns.
    pub cutting: Option<Cutting>,
    /// A force from outside, besides that of the cut.
    pub drive: Option<Box<dyn Drive>>,
    /// What the equation of motion has besides the structure.
    pub terms: Vec<Box<dyn Term>>,
}

/// A turning tool on its way through a workpiece.
#[derive(Clone, Debug)]
pub struct Cutting {
    /// The tool.
    pub cutter: Cutter,
    /// How it turns.
    pub spindle: Spindle,
    /// How it comes into the workpiece and out.
    pub passage: Passage,
    /// What a tooth finds in front of it.
    pub regeneration: Regeneration,
    /// Pores of the material; `None` where it is solid.
    pub pores: Option<Pores>,
}

/// Which earlier vibration a chip feels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Regeneration {
    /// That of all earlier passes: the surface is what they left, and a tooth that does not reach it feels no force.
    AllPasses,
    /// That of the last pass alone, and a chip of negative thickness pulls: the linear model of stability charts.
    LastPass,
    /// None, nor that of the tooth itself: the chip is that of the feed (and of runout), and the motion is the forced one
    /// that every stable cut comes to.
    None,
}

/// A force from outside on the tool: a shaker.
pub trait Drive: Send + Sync {
    /// The force at `t`, N, in the machine's x, y, z. It is never asked for within a billionth of a step of a knot.
    fn force_n(&self, t: f64) -> [f64; 3];

    /// How much less the force is per velocity of the tool, N s/m: a shaker's armature generates a voltage against its
    /// drive as it moves, so that the force drops where the structure resonates.
    fn drop_ns_per_m(&self) -> [f64; 3] {
        [0.0; 3]
    }

    /// The first time after `t` at which the force or one of its lower derivatives jumps.
    fn next_knot_s(&self, _t: f64) -> f64 {
        f64::INFINITY
    }

    /// The longest step in which the force is not missed: nothing else shortens steps while friction holds the tool.
    fn longest_step_s(&self) -> f64 {
        f64::INFINITY
    }
}

/// How exactly to integrate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Error allowed per step, m.
    pub absolute_m: f64,
    /// Error allowed per step, as a share of the amplitude of the motion.
    pub relative: f64,
    /// A displacement beyond this ends the run as diverged, m.
    pub largest_m: f64,
    /// More steps than this end the run: of equations that are too stiff to be worth it.
    pub steps_max: u64,
}

impl Default for Settings {
    /// A millionth of a micrometer, a hundred-millionth of the amplitude; a tool does not move by 0.1 m.
    fn default() -> Self {
        Self {
            absolute_m: 1e-12,
            relative: 1e-8,
            largest_m: 0.1,
            steps_max: u64::MAX,
        }
    }
}

impl Model {
    /// Integrates from t = 0, the structure at rest, to `end_s`; `observe` sees every stretch of the motion in order.
    ///
    /// The error per step is controlled (see [`Settings`]); steps end exactly where a tooth enters, leaves, loses or
    /// finds contact, and where the surface in front of a tooth has a kink from one of these.
    ///
    /// # Errors
    /// The motion diverges; a tooth neither cuts nor leaves the surface; the size of the tool is needed and unknown.
    pub fn run(
        &self,
        end_s: f64,
        settings: Settings,
        observe: impl FnMut(&Segment<'_>),
    ) -> Result<Statistics, SimulateError> {
        self.run_from(vec![0.0; self.order()], end_s, settings, observe)
    }

    /// Number of states: those of [`Dynamics`], and behind them those of the terms in their order.
    pub fn order(&self) -> usize {
        self.dynamics.order() + term::states(&self.terms)
    }

    /// As [`Self::run`], from the states `y` (see [`Self::order`]); before t = 0 the tool was at rest.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn run_from(
        &self,
        y: Vec<f64>,
        end_s: f64,
        settings: Settings,
        observe: impl FnMut(&Segment<'_>),
    ) -> Result<Statistics, SimulateError> {
        if let Some(cutting) = &self.cutting
            && matches!(cutting.passage, Passage::Feed { .. })
            && cutting.cutter.radius_m.is_none()
        {
            return Err(SimulateError::NoDiameter);
        }
        Integrator::new(self, settings, y).run(end_s, observe)
    }

    /// Force on the tool from cut and drive, N.
    fn force_n(&self, stretch: Stretch<'_>, t: f64, x: [f64; 3], y: &[f64]) -> [f64; 3] {
        let mut force = stretch.contact.map_or([0.0; 3], |contact| contact.force_n(t, x));
        if let Some(drive) = &self.drive {
            let driven = drive.force_n(t.clamp(stretch.within[0], stretch.within[1]));
            for (force, driven) in force.iter_mut().zip(driven) {
                *force += driven;
            }
            let drop = drive.drop_ns_per_m();
            if drop != [0.0; 3] {
                let v = self
                    .dynamics
                    .velocity_under(&y[..self.dynamics.order()], [0.0; 3]);
                for axis in 0..3 {
                    force[axis] -= drop[axis] * v[axis];
                }
            }
        }
        match stretch.contact.and_then(|contact| contact.damping_ns_per_m(t, x)) {
            Some(damping) => self.damped_n(force, damping, y),
            None => force,
        }
    }

    /// F with F = `force` − D v, v = C A x + C B F: where the velocity feels the force itself, both are solved for.
    fn damped_n(&self, force: [f64; 3], damping: [[f64; 3]; 3], y: &[f64]) -> [f64; 3] {
        let v = Vector3::from(
            self.dynamics
                .velocity_under(&y[..self.dynamics.order()], [0.0; 3]),
        );
        let damping = Matrix3::from_fn(|i, j| damping[i][j]);
        let jump = self.dynamics.velocity_per_force();
        let jump = Matrix3::from_fn(|i, j| jump[i][j]);
        let free = Vector3::from(force) - damping * v;
        // Damping over a tool without inertia is small beside 1: the matrix is regular.
        (Matrix3::identity() + damping * jump)
            .lu()
            .solve(&free)
            .unwrap_or(free)
            .into()
    }

    /// ẏ at `t` with the tool at `x`; the force on the tool from cut and drive, N.
    fn rate(&self, stretch: Stretch<'_>, (t, x): (f64, [f64; 3]), y: &[f64], rate: &mut [f64]) -> [f64; 3] {
        let force = self.force_n(stretch, t, x, y);
        if self.terms.is_empty() {
            self.dynamics.rate(y, force, rate);
        } else {
            term::rate(
                &self.dynamics,
                &self.terms,
                stretch.branches,
                (t, x),
                force,
                y,
                rate,
            );
        }
        force
    }
}

/// What holds on a smooth stretch of the motion.
#[derive(Clone, Copy)]
struct Stretch<'a> {
    contact: Option<&'a Contact<'a>>,
    /// The ends of the stretch, shortened by rounding: a drive may jump at either.
    within: [f64; 2],
    branches: Branches<'a>,
}
