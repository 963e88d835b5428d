//! Cutting coefficients and structures that depend on the spindle speed, evaluated at one speed.

use super::extension::material_at;
use crate::error::StabilityError;
use quietcut_model::case::Case;
use quietcut_model::effects::{Class, EffectName, EffectSpec, Treatment};

/// True if cutting coefficients or the structure of a case depend on the spindle speed.
pub fn depends_on_speed(case: &Case) -> bool {
    case.speed_dependence.is_some()
        || case
            .effects()
            .any(|spec| spec.treatment == Treatment::ProcessOfSpeed)
}

/// The case with the structure and the cutting coefficients of one spindle speed, rev/min, in place of the dependence of
/// the structure and of the extensions that change the coefficients.
///
/// # Errors
/// A section is missing, or an extension cannot be applied to the case.
pub(crate) fn at_speed(case: &Case, rpm: f64) -> Result<Case, StabilityError> {
    // Extensions of the cutting force that do not depend on the speed are replaced too, since extensions act one after
    // the other.
    let changes_coefficients = |spec: &EffectSpec| match spec.treatment {
        Treatment::ProcessOfSpeed => true,
        treatment => treatment == Treatment::LinearProcess && spec.class == Class::CuttingForce,
    };
    let material = material_at(case, rpm, changes_coefficients)?;
    let mut at_speed = case.at_speed(rpm);
    at_speed.material = Some(material);
    for effect in EffectName::ALL {
        if changes_coefficients(effect.spec()) {
            at_speed.extensions.remove(effect.name());
        }
    }
    Ok(at_speed)
}
