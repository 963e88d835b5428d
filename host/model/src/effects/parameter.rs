//! One parameter of an effect: key, unit, type and bounds.

/// One parameter of an effect.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Key of the parameter in cases and answers; empty if only the command line has the parameter, as the VALUE of the
    /// effect.
    pub key: &'static str,
    /// Unit of the parameter; empty for words, switches and dimensionless numbers.
    pub unit: &'static str,
    /// Type of the value, such as number, word or switch.
    pub kind: ValueKind,
    /// True only if the equation of the effect is linear in this parameter; not set for all such parameters.
    pub linear: bool,
    /// True for the parameter that VALUE sets in `--effect NAME=VALUE`.
    pub main: bool,
    /// Physically possible values of the parameter.
    pub prior: Prior,
    /// Meaning of the parameter in words, for the help.
    pub meaning: &'static str,
}

impl Parameter {
    /// A parameter whose value may be any finite number, in `unit`.
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

    /// A parameter whose value is a word.
    pub(super) const fn word(key: &'static str, meaning: &'static str) -> Self {
        Self {
            kind: ValueKind::Word,
            ..Self::number(key, "", meaning)
        }
    }

    /// This parameter, marked as one in which the effect is linear.
    pub(super) const fn linear(self) -> Self {
        Self { linear: true, ..self }
    }

    /// This parameter, marked as the one whose value `--effect NAME=VALUE` sets.
    pub(super) const fn main(self) -> Self {
        Self { main: true, ..self }
    }

    /// This parameter with the bounds `prior` of its value.
    pub(super) const fn within(self, prior: Prior) -> Self {
        Self { prior, ..self }
    }

    /// This parameter with a value of the type `kind`.
    pub(super) const fn of_kind(self, kind: ValueKind) -> Self {
        Self { kind, ..self }
    }
}

/// The type of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueKind {
    /// The value is one number. At several locations of the effect it holds for all of them, or is a list with one
    /// number for each.
    Number,
    /// The value is one number for all modes of the structure, or a list with one number for each mode.
    NumberPerMode,
    /// A word.
    Word,
    /// true or false.
    Switch,
}

/// Physically possible values of a parameter: an interval.
#[derive(Clone, Copy, Debug)]
pub struct Prior {
    /// Lower bound of the interval.
    pub low: f64,
    /// Upper bound of the interval.
    pub high: f64,
    /// For the lower and the upper bound of a parameter: true if the bound itself is a possible value.
    pub closed: [bool; 2],
    /// The possible values of the parameter in words, for messages.
    pub words: &'static str,
}

impl Prior {
    /// Any finite number.
    pub const ANY: Self = Self::open(f64::NEG_INFINITY, f64::INFINITY, "a number");
    /// x > 0.
    pub const POSITIVE: Self = Self::open(0.0, f64::INFINITY, "a number greater than 0");

    /// Values between two bounds that are not possible themselves.
    pub(super) const fn open(low: f64, high: f64, words: &'static str) -> Self {
        Self {
            low,
            high,
            closed: [false; 2],
            words,
        }
    }

    /// Values of 0 or more.
    pub(super) const fn not_negative(words: &'static str) -> Self {
        Self::from(0.0, words)
    }

    /// Values of at least `low`.
    pub(super) const fn from(low: f64, words: &'static str) -> Self {
        Self {
            closed: [true, false],
            ..Self::open(low, f64::INFINITY, words)
        }
    }

    /// True if `value` is finite and within the bounds.
    pub fn allows(&self, value: f64) -> bool {
        let above = value > self.low || (self.closed[0] && value == self.low);
        let below = value < self.high || (self.closed[1] && value == self.high);
        value.is_finite() && above && below
    }
}
