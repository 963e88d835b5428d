//! Structure and cutting process of a case with its extensions.

use std::sync::Arc;

use crate::error::StabilityError;
use quietcut_model::case::Case;
use quietcut_model::effects::{Class, EffectSpec, Treatment};
use quietcut_model::milling::Material;
use quietcut_model::structure::FirstOrder;
use quietcut_model::{Cutter, Effects, ForceLaw, ModelError, RestoringForce};

/// Effects of those extensions of a case whose specification fulfils `wanted`.
fn effects(case: &Case, wanted: impl Fn(&EffectSpec) -> bool) -> Result<Effects, StabilityError> {
    let all = Effects::of_case(case).map_err(|cause| wrong(case, cause.into()))?;
    Ok(Effects(
        all.0
            .into_iter()
            .filter(|effect| wanted(effect.id().spec()))
            .collect(),
    ))
}

pub(super) fn wrong(case: &Case, cause: ModelError) -> StabilityError {
    StabilityError::Extension {
        path: case.path.clone(),
        cause: Box::new(cause),
    }
}

/// First-order form of the linear structure of a case with its linear extensions, in the machine's axes.
pub(crate) fn structure(case: &Case) -> Result<FirstOrder, StabilityError> {
    if case.speed_dependence.is_some() {
        return Err(StabilityError::NotCovered {
            path: case.path.clone(),
            what: "structure.at_speed: the structure depends on the spindle speed, and here one structure serves all speeds; \
                   lobes and table with --method collocation and without --linear take that of each speed",
        });
    }
    let structure = case.structure()?;
    let effects = effects(case, |spec| spec.treatment == Treatment::LinearStructure)?;
    let whole = if effects.0.is_empty() {
        structure.first_order().map_err(ModelError::from)
    } else {
        effects
            .dynamics(structure)
            .map(|(dynamics, _)| dynamics.first_order())
    };
    whole.map_err(|cause| match cause {
        ModelError::Structure(cause) => StabilityError::Structure {
            path: case.path.clone(),
            cause,
        },
        other => wrong(case, other),
    })
}

/// Cutting coefficients of a case with its linear extensions of the cutting force that do not depend on the spindle
/// speed.
pub(crate) fn material(case: &Case) -> Result<Material, StabilityError> {
    let has_own =
        |spec: &EffectSpec| spec.treatment == Treatment::LinearProcess && spec.class == Class::CuttingForce;
    if !case.effects().any(has_own) {
        return Ok(*case.material()?);
    }
    Ok(law(case, has_own)?.material())
}

/// Cutting coefficients of a case at a spindle speed, rev/min, with the extensions that fulfil `wanted`.
pub(super) fn material_at(
    case: &Case,
    rpm: f64,
    wanted: impl Fn(&EffectSpec) -> bool,
) -> Result<Material, StabilityError> {
    Ok(cutter(case, Some(rpm), wanted)?.force.material())
}

/// Cutting force law of a case with the extensions that fulfil `wanted`.
fn law(case: &Case, wanted: impl Fn(&EffectSpec) -> bool) -> Result<ForceLaw, StabilityError> {
    Ok(cutter(case, None, wanted)?.force)
}

/// Tool and force law of a case with the extensions that fulfil `wanted`, at a spindle speed, rev/min, if one is given.
fn cutter(
    case: &Case,
    rpm: Option<f64>,
    wanted: impl Fn(&EffectSpec) -> bool,
) -> Result<Cutter, StabilityError> {
    // The geometry does not depend on the axial depth, which is set to an arbitrary value.
    let cutter = Cutter::new(case.tool()?, case.material()?, case.cut()?, 1e-3).map(|cutter| match rpm {
        Some(rpm) => cutter.at_speed(rpm),
        None => cutter,
    });
    let effects = effects(case, wanted)?;
    let cutter = cutter.and_then(|cutter| effects.cutter(cutter));
    cutter.map_err(|cause| wrong(case, cause))
}

/// Radial runout of each tooth: its radius minus the radius without runout, m, in the order of the teeth.
///
/// # Errors
/// A section is missing, or an extension cannot be applied to the case.
pub(crate) fn radial_m(case: &Case) -> Result<Vec<f64>, StabilityError> {
    let teeth = cutter(case, None, |spec| {
        spec.treatment == Treatment::LinearProcess && spec.class == Class::Geometry
    })?
    .teeth;
    Ok(teeth.iter().map(|tooth| tooth.radial_m).collect())
}

/// Extensions that are linearized about a forced orbit: smooth restoring forces, the chip law and process damping.
///
/// # Errors
/// An extension cannot be applied to the case.
pub(crate) fn about_orbit(case: &Case) -> Result<AboutOrbit, StabilityError> {
    let structure = case.structure()?;
    let mut terms = Vec::new();
    for effect in &effects(case, |spec| spec.treatment == Treatment::Smooth)?.0 {
        let found = effect
            .restoring_forces(structure)
            .map_err(|cause| wrong(case, cause.into()))?;
        terms.extend(found.into_iter().map(Arc::from));
    }
    Ok(AboutOrbit {
        terms,
        law: law(case, |spec| spec.treatment == Treatment::ChipLaw)?,
    })
}

/// Restoring forces of the extensions that are not smooth (friction, backlash, hysteresis), for the structure with its
/// linear extensions.
///
/// # Errors
/// An extension cannot be applied to the case.
pub(crate) fn not_smooth(case: &Case) -> Result<Vec<Box<dyn RestoringForce>>, StabilityError> {
    let structure = case.structure()?;
    let wanted =
        |spec: &EffectSpec| matches!(spec.treatment, Treatment::LinearStructure | Treatment::Equivalent);
    match effects(case, wanted)?.dynamics(structure) {
        Ok((_, terms)) => Ok(terms),
        Err(ModelError::Structure(cause)) => Err(StabilityError::Structure {
            path: case.path.clone(),
            cause,
        }),
        Err(other) => Err(wrong(case, other)),
    }
}

/// Extensions that are linearized about a forced orbit: smooth restoring forces, the chip law and process damping.
pub(crate) struct AboutOrbit {
    pub(crate) terms: Vec<Arc<dyn RestoringForce>>,
    pub(crate) law: ForceLaw,
}
