//! A virtual cut: cutting conditions, model, and simulated sensor output.

use std::f64::consts::TAU;

use quietcut_core::acceleration::Block;
use quietcut_core::tachometer::Edge;

use super::Statistics;
use super::effect::{EffectError, EffectName, Effects};
use super::sensor::{Accelerometer, Sampler, TachometerModel};
use super::{
    Cutter, Cutting, Model, ModelError, Pores, Regeneration, Settings, SimulateError, Spindle,
    WorkpieceTraverse,
};
use quietcut_model::case::{Case, CaseError};
use quietcut_recording::Quantity;

/// A simulated cut of a case: spindle speed, axial depth, entry, duration and effects.
#[derive(Clone, Debug)]
pub struct VirtualCut {
    /// Spindle speed at the start of the virtual cut, rev/min.
    pub spindle_rpm: f64,
    /// Spindle speed at the end of a linear speed sweep, rev/min; `None` for a constant speed. The feed speed is
    /// constant and gives the feed per tooth of the case at the mean spindle speed.
    pub last_rpm: Option<f64>,
    /// Axial depth of cut, mm.
    pub depth_mm: f64,
    /// Duration of the simulation, s.
    pub seconds: f64,
    /// Entry of the tool into the workpiece, and its exit.
    pub entry: Entry,
    /// Duration of air cutting before and after the cut, s; not used with [`Entry::None`].
    pub air_s: f64,
    /// Pores of the workpiece material; `None` for solid material.
    pub pores: Option<Pores>,
    /// Effects that act after those of the extensions of the case.
    pub effects: Effects,
    /// Quantities that are recorded besides the tachometer, each along those of x, y and z that the structure has.
    pub measured: Vec<Quantity>,
}

/// Entry of the tool into the workpiece, and its exit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Entry {
    /// The virtual cut is in full engagement from its start to its end: no entry and no exit.
    None,
    /// The axial depth grows linearly at the start, and decreases linearly at the end.
    Ramp {
        /// Duration of the growth of the axial depth at the start, and of its decrease at the end, s.
        seconds: f64,
    },
    /// Through the faces of the workpiece: the immersion grows as the tool feeds in, and decreases as it feeds out.
    Feed,
}

/// A virtual cut that cannot be simulated.
#[derive(Debug, thiserror::Error)]
pub enum VirtualCutError {
    /// The case lacks a section.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// An effect with invalid parameters, or one that this case does not allow.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// The equation of motion cannot be assembled.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The simulation cannot be set up or cannot continue.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// A tachometer wheel whose shortest pitch period is below six sampling intervals.
    #[error(
        "a tachometer wheel with {positions} positions at {spindle_rpm} rev/min is too fine for {rate_hz:.0} samples per second: at least {needed_hz:.0} Hz are needed"
    )]
    WheelTooFine {
        /// Positions on the wheel.
        positions: u16,
        /// Spindle speed at the start of the cut, rev/min.
        spindle_rpm: f64,
        /// Sampling rate, Hz.
        rate_hz: f64,
        /// Smallest sampling rate that is not refused for this tachometer wheel, Hz.
        needed_hz: f64,
    },
    /// Wear that makes the cutting force negative within the duration of the virtual cut.
    #[error(
        "wear of {relative_rate_per_s} per s makes the cutting force negative within {seconds} s: a larger rate or a shorter time is needed"
    )]
    WornOut {
        /// Relative rate of wear, 1/s.
        relative_rate_per_s: f64,
        /// Duration of the cut, s.
        seconds: f64,
    },
    /// A virtual cut that is not longer than air, entry and exit together.
    #[error(
        "{seconds} s are too short: with {air_s} s of air at both ends, way in and way out take {needed_s:.2} s, so give more than that"
    )]
    TooShort {
        /// Duration of the cut, s.
        seconds: f64,
        /// Duration of air cutting before and after the cut, s.
        air_s: f64,
        /// Duration that the virtual cut must exceed, s.
        needed_s: f64,
    },
}

/// Output of accelerometer and tachometer in a virtual cut, and the statistics of its integration.
#[derive(Clone, Debug)]
pub struct SensedCut {
    /// Acceleration samples in blocks, as the sensor delivers them.
    pub blocks: Vec<Block>,
    /// Edges of the tachometer in the order of time.
    pub edges: Vec<Edge>,
    /// Numbers of integration steps and events.
    pub statistics: Statistics,
}

impl VirtualCut {
    /// A cut of `depth_mm` at constant speed that enters and leaves through the faces of the workpiece, with 0.2 s of
    /// air cutting at each end.
    pub fn new(spindle_rpm: f64, depth_mm: f64, seconds: f64) -> Self {
        Self {
            spindle_rpm,
            last_rpm: None,
            depth_mm,
            seconds,
            entry: Entry::Feed,
            air_s: 0.2,
            pores: None,
            effects: Effects::default(),
            measured: vec![Quantity::Force, Quantity::Displacement, Quantity::Acceleration],
        }
    }

    /// The equation of motion of this cut of `case`.
    ///
    /// # Errors
    /// The case lacks a section or has an extension that cannot be simulated, tool or structure is refused, an effect
    /// does not apply to the case, the duration is too short, wear makes the cutting force negative, or the tool
    /// diameter is required and missing.
    pub fn model(&self, case: &Case) -> Result<Model, VirtualCutError> {
        let effects = Effects::of_case(case)?.and(&self.effects);
        let mean_rpm = self.spindle_motion().speed_rad_per_s() * 60.0 / TAU;
        let cutter = Cutter::new(case.tool()?, case.material()?, case.cut()?, 1e-3 * self.depth_mm)?;
        let cutter = effects.cutter(cutter.at_speed(mean_rpm))?;
        if cutter.force.wear(self.seconds) < 0.0 {
            return Err(VirtualCutError::WornOut {
                relative_rate_per_s: cutter.force.wear_per_s,
                seconds: self.seconds,
            });
        }
        if self.pores.is_some() && cutter.radius_m.is_none() {
            return Err(SimulateError::NoDiameter.into());
        }
        let spindle = self.spindle(case)?;
        let traverse = self.traverse(&cutter, &spindle)?;
        let (dynamics, restoring_forces) = effects.dynamics(case.structure()?)?;
        if cutter.force.process_damping.is_some() && dynamics.velocity_jumps() && !restoring_forces.is_empty()
        {
            return Err(EffectError::Cut {
                name: EffectName::ProcessDamping.name(),
                what: "the modes of this structure add up to no mass, so that its velocity jumps with the force; the \
                       force of the flank is then not known beside added terms such as drift or cubic stiffness; use \
                       mass, damping and stiffness matrices",
            }
            .into());
        }
        Ok(Model {
            dynamics,
            cutting: Some(Cutting {
                cutter,
                spindle,
                traverse,
                regeneration: Regeneration::AllPasses,
                pores: self.pores,
            }),
            drive: None,
            restoring_forces,
        })
    }

    /// The spindle motion in this cut of `case`, with its speed modulation.
    ///
    /// # Errors
    /// The case has an extension that cannot be simulated, or the speed is modulated in a sweep.
    pub fn spindle(&self, case: &Case) -> Result<Spindle, VirtualCutError> {
        let effects = Effects::of_case(case)?.and(&self.effects);
        let spindle = effects.spindle(self.spindle_motion());
        if self.last_rpm.is_some() && spindle.fluctuation().is_some() {
            return Err(EffectError::Cut {
                name: EffectName::SpeedFluctuation.name(),
                what: "the spindle speed changes over the cut, and a modulation about a changing speed is not simulated; \
                       leave out one of both",
            }
            .into());
        }
        Ok(spindle)
    }

    /// The commanded spindle motion, without speed modulation.
    fn spindle_motion(&self) -> Spindle {
        match self.last_rpm {
            Some(last_rpm) => Spindle::sweeping(self.spindle_rpm, last_rpm, self.seconds),
            None => Spindle::new(self.spindle_rpm),
        }
    }

    /// Start and end of full engagement, s.
    ///
    /// # Errors
    /// As [`Self::model`].
    pub fn full_cut_s(&self, case: &Case) -> Result<[f64; 2], VirtualCutError> {
        let model = self.model(case)?;
        let whole = [0.0, self.seconds];
        let Some(cutting) = &model.cutting else {
            return Ok(whole);
        };
        Ok(match cutting.traverse {
            WorkpieceTraverse::Air => [0.0, 0.0],
            WorkpieceTraverse::Steady => whole,
            WorkpieceTraverse::Ramp {
                start_s,
                ramp_s,
                end_s,
            } => [start_s + ramp_s, end_s - ramp_s],
            WorkpieceTraverse::Feed { start_s, end_s } => {
                let entry_s = WorkpieceTraverse::entry_duration_s(&cutting.cutter, &cutting.spindle)?;
                [start_s + entry_s, end_s]
            }
        })
    }

    fn traverse(&self, cutter: &Cutter, spindle: &Spindle) -> Result<WorkpieceTraverse, VirtualCutError> {
        let (start_s, end_s) = (self.air_s, self.seconds - self.air_s);
        let long_enough = |entry_s: f64| {
            let needed_s = 2.0 * (self.air_s + entry_s);
            if needed_s < self.seconds {
                Ok(())
            } else {
                Err(VirtualCutError::TooShort {
                    seconds: self.seconds,
                    air_s: self.air_s,
                    needed_s,
                })
            }
        };
        match self.entry {
            Entry::None => Ok(WorkpieceTraverse::Steady),
            Entry::Ramp { seconds } => {
                long_enough(seconds)?;
                Ok(WorkpieceTraverse::Ramp {
                    start_s,
                    ramp_s: seconds,
                    end_s,
                })
            }
            Entry::Feed => {
                let entry_s = WorkpieceTraverse::entry_duration_s(cutter, spindle)?;
                long_enough(entry_s)?;
                Ok(WorkpieceTraverse::Feed {
                    start_s,
                    end_s: end_s - entry_s,
                })
            }
        }
    }

    /// Simulates the cut and the output of accelerometer and tachometer; the same `seed` gives the same noise and
    /// jitter.
    ///
    /// # Errors
    /// As [`Self::model`] and [`Model::run`].
    pub fn sense(
        &self,
        case: &Case,
        accelerometer: Accelerometer,
        tachometer: TachometerModel,
        seed: u64,
    ) -> Result<SensedCut, VirtualCutError> {
        let model = self.model(case)?;
        let mut sampler = Sampler::new(&model, accelerometer);
        let statistics = model.run(self.seconds + sampler.tail_s(), Settings::default(), |step| {
            sampler.observe(step);
        })?;
        Ok(SensedCut {
            blocks: sampler.blocks(seed),
            edges: tachometer.edges(&self.spindle(case)?, self.seconds, seed),
            statistics,
        })
    }
}
