//! Errors of effects: unknown names or keys, impossible or missing values, or a model to which an effect does not
//! apply.

use super::{EffectName, nearest};

/// The fault of an effect.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EffectError {
    /// A text without `=`: neither `NAME=VALUE` nor `NAME.KEY=VALUE`.
    #[error("effect `{0}`: NAME=VALUE or NAME.KEY=VALUE is needed, as in {example}=20", example = EffectName::Runout.name())]
    Form(String),
    /// An unknown name.
    #[error("effect `{0}` is not known; {names} is needed{value}", names = nearest::expected(.0, EffectName::ALL.into_iter().map(EffectName::name)), value = value_of_closest(.0))]
    Unknown(String),
    /// A key, or the VALUE of `--effect NAME=VALUE`, that the effect does not have, or does not use with the other
    /// values as given.
    #[error("effect `{name}` has no key `{key}`; it has {known}", name = .effect.name(), known = .effect.spec().keys_in_words())]
    Key {
        /// The effect.
        effect: EffectName,
        /// The key; the words "a value" for VALUE.
        key: String,
    },
    /// An effect without a value that it requires: neither this key nor, where there is one, another in its place is
    /// given.
    #[error("effect `{name}` needs {key}")]
    Missing {
        /// The effect.
        name: &'static str,
        /// The key, or a phrase that begins with it.
        key: &'static str,
    },
    /// Drift or wear given as change over the whole recording, for a recording of unknown length.
    #[error("effect `{name}`: the length of the record is not known here; give {name}.{key} instead")]
    NoDuration {
        /// The effect.
        name: &'static str,
        /// The key to give instead.
        key: &'static str,
    },
    /// A value that is not possible for its key, such as a negative damping ratio, or not possible beside the other
    /// given values and effects.
    #[error("effect `{name}{dot}{key}`: `{found}` is not possible; {needed}{unit} is needed", unit = unit(name, key), dot = if .key.is_empty() { "" } else { "." })]
    Value {
        /// The effect.
        name: &'static str,
        /// The key of the refused value; empty for the VALUE of `--effect NAME=VALUE`.
        key: String,
        /// The refused value.
        found: String,
        /// Description of the possible values.
        needed: &'static str,
    },
    /// A direction of an effect that the structure does not have, or that is a rotation instead of an axis; or no
    /// direction, although the structure has not exactly as many axes as the effect needs.
    #[error("effect `{name}`: {what}; the structure has the directions {directions}")]
    Direction {
        /// The effect.
        name: &'static str,
        /// The fault.
        what: String,
        /// The directions of the structure.
        directions: String,
    },
    /// An effect that this structure does not allow: for example one with a parameter that this kind of structure does
    /// not have, or one that needs a static stiffness that is not known.
    #[error("effect `{name}`: {what}")]
    Structure {
        /// The effect.
        name: &'static str,
        /// The fault, in some cases with the remedy.
        what: String,
    },
    /// An effect of the cut that requires a quantity of the tool or the cut that is not given, or that the structure
    /// does not allow.
    #[error("effect `{name}`: {what}")]
    Cut {
        /// The effect.
        name: &'static str,
        /// The fault, and the remedy.
        what: &'static str,
    },
    /// Friction with a stick regime on a structure given by modes whose residues do not sum to zero, so that it has no
    /// mass matrix: stick is not computed there.
    #[error(
        "{name}: the modes of this structure add up to no mass (their residues do not sum to zero), so that no friction can hold it; use mass, damping and stiffness matrices",
        name = EffectName::CoulombFriction.name()
    )]
    NoInertia,
}

/// The unit of the parameter of an effect with this key, or with an empty key of VALUE, as words after a description of
/// possible values; empty for a parameter without unit.
fn unit(name: &str, key: &str) -> String {
    let spec = name.parse::<EffectName>().ok().map(EffectName::spec);
    let parameter = spec.and_then(|spec| {
        if key.is_empty() {
            spec.main()
        } else {
            spec.parameter(key)
        }
    });
    match parameter {
        Some(parameter) if !parameter.unit.is_empty() => format!(" in {}, without the unit,", parameter.unit),
        _ => String::new(),
    }
}

/// What VALUE means for the effect whose name is closest to an unknown one, in words after the names; empty without such
/// an effect or without unit.
fn value_of_closest(unknown: &str) -> String {
    let names = EffectName::ALL.into_iter().map(EffectName::name);
    match nearest::nearest(unknown, names) {
        Some(closest) => match unit(closest, "") {
            unit if unit.is_empty() => unit,
            unit => format!(
                "; the value of {closest} is a number{}",
                unit.trim_end_matches(',')
            ),
        },
        None => String::new(),
    }
}

impl EffectError {
    /// Name of the effect at fault, or the unknown name, and the key of [`Self::Key`] or [`Self::Value`]; the key is
    /// empty for all other errors. `None` for a text without `=`.
    pub fn location(&self) -> Option<(&str, &str)> {
        match self {
            Self::Form(_) => None,
            Self::Unknown(name) => Some((name, "")),
            Self::Key { effect, key } => Some((effect.name(), key)),
            Self::Missing { name, .. }
            | Self::NoDuration { name, .. }
            | Self::Direction { name, .. }
            | Self::Structure { name, .. }
            | Self::Cut { name, .. } => Some((name, "")),
            Self::Value { name, key, .. } => Some((name, key)),
            Self::NoInertia => Some((EffectName::CoulombFriction.name(), "")),
        }
    }
}
