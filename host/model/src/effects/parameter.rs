//! One parameter of an effect: key, unit, type and bounds.

/// One parameter of an effect.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// The key in cases and answers; empty where only the command line has it, as the VALUE of the effect.
    pub key: &'static str,
    /// Its unit; empty for words and for numbers without a unit.
    pub unit: &'static str,
    /// The type of its value.
    pub kind: ValueKind,
    /// True where the effect is linear in it.
    pub linear: bool,
    /// True for the parameter that the VALUE of the command line stands for.
    pub main: bool,
    /// The values that it can have, before any recording is seen.
    pub prior: Prior,
    /// What it is.
    pub meaning: &'static str,
}

impl Parameter {
    /// A number of any size in a unit.
    pub(super) const fn number(key: &'static str, unit: &'static str, meaning: &'static str) -> Self {
        Self {
            key,
            unit,
            kind: ValueKind::Number,
            linear: false,
            main: false,
            prior: Prior::ANY,
            meaning,
        }
    }

    /// A word.
    pub(super) const fn word(key: &'static str, meaning: &'static str) -> Self {
        Self {
            kind: ValueKind::Word,
            ..Self::number(key, "", meaning)
        }
    }

    /// The same parameter, in which the effect is linear.
    pub(super) const fn linear(self) -> Self {
        Self { linear: true, ..self }
    }

    /// The same parameter, for which the VALUE of the command line stands.
    pub(super) const fn main(self) -> Self {
        Self { main: true, ..self }
    }

    /// The same parameter within bounds.
    pub(super) const fn within(self, prior: Prior) -> Self {
        Self { prior, ..self }
    }

    /// The same parameter with another type of value.
    pub(super) const fn of_kind(self, kind: ValueKind) -> Self {
        Self { kind, ..self }
    }
}

/// The type of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueKind {
    /// A number; a list where the effect acts at several locations.
    Number,
    /// A number, or one for each mode of the structure.
    NumberPerMode,
    /// A word.
    Word,
    /// true or false.
    Switch,
}

/// The values that a parameter can have.
#[derive(Clone, Copy, Debug)]
pub struct Prior {
    /// The lower bound.
    pub low: f64,
    /// The upper bound.
    pub high: f64,
    /// True where the bound itself is possible: lower, upper.
    pub closed: [bool; 2],
    /// The bounds in words, for messages.
    pub words: &'static str,
}

impl Prior {
    /// Any finite number.
    pub const ANY: Self = Self::open(f64::NEG_INFINITY, f64::INFINITY, "a number");
    /// x > 0.
    pub const POSITIVE: Self = Self::open(0.0, f64::INFINITY, "a number greater than 0");

    /// Between two bounds that are not possible themselves.
    pub(super) const fn open(low: f64, high: f64, words: &'static str) -> Self {
        Self {
            low,
            high,
            closed: [false; 2],
            words,
        }
    }

    /// 0 or more.
    pub(super) const fn not_negative(words: &'static str) -> Self {
        Self::from(0.0, words)
    }

    /// The lower bound or more.
    pub(super) const fn from(low: f64, words: &'static str) -> Self {
        Self {
            closed: [true, false],
            ..Self::open(low, f64::INFINITY, words)
        }
    }

    /// True for a finite number within the bounds.
    pub fn allows(&self, value: f64) -> bool {
        let above = value > self.low || (self.closed[0] && value == self.low);
        let below = value < self.high || (self.closed[1] && value == self.high);
        value.is_finite() && above && below
    }
}
