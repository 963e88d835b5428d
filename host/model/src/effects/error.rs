//! An effect that cannot be.

use super::KINDS;

/// What is wrong with an effect.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EffectError {
    /// Not `NAME=VALUE`.
    #[error("effect `{0}`: NAME=VALUE or NAME.KEY=VALUE is needed, as in runout=20")]
    Form(String),
    /// A name that is not known.
    #[error("effect `{0}` is not known; there are {list}", list = names())]
    Unknown(String),
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
    /// A key that is not there.
    #[error("effect `{name}` needs {key}")]
    Missing {
        /// The effect.
        name: String,
        /// What is needed.
        key: &'static str,
    },
    /// A change over a record whose length is not known.
    #[error("effect `{name}`: how long the record is, is not known here; give {name}.{key} instead")]
    NoDuration {
        /// The effect.
        name: String,
        /// The key to give.
        key: &'static str,
    },
    /// A value that cannot be.
    #[error("effect `{effect}`: `{found}` is not possible; {needed} is needed")]
    Value {
        /// The effect, with its key.
        effect: String,
        /// What was found.
        found: String,
        /// What would be right.
        needed: &'static str,
    },
    /// A direction that the structure does not have, or one that must be said.
    #[error("effect `{name}`: {what}; the structure has the directions {directions}")]
    Direction {
        /// The effect.
        name: &'static str,
        /// What is wrong.
        what: String,
        /// What there is.
        directions: String,
    },
    /// A parameter that this kind of structure does not have.
    #[error("effect `{name}`: {what}")]
    Structure {
        /// The effect.
        name: &'static str,
        /// What is wrong, and what would be right.
        what: String,
    },
    /// Something that the cut of the case does not allow.
    #[error("effect `{name}`: {what}")]
    Cut {
        /// The effect.
        name: &'static str,
        /// What is wrong, and what would be right.
        what: &'static str,
    },
    /// Friction that holds a tool without inertia.
    #[error(
        "coulomb-friction: the modes of this structure add up to no mass (their residues do not sum to zero), so that no friction can hold it; use mass, damping and stiffness matrices"
    )]
    NoInertia,
}

fn names() -> String {
    KINDS.map(|kind| kind.name).join(", ")
}
