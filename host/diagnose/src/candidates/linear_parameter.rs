//! Mass, stiffness or damping of the structure that differs from the case.
//!
//! Shows: a receptance that differs from the baseline and does not depend on amplitude: above resonance for mass, below
//! it for stiffness, at it for damping. Does not show: harmonics, or response at frequencies without excitation. All
//! three changed by one factor are equivalent to a gain of the only channel of motion. Fit: linear in the relative
//! change. Source: the output-error equation of Pintelon and Schoukens, System Identification (2012).
//!
//! The residual along the measured motion is that of [`altered_structure`](super::altered_structure).

use crate::candidates::altered_structure::{AlteredStructure, response_to};
use crate::candidates::cause::{Cause, Location, Parameter, Regressor, Regressors};
use crate::criteria::LEAST_RELATIVE_CHANGE;
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::effects::EffectName;
use quietcut_model::structure::Form;
use quietcut_simulate::Effects;

/// Relative change θ of mass, damping or stiffness in the central differences that give the derivative of the
/// receptance with respect to θ (of the dynamic stiffness if forces are compared). Their relative truncation error near a
/// resonance of quality Q is (Q·`STEP`)², 1e-8 for Q = 100; that of rounding 1e-10. Beside an uncertain parameter of the
/// baseline they must agree with its derivative beyond what the records resolve.
const STEP: f64 = 1e-6;

#[derive(Clone, Copy)]
pub(super) enum StructureMatrix {
    Mass,
    Stiffness,
    Damping,
}

pub(super) struct LinearChange(pub(super) StructureMatrix);

impl LinearChange {
    fn key(&self) -> &'static str {
        match self.0 {
            StructureMatrix::Mass => "mass_kg",
            StructureMatrix::Stiffness => "stiffness_n_per_m",
            StructureMatrix::Damping => "damping_ns_per_m",
        }
    }

    /// Diagonal entry of the case's mass, stiffness or damping matrix for the direction of `location`; `None` if the
    /// structure is not given by matrices, or if `location` has no single direction in which the structure moves.
    fn entry(&self, study: &Study<'_>, location: &Location) -> Option<f64> {
        let Form::Matrices(matrices) = &study.baseline.structure.form else {
            return None;
        };
        let directions = &study.baseline.structure.directions;
        let index = directions
            .iter()
            .position(|direction| Some(*direction) == location.direction())?;
        let matrix = match self.0 {
            StructureMatrix::Mass => &matrices.mass,
            StructureMatrix::Stiffness => &matrices.stiffness,
            StructureMatrix::Damping => &matrices.damping,
        };
        Some(matrix[(index, index)])
    }

    fn effect(&self, location: &Location, relative: f64) -> Result<Effects, String> {
        let mut table = location.table();
        table.insert("relative_change".into(), relative.into());
        Effects::of_extension(self.name(), &table).map_err(|error| error.to_string())
    }
}

impl Cause for LinearChange {
    fn effect(&self) -> EffectName {
        match self.0 {
            StructureMatrix::Mass => EffectName::Mass,
            StructureMatrix::Stiffness => EffectName::Stiffness,
            StructureMatrix::Damping => EffectName::Damping,
        }
    }

    fn locations(&self, study: &Study<'_>) -> Vec<Location> {
        if study.baseline.case.extensions.contains_key(self.name()) {
            return Vec::new();
        }
        let driven = study.driven_axes();
        if study.has_modes() {
            return if driven.is_empty() {
                Vec::new()
            } else {
                vec![Location::Everywhere]
            };
        }
        let mut locations: Vec<Location> = driven
            .iter()
            .map(|axis| Location::Axis(*axis))
            .filter(|location| self.entry(study, location).is_some_and(|entry| entry != 0.0))
            .collect();
        if driven.len() > 1 {
            locations.push(Location::Everywhere);
        }
        locations
    }

    fn regressors(&self, study: &Study<'_>, record: &Record, location: &Location, _: &[f64]) -> Regressors {
        let [below, above] = [-STEP, STEP].map(|step| {
            let effects = study.baseline.effects.clone().and(&self.effect(location, step)?);
            AlteredStructure::new(study.baseline.structure, &effects)
        });
        let readings = response_to(study, record, [&below?, &above?], 2.0 * STEP);
        Ok(vec![Regressor::of_channels(readings)])
    }

    fn parameters(
        &self,
        study: &Study<'_>,
        location: &Location,
        _: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        let relative = *coefficients.first()?;
        if relative <= LEAST_RELATIVE_CHANGE {
            return None;
        }
        Some(match self.entry(study, location) {
            Some(entry) => vec![(self.key(), entry * (1.0 + relative))],
            None => vec![("relative_change", relative)],
        })
    }

    fn also(&self, study: &Study<'_>, _: &Location, parameters: &[Parameter]) -> Vec<Parameter> {
        let [("relative_change", relative)] = parameters else {
            return Vec::new();
        };
        let Form::Modes(modes) = &study.baseline.structure.form else {
            return Vec::new();
        };
        let [mode] = modes.as_slice() else {
            return Vec::new();
        };
        match self.0 {
            StructureMatrix::Mass => vec![("frequency_hz", mode.frequency_hz / (1.0 + relative).sqrt())],
            StructureMatrix::Stiffness => vec![("frequency_hz", mode.frequency_hz * (1.0 + relative).sqrt())],
            StructureMatrix::Damping => vec![("damping_ratio", mode.damping_ratio * (1.0 + relative))],
        }
    }
}
