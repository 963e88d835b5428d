//! The extensions of a case that a method treats, and the reasons against the others.

use crate::error::StabilityError;
use quietcut_model::case::Case;
use quietcut_model::effects::{EffectSpec, Treatment};

/// How much of the extensions a method treats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Treated {
    /// The process alone, whose structure is not that of the case.
    LinearProcess,
    /// Linear structure and linear process.
    Linear,
    /// The same, and smooth terms are left out: the limits for vanishing feed.
    WithoutSmooth,
    /// All effects with a Jacobian or an equivalent about a forced orbit.
    AboutOrbit,
}

/// True where the limits of a case depend on its forced orbit.
pub fn needs_orbit(case: &Case) -> bool {
    case.structure
        .as_ref()
        .is_some_and(quietcut_model::structure::Structure::is_nonlinear)
        || case.effects().any(|spec| {
            matches!(
                spec.treatment,
                Treatment::Smooth | Treatment::ChipLaw | Treatment::Equivalent
            )
        })
}

/// True where a case has an effect that acts by its equivalent stiffness and damping: friction, backlash or hysteresis.
pub(crate) fn is_not_smooth(case: &Case) -> bool {
    case.effects().any(|spec| spec.treatment == Treatment::Equivalent)
}

/// Refuses the extensions that a method cannot treat, with the reason.
///
/// # Errors
/// The first such extension.
pub(crate) fn refuse_others(case: &Case, treated: Treated) -> Result<(), StabilityError> {
    Ok(case.refuse_extensions(|spec| reason(spec, treated))?)
}

/// The reason against an effect; `None` for one that is treated.
fn reason(spec: &EffectSpec, treated: Treated) -> Option<&'static str> {
    let (is_treated, reason) = match spec.treatment {
        Treatment::Sensor | Treatment::LinearProcess => return None,
        Treatment::LinearStructure => (
            treated != Treated::LinearProcess,
            "it changes the structure, and this method takes receptances as they were measured; remove the table",
        ),
        Treatment::Smooth => (
            matches!(treated, Treated::WithoutSmooth | Treated::AboutOrbit),
            OF_FORCED_MOTION,
        ),
        Treatment::ChipLaw => (treated == Treated::AboutOrbit, OF_FORCED_MOTION),
        Treatment::Equivalent => (
            treated == Treated::AboutOrbit,
            "it is not smooth: its equivalent depends on the amplitude of the forced motion, which this method does not follow; \
             --method collocation takes its equivalent stiffness and damping there, and `simulate` runs it as it is",
        ),
        Treatment::OfMoment(reason) | Treatment::Refused(reason) => (false, reason),
    };
    (!is_treated).then_some(reason)
}

const OF_FORCED_MOTION: &str = "the limit then depends on the forced motion, which this method does not follow; --method \
    collocation does, and --linear leaves smooth terms of the structure out";
