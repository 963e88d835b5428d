//! The effects of one simulation.

use std::sync::Arc;

use super::effect::Effect;
use super::pickup::Pickup;
use super::values::{Value, Values};
use super::{EffectError, EffectName, coulomb_friction};
use crate::structure::Structure;
use crate::{Cutter, Dynamics, ModelError, RestoringForce, Spindle};

/// Effects on one model, in the order in which they act.
#[derive(Clone, Debug, Default)]
pub struct Effects(pub Vec<Arc<dyn Effect>>);

impl Effects {
    /// Effects from `NAME=VALUE` and `NAME.KEY=VALUE`, in any order.
    ///
    /// # Errors
    /// A text without `=`, an unknown name, an unknown or unused key, a missing key, or a value that is not possible.
    /// Also a VALUE that is a change over the whole recording, whose length is not known: see [`Self::parse_over`].
    pub fn parse<'a>(texts: impl IntoIterator<Item = &'a str>) -> Result<Self, EffectError> {
        Self::parse_over(texts, None)
    }

    /// Effects from `NAME=VALUE` and `NAME.KEY=VALUE` for a recording of the length `record_s`, s; `None` if the length
    /// is not known. The VALUE of wear, and of drift without `time_constant_s`, is the relative change over the whole
    /// recording.
    ///
    /// # Errors
    /// As [`Self::parse`]; such a VALUE only if `record_s` is `None`.
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

    /// The effect of one table `[extension.NAME]`; several if its `direction` or `channel` is a list.
    ///
    /// # Errors
    /// An unknown extension, an unknown, unused or missing key, or a value that is not possible.
    pub fn of_extension(name: &str, table: &toml::Table) -> Result<Self, EffectError> {
        Self::build(vec![extension(name, table)?])
    }

    /// The effects of several tables `[extension.NAME]`; a backlash may be in series with the friction of another
    /// table.
    ///
    /// # Errors
    /// An unknown extension, an unknown, unused or missing key, or a value that is not possible.
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
        coulomb_friction::take_backlash(&mut all)?;
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

    /// The effects of `self`, followed by those of `other`.
    pub fn and(mut self, other: &Self) -> Self {
        self.0.extend(other.0.iter().cloned());
        self
    }

    /// `structure` after these effects have changed its parameters; restoring forces and modes that they add are not
    /// part of it.
    ///
    /// # Errors
    /// An effect that does not apply to the structure: see [`EffectError::Structure`].
    pub fn altered(&self, structure: &Structure) -> Result<Structure, EffectError> {
        let mut structure = structure.clone();
        for effect in &self.0 {
            effect.alter_structure(&mut structure)?;
        }
        Ok(structure)
    }

    /// The equation of motion of `structure` with these effects, and the restoring forces that they add.
    ///
    /// # Errors
    /// An effect that is not possible for this structure, or a structure that is refused: see
    /// [`ModelError::Structure`].
    pub fn dynamics(
        &self,
        structure: &Structure,
    ) -> Result<(Dynamics, Vec<Box<dyn RestoringForce>>), ModelError> {
        let structure = self.altered(structure)?;
        let mut dynamics = Dynamics::new(&structure)?;
        let mut restoring_forces = Vec::new();
        for effect in &self.0 {
            effect.alter_dynamics(&structure, &mut dynamics)?;
            restoring_forces.extend(effect.restoring_forces(&structure)?);
        }
        if dynamics.velocity_jumps()
            && restoring_forces
                .iter()
                .any(|restoring_force| restoring_force.holds().is_some())
        {
            return Err(EffectError::NoInertia.into());
        }
        Ok((dynamics, restoring_forces))
    }

    /// The tool in its cut with the changes of these effects.
    ///
    /// # Errors
    /// The tool or the cut lacks a quantity that an effect requires.
    pub fn cutter(&self, mut cutter: Cutter) -> Result<Cutter, ModelError> {
        for effect in &self.0 {
            effect.alter_cutter(&mut cutter)?;
        }
        Ok(cutter)
    }

    /// The spindle motion with the changes of these effects.
    pub fn spindle(&self, mut spindle: Spindle) -> Spindle {
        for effect in &self.0 {
            effect.alter_spindle(&mut spindle);
        }
        spindle
    }

    /// The pickup of a channel with the changes of these effects.
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
    // A key that ends in `_std` is the standard deviation of a parameter; it changes no equation.
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
