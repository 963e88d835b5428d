//! Virtual cuts: the delay equations of milling integrated in time, and the sensors that hear them.
//!
//! The equations are those of thesis chapters 3 and 6 without any smoothing: teeth enter and leave exactly at their
//! angles, a chip is as thick as the surface left by *all* earlier passes leaves it (eqs 6.20 to 6.27), and a tooth
//! off the surface feels no force.

mod contact;
mod crossing;
mod cutter;
mod dormand_prince;
mod dynamics;
mod effect;
mod error;
mod integrator;
mod passage;
mod record;
mod sensor;
mod spindle;
mod surface;
mod virtual_cut;

#[cfg(test)]
mod tests;

pub use cutter::{Cutter, Tooth};
pub use dynamics::Dynamics;
pub use effect::{Effect, EffectError};
pub use error::SimulateError;
pub use integrator::{Motion, Room, Segment, Statistics};
pub use passage::Passage;
pub use record::Recorder;
pub use sensor::{Accelerometer, Sampler, TachometerModel};
pub use spindle::Spindle;
pub use virtual_cut::{Entry, Heard, VirtualCut, VirtualCutError};

use contact::Contact;
use integrator::Integrator;

/// A machine, and what happens to it.
pub struct Model {
    /// The structure.
    pub dynamics: Dynamics,
    /// The cut; `None` where no tool turns.
    pub cutting: Option<Cutting>,
    /// A force from outside, besides that of the cut.
    pub drive: Option<Box<dyn Drive>>,
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

    /// The first time after `t` at which the force or one of its lower derivatives jumps.
    fn next_knot_s(&self, _t: f64) -> f64 {
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
}

impl Default for Settings {
    /// A millionth of a micrometer, a hundred-millionth of the amplitude; a tool does not move by 0.1 m.
    fn default() -> Self {
        Self {
            absolute_m: 1e-12,
            relative: 1e-8,
            largest_m: 0.1,
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
        self.run_from(vec![0.0; self.dynamics.order()], end_s, settings, observe)
    }

    /// As [`Self::run`], from the states `y` of [`Dynamics`]; before t = 0 the tool was at rest.
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

    /// `within` are the ends of the smooth stretch that `t` belongs to: a drive may jump at either.
    fn force_n(&self, contact: Option<&Contact<'_>>, within: [f64; 2], t: f64, x: [f64; 3]) -> [f64; 3] {
        let mut force = contact.map_or([0.0; 3], |contact| contact.force_n(t, x));
        if let Some(drive) = &self.drive {
            for (force, driven) in force.iter_mut().zip(drive.force_n(t.clamp(within[0], within[1]))) {
                *force += driven;
            }
        }
        force
    }

    fn rate(&self, contact: Option<&Contact<'_>>, within: [f64; 2], t: f64, y: &[f64], rate: &mut [f64]) {
        let force = self.force_n(contact, within, t, self.dynamics.displacement(y));
        self.dynamics.rate(y, force, rate);
    }
}
