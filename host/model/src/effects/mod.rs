//! What a simulation can have that the plain model has not: the causes that `diagnose` looks for, one file each.
//!
//! To add one: write its file with its equation and a [`Kind`], and name it in [`KINDS`].

mod axial_depth_modulation;
mod backlash;
mod coulomb_friction;
mod cross_axis;
mod cubic_damping;
mod cubic_stiffness;
mod drift;
mod edge_force;
mod error;
mod force_coefficients;
mod force_exponent;
mod hysteresis;
mod linear;
mod local_force;
mod missing_mode;
mod mode_coupling;
mod parameters;
mod place;
mod process_damping;
mod quadratic_stiffness;
mod runout;
mod sensor_delay;
mod sensor_gain;
mod sensor_offset;
mod softening_hardening;
mod speed_fluctuation;
mod wear;

#[cfg(test)]
mod tests;

use std::fmt::Debug;
use std::sync::Arc;

pub use error::EffectError;
pub use parameters::{Parameters, Value};

use crate::case::Case;
use crate::structure::Structure;
use crate::{Cutter, Dynamics, ModelError, Spindle, Term};
use quietcut_recording::Quantity;

/// One effect with its parameters. It does what it does by one of these; the others leave things as they are.
pub trait Effect: Debug + Send + Sync {
    /// Its name, as in `CAUSES`: one of [`EXTENSION_NAMES`](crate::case::EXTENSION_NAMES).
    fn name(&self) -> &'static str;

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

    /// Changes how the spindle turns.
    fn alter_spindle(&self, _spindle: &mut Spindle) {}

    /// Changes what a channel reads.
    fn alter_channel(&self, _channel: &mut Pickup) {}
}

/// What a channel reads: a mix of axes, scaled, late.
#[derive(Clone, Debug, PartialEq)]
pub struct Pickup {
    /// Its name: `ax`, `y`, `fx` …
    pub name: String,
    /// What it measures: force, displacement, velocity or acceleration.
    pub quantity: Quantity,
    /// How much of the machine's x, y and z it reads.
    pub weights: [f64; 3],
    /// By mode of a structure of modes: how many times what the mode moves the tool it moves the sensor. Empty where the sensor moves
    /// as the tool.
    pub modes: Vec<f64>,
    /// How late it is, s.
    pub delay_s: f64,
}

impl Pickup {
    /// A channel of one axis (0, 1, 2), without a fault.
    pub fn of_axis(quantity: Quantity, axis: usize) -> Self {
        let prefix = match quantity {
            Quantity::Force => "f",
            Quantity::Velocity => "v",
            Quantity::Acceleration => "a",
            _ => "",
        };
        let mut weights = [0.0; 3];
        weights[axis] = 1.0;
        Self {
            name: format!("{prefix}{}", ["x", "y", "z"][axis]),
            quantity,
            weights,
            modes: Vec::new(),
            delay_s: 0.0,
        }
    }

    /// What it reads of a quantity along x, y and z.
    pub fn read(&self, value: [f64; 3]) -> f64 {
        self.weights
            .iter()
            .zip(value)
            .map(|(weight, value)| weight * value)
            .sum()
    }
}

/// A kind of effect, before it has parameters.
#[derive(Clone, Copy)]
pub struct Kind {
    /// Its name.
    pub name: &'static str,
    /// The keys that it has, as people read them.
    pub keys: &'static str,
    /// Makes one; what it does not take of the parameters is a key that it does not have.
    pub build: fn(&mut Parameters) -> Result<Arc<dyn Effect>, EffectError>,
}

/// All effects that can be simulated.
pub const KINDS: [Kind; 25] = [
    linear::MASS,
    linear::STIFFNESS,
    linear::DAMPING,
    missing_mode::KIND,
    cubic_stiffness::KIND,
    quadratic_stiffness::KIND,
    cubic_damping::KIND,
    softening_hardening::KIND,
    coulomb_friction::KIND,
    backlash::KIND,
    hysteresis::KIND,
    mode_coupling::KIND,
    drift::KIND,
    force_coefficients::KIND,
    edge_force::KIND,
    force_exponent::KIND,
    runout::KIND,
    process_damping::KIND,
    axial_depth_modulation::KIND,
    speed_fluctuation::KIND,
    wear::KIND,
    sensor_gain::KIND,
    sensor_delay::KIND,
    cross_axis::KIND,
    sensor_offset::KIND,
];

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
        let mut all: Vec<Parameters> = Vec::new();
        for text in texts {
            let (path, value) = text
                .split_once('=')
                .ok_or_else(|| EffectError::Form(text.into()))?;
            let (name, key) = path.trim().split_once('.').unwrap_or((path.trim(), ""));
            kind(name)?;
            let parameters = match all.iter().position(|known| known.effect() == name) {
                Some(index) => &mut all[index],
                None => {
                    all.push(Parameters::new(name).over(record_s));
                    let last = all.len() - 1;
                    &mut all[last]
                }
            };
            parameters.put(key, Value::of_text(value));
        }
        Self::build(all)
    }

    /// The effects that a case has as extensions: one for each place where `direction`, or else `channel`, is a list. A tool's runout is part of the tool and not among them.
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

    fn build(mut all: Vec<Parameters>) -> Result<Self, EffectError> {
        coulomb_friction::take_play(&mut all)?;
        let by_place: Vec<Vec<Parameters>> = all
            .into_iter()
            .map(Parameters::by_place)
            .collect::<Result<_, _>>()?;
        by_place
            .into_iter()
            .flatten()
            .map(|mut parameters| {
                let kind = kind(parameters.effect())?;
                let effect = (kind.build)(&mut parameters)?;
                parameters.finish(kind.keys)?;
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

fn extension(name: &str, table: &toml::Table) -> Result<Parameters, EffectError> {
    kind(name)?;
    let mut parameters = Parameters::new(name);
    // How well a parameter is known changes nothing here.
    for (key, value) in table.iter().filter(|(key, _)| !key.ends_with("_std")) {
        let value = Value::of_toml(value).ok_or_else(|| EffectError::Value {
            effect: format!("{name}.{key}"),
            found: value.to_string(),
            needed: "a number, a text, true or false, or a list of one kind of these",
        })?;
        parameters.put(if key == "on" { "" } else { key }, value);
    }
    Ok(parameters)
}

fn kind(name: &str) -> Result<&'static Kind, EffectError> {
    KINDS
        .iter()
        .find(|kind| kind.name == name)
        .ok_or_else(|| EffectError::Unknown(name.into()))
}
