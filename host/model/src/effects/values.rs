//! The values given for an effect, from the command line or from a case.

use std::collections::{BTreeMap, BTreeSet};

use super::parameter::{Prior, ValueKind};
use super::{EffectError, EffectName};
use crate::structure::Direction;

/// A value of a parameter as given in the case or on the command line.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number; a switch is stored as 1 (true) or 0 (false).
    Number(f64),
    /// A word.
    Text(String),
    /// Several words.
    List(Vec<String>),
    /// Several numbers, one for each direction, channel or mode.
    Numbers(Vec<f64>),
}

impl Value {
    /// Value of a text from the command line: a number if the text is one, 1 or 0 for `true` or `false`. A text with
    /// commas is a list of numbers if all its parts are numbers, otherwise a list of words; any other text is a word.
    pub fn of_text(text: &str) -> Self {
        let text = text.trim();
        if let Ok(number) = text.parse() {
            return Self::Number(number);
        }
        if let Ok(on) = text.parse::<bool>() {
            return Self::Number(f64::from(u8::from(on)));
        }
        if !text.contains(',') {
            return Self::Text(text.into());
        }
        let parts = || text.split(',').map(str::trim);
        match parts().map(str::parse).collect() {
            Ok(numbers) => Self::Numbers(numbers),
            Err(_) => Self::List(parts().map(String::from).collect()),
        }
    }

    /// Value of a TOML value. `None` for tables, dates, and lists that contain neither only words nor only numbers.
    pub fn of_toml(value: &toml::Value) -> Option<Self> {
        match value {
            toml::Value::Boolean(on) => Some(Self::Number(f64::from(u8::from(*on)))),
            toml::Value::Integer(number) => Some(Self::Number(*number as f64)),
            toml::Value::Float(number) => Some(Self::Number(*number)),
            toml::Value::String(text) => Some(Self::Text(text.clone())),
            toml::Value::Array(list) => {
                let number = |value: &toml::Value| {
                    value
                        .as_float()
                        .or_else(|| value.as_integer().map(|whole| whole as f64))
                };
                let words: Option<Vec<String>> =
                    list.iter().map(|word| word.as_str().map(String::from)).collect();
                words
                    .map(Self::List)
                    .or_else(|| list.iter().map(number).collect::<Option<_>>().map(Self::Numbers))
            }
            _ => None,
        }
    }

    pub(super) fn in_words(&self) -> String {
        match self {
            Self::Number(number) => number.to_string(),
            Self::Text(text) => text.clone(),
            Self::List(words) => words.join(","),
            Self::Numbers(numbers) => {
                let numbers: Vec<String> = numbers.iter().map(f64::to_string).collect();
                numbers.join(",")
            }
        }
    }
}

/// The values given for one effect. The effect removes those that it uses, so that unused keys remain.
#[derive(Clone, Debug)]
pub struct Values {
    effect: EffectName,
    /// Values by the key of the parameter or the location; the VALUE of the command line has the empty key.
    by_key: BTreeMap<String, Value>,
    /// Length of the recording, s, over which the VALUE of [`Self::rate`] is a change; `None` if it is not known.
    record_s: Option<f64>,
}

impl Values {
    pub(super) fn new(effect: EffectName) -> Self {
        Self {
            effect,
            by_key: BTreeMap::new(),
            record_s: None,
        }
    }

    /// These values for a recording of the length `record_s`, s, over which the VALUE of [`Self::rate`] is a change;
    /// `None` if it is not known.
    pub(super) fn over(mut self, record_s: Option<f64>) -> Self {
        self.record_s = record_s;
        self
    }

    pub(super) fn effect(&self) -> EffectName {
        self.effect
    }

    pub(super) fn put(&mut self, key: &str, value: Value) {
        self.by_key.insert(key.into(), value);
    }

    /// The value with this key; `None` if it is not given.
    pub(super) fn given(&self, key: &str) -> Option<&Value> {
        self.by_key.get(key)
    }

    /// Removes the value with this key from the given values and returns it; `None` if it is not given.
    pub(super) fn take(&mut self, key: &str) -> Option<Value> {
        self.by_key.remove(key)
    }

    /// The bounds of the effect's parameter with this key; for the empty key (VALUE) those of the main parameter; any
    /// finite number if there is no such parameter.
    fn prior(&self, key: &str) -> Prior {
        let parameter = if key.is_empty() {
            self.effect.spec().main()
        } else {
            self.effect.spec().parameter(key)
        };
        parameter.map_or(Prior::ANY, |parameter| parameter.prior)
    }

    /// Removes the number with this key from the given values and returns it; `None` if it is not given.
    ///
    /// # Errors
    /// The value is not a finite number, or out of the bounds of its parameter.
    pub(super) fn number(&mut self, key: &str) -> Result<Option<f64>, EffectError> {
        let prior = self.prior(key);
        match self.by_key.remove(key) {
            None => Ok(None),
            Some(Value::Number(number)) if prior.allows(number) => Ok(Some(number)),
            Some(other) => Err(self.wrong(key, &other, prior.words)),
        }
    }

    /// Splits values whose `direction` or `channel` is a list into one set of values for each location. A list of
    /// numbers has one number for each location; a single value applies to all. The channels of an effect with one
    /// number per mode are not split.
    ///
    /// # Errors
    /// The length of a list of numbers differs from the number of locations, or the list of locations is empty or names
    /// one twice.
    pub(super) fn by_location(self) -> Result<Vec<Self>, EffectError> {
        let has_number_per_mode = self
            .effect
            .spec()
            .parameters
            .iter()
            .any(|parameter| parameter.kind == ValueKind::NumberPerMode);
        let listed = ["direction", "channel"]
            .into_iter()
            .find_map(|key| match self.by_key.get(key) {
                Some(Value::List(names)) if key == "direction" || !has_number_per_mode => {
                    Some((key, names.clone()))
                }
                _ => None,
            });
        let Some((location, names)) = listed else {
            return Ok(vec![self]);
        };
        if let ("direction", Some(channels @ Value::List(_))) = (location, self.by_key.get("channel")) {
            return Err(self.wrong("channel", channels, "one name beside a list of directions"));
        }
        let distinct: BTreeSet<&String> = names.iter().collect();
        if names.is_empty() || distinct.len() < names.len() {
            let found = Value::List(names);
            return Err(self.wrong(location, &found, "one name, or several that differ"));
        }
        let uneven = self
            .by_key
            .iter()
            .find(|(_, value)| matches!(value, Value::Numbers(numbers) if numbers.len() != names.len()));
        if let Some((key, value)) = uneven {
            return Err(self.wrong(key, value, "one number, or one for each location,"));
        }
        let of = |(index, name): (usize, &String)| {
            let mut own = self.clone();
            for value in own.by_key.values_mut() {
                if let Value::Numbers(numbers) = value {
                    *value = Value::Number(numbers[index]);
                }
            }
            own.put(location, Value::Text(name.clone()));
            own
        };
        Ok(names.iter().enumerate().map(of).collect())
    }

    /// Value of the effect's main parameter, given by its key or as VALUE of `--effect NAME=VALUE`.
    pub(super) fn main(&mut self, key: &'static str) -> Result<f64, EffectError> {
        match self.number("")? {
            Some(number) => Ok(number),
            None => self.needed(key),
        }
    }

    /// Values of a main parameter with one number for each mode or one for all, given by its key or as VALUE of
    /// `--effect NAME=VALUE`.
    pub(super) fn main_numbers(&mut self, key: &'static str) -> Result<Vec<f64>, EffectError> {
        let given = if self.by_key.contains_key("") { "" } else { key };
        match self.by_key.remove(given) {
            Some(Value::Number(number)) if number.is_finite() => Ok(vec![number]),
            Some(Value::Numbers(numbers)) if !numbers.is_empty() && numbers.iter().all(|x| x.is_finite()) => {
                Ok(numbers)
            }
            Some(other) => Err(self.wrong(given, &other, "a number, or several")),
            None => Err(self.missing(key)),
        }
    }

    /// State of an on/off parameter, given by its key or as VALUE of `--effect NAME=VALUE`: true for 1, false for 0.
    /// True and false of a case are stored as 1 and 0.
    pub(super) fn switch(&mut self, key: &'static str) -> Result<bool, EffectError> {
        let given = if self.by_key.contains_key("") { "" } else { key };
        match self.by_key.remove(given) {
            Some(Value::Number(number)) if number == 0.0 || number == 1.0 => Ok(number == 1.0),
            Some(other) => Err(self.wrong(given, &other, "true or false (1 or 0)")),
            None => Err(self.missing(key)),
        }
    }

    /// Relative rate of drift or wear, 1/s: given by its key, or as VALUE, which is the relative change over the whole
    /// recording.
    pub(super) fn rate(&mut self, key: &'static str) -> Result<f64, EffectError> {
        match (self.number("")?, self.record_s) {
            (Some(change), Some(record_s)) => Ok(change / record_s),
            (Some(_), None) => Err(EffectError::NoDuration {
                name: self.effect.name(),
                key,
            }),
            (None, _) => self.needed(key),
        }
    }

    /// Removes the number with this key from the given values and returns it; an error if it is missing or not
    /// possible.
    pub(super) fn needed(&mut self, key: &'static str) -> Result<f64, EffectError> {
        self.number(key)?.ok_or_else(|| self.missing(key))
    }

    /// The error for a required key of the effect that is missing.
    pub(super) fn missing(&self, key: &'static str) -> EffectError {
        EffectError::Missing {
            name: self.effect.name(),
            key,
        }
    }

    /// The error for the refused value `found` of a key; `needed` describes the possible values.
    pub(super) fn clash(&self, key: &str, found: impl ToString, needed: &'static str) -> EffectError {
        self.wrong(key, &Value::Text(found.to_string()), needed)
    }

    /// Removes the word with this key from the given values and returns it; `None` if it is not given.
    pub(super) fn text(&mut self, key: &str) -> Result<Option<String>, EffectError> {
        match self.by_key.remove(key) {
            None => Ok(None),
            Some(Value::Text(text)) => Ok(Some(text)),
            Some(other) => Err(self.wrong(key, &other, "a name")),
        }
    }

    /// The key `direction`.
    pub(super) fn direction(&mut self) -> Result<Option<Direction>, EffectError> {
        let key = "direction";
        match self.text(key)? {
            None => Ok(None),
            Some(text) => match text.parse() {
                Ok(direction) => Ok(Some(direction)),
                Err(_) => Err(self.wrong(key, &Value::Text(text), "x, y or z")),
            },
        }
    }

    /// The key `channel`.
    pub(super) fn channel(&mut self) -> Result<Option<String>, EffectError> {
        self.text("channel")
    }

    /// Value of the key `directions`, two different directions: `["x", "y"]` in a case or `x,y` on the command line.
    /// `None` if it is not given.
    pub(super) fn directions(&mut self) -> Result<Option<[Direction; 2]>, EffectError> {
        let key = "directions";
        let Some(value) = self.by_key.remove(key) else {
            return Ok(None);
        };
        if let Value::List(words) = &value
            && let [a, b] = words.as_slice()
            && let (Ok(a), Ok(b)) = (a.parse(), b.parse())
            && a != b
        {
            return Ok(Some([a, b]));
        }
        Err(self.wrong(key, &value, "two of x, y and z, as in x,y"))
    }

    fn wrong(&self, key: &str, found: &Value, needed: &'static str) -> EffectError {
        EffectError::Value {
            name: self.effect.name(),
            key: key.into(),
            found: found.in_words(),
            needed,
        }
    }

    /// Checks that the effect has used all given values.
    ///
    /// # Errors
    /// A key or VALUE is left: see [`EffectError::Key`].
    pub(super) fn finish(self) -> Result<(), EffectError> {
        match self.by_key.into_keys().next() {
            None => Ok(()),
            Some(key) => Err(EffectError::Key {
                effect: self.effect,
                key: if key.is_empty() { "a value".into() } else { key },
            }),
        }
    }
}
