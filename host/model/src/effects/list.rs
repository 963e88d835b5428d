//! Macro that makes the type [`EffectName`] and the list of all effects from one table.

use std::str::FromStr;

use super::{EffectError, EffectName};

macro_rules! list {
    ($($variant:ident => $module:ident::$spec:ident,)+) => {
        /// The name of an effect.
        ///
        /// A match on [`EffectName`] without a wildcard makes the compiler ask for the treatment of a new effect.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum EffectName {
            $(#[doc = concat!("The effect of the file `", stringify!($module), ".rs`.")] $variant,)+
        }

        /// The specifications of all effects, in the order of [`EffectName`].
        pub const ALL: [&EffectSpec; [$(EffectName::$variant),+].len()] = [$(&$module::$spec),+];

        impl EffectName {
            /// All effects.
            pub const ALL: [Self; ALL.len()] = [$(Self::$variant),+];

            /// The specification of the effect.
            pub const fn spec(self) -> &'static EffectSpec {
                match self {
                    $(Self::$variant => &$module::$spec,)+
                }
            }

            /// Name of the effect in cases, in answers and on the command line.
            pub const fn name(self) -> &'static str {
                self.spec().name
            }
        }
    };
}

pub(super) use list;

impl FromStr for EffectName {
    type Err = EffectError;

    fn from_str(name: &str) -> Result<Self, EffectError> {
        Self::ALL
            .into_iter()
            .find(|known| known.name() == name)
            .ok_or_else(|| EffectError::Unknown(name.into()))
    }
}

impl std::fmt::Display for EffectName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}
