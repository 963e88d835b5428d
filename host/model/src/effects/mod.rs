//! Effects: what a machine, a cut or a sensor may have beyond the plain model. One file each, with its [`EffectSpec`] and its physics.
//!
//! [`EffectName`] is the only list. Names, keys, help, the table of the documentation, the checks of cases, simulation and the treatment
//! in stability follow from it. To add an effect: write its file and name it twice below, as a module and in the list.

mod axial_depth_modulation;
mod backlash;
mod coulomb_friction;
mod cross_axis;
mod cubic_damping;
mod cubic_stiffness;
mod damping;
mod drift;
mod edge_force;
mod error;
mod force_coefficients;
mod force_exponent;
mod hysteresis;
mod linear_change;
mod list;
mod local_force;
mod mass;
mod missing_mode;
mod mode_coupling;
pub(crate) mod nearest;
mod pickup;
mod place;
mod process_damping;
mod quadratic_damping;
mod quadratic_stiffness;
mod runout;
mod sensor_delay;
mod sensor_gain;
mod sensor_offset_from_tool_tip;
mod softening_hardening;
mod spec;
mod speed_fluctuation;
mod stiffness;
pub mod table;
mod values;
mod wear;

#[cfg(test)]
mod round_trip_tests;
#[cfg(test)]
mod tests;

use std::fmt::Debug;
use std::sync::Arc;

pub use error::EffectError;
use list::list;
pub use pickup::Pickup;
pub use spec::{Argument, Class, EffectSpec, Locations, Parameter, Prior, Treatment, ValueKind};
pub use values::{Value, Values};

use crate::case::Case;
use crate::structure::Structure;
use crate::{Cutter, Dynamics, ModelError, Spindle, Term};

/// Describing functions of laws with a coefficient of 1: see [`Term::describing_function`](crate::Term::describing_function).
pub mod describing_functions {
    pub use super::backlash::describing_function as backlash;
    pub use super::coulomb_friction::describing_function as coulomb_friction;
    pub use super::cubic_damping::describing_function as cubic_damping;
    pub use super::cubic_stiffness::describing_function as cubic_stiffness;
    pub use super::hysteresis::describing_function as hysteresis;
    pub use super::softening_hardening::quintic_describing_function as quintic_stiffness;
}

list! {
    Mass => mass::MASS,
    Stiffness => stiffness::STIFFNESS,
    Damping => damping::DAMPING,
    MissingMode => missing_mode::MISSING_MODE,
    CubicStiffness => cubic_stiffness::CUBIC_STIFFNESS,
    QuadraticStiffness => quadratic_stiffness::QUADRATIC_STIFFNESS,
    CubicDamping => cubic_damping::CUBIC_DAMPING,
    SofteningHardening => softening_hardening::SOFTENING_HARDENING,
    QuadraticDamping => quadratic_damping::QUADRATIC_DAMPING,
    CoulombFriction => coulomb_friction::COULOMB_FRICTION,
    Backlash => backlash::BACKLASH,
    Hysteresis => hysteresis::HYSTERESIS,
    ModeCoupling => mode_coupling::MODE_COUPLING,
    Drift => drift::DRIFT,
    ForceCoefficients => force_coefficients::FORCE_COEFFICIENTS,
    EdgeForce => edge_force::EDGE_FORCE,
    ForceExponent => force_exponent::FORCE_EXPONENT,
    Runout => runout::RUNOUT,
    ProcessDamping => process_damping::PROCESS_DAMPING,
    AxialDepthModulation => axial_depth_modulation::AXIAL_DEPTH_MODULATION,
    SpeedFluctuation => speed_fluctuation::SPEED_FLUCTUATION,
    Wear => wear::WEAR,
    SensorGain => sensor_gain::SENSOR_GAIN,
    SensorDelay => sensor_delay::SENSOR_DELAY,
    CrossAxis => cross_axis::CROSS_AXIS,
    SensorOffsetFromToolTip => sensor_offset_from_tool_tip::SENSOR_OFFSET_FROM_TOOL_TIP,
}

/// An effect with values. It acts by one of these methods; the others change nothing.
pub trait Effect: Debug + Send + Sync {
    /// Its entry in the list.
    fn id(&self) -> EffectName;

    /// Its specification.
    fn spec(&self) -> &'static EffectSpec {
        self.id().spec()
    }

    /// Its name in cases, answers and on the command line.
    fn name(&self) -> &'static str {
        self.id().name()
    }

    /// Changes a parameter of the structure.
    ///
    /// # Errors
    /// The structure has no such parameter.
    fn alter_structure(&self, _structure: &mut Structure) -> Result<(), EffectError> {
        Ok(())
    }

    /// Changes the equations of the `structure` beyond what a case can say.
    ///
    /// # Errors
    /// The structure does not have the direction.
    fn alter_dynamics(&self, _structure: &Structure, _dynamics: &mut Dynamics) -> Result<(), EffectError> {
        Ok(())
    }

    /// Terms that the equation of motion of `structure` gets.
    ///
    /// # Errors
    /// The structure does not have the direction, or cannot have the term.
    fn terms(&self, _structure: &Structure) -> Result<Vec<Box<dyn Term>>, EffectError> {
        Ok(Vec::new())
    }

    /// Changes the tool or its cut.
    ///
    /// # Errors
    /// What the cutter refuses.
    fn alter_cutter(&self, _cutter: &mut Cutter) -> Result<(), ModelError> {
        Ok(())
    }

    /// Changes the rotation of the spindle.
    fn alter_spindle(&self, _spindle: &mut Spindle) {}

    /// Changes what a channel reads.
    fn alter_channel(&self, _channel: &mut Pickup) {}
}

/// The effects of one simulation, in the order in which they act.
#[derive(Clone, Debug, Default)]
pub struct Effects(pub Vec<Arc<dyn Effect>>);

impl Effects {
    /// Effects from `NAME=VALUE` and `NAME.KEY=VALUE`, in any order.
    ///
    /// # Errors
    /// A text of another form, a name or a key that is not known, a value that cannot be; a change over the record, whose
    /// length is not known: see [`Self::parse_over`].
    pub fn parse<'a>(texts: impl IntoIterator<Item = &'a str>) -> Result<Self, EffectError> {
        Self::parse_over(texts, None)
    }

    /// The same for a record of a known length in s: the VALUE of drift and wear is the change over it.
    ///
    /// # Errors
    /// As [`Self::parse`].
    pub fn parse_over<'a>(
        texts: impl IntoIterator<Item = &'a str>,
        record_s: Option<f64>,
    ) -> Result<Self, EffectError> {
        let mut all: Vec<Values> = Vec::new();
        for text in texts {
            let (path, value) = text
                .split_once('=')
                .ok_or_else(|| EffectError::Form(text.into()))?;
            let (name, key) = path.trim().split_once('.').unwrap_or((path.trim(), ""));
            let effect: EffectName = name.parse()?;
            let values = match all.iter().position(|known| known.effect() == effect) {
                Some(index) => &mut all[index],
                None => {
                    all.push(Values::new(effect).over(record_s));
                    let last = all.len() - 1;
                    &mut all[last]
                }
            };
            values.put(key, Value::of_text(value));
        }
        Self::build(all)
    }

    /// The effects that a case has as extensions: one for each location where `direction`, or else `channel`, is a list. A tool's runout is part of the tool and not among them.
    ///
    /// # Errors
    /// An extension that cannot be simulated, or a key or value that it cannot have.
    pub fn of_case(case: &Case) -> Result<Self, EffectError> {
        case.extensions
            .iter()
            .map(|(name, table)| extension(name, table))
            .collect::<Result<_, _>>()
            .and_then(Self::build)
    }

    /// The effect of one table `[extension.NAME]`.
    ///
    /// # Errors
    /// As [`Self::of_case`].
    pub fn of_extension(name: &str, table: &toml::Table) -> Result<Self, EffectError> {
        Self::build(vec![extension(name, table)?])
    }

    /// The effects of several tables `[extension.NAME]`, some of which may belong together.
    ///
    /// # Errors
    /// As [`Self::of_case`].
    pub fn of_extensions<'a>(
        tables: impl IntoIterator<Item = (&'a str, &'a toml::Table)>,
    ) -> Result<Self, EffectError> {
        tables
            .into_iter()
            .map(|(name, table)| extension(name, table))
            .collect::<Result<_, _>>()
            .and_then(Self::build)
    }

    fn build(mut all: Vec<Values>) -> Result<Self, EffectError> {
        coulomb_friction::take_play(&mut all)?;
        let by_location: Vec<Vec<Values>> = all
            .into_iter()
            .map(Values::by_location)
            .collect::<Result<_, _>>()?;
        by_location
            .into_iter()
            .flatten()
            .map(|mut values| {
                let effect = (values.effect().spec().build)(&mut values)?;
                values.finish()?;
                Ok(effect)
            })
            .collect::<Result<Vec<_>, EffectError>>()
            .map(Self)
    }

    /// Those of `self`, then those of `other`.
    pub fn and(mut self, other: &Self) -> Self {
        self.0.extend(other.0.iter().cloned());
        self
    }

    /// The structure as these effects make it, as far as that is a change of its own numbers.
    ///
    /// # Errors
    /// An effect that the structure cannot have.
    pub fn altered(&self, structure: &Structure) -> Result<Structure, EffectError> {
        let mut structure = structure.clone();
        for effect in &self.0 {
            effect.alter_structure(&mut structure)?;
        }
        Ok(structure)
    }

    /// The equations of `structure` with these effects.
    ///
    /// # Errors
    /// What an effect cannot do to this structure, or an indefinite structure.
    pub fn dynamics(&self, structure: &Structure) -> Result<(Dynamics, Vec<Box<dyn Term>>), ModelError> {
        let structure = self.altered(structure)?;
        let mut dynamics = Dynamics::new(&structure)?;
        let mut terms = Vec::new();
        for effect in &self.0 {
            effect.alter_dynamics(&structure, &mut dynamics)?;
            terms.extend(effect.terms(&structure)?);
        }
        if dynamics.velocity_jumps() && terms.iter().any(|term| term.holds().is_some()) {
            return Err(EffectError::NoInertia.into());
        }
        Ok((dynamics, terms))
    }

    /// The tool in its cut as these effects make it.
    ///
    /// # Errors
    /// What the cutter refuses, or what goes with it only on some structures.
    pub fn cutter(&self, mut cutter: Cutter) -> Result<Cutter, ModelError> {
        for effect in &self.0 {
            effect.alter_cutter(&mut cutter)?;
        }
        Ok(cutter)
    }

    /// The spindle as these effects make it.
    pub fn spindle(&self, mut spindle: Spindle) -> Spindle {
        for effect in &self.0 {
            effect.alter_spindle(&mut spindle);
        }
        spindle
    }

    /// The channel as these effects make it.
    pub fn pickup(&self, mut channel: Pickup) -> Pickup {
        for effect in &self.0 {
            effect.alter_channel(&mut channel);
        }
        channel
    }
}

fn extension(name: &str, table: &toml::Table) -> Result<Values, EffectError> {
    let effect: EffectName = name.parse()?;
    let mut values = Values::new(effect);
    // The standard deviation of a parameter changes no equation.
    for (key, value) in table.iter().filter(|(key, _)| !key.ends_with("_std")) {
        let value = Value::of_toml(value).ok_or_else(|| EffectError::Value {
            name: effect.name(),
            key: key.clone(),
            found: value.to_string(),
            needed: "a number, a text, true or false, or a list of one kind of these",
        })?;
        values.put(key, value);
    }
    Ok(values)
}
