//! Errors of an effect with impossible or missing values, or that does not apply to the model.

use super::{EffectName, nearest};

/// The fault of an effect.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EffectError {
    /// A text without `=`: neither `NAME=VALUE` nor `NAME.KEY=VALUE`.
    #[error("effect `{0}`: NAME=VALUE or NAME.KEY=VALUE is needed, as in {example}=20", example = EffectName::Runout.name())]
    Form(String),
    /// An unknown name.
    #[error("effect `{0}` is not known; {names} is needed", names = nearest::expected(.0, EffectName::ALL.into_iter().map(EffectName::name)))]
    Unknown(String),
    /// A key that the effect does not have, or does not use beside the other given keys.
    #[error("effect `{name}` has no key `{key}`; it has {known}", name = .effect.name(), known = .effect.spec().keys_in_words())]
    Key {
        /// The effect.
        effect: EffectName,
        /// The key.
        key: String,
    },
    /// A missing key that the effect with this name requires.
    #[error("effect `{name}` needs {key}")]
    Missing {
        /// The effect.
        name: &'static str,
        /// The key.
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
    /// given values.
    #[error("effect `{name}{dot}{key}`: `{found}` is not possible; {needed} is needed", dot = if .key.is_empty() { "" } else { "." })]
    Value {
        /// The effect.
        name: &'static str,
        /// The key of the refused value; empty for the VALUE of `--effect NAME=VALUE`.
        key: String,
        /// The value as given.
        found: String,
        /// Description of the possible values.
        needed: &'static str,
    },
    /// A direction of an effect that cannot be used: for example one that the structure does not have, a rotation
    /// instead of an axis, or none although the structure has several.
    #[error("effect `{name}`: {what}; the structure has the directions {directions}")]
    Direction {
        /// The effect.
        name: &'static str,
        /// The fault.
        what: String,
        /// The directions of the structure.
        directions: String,
    },
    /// An effect that this structure does not allow: for example with a parameter that this kind of structure does not
    /// have, or if its static stiffness is not known.
    #[error("effect `{name}`: {what}")]
    Structure {
        /// The effect.
        name: &'static str,
        /// The fault, and the remedy.
        what: String,
    },
    /// An effect that requires a quantity of the tool or the cut that is not given.
    #[error("effect `{name}`: {what}")]
    Cut {
        /// The effect.
        name: &'static str,
        /// The fault, and the remedy.
        what: &'static str,
    },
    /// Friction on a structure given by modes that have no mass matrix, so that the tool cannot stick.
    #[error(
        "{name}: the modes of this structure add up to no mass (their residues do not sum to zero), so that no friction can hold it; use mass, damping and stiffness matrices",
        name = EffectName::CoulombFriction.name()
    )]
    NoInertia,
}

impl EffectError {
    /// Name of the effect and key that are at fault; the key is empty if the error does not record one. An unknown
    /// effect is given by the name that was found; `None` for a text without `=`.
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
