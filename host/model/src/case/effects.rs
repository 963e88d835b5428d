//! The effects that a case has as extensions.

use super::Case;
use crate::effects::{EffectError, Effects};

impl Effects {
    /// The effects that a case has as extensions. A table whose key `direction` or `channel` is a list gives one effect
    /// for each location of the list. The runout of the section `[tool]` is not among them.
    ///
    /// # Errors
    /// An unknown extension, an unknown key, a missing key, or a value that is not possible alone or together with
    /// others.
    pub fn of_case(case: &Case) -> Result<Self, EffectError> {
        Self::of_extensions(case.extensions.iter().map(|(name, table)| (name.as_str(), table)))
    }
}
