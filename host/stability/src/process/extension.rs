//! Structure and cutting process of a case with its extensions.

use std::sync::Arc;

use crate::error::StabilityError;
use quietcut_model::case::Case;
use quietcut_model::effects::{Class, EffectSpec, Treatment};
use quietcut_model::milling::Material;
use quietcut_model::structure::FirstOrder;
use quietcut_model::{Cutter, Effects, ForceLaw, ModelError, Term};

/// The effects of a case that are wanted.
fn effects(case: &Case, wanted: impl Fn(&EffectSpec) -> bool) -> Result<Effects, StabilityError> {
    let all = Effects::of_case(case).map_err(|cause| wrong(case, cause.into()))?;
    Ok(Effects(
        all.0.into_iter().filter(|effect| wanted(effect.spec())).collect(),
    ))
}

pub(super) fn wrong(case: &Case, cause: ModelError) -> StabilityError {
    StabilityError::Extension {
        path: case.path.clone(),
        cause: Box::new(cause),
    }
}

/// The linear structure with its extensions, in the machine's axes.
///
/// # Errors
/// The case has none, it is indefinite, or it cannot have an extension.
pub(crate) fn structure(case: &Case) -> Result<FirstOrder, StabilityError> {
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

/// The coefficients of the material with those that extensions give.
///
/// # Errors
/// The case has none.
pub(crate) fn material(case: &Case) -> Result<Material, StabilityError> {
    let has_own =
        |spec: &EffectSpec| spec.treatment == Treatment::LinearProcess && spec.class == Class::CuttingForce;
    if !case.effects().any(has_own) {
        return Ok(*case.material()?);
    }
    Ok(law(case, has_own)?.material())
}

/// The force law with these extensions.
fn law(case: &Case, wanted: impl Fn(&EffectSpec) -> bool) -> Result<ForceLaw, StabilityError> {
    Ok(cutter(case, wanted)?.force)
}

/// The tool with these extensions.
fn cutter(case: &Case, wanted: impl Fn(&EffectSpec) -> bool) -> Result<Cutter, StabilityError> {
    // The depth is no part of what is asked.
    let cutter = Cutter::new(case.tool()?, case.material()?, case.cut()?, 1e-3);
    let effects = effects(case, wanted)?;
    let cutter = cutter.and_then(|cutter| effects.cutter(cutter));
    cutter.map_err(|cause| wrong(case, cause))
}

/// How far the radius of each tooth exceeds the mean, m, in the order of the teeth: runout.
///
/// # Errors
/// A section is missing, or an extension that the case cannot have.
pub(crate) fn radial_m(case: &Case) -> Result<Vec<f64>, StabilityError> {
    let teeth = cutter(case, |spec| {
        spec.treatment == Treatment::LinearProcess && spec.class == Class::Geometry
    })?
    .teeth;
    Ok(teeth.iter().map(|tooth| tooth.radial_m).collect())
}

/// The terms that act about a forced orbit: smooth terms, the chip law, process damping.
///
/// # Errors
/// An extension that the case cannot have.
pub(crate) fn about_orbit(case: &Case) -> Result<AboutOrbit, StabilityError> {
    let structure = case.structure()?;
    let mut terms = Vec::new();
    for effect in &effects(case, |spec| spec.treatment == Treatment::Smooth)?.0 {
        let found = effect
            .terms(structure)
            .map_err(|cause| wrong(case, cause.into()))?;
        terms.extend(found.into_iter().map(Arc::from));
    }
    Ok(AboutOrbit {
        terms,
        law: law(case, |spec| spec.treatment == Treatment::ChipLaw)?,
    })
}

/// The terms of a case that are not smooth, on the structure as the other extensions leave it.
///
/// # Errors
/// An extension that the case cannot have.
pub(crate) fn not_smooth(case: &Case) -> Result<Vec<Box<dyn Term>>, StabilityError> {
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

/// See [`about_orbit`].
pub(crate) struct AboutOrbit {
    pub(crate) terms: Vec<Arc<dyn Term>>,
    pub(crate) law: ForceLaw,
}
