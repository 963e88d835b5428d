//! Stiffness that changes with time: K → K·(1 + r·t), or K·(1 + a·(1 − e^(−t/T))).
//!
//! K is the static stiffness matrix at the tool along x, y and z; with a direction, only the diagonal entry of that
//! direction changes.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use super::location::{axis_of, static_stiffness};
use super::{
    Argument, Class, Effect, EffectError, EffectName, EffectSpec, Locations, Parameter, Prior, Treatment,
};
use crate::structure::{Direction, Structure};
use crate::{MotionState, Regime, RestoringForce};

/// The specification.
pub(super) const DRIFT: EffectSpec = EffectSpec {
    id: EffectName::Drift,
    name: "drift",
    class: Class::RestoringForce(Argument::Displacement),
    locations: Locations::WholeOrDirection,
    parameters: &[
        Parameter::number("", "", "relative change of the stiffness over the record").main(),
        Parameter::number("relative_rate_per_s", "1/s", "relative change per second").linear(),
        Parameter::number(
            "relative_change",
            "",
            "relative change in the end, with time_constant_s",
        )
        .linear(),
        Parameter::number("time_constant_s", "s", "time constant of an exponential change")
            .within(Prior::POSITIVE),
    ],
    treatment: Treatment::OfMoment(
        "stiffness that moves with time has limits for one moment only; give the stiffness of that moment in \
         [extension.stiffness] instead, or say after how long (--after-s 0 and --after-s T: between, limits lie between)",
    ),
    candidates: &[
        "a change at a constant rate",
        "a change that settles with a time constant",
    ],
    shares_term_with: &[],
    summary: "the stiffness changes with time",
    equation: "K → K·(1 + r·t), or K·(1 + a·(1 − e^(−t/T)))",
    shows: "frequencies that move along the record at one amplitude, all by the same share",
    hidden_by: "levels that only rise or fall with time; wear and speed fluctuation, unless motion and tachometer are separate",
    source: "Poulimenos and Fassois, MSSP 20 (2006)",
    example: "relative_change = -0.05\ntime_constant_s = 30.0\ndirection = \"x\"",
    describing_function: None,
    build: |values| {
        let direction = values.direction()?;
        let time_constant = values.number("time_constant_s")?;
        let law = match (time_constant, values.number("relative_change")?) {
            (Some(time_constant_s), Some(change)) => DriftLaw::Settles {
                change,
                time_constant_s,
            },
            (Some(time_constant_s), None) => DriftLaw::Settles {
                change: values.main("relative_change")?,
                time_constant_s,
            },
            (None, Some(_)) => return Err(values.missing("time_constant_s beside relative_change")),
            (None, None) => DriftLaw::Rate(values.rate("relative_rate_per_s")?),
        };
        Ok(Arc::new(Drift { law, direction }))
    },
};

#[derive(Clone, Copy, Debug)]
enum DriftLaw {
    Rate(f64),
    Settles { change: f64, time_constant_s: f64 },
}

impl DriftLaw {
    fn relative_change(self, t: f64) -> f64 {
        match self {
            Self::Rate(rate) => rate * t,
            Self::Settles {
                change,
                time_constant_s,
            } => -change * (-t / time_constant_s).exp_m1(),
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Drift {
    law: DriftLaw,
    direction: Option<Direction>,
}

#[derive(Debug)]
struct DriftingSpring {
    law: DriftLaw,
    stiffness: Matrix3<f64>,
}

impl Effect for Drift {
    fn id(&self) -> EffectName {
        EffectName::Drift
    }

    fn restoring_forces(&self, structure: &Structure) -> Result<Vec<Box<dyn RestoringForce>>, EffectError> {
        let mut stiffness = static_stiffness(structure, self.name())?;
        if self.direction.is_some() {
            let axis = axis_of(structure, self.direction, self.name())?;
            let own = stiffness[(axis, axis)];
            stiffness.fill(0.0);
            stiffness[(axis, axis)] = own;
        }
        Ok(vec![Box::new(DriftingSpring {
            law: self.law,
            stiffness,
        })])
    }
}

impl RestoringForce for DriftingSpring {
    fn restoring_n(&self, _: Regime, at: &MotionState, _: &[f64]) -> [f64; 3] {
        (self.stiffness * Vector3::from(at.x) * self.law.relative_change(at.t)).into()
    }
}
