//! Check of the tables `[extension.NAME]` of a case: the names, keys and values that [`EffectSpec`] allows.

use std::collections::BTreeMap;

use toml::{Spanned, Value};

use super::Check;
use crate::case::CaseError;
use crate::case::file::ExtensionsFile;
use crate::effects::nearest::expected;
use crate::effects::{EffectName, EffectSpec, Effects, Parameter, ValueKind};
use crate::structure::Direction;

/// Endings of parameter keys that state a unit. They recognise a key that differs from a known one in the unit only.
const UNITS: [&str; 40] = [
    "_n_per_m",
    "_n_per_mm",
    "_n_per_um",
    "_n_per_m2",
    "_n_per_mm2",
    "_n_per_m3",
    "_n_per_mm3",
    "_n_per_m5",
    "_n_per_mm5",
    "_ns_per_m",
    "_ns_per_mm",
    "_ns2_per_m2",
    "_ns2_per_mm2",
    "_ns3_per_m3",
    "_ns3_per_mm3",
    "_per_s",
    "_per_min",
    "_per_h",
    "_rad_per_s",
    "_m",
    "_mm",
    "_um",
    "_s",
    "_ms",
    "_us",
    "_min",
    "_h",
    "_hz",
    "_khz",
    "_rpm",
    "_deg",
    "_rad",
    "_kg",
    "_g",
    "_n",
    "_kn",
    "_pa",
    "_mpa",
    "_gpa",
    "_percent",
];

/// The key of a parameter without the ending that states its unit.
fn stem(key: &str) -> &str {
    UNITS
        .iter()
        .filter_map(|unit| key.strip_suffix(unit))
        .min_by_key(|stem| stem.len())
        .unwrap_or(key)
}

/// The first parameter of the effect `spec` whose key differs from `key` in the unit only; `None` if there is none.
fn of_other_unit(spec: &EffectSpec, key: &str) -> Option<&'static Parameter> {
    let with_key = || {
        spec.parameters
            .iter()
            .filter(|parameter| !parameter.key.is_empty())
    };
    with_key().find(|parameter| stem(parameter.key) == stem(key))
}

impl Check<'_> {
    pub(super) fn extensions(
        &self,
        file: ExtensionsFile,
    ) -> Result<BTreeMap<String, toml::Table>, CaseError> {
        let mut extensions = BTreeMap::new();
        for (name, table) in &file {
            let effect: EffectName = name.get_ref().parse().map_err(|_| {
                let known = EffectName::ALL.into_iter().map(EffectName::name);
                let found = format!("\"{}\"", name.get_ref());
                self.wrong(name, "extension", found, expected(name.get_ref(), known))
            })?;
            for (key, value) in table {
                self.extension_value(effect.spec(), key, value)?;
            }
            let table = table
                .iter()
                .map(|(key, value)| (key.get_ref().clone(), value.get_ref().clone()));
            extensions.insert(name.get_ref().clone(), table.collect::<toml::Table>());
        }
        self.extensions_together(&file, &extensions)?;
        Ok(extensions)
    }

    /// Refuses extensions of which a key is missing, or whose keys or values are not possible together.
    fn extensions_together(
        &self,
        file: &ExtensionsFile,
        extensions: &BTreeMap<String, toml::Table>,
    ) -> Result<(), CaseError> {
        let tables = extensions.iter().map(|(name, table)| (name.as_str(), table));
        let Err(error) = Effects::of_extensions(tables) else {
            return Ok(());
        };
        let (effect, key) = error.location().unwrap_or_default();
        let of_effect = file.iter().find(|(name, _)| name.get_ref() == effect);
        let Some((name, table)) = of_effect.or_else(|| file.iter().next()) else {
            return Ok(());
        };
        let line = table
            .iter()
            .find(|(known, _)| known.get_ref() == key)
            .map_or_else(|| self.line(name), |(key, _)| self.line(key));
        Err(CaseError::Effect {
            path: self.path.into(),
            line,
            error,
        })
    }

    fn extension_value(
        &self,
        spec: &EffectSpec,
        key: &Spanned<String>,
        value: &Spanned<Value>,
    ) -> Result<(), CaseError> {
        let name = key.get_ref().as_str();
        let full = format!("extension.{}.{name}", spec.name);
        if spec.locations.keys().contains(&name) {
            return self.location(value, &full, name);
        }
        if let Some(parameter) = name.strip_suffix("_std").and_then(|of| spec.parameter(of)) {
            let is_deviation = |x: f64| x.is_finite() && x >= 0.0;
            let numbers = numbers(value.get_ref()).filter(|_| is_number(parameter.kind));
            return match numbers {
                Some(all) if all.iter().all(|x| is_deviation(*x)) => Ok(()),
                _ => Err(self.wrong(value, &full, value.get_ref(), "a standard deviation of 0 or more")),
            };
        }
        let known = spec.parameter(name).filter(|parameter| !parameter.key.is_empty());
        let Some(parameter) = known else {
            return Err(match of_other_unit(spec, name) {
                Some(Parameter { key: right, unit, .. }) if !unit.is_empty() => {
                    self.wrong(key, &full, "another unit", format!("the key {right}, in {unit},"))
                }
                _ => self.wrong(key, &full, "an unknown key", expected(name, spec.keys())),
            });
        };
        let fits = match parameter.kind {
            ValueKind::Number | ValueKind::NumberPerMode => numbers(value.get_ref())
                .is_some_and(|all| !all.is_empty() && all.iter().all(|x| parameter.prior.allows(*x))),
            ValueKind::Word => value.get_ref().is_str(),
            ValueKind::Switch => value.get_ref().is_bool(),
        };
        if fits {
            return Ok(());
        }
        let needed = match parameter.kind {
            ValueKind::Number | ValueKind::NumberPerMode => parameter.prior.words.into(),
            ValueKind::Word => "a word".into(),
            ValueKind::Switch => format!("{name} = true or {name} = false"),
        };
        let unit = match parameter.unit {
            "" => String::new(),
            unit => format!(", in {unit},"),
        };
        Err(self.wrong(value, &full, value.get_ref(), format!("{needed}{unit}")))
    }

    /// Checks the value of a key that sets the location of an effect: a name, or a list of names; for `directions` only
    /// a list.
    fn location(&self, value: &Spanned<Value>, full: &str, key: &str) -> Result<(), CaseError> {
        let fits = |word: &Value| match word.as_str() {
            Some(word) => {
                key == "channel" || word.parse().is_ok_and(|known: Direction| known.axis().is_some())
            }
            None => false,
        };
        let (fits, needed) = match value.get_ref() {
            Value::Array(list) => (list.iter().all(fits), "a list of directions or channels"),
            one => (
                fits(one) && key != "directions",
                match key {
                    "channel" => "the name of a channel, or a list of names,",
                    "directions" => "a list of two of \"x\", \"y\" and \"z\"",
                    _ => "\"x\", \"y\" or \"z\", or a list of these,",
                },
            ),
        };
        if fits {
            Ok(())
        } else {
            Err(self.wrong(value, full, value.get_ref(), needed))
        }
    }
}

fn is_number(kind: ValueKind) -> bool {
    matches!(kind, ValueKind::Number | ValueKind::NumberPerMode)
}

/// The numbers of a TOML value that is a number or a list of numbers; `None` for any other value.
fn numbers(value: &Value) -> Option<Vec<f64>> {
    let number = |value: &Value| {
        value
            .as_float()
            .or_else(|| value.as_integer().map(|whole| whole as f64))
    };
    match value {
        Value::Array(list) => list.iter().map(number).collect(),
        one => number(one).map(|number| vec![number]),
    }
}
