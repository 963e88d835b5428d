//! What a virtual cut can have that the plain model has not: the causes that `diagnose` looks for.

use crate::case::{AXIAL_DEPTH_MODULATION, Case, EXTENSION_NAMES};
use crate::milling::Runout;

use super::{Cutter, SimulateError};

/// An effect with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Effect {
    /// Tooth j runs on the radius R + e·cos(ψ + 2πj/N).
    Runout(Runout),
    /// The depth of cut follows the axial vibration, b = b₀ − z.
    AxialDepthModulation(bool),
}

/// The name of [`Effect::Runout`].
const RUNOUT: &str = "runout";

impl Effect {
    /// The effects that can be simulated.
    pub const NAMES: [&'static str; 2] = [RUNOUT, AXIAL_DEPTH_MODULATION];

    /// Effects from `NAME=VALUE` and `NAME.KEY=VALUE`, in any order.
    ///
    /// # Errors
    /// A text of another form, a name or a key that is not known, a value that is no number.
    pub fn parse<'a>(texts: impl IntoIterator<Item = &'a str>) -> Result<Vec<Self>, EffectError> {
        let mut effects = Vec::new();
        for text in texts {
            let (path, value) = text
                .split_once('=')
                .ok_or_else(|| EffectError::Form(text.into()))?;
            let number: f64 = value
                .trim()
                .parse()
                .ok()
                .filter(|number: &f64| number.is_finite())
                .ok_or_else(|| EffectError::Value {
                    effect: path.into(),
                    found: value.into(),
                })?;
            let (name, key) = match path.trim().split_once('.') {
                Some((name, key)) => (name, Some(key)),
                None => (path.trim(), None),
            };
            let effect = Self::named(&mut effects, name)?;
            effect.set(name, key, number)?;
        }
        Ok(effects)
    }

    /// The effects that a case has as extensions. A tool's runout is part of the tool and not among them.
    ///
    /// # Errors
    /// An extension that cannot be simulated, or a key or value that it cannot have.
    pub fn of_case(case: &Case) -> Result<Vec<Self>, EffectError> {
        let mut effects = Vec::new();
        for (name, table) in &case.extensions {
            let effect = Self::named(&mut effects, name)?;
            for (key, value) in table {
                let number = match value {
                    toml::Value::Boolean(on) => Some(f64::from(u8::from(*on))),
                    toml::Value::Integer(number) => Some(*number as f64),
                    toml::Value::Float(number) => Some(*number),
                    _ => None,
                };
                let number = number.ok_or_else(|| EffectError::Value {
                    effect: format!("{name}.{key}"),
                    found: value.to_string(),
                })?;
                let key = if key == "on" { None } else { Some(key.as_str()) };
                effect.set(name, key, number)?;
            }
        }
        Ok(effects)
    }

    /// The effect of this name among `effects`, put there if it is new.
    fn named<'a>(effects: &'a mut Vec<Self>, name: &str) -> Result<&'a mut Self, EffectError> {
        let fresh = match name {
            RUNOUT => Self::Runout(Runout {
                offset_um: 0.0,
                angle_deg: 0.0,
            }),
            AXIAL_DEPTH_MODULATION => Self::AxialDepthModulation(false),
            _ if EXTENSION_NAMES.contains(&name) => return Err(EffectError::NotSimulated(name.into())),
            _ => return Err(EffectError::Unknown(name.into())),
        };
        let kind = std::mem::discriminant(&fresh);
        let index = match effects
            .iter()
            .position(|effect| std::mem::discriminant(effect) == kind)
        {
            Some(index) => index,
            None => {
                effects.push(fresh);
                effects.len() - 1
            }
        };
        Ok(&mut effects[index])
    }

    /// Sets one parameter; no key is the quantity that the effect is named for.
    fn set(&mut self, name: &str, key: Option<&str>, value: f64) -> Result<(), EffectError> {
        match (&mut *self, key) {
            (Self::Runout(runout), None | Some("runout_um")) => runout.offset_um = value,
            (Self::Runout(runout), Some("angle_deg")) => runout.angle_deg = value,
            (Self::AxialDepthModulation(on), None) if value == 0.0 || value == 1.0 => *on = value == 1.0,
            (Self::AxialDepthModulation(_), None) => {
                return Err(EffectError::Value {
                    effect: name.into(),
                    found: value.to_string(),
                });
            }
            (_, Some(key)) => {
                return Err(EffectError::Key {
                    name: name.into(),
                    key: key.into(),
                    known: self.keys(),
                });
            }
        }
        Ok(())
    }

    fn keys(&self) -> &'static str {
        match self {
            Self::Runout(_) => "runout_um and angle_deg",
            Self::AxialDepthModulation(_) => "none but on = true in a case",
        }
    }

    /// Puts the effect into the cut.
    ///
    /// # Errors
    /// What the cutter refuses.
    pub(super) fn apply(self, cutter: &mut Cutter) -> Result<(), SimulateError> {
        match self {
            Self::Runout(runout) => cutter.set_runout(runout),
            Self::AxialDepthModulation(on) => cutter.axial_depth_modulation = on,
        }
        Ok(())
    }
}

/// An effect that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EffectError {
    /// Not `NAME=VALUE`.
    #[error("effect `{0}`: NAME=VALUE or NAME.KEY=VALUE is needed, as in runout=20")]
    Form(String),
    /// A name that is not known.
    #[error("effect `{0}` is not known; there are {list}", list = Effect::NAMES.join(", "))]
    Unknown(String),
    /// A cause that is known and is not simulated.
    #[error("effect `{0}` is not simulated yet; there are {list}", list = Effect::NAMES.join(", "))]
    NotSimulated(String),
    /// A key that the effect does not have.
    #[error("effect `{name}` has no key `{key}`; it has {known}")]
    Key {
        /// The effect.
        name: String,
        /// The key.
        key: String,
        /// What it has.
        known: &'static str,
    },
    /// A value that cannot be.
    #[error("effect `{effect}`: `{found}` is not possible; a number is needed, 0 or 1 where it is switched")]
    Value {
        /// The effect, with its key.
        effect: String,
        /// What was found.
        found: String,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_and_its_keys_are_one_effect() {
        let effects =
            Effect::parse(["runout=20", "axial-depth-modulation=1", "runout.angle_deg=-30"]).unwrap();
        assert_eq!(
            effects,
            [
                Effect::Runout(Runout {
                    offset_um: 20.0,
                    angle_deg: -30.0
                }),
                Effect::AxialDepthModulation(true)
            ]
        );
    }

    #[test]
    fn what_cannot_be_is_told_apart() {
        let error = |text| Effect::parse([text]).unwrap_err();
        assert!(matches!(error("runout"), EffectError::Form(_)));
        assert!(matches!(error("runout=lots"), EffectError::Value { .. }));
        assert!(matches!(error("runout=inf"), EffectError::Value { .. }));
        assert!(matches!(
            error("axial-depth-modulation=2"),
            EffectError::Value { .. }
        ));
        assert!(matches!(error("runout.teeth=2"), EffectError::Key { .. }));
        assert!(matches!(error("wear=0.1"), EffectError::NotSimulated(_)));
        assert!(matches!(error("weather=1"), EffectError::Unknown(_)));
        assert!(
            error("weather=1")
                .to_string()
                .contains("runout, axial-depth-modulation")
        );
    }
}
