//! The effects that a case has as extensions.

use super::Case;
use crate::effects::{EffectError, Effects};

impl Effects {
    /// The effects that a case has as extensions: one for each location where `direction`, or else `channel`, is a list. A tool's runout
    /// is part of the tool and not among them.
    ///
    /// # Errors
    /// An extension that cannot be simulated, or a key or value that it cannot have.
    pub fn of_case(case: &Case) -> Result<Self, EffectError> {
        Self::of_extensions(case.extensions.iter().map(|(name, table)| (name.as_str(), table)))
    }
}
