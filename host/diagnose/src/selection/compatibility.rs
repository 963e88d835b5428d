//! Which causes may act together in a candidate model.

use crate::candidates::cause::{LocatedEffect, Location, Parameter};
use crate::fit::candidate_model::{CandidateModel, Choice};
use crate::fit::library::Library;
use quietcut_model::effects::{Argument, Class, EffectName};

impl Library {
    /// True if a further cause may join a candidate model.
    ///
    /// A case holds one extension of a name, so that the same cause cannot act twice. Three restoring forces of the
    /// displacement along one axis, or three of the velocity, are the series expansion of an unknown law, and no
    /// causes. A time-varying spring counts as a spring. Hysteresis, which acts like friction before it slips, counts
    /// as friction. Causes that share a term of the equation are not identifiable together.
    pub(crate) fn may_act_together(&self, some: &[Choice], other: Choice) -> bool {
        let new = self.cause(other.candidate).names();
        let is_new = some.iter().all(|choice| {
            self.cause(choice.candidate)
                .names()
                .iter()
                .all(|name| !new.contains(name))
        });
        let alike = some
            .iter()
            .filter(|choice| self.are_in_same_variable(**choice, other))
            .count();
        is_new && alike < 2 && !some.iter().any(|choice| self.share_a_term(*choice, other))
    }

    /// True for two candidate models with the same causes, at whatever locations.
    pub(crate) fn are_same_causes(&self, one: &CandidateModel, other: &CandidateModel) -> bool {
        let causes = |of: &CandidateModel| {
            let mut causes: Vec<usize> = of
                .choices
                .iter()
                .map(|choice| self.candidates[choice.candidate].cause)
                .collect();
            causes.sort_unstable();
            causes
        };
        causes(one) == causes(other)
    }

    /// True for two candidate models with the same causes at the same locations.
    pub(crate) fn are_at_same_locations(&self, one: &CandidateModel, other: &CandidateModel) -> bool {
        let is_in = |choice: &Choice, of: &CandidateModel| {
            let known = &self.candidates[choice.candidate];
            of.choices.iter().any(|other| {
                let other = &self.candidates[other.candidate];
                other.cause == known.cause && other.location == known.location
            })
        };
        one.choices.len() == other.choices.len() && one.choices.iter().all(|choice| is_in(choice, other))
    }

    /// True for two causes that share a term at a common location, and are therefore not identifiable together. For
    /// example, softening-hardening contains a cubic spring, and a ratio for each mode of a channel contains the gain
    /// of the channel.
    fn share_a_term(&self, one: Choice, other: Choice) -> bool {
        let effect = |choice: Choice| self.cause(choice.candidate).effect();
        if !effect(one).spec().shares_term_with.contains(&effect(other)) {
            return false;
        }
        let location = |choice: Choice| &self.candidates[choice.candidate].location;
        let is_by_mode =
            |choice: Choice| self.candidates[choice.candidate].variants[choice.variant].1.len() > 1;
        match effect(one).spec().class {
            Class::Sensor => location(one) == location(other) && (is_by_mode(one) || is_by_mode(other)),
            _ => meet(location(one), location(other)),
        }
    }

    /// True for two restoring forces of the same variable, displacement or velocity, along a common axis.
    fn are_in_same_variable(&self, one: Choice, other: Choice) -> bool {
        match (self.law(one), self.law(other)) {
            (Some((law, location)), Some((other_law, other_location))) => {
                law == other_law && meet(location, other_location)
            }
            _ => false,
        }
    }

    /// The variable of a restoring force (displacement or velocity) and its location; `None` for other causes and for
    /// mode coupling, whose force depends on two displacements.
    fn law(&self, choice: Choice) -> Option<(Argument, &Location)> {
        match self.cause(choice.candidate).effect().spec().class {
            Class::RestoringForce(Argument::TwoDisplacements) => None,
            Class::RestoringForce(argument) => Some((argument, &self.candidates[choice.candidate].location)),
            _ => None,
        }
    }
}

impl Library {
    /// True if two causes with these parameters are one effect under its own name: a cubic and a quintic spring with
    /// k3 < 0 < k5 along one axis are softening-hardening.
    pub(crate) fn hides_one_effect(&self, choices: &[Choice], parameters: &[Vec<Parameter>]) -> bool {
        let springs = [EffectName::CubicStiffness, EffectName::QuinticStiffness];
        let found = choices.iter().zip(parameters).flat_map(|(choice, parameters)| {
            let cause = self.cause(choice.candidate);
            let is_spring = springs.contains(&cause.effect());
            let location = &self.candidates[choice.candidate].location;
            let parts = is_spring.then(|| cause.located_effects(location, parameters));
            parts.unwrap_or_default()
        });
        are_softening_hardening(&found.collect::<Vec<_>>())
    }
}

/// True if among these effects are a cubic spring and a quintic one with k3 < 0 < k5 at one location.
fn are_softening_hardening(effects: &[LocatedEffect]) -> bool {
    let of = |name: EffectName| effects.iter().filter(move |effect| effect.name == name.name());
    let value = |effect: &LocatedEffect| effect.parameters.first().map_or(0.0, |(_, value)| *value);
    of(EffectName::CubicStiffness)
        .filter(|cubic| value(cubic) < 0.0)
        .any(|cubic| {
            of(EffectName::QuinticStiffness)
                .any(|quintic| value(quintic) > 0.0 && meet(&cubic.location, &quintic.location))
        })
}

/// True if two locations of causes are equal or have a common axis.
fn meet(one: &Location, other: &Location) -> bool {
    match (one, other) {
        (Location::EachOf(axes), Location::Axis(axis)) | (Location::Axis(axis), Location::EachOf(axes)) => {
            axes.contains(axis)
        }
        (Location::EachOf(axes), Location::EachOf(others)) => axes.iter().any(|axis| others.contains(axis)),
        _ => one == other,
    }
}
