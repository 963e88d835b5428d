//! The specification of an effect: its name, its keys, its place in the model, and what a reader must know of it.

use std::sync::Arc;

use super::effect::Effect;
use super::parameter::Parameter;
use super::values::Values;
use super::{DescribingFunction, EffectError, EffectName};

/// Specification of one effect of the list [`EffectName`]. Cases, answers, help and documentation all use it.
pub struct EffectSpec {
    /// Entry of the effect in the list of all effects.
    pub id: EffectName,
    /// Name of the effect in cases, in answers and on the command line.
    pub name: &'static str,
    /// Part of the model that the effect changes, such as mass, restoring force or sensor.
    pub class: Class,
    /// Locations at which the effect can act.
    pub locations: Locations,
    /// Parameters of the effect. The keys that set its location are not among them: see [`Locations::keys`].
    pub parameters: &'static [Parameter],
    /// Treatment of the effect in stability computations, such as linearization about the forced orbit.
    pub treatment: Treatment,
    /// Forms of the effect in words, such as different friction laws, that compete as candidate models in a diagnosis.
    pub candidates: &'static [&'static str],
    /// Effects that share a term of the equation with this one, so that the two are not identifiable together at one
    /// location.
    pub shares_term_with: &'static [EffectName],
    /// The effect in one phrase or sentence.
    pub summary: &'static str,
    /// Equation of the effect: the change of the model.
    pub equation: &'static str,
    /// Signs of the effect in a recording, by which it is recognised.
    pub shows: &'static str,
    /// Conditions under which recordings do not show the effect, other effects that look the same, and changes that
    /// this effect does not cause.
    pub hidden_by: &'static str,
    /// Source of the equation of the effect, such as a publication or a standard.
    pub source: &'static str,
    /// Example: the lines of a table `[extension.NAME]` of a case.
    pub example: &'static str,
    /// Describing function of the effect's restoring force: of friction without a backlash in series, of hysteresis
    /// with exponent 1 and γ = ½. `None` if the effect does not provide one.
    pub describing_function: Option<DescribingFunction>,
    /// Builds the effect from the given values and removes from them those that it uses; `Values::finish` refuses a key
    /// left over.
    pub(super) build: fn(&mut Values) -> Result<Arc<dyn Effect>, EffectError>,
}

impl EffectSpec {
    /// The parameter that the VALUE of `--effect NAME=VALUE` stands for; `None` if none is marked so.
    pub fn main(&self) -> Option<&'static Parameter> {
        self.parameters.iter().find(|parameter| parameter.main)
    }

    /// The parameter of the effect with this key; `None` if the effect has no such parameter.
    pub fn parameter(&self, key: &str) -> Option<&'static Parameter> {
        self.parameters.iter().find(|parameter| parameter.key == key)
    }

    /// The keys of the effect's parameters in the table `[extension.NAME]`, then those of its location.
    pub fn keys(&self) -> impl Iterator<Item = &'static str> + '_ {
        let own = self.parameters.iter().map(|parameter| parameter.key);
        own.filter(|key| !key.is_empty())
            .chain(self.locations.keys().iter().copied())
    }

    /// The keys of the effect as a list for messages. If VALUE has no key, its meaning comes first.
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
    /// Restoring forces of the equation of motion: stiffness, damping, friction and others.
    RestoringForce(Argument),
    /// Cutting force.
    CuttingForce,
    /// Tool and chip geometry.
    Geometry,
    /// The rotation of the spindle.
    Spindle,
    /// The reading of a channel.
    Sensor,
}

/// The main quantity on which a restoring force depends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Argument {
    /// Displacement, as for a spring; also for a spring that changes with time.
    Displacement,
    /// Velocity, as for a damper or friction; also for a hysteresis loop, which approaches friction at large slip.
    Velocity,
    /// The displacements of two directions.
    TwoDisplacements,
}

/// Locations at which an effect can act, and the keys that set them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Locations {
    /// Location of an effect along one direction, or along each of a list of directions. In a structure with only one
    /// of the axes x, y and z the key may be missing.
    EachDirection,
    /// Location of an effect on the whole structure, or only along the given directions.
    WholeOrDirection,
    /// Between two directions.
    TwoDirections,
    /// On the cut.
    Cut,
    /// Location of a sensor effect: the named channels of a recording; without a name, every channel of motion.
    Channels,
    /// Location of a cross-axis effect: the direction that channels also read, and the names of these channels; without
    /// a name, every channel of motion that does not already read that direction.
    ChannelsFromDirection,
}

impl Locations {
    /// The keys of a case that set the location of an effect.
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

/// The treatment of an effect in stability computations. Some methods refuse effects that others treat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Treatment {
    /// The effect changes the matrices or modes of the linear structure.
    LinearStructure,
    /// The effect changes coefficients or geometry of the linear cutting process.
    LinearProcess,
    /// The effect changes coefficients of the linear cutting process with the spindle speed: they are evaluated at each
    /// speed.
    ProcessOfSpeed,
    /// A smooth restoring force: it is linearized about the forced periodic orbit, or left out for vanishing feed.
    Smooth,
    /// The effect gives the cutting force a power law of the chip thickness, linearized about the chip thickness by the
    /// feed alone, or process damping, which is linear in the velocity.
    ChipLaw,
    /// A restoring force that is not smooth. Stability computations replace it by its equivalent stiffness and damping
    /// along the forced periodic orbit.
    Equivalent,
    /// The effect changes with time, so that stability limits hold for one moment only. The text names what to give
    /// instead.
    OfMoment(&'static str),
    /// No stability limits are computed with this effect. The text states the reason.
    Refused(&'static str),
    /// The effect changes a measured channel but no stability limit.
    Sensor,
}
