//! The specification of an effect: its name, its keys, its place in the model, and what a reader must know of it.

use std::sync::Arc;

use super::{Effect, EffectError, EffectName, Values};

/// One effect of the list [`EffectName`]: everything that cases, answers, help and documentation say of it.
pub struct EffectSpec {
    /// The entry of the list.
    pub id: EffectName,
    /// The word in cases, in answers and on the command line.
    pub name: &'static str,
    /// The part of the model that it changes.
    pub class: Class,
    /// Where it acts.
    pub locations: Locations,
    /// Its parameters. The keys of the location are not among them: see [`Locations::keys`].
    pub parameters: &'static [Parameter],
    /// The treatment in stability computations.
    pub treatment: Treatment,
    /// The forms that compete under this name in a diagnosis.
    pub candidates: &'static [&'static str],
    /// Effects with a term in common at one location: not identifiable beside each other.
    pub shares_term_with: &'static [EffectName],
    /// One sentence.
    pub summary: &'static str,
    /// The equation that changes.
    pub equation: &'static str,
    /// What shows it in a recording.
    pub shows: &'static str,
    /// What it does not show, and which other effects look the same.
    pub hidden_by: &'static str,
    /// Where its equation is published.
    pub source: &'static str,
    /// The lines of a table `[extension.NAME]` that holds it.
    pub example: &'static str,
    /// Makes the effect. A key that it leaves in the values is a key that the effect does not have.
    pub(super) build: fn(&mut Values) -> Result<Arc<dyn Effect>, EffectError>,
}

impl EffectSpec {
    /// The parameter that the VALUE of `--effect NAME=VALUE` stands for.
    pub fn main(&self) -> Option<&'static Parameter> {
        self.parameters.iter().find(|parameter| parameter.main)
    }

    /// The parameter of a key.
    pub fn parameter(&self, key: &str) -> Option<&'static Parameter> {
        self.parameters.iter().find(|parameter| parameter.key == key)
    }

    /// All keys of a table `[extension.NAME]`, those of the location last.
    pub fn keys(&self) -> impl Iterator<Item = &'static str> + '_ {
        let own = self.parameters.iter().map(|parameter| parameter.key);
        own.filter(|key| !key.is_empty())
            .chain(self.locations.keys().iter().copied())
    }

    /// The keys as a reader lists them, the VALUE of the command line first where it has no key.
    pub fn keys_in_words(&self) -> String {
        let value = self
            .main()
            .filter(|main| main.key.is_empty())
            .map(|main| format!("a value ({})", main.meaning));
        let keys = self.keys().map(String::from);
        value.into_iter().chain(keys).collect::<Vec<_>>().join(", ")
    }
}

impl std::fmt::Debug for EffectSpec {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

/// The part of the model that an effect changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Masses and modes.
    Inertia,
    /// The restoring side of the equation of motion.
    RestoringForce(Argument),
    /// The force of the cut.
    CuttingForce,
    /// Tool and chip geometry.
    Geometry,
    /// The rotation of the spindle.
    Spindle,
    /// The reading of a channel.
    Sensor,
}

/// The quantity on which a restoring force depends first of all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Argument {
    /// Displacement: a spring. A spring that changes with time counts as a spring.
    Displacement,
    /// Velocity: a damper. A hysteresis loop counts as friction, which it approaches at large slip.
    Velocity,
    /// The displacements of two directions.
    TwoDisplacements,
}

/// Where an effect acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Locations {
    /// Along one direction; a list of directions has an effect along each. The only direction of a structure needs no key.
    EachDirection,
    /// On the whole structure, or along the directions that are given.
    WholeOrDirection,
    /// Between two directions.
    TwoDirections,
    /// On the cut.
    Cut,
    /// In the named channels; without a name in every channel of motion.
    Channels,
    /// In the named channels, from another direction.
    ChannelsFromDirection,
}

impl Locations {
    /// The keys that set the location.
    pub const fn keys(self) -> &'static [&'static str] {
        match self {
            Self::EachDirection | Self::WholeOrDirection => &["direction"],
            Self::TwoDirections => &["directions"],
            Self::Cut => &[],
            Self::Channels => &["channel"],
            Self::ChannelsFromDirection => &["direction", "channel"],
        }
    }
}

/// The treatment of an effect in stability computations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Treatment {
    /// It changes the matrices or modes of the linear structure.
    LinearStructure,
    /// It changes coefficients or geometry of the linear cutting process.
    LinearProcess,
    /// A smooth restoring force: its Jacobian acts about the forced orbit.
    Smooth,
    /// A chip law or the damping of the flank: it acts through the depth or about the forced chip.
    ChipLaw,
    /// A restoring force that is not smooth: its equivalent stiffness and damping act at the amplitude of the forced orbit.
    Equivalent,
    /// It changes with time: the limits hold for one moment. The text says what to give instead.
    OfMoment(&'static str),
    /// Stability is not defined with it. The text says why.
    Refused(&'static str),
    /// It changes a reading and no limit.
    Sensor,
}

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
