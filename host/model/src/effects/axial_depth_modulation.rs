//! The depth of cut follows the axial vibration, b = b₀ − z (thesis eq. 3.5).

use std::sync::Arc;

use super::{Class, Effect, EffectName, EffectSpec, Locations, Parameter, Treatment, ValueKind};
use crate::{Cutter, ModelError};

/// The specification.
pub(super) const AXIAL_DEPTH_MODULATION: EffectSpec = EffectSpec {
    id: EffectName::AxialDepthModulation,
    name: "axial-depth-modulation",
    class: Class::Geometry,
    locations: Locations::Cut,
    parameters: &[
        Parameter::number("on", "", "true where the depth follows the axial vibration")
            .of_kind(ValueKind::Switch)
            .main(),
    ],
    treatment: Treatment::LinearProcess,
    candidates: &["present or absent: the coefficient of the change must come out near 1"],
    shares_term_with: &[],
    summary: "the depth of cut follows the axial vibration",
    equation: "b = b₀ − z",
    shows: "forces in the rhythm of z, with edge angles below 90°",
    hidden_by: "an edge angle of 90°, or a structure that is stiff along z",
    source: "thesis, eq. 3.5",
    example: "on = true",
    describing_function: None,
    build: |values| Ok(Arc::new(AxialDepthModulation(values.switch("on")?))),
};

#[derive(Clone, Copy, Debug)]
struct AxialDepthModulation(bool);

impl Effect for AxialDepthModulation {
    fn id(&self) -> EffectName {
        EffectName::AxialDepthModulation
    }

    fn alter_cutter(&self, cutter: &mut Cutter) -> Result<(), ModelError> {
        cutter.axial_depth_modulation = self.0;
        Ok(())
    }
}
