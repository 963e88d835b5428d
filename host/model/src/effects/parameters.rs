//! The parameters of an effect, from the command line or from a case.

use std::collections::{BTreeMap, BTreeSet};

use super::EffectError;
use crate::structure::Direction;

/// A value as it was given.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number; true is 1 and false is 0.
    Number(f64),
    /// A word.
    Text(String),
    /// Several words.
    List(Vec<String>),
    /// Several numbers, one for each direction or mode.
    Numbers(Vec<f64>),
}

impl Value {
    /// A number where the text is one, several numbers or words where it has commas.
    pub fn of_text(text: &str) -> Self {
        let text = text.trim();
        if let Ok(number) = text.parse() {
            return Self::Number(number);
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

    /// `None` for tables, dates and lists of anything but words alone or numbers alone.
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

    fn said(&self) -> String {
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

/// What was given for one effect; an effect takes out what it knows.
#[derive(Clone, Debug)]
pub struct Parameters {
    effect: String,
    /// By key; the quantity that the effect is named for has the key "".
    values: BTreeMap<String, Value>,
    /// How long the record is, s; `None` where that is not known.
    record_s: Option<f64>,
}

impl Parameters {
    pub(super) fn new(effect: &str) -> Self {
        Self {
            effect: effect.into(),
            values: BTreeMap::new(),
            record_s: None,
        }
    }

    /// The same, for a record that is so long.
    pub(super) fn over(mut self, record_s: Option<f64>) -> Self {
        self.record_s = record_s;
        self
    }

    pub(super) fn effect(&self) -> &str {
        &self.effect
    }

    pub(super) fn put(&mut self, key: &str, value: Value) {
        self.values.insert(key.into(), value);
    }

    /// The number of a key; `None` where it is not given.
    ///
    /// # Errors
    /// It is no finite number, or not one that `allowed` allows.
    pub(super) fn number(
        &mut self,
        key: &str,
        allowed: fn(f64) -> bool,
        needed: &'static str,
    ) -> Result<Option<f64>, EffectError> {
        match self.values.remove(key) {
            None => Ok(None),
            Some(Value::Number(number)) if number.is_finite() && allowed(number) => Ok(Some(number)),
            Some(other) => Err(self.wrong(key, &other, needed)),
        }
    }

    /// One set of parameters for each place, where `direction`, or else `channel`, names several: what has several numbers has one for
    /// each, what has one has the same for all. Ratios are one for each mode, of one channel.
    ///
    /// # Errors
    /// Numbers that are not as many as the places.
    pub(super) fn by_place(self) -> Result<Vec<Self>, EffectError> {
        let listed = ["direction", "channel"]
            .into_iter()
            .find_map(|key| match self.values.get(key) {
                Some(Value::List(names)) if key == "direction" || !self.values.contains_key("ratio") => {
                    Some((key, names.clone()))
                }
                _ => None,
            });
        let Some((place, names)) = listed else {
            return Ok(vec![self]);
        };
        let distinct: BTreeSet<&String> = names.iter().collect();
        if names.is_empty() || distinct.len() < names.len() {
            let found = Value::List(names);
            return Err(self.wrong(place, &found, "one name, or several that differ"));
        }
        let uneven = self
            .values
            .iter()
            .find(|(_, value)| matches!(value, Value::Numbers(numbers) if numbers.len() != names.len()));
        if let Some((key, value)) = uneven {
            return Err(self.wrong(key, value, "one number, or one for each of its places"));
        }
        let of = |(index, name): (usize, &String)| {
            let mut own = self.clone();
            for value in own.values.values_mut() {
                if let Value::Numbers(numbers) = value {
                    *value = Value::Number(numbers[index]);
                }
            }
            own.put(place, Value::Text(name.clone()));
            own
        };
        Ok(names.iter().enumerate().map(of).collect())
    }

    /// Any finite number.
    pub(super) fn finite(&mut self, key: &str) -> Result<Option<f64>, EffectError> {
        self.number(key, |_| true, "a number")
    }

    /// A number greater than 0.
    pub(super) fn positive(&mut self, key: &str) -> Result<Option<f64>, EffectError> {
        self.number(key, |x| x > 0.0, "a number greater than 0")
    }

    /// The quantity that the effect is named for, by its own key or without one.
    pub(super) fn main(&mut self, key: &'static str) -> Result<f64, EffectError> {
        match self.finite("")? {
            Some(number) => Ok(number),
            None => self.needed(key),
        }
    }

    /// The quantity that the effect is named for, of which there may be several, by its own key or without one.
    pub(super) fn main_numbers(&mut self, key: &'static str) -> Result<Vec<f64>, EffectError> {
        let given = if self.values.contains_key("") { "" } else { key };
        match self.values.remove(given) {
            Some(Value::Number(number)) if number.is_finite() => Ok(vec![number]),
            Some(Value::Numbers(numbers)) if !numbers.is_empty() && numbers.iter().all(|x| x.is_finite()) => {
                Ok(numbers)
            }
            Some(other) => Err(self.wrong(given, &other, "a number, or several")),
            None => Err(EffectError::Missing {
                name: self.effect.clone(),
                key,
            }),
        }
    }

    /// A relative rate per s: by its own key, or from the change over the whole record that the effect is named for.
    pub(super) fn rate(&mut self, key: &'static str) -> Result<f64, EffectError> {
        match (self.finite("")?, self.record_s) {
            (Some(change), Some(record_s)) => Ok(change / record_s),
            (Some(_), None) => Err(EffectError::NoDuration {
                name: self.effect.clone(),
                key,
            }),
            (None, _) => self.needed(key),
        }
    }

    /// A number that must be there.
    pub(super) fn needed(&mut self, key: &'static str) -> Result<f64, EffectError> {
        self.finite(key)?.ok_or_else(|| EffectError::Missing {
            name: self.effect.clone(),
            key,
        })
    }

    /// A word.
    pub(super) fn text(&mut self, key: &str) -> Result<Option<String>, EffectError> {
        match self.values.remove(key) {
            None => Ok(None),
            Some(Value::Text(text)) => Ok(Some(text)),
            Some(other) => Err(self.wrong(key, &other, "a name")),
        }
    }

    /// A direction.
    pub(super) fn direction(&mut self, key: &str) -> Result<Option<Direction>, EffectError> {
        match self.text(key)? {
            None => Ok(None),
            Some(text) => match text.parse() {
                Ok(direction) => Ok(Some(direction)),
                Err(_) => Err(self.wrong(key, &Value::Text(text), "x, y or z")),
            },
        }
    }

    /// Two directions, as `directions = ["x", "y"]` or `x,y`.
    pub(super) fn pair(&mut self, key: &str) -> Result<Option<[Direction; 2]>, EffectError> {
        let Some(value) = self.values.remove(key) else {
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
            effect: if key.is_empty() {
                self.effect.clone()
            } else {
                format!("{}.{key}", self.effect)
            },
            found: found.said(),
            needed,
        }
    }

    /// # Errors
    /// A key that nobody has taken.
    pub(super) fn finish(self, known: &'static str) -> Result<(), EffectError> {
        match self.values.into_keys().next() {
            None => Ok(()),
            Some(key) => Err(EffectError::Key {
                name: self.effect,
                key: if key.is_empty() { "a value".into() } else { key },
                known,
            }),
        }
    }
}
