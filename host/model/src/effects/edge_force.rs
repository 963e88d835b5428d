//! One or more of the edge coefficients K_te, K_re, K_ae differ from those of the case.

use std::sync::Arc;

use super::{Class, Effect, EffectName, EffectSpec, Locations, Parameter, Treatment};
use crate::{Cutter, ModelError};

/// The specification.
pub(super) const EDGE_FORCE: EffectSpec = EffectSpec {
    id: EffectName::EdgeForce,
    name: "edge-force",
    class: Class::CuttingForce,
    locations: Locations::Cut,
    parameters: &[
        Parameter::number("kte_n_per_mm", "N/mm", "tangential edge coefficient")
            .linear()
            .main(),
        Parameter::number("kre_n_per_mm", "N/mm", "radial edge coefficient").linear(),
        Parameter::number("kae_n_per_mm", "N/mm", "axial edge coefficient").linear(),
    ],
    treatment: Treatment::LinearProcess,
    candidates: &["each edge coefficient by itself"],
    shares_term_with: &[],
    summary: "the edge coefficients differ from the case",
    equation: "F = b·(K_e + K_c·h) with other K_te, K_re, K_ae",
    shows: "forces that do not depend on the chip thickness while a tooth is engaged, at two feeds",
    hidden_by: "recordings at one feed; wear in a short recording looks the same",
    source: "Altintas, Manufacturing Automation (2012), ch. 2; Budak, Altintas and Armarego (1996)",
    example: "kte_n_per_mm = 20.0\nkre_n_per_mm = 10.0",
    describing_function: None,
    build: |values| {
        let mut n_per_mm = [None; 3];
        for (n_per_mm, key) in n_per_mm
            .iter_mut()
            .zip(["kte_n_per_mm", "kre_n_per_mm", "kae_n_per_mm"])
        {
            *n_per_mm = values.number(key)?;
        }
        if n_per_mm == [None; 3] {
            n_per_mm[0] = Some(values.main("kte_n_per_mm")?);
        } else if let Some(value) = values.number("")? {
            n_per_mm[0] = Some(value);
        }
        Ok(Arc::new(EdgeForce { n_per_mm }))
    },
};

#[derive(Clone, Copy, Debug)]
struct EdgeForce {
    /// Tangential, radial and axial edge coefficient, N/mm; `None` leaves that of the case.
    n_per_mm: [Option<f64>; 3],
}

impl Effect for EdgeForce {
    fn id(&self) -> EffectName {
        EffectName::EdgeForce
    }

    fn alter_cutter(&self, cutter: &mut Cutter) -> Result<(), ModelError> {
        let mut material = cutter.force.material();
        for (n_per_mm, given) in [
            &mut material.kte_n_per_mm,
            &mut material.kre_n_per_mm,
            &mut material.kae_n_per_mm,
        ]
        .into_iter()
        .zip(self.n_per_mm)
        {
            *n_per_mm = given.unwrap_or(*n_per_mm);
        }
        cutter.force = cutter.force.with_material(material);
        Ok(())
    }
}
