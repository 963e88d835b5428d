//! Wear and drift, evaluated at one moment as cutting coefficients and stiffness.

use super::extension::{material, wrong};
use crate::error::StabilityError;
use quietcut_model::Effects;
use quietcut_model::case::Case;
use quietcut_model::effects::EffectName;

/// The case after `after_s` seconds of operation, with drift and wear replaced by the stiffness, the cutting
/// coefficients and the process damping of that moment.
///
/// # Errors
/// Drift together with an extension of the stiffness, drift in several directions, forces or stiffness that have fallen
/// to zero, a missing section, or an extension that cannot be applied to the case.
pub fn after(case: &Case, after_s: f64) -> Result<Case, StabilityError> {
    let not_covered = |what| StabilityError::NotCovered {
        path: case.path.clone(),
        what,
    };
    // Building the effects checks keys and values of the extensions; the effects themselves are not needed.
    Effects::of_case(case).map_err(|cause| wrong(case, cause.into()))?;
    let number = |table: &toml::Table, key: &str| {
        let value = table.get(key)?;
        value
            .as_float()
            .or_else(|| value.as_integer().map(|whole| whole as f64))
    };
    let mut moved = case.clone();
    if let Some(wear) = moved.extensions.remove(EffectName::Wear.name()) {
        let factor = 1.0 + number(&wear, "relative_rate_per_s").unwrap_or(0.0) * after_s;
        if factor <= 0.0 {
            return Err(not_covered(
                "extension.wear: by then no force is left; less time is needed",
            ));
        }
        let mut material = material(case)?;
        for value in [
            &mut material.ktc_mpa,
            &mut material.krc_mpa,
            &mut material.kac_mpa,
            &mut material.kte_n_per_mm,
            &mut material.kre_n_per_mm,
            &mut material.kae_n_per_mm,
        ] {
            *value *= factor;
        }
        moved.material = Some(material);
        moved.extensions.remove(EffectName::ForceCoefficients.name());
        moved.extensions.remove(EffectName::EdgeForce.name());
        if let Some(flank) = moved.extensions.get_mut(EffectName::ProcessDamping.name())
            && let Some(damping) = number(flank, "process_damping_n_per_m")
        {
            flank.insert("process_damping_n_per_m".into(), (factor * damping).into());
        }
    }
    if let Some(drift) = moved.extensions.remove(EffectName::Drift.name()) {
        if moved.has(EffectName::Stiffness) {
            return Err(not_covered(
                "extension.drift beside extension.stiffness: put the stiffness into the structure, so that drift starts from it",
            ));
        }
        if drift.values().any(toml::Value::is_array) {
            return Err(not_covered(
                "extension.drift in several directions: give the stiffness of that moment in extension.stiffness instead",
            ));
        }
        let change = match (
            number(&drift, "relative_change"),
            number(&drift, "time_constant_s"),
        ) {
            (Some(change), Some(time_constant_s)) => -change * (-after_s / time_constant_s).exp_m1(),
            _ => number(&drift, "relative_rate_per_s").unwrap_or(0.0) * after_s,
        };
        if change <= -1.0 {
            return Err(not_covered(
                "extension.drift: by then no stiffness is left; less time is needed",
            ));
        }
        let mut stiffness = toml::Table::new();
        stiffness.insert("relative_change".into(), change.into());
        if let Some(direction) = drift.get("direction") {
            stiffness.insert("direction".into(), direction.clone());
        }
        moved
            .extensions
            .insert(EffectName::Stiffness.name().into(), stiffness);
    }
    Ok(moved)
}
