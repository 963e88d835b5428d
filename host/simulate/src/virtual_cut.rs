//! A virtual cut of a case: what is asked for, and what comes of it.

use quietcut_core::acceleration::Block;
use quietcut_core::tachometer::Edge;

use super::Statistics;
use super::effect::{EffectError, EffectName, Effects};
use super::sensor::{Accelerometer, Sampler, TachometerModel};
use super::{
    Cutter, Cutting, Model, ModelError, Passage, Pores, Regeneration, Settings, SimulateError, Spindle,
};
use quietcut_model::case::{Case, CaseError};
use quietcut_recording::Quantity;

/// A cut of a case.
#[derive(Clone, Debug)]
pub struct VirtualCut {
    /// Spindle speed, rev/min.
    pub spindle_rpm: f64,
    /// The speed to which it glides by the end, rev/min; `None` where it stays. The feed axis moves steadily, with the
    /// feed per tooth of the case at the speed in the middle.
    pub last_rpm: Option<f64>,
    /// Axial depth of cut, mm.
    pub depth_mm: f64,
    /// How long it is watched, s.
    pub seconds: f64,
    /// How the tool comes into the workpiece.
    pub entry: Entry,
    /// Air before and after the cut, s.
    pub air_s: f64,
    /// Pores of the material; `None` where it is solid.
    pub pores: Option<Pores>,
    /// What the case does not have, or has otherwise.
    pub effects: Effects,
    /// What a recording of it has, besides the tachometer, in every direction of the structure.
    pub measured: Vec<Quantity>,
}

/// How the tool comes into the workpiece, and out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Entry {
    /// In full cut from the start to the end.
    None,
    /// The depth grows, and shrinks, over so many seconds.
    Ramp {
        /// Duration, s.
        seconds: f64,
    },
    /// Through the face of the workpiece: immersion grows as the tool feeds in, and shrinks as it feeds out.
    Feed,
}

/// Why a case cannot be cut.
#[derive(Debug, thiserror::Error)]
pub enum VirtualCutError {
    /// The case lacks a section.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// An effect that cannot be.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// The equations cannot be set up.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The simulation cannot go on.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// Pulses of the tachometer that run into each other.
    #[error(
        "a tachometer wheel with {positions} positions at {spindle_rpm} rev/min is too fine for {rate_hz:.0} samples per second: at least {needed_hz:.0} Hz are needed"
    )]
    WheelTooFine {
        /// Positions on the wheel.
        positions: u16,
        /// Spindle speed, rev/min.
        spindle_rpm: f64,
        /// Samples per second.
        rate_hz: f64,
        /// Samples per second needed.
        needed_hz: f64,
    },
    /// Forces that turn around within the time.
    #[error(
        "wear of {relative_rate_per_s} per s makes the cutting force negative within {seconds} s: a larger rate or a shorter time is needed"
    )]
    WornOut {
        /// The rate, 1/s.
        relative_rate_per_s: f64,
        /// The time, s.
        seconds: f64,
    },
    /// The time is over before the cut is whole.
    #[error(
        "{seconds} s are too short: with {air_s} s of air at both ends, way in and way out take {needed_s:.2} s, so give more than that"
    )]
    TooShort {
        /// The time given, s.
        seconds: f64,
        /// Air, s.
        air_s: f64,
        /// The time needed, s.
        needed_s: f64,
    },
}

/// What the sensors of a cut deliver, and what it took.
#[derive(Clone, Debug)]
pub struct Heard {
    /// Samples in blocks.
    pub blocks: Vec<Block>,
    /// Edges of the tachometer, in their order.
    pub edges: Vec<Edge>,
    /// What the integration took.
    pub statistics: Statistics,
}

impl VirtualCut {
    /// A cut with entry and exit through the faces of the workpiece, and a fifth of a second of air at both ends.
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

    /// The model of this cut of `case`.
    ///
    /// # Errors
    /// The case lacks a section or has an extension that cannot be simulated; the time is too short; the tool's
    /// size is needed and not known.
    pub fn model(&self, case: &Case) -> Result<Model, VirtualCutError> {
        let effects = Effects::of_case(case)?.and(&self.effects);
        let cutter = effects.cutter(Cutter::new(
            case.tool()?,
            case.material()?,
            case.cut()?,
            1e-3 * self.depth_mm,
        )?)?;
        if cutter.force.wear(self.seconds) < 0.0 {
            return Err(VirtualCutError::WornOut {
                relative_rate_per_s: cutter.force.wear_per_s,
                seconds: self.seconds,
            });
        }
        if self.pores.is_some() && cutter.radius_m.is_none() {
            return Err(SimulateError::NoDiameter.into());
        }
        let spindle = effects.spindle(self.turning());
        let passage = self.passage(&cutter, &spindle)?;
        let (dynamics, terms) = effects.dynamics(case.structure()?)?;
        if cutter.force.process_damping.is_some() && dynamics.velocity_jumps() && !terms.is_empty() {
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
                passage,
                regeneration: Regeneration::AllPasses,
                pores: self.pores,
            }),
            drive: None,
            terms,
        })
    }

    /// How the spindle turns in this cut of `case`.
    ///
    /// # Errors
    /// The case has an extension that cannot be simulated.
    pub fn spindle(&self, case: &Case) -> Result<Spindle, VirtualCutError> {
        let effects = Effects::of_case(case)?.and(&self.effects);
        Ok(effects.spindle(self.turning()))
    }

    /// How the spindle is told to turn.
    fn turning(&self) -> Spindle {
        match self.last_rpm {
            Some(last_rpm) => Spindle::gliding(self.spindle_rpm, last_rpm, self.seconds),
            None => Spindle::new(self.spindle_rpm),
        }
    }

    /// When the tool is in full cut, from and to in s.
    ///
    /// # Errors
    /// As [`Self::model`].
    pub fn full_cut_s(&self, case: &Case) -> Result<[f64; 2], VirtualCutError> {
        let model = self.model(case)?;
        let whole = [0.0, self.seconds];
        let Some(cutting) = &model.cutting else {
            return Ok(whole);
        };
        Ok(match cutting.passage {
            Passage::Air => [0.0, 0.0],
            Passage::Steady => whole,
            Passage::Ramp {
                start_s,
                ramp_s,
                end_s,
            } => [start_s + ramp_s, end_s - ramp_s],
            Passage::Feed { start_s, end_s } => {
                let way_s = Passage::way_in_s(&cutting.cutter, &cutting.spindle)?;
                [start_s + way_s, end_s]
            }
        })
    }

    fn passage(&self, cutter: &Cutter, spindle: &Spindle) -> Result<Passage, VirtualCutError> {
        let (start_s, end_s) = (self.air_s, self.seconds - self.air_s);
        let long_enough = |way_s: f64| {
            let needed_s = 2.0 * (self.air_s + way_s);
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
            Entry::None => Ok(Passage::Steady),
            Entry::Ramp { seconds } => {
                long_enough(seconds)?;
                Ok(Passage::Ramp {
                    start_s,
                    ramp_s: seconds,
                    end_s,
                })
            }
            Entry::Feed => {
                let way_s = Passage::way_in_s(cutter, spindle)?;
                long_enough(way_s)?;
                Ok(Passage::Feed {
                    start_s,
                    end_s: end_s - way_s,
                })
            }
        }
    }

    /// Cuts, and listens with these sensors; `seed` makes their noise repeat.
    ///
    /// # Errors
    /// As [`Self::model`], and what [`Model::run`] says.
    pub fn hear(
        &self,
        case: &Case,
        accelerometer: Accelerometer,
        tachometer: TachometerModel,
        seed: u64,
    ) -> Result<Heard, VirtualCutError> {
        let model = self.model(case)?;
        let mut sampler = Sampler::new(&model, accelerometer);
        let statistics = model.run(self.seconds + sampler.tail_s(), Settings::default(), |segment| {
            sampler.observe(segment);
        })?;
        Ok(Heard {
            blocks: sampler.blocks(seed),
            edges: tachometer.edges(&self.spindle(case)?, self.seconds, seed),
            statistics,
        })
    }
}
