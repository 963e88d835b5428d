//! One more mode in the receptance of a direction: H += 1/(m·(ω_m² − ω² + 2iζω_m·ω)) at the angular frequency ω, with
//! the natural angular frequency ω_m, damping ratio ζ and modal mass m of this mode.

use std::sync::Arc;

use super::location::axis_of;
use super::{Class, Effect, EffectError, EffectName, EffectSpec, Locations, Parameter, Prior, Treatment};
use crate::Dynamics;
use crate::structure::{Direction, Structure};

/// The specification.
pub(super) const MISSING_MODE: EffectSpec = EffectSpec {
    id: EffectName::MissingMode,
    name: "missing-mode",
    class: Class::Inertia,
    locations: Locations::EachDirection,
    parameters: &[
        Parameter::number("frequency_hz", "Hz", "natural frequency")
            .main()
            .within(FREQUENCY),
        Parameter::number("damping_ratio", "", "damping ratio; 0.02 without the key").within(RATIO),
        Parameter::number("modal_mass_kg", "kg", "modal mass").within(Prior::POSITIVE),
    ],
    treatment: Treatment::LinearStructure,
    candidates: &["one mode along one direction"],
    shares_term_with: &[],
    summary: "the receptance of a direction has one more mode",
    equation: "H += 1/(m·(ω_m² − ω² + 2iζω_m·ω))",
    shows: "a resonance where the case has none, with its own phase, alike at all levels",
    hidden_by: "frequencies far outside the band, where it is a little stiffness or mass",
    source: "Ewins, Modal Testing (2000), ch. 4",
    example: "frequency_hz = 85.0\ndamping_ratio = 0.03\nmodal_mass_kg = 40.0\ndirection = \"x\"",
    describing_function: None,
    build: |values| {
        Ok(Arc::new(MissingMode {
            frequency_hz: values.main("frequency_hz")?,
            damping_ratio: values.number("damping_ratio")?.unwrap_or(0.02),
            modal_mass_kg: values.needed("modal_mass_kg")?,
            direction: values.direction()?,
        }))
    },
};

const FREQUENCY: Prior = Prior::open(0.0, f64::INFINITY, "a frequency greater than 0");
const RATIO: Prior = Prior {
    closed: [true, false],
    ..Prior::open(0.0, 1.0, "a ratio from 0 to below 1")
};

#[derive(Clone, Copy, Debug)]
struct MissingMode {
    frequency_hz: f64,
    damping_ratio: f64,
    modal_mass_kg: f64,
    direction: Option<Direction>,
}

impl Effect for MissingMode {
    fn id(&self) -> EffectName {
        EffectName::MissingMode
    }

    fn alter_dynamics(&self, structure: &Structure, dynamics: &mut Dynamics) -> Result<(), EffectError> {
        let axis = axis_of(structure, self.direction, self.name())?;
        dynamics.add_mode(axis, self.frequency_hz, self.damping_ratio, self.modal_mass_kg);
        Ok(())
    }
}
