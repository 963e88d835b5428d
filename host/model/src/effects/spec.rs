//! The specification of an effect: its name, its keys, its place in the model, and what a reader must know of it.

use std::sync::Arc;

use super::effect::Effect;
use super::parameter::Parameter;
use super::values::Values;
use super::{EffectError, EffectName};

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
    /// Signs of the effect in a recording, by which it is recognised.
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
