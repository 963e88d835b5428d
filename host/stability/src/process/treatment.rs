//! Which extensions of a case a method treats, and why it refuses the others.

use crate::error::StabilityError;
use quietcut_model::case::Case;
use quietcut_model::effects::{EffectSpec, Treatment};

/// Set of extensions of a case that a stability method treats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Treated {
    /// The method treats linear extensions of the cutting process only; measured receptances replace the structure.
    LinearProcess,
    /// The method treats linear extensions of structure and cutting process.
    Linear,
    /// The method treats linear extensions and omits smooth nonlinear terms, which gives the limits for vanishing feed.
    WithoutSmooth,
    /// The method treats all extensions with a Jacobian or an equivalent linearization about a forced orbit.
    AboutOrbit,
}

/// True if the stability limits of a case depend on its forced orbit.
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

/// True if a case has friction, backlash or hysteresis, which act by equivalent stiffness and damping.
pub(crate) fn is_not_smooth(case: &Case) -> bool {
    case.effects().any(|spec| spec.treatment == Treatment::Equivalent)
}

/// Refuses a case with extensions that a stability method does not treat.
///
/// # Errors
/// The first such extension, with the reason.
pub(crate) fn refuse_others(case: &Case, treated: Treated) -> Result<(), StabilityError> {
    Ok(case.refuse_extensions(|spec| reason(spec, treated))?)
}

/// Reason why a stability method refuses an extension; `None` if it treats the extension.
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
        Treatment::ProcessOfSpeed => (
            false,
            "its coefficients hold at one spindle speed, and here one set of coefficients serves all speeds; --method collocation \
             takes those of each speed",
        ),
        Treatment::OfMoment(reason) | Treatment::Refused(reason) => (false, reason),
    };
    (!is_treated).then_some(reason)
}

const OF_FORCED_MOTION: &str = "the limit then depends on the forced motion, which this method does not follow; --method \
    collocation does, and --linear leaves smooth terms of the structure out";
