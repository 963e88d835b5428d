//! The effects that a case has as extensions.

use super::Case;
use crate::effects::{EffectError, Effects};

impl Effects {
    /// The effects that a case has as extensions. A table whose key `direction` or `channel` is a list gives one effect
    /// for each location of the list, except for the channels of an effect with one number per mode. The runout of the
    /// section `[tool]` is not among the effects.
    ///
    /// # Errors
    /// An unknown extension, an unknown or missing key, or keys or values that are not possible alone or together.
    pub fn of_case(case: &Case) -> Result<Self, EffectError> {
        Self::of_extensions(case.extensions.iter().map(|(name, table)| (name.as_str(), table)))
    }
}
