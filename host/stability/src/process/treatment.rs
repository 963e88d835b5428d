//! Which extensions of a case a method treats, and what it says of the others.

use crate::error::StabilityError;
use quietcut_model::case::{AXIAL_DEPTH_MODULATION, Case, EXTENSIONS_OF_SENSORS};

/// Extensions that change the linear structure: its matrices, its modes.
pub(super) const OF_LINEAR_STRUCTURE: [&str; 4] = ["mass", "stiffness", "damping", "missing-mode"];

/// Smooth terms of the equation of motion: about a forced orbit they have slopes.
pub(super) const SMOOTH: [&str; 5] = [
    "cubic-stiffness",
    "quadratic-stiffness",
    "cubic-damping",
    "softening-hardening",
    "mode-coupling",
];

/// Extensions of the process that the linear problem has: coefficients, and runout, which on a linear structure moves the
/// forced motion and not its stability.
const OF_LINEAR_PROCESS: [&str; 4] = [
    AXIAL_DEPTH_MODULATION,
    "force-coefficients",
    "edge-force",
    "runout",
];

/// Extensions of the process that act through the depth or about the forced chip.
pub(super) const ABOUT_FORCED_CHIP: [&str; 2] = ["process-damping", "force-exponent"];

/// Terms that are not smooth: they act by an equivalent stiffness and damping at the amplitude of the forced orbit.
pub(crate) const NOT_SMOOTH: [&str; 3] = ["coulomb-friction", "backlash", "hysteresis"];

/// How much of the extensions a method treats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Treated {
    /// The process alone, whose structure is not that of the case.
    LinearProcess,
    /// Linear structure and linear process.
    Linear,
    /// The same, and smooth terms are left out: the limits for vanishing feed.
    WithoutSmooth,
    /// Everything that has slopes about a forced orbit.
    AboutOrbit,
}

/// True where the limits of a case depend on its forced orbit.
pub fn needs_orbit(case: &Case) -> bool {
    case.structure
        .as_ref()
        .is_some_and(quietcut_model::structure::Structure::is_nonlinear)
        || case
            .extensions
            .keys()
            .any(|name| SMOOTH.contains(&name.as_str()) || ABOUT_FORCED_CHIP.contains(&name.as_str()))
        || is_not_smooth(case)
}

/// True where a case has friction, backlash or hysteresis.
pub(crate) fn is_not_smooth(case: &Case) -> bool {
    case.extensions
        .keys()
        .any(|name| NOT_SMOOTH.contains(&name.as_str()))
}

/// Refuses what a method cannot treat, with the reason.
///
/// # Errors
/// The first such extension.
pub(crate) fn refuse_others(case: &Case, treated: Treated) -> Result<(), StabilityError> {
    let mut names = OF_LINEAR_PROCESS.to_vec();
    if treated != Treated::LinearProcess {
        names.extend(OF_LINEAR_STRUCTURE);
    }
    if matches!(treated, Treated::WithoutSmooth | Treated::AboutOrbit) {
        names.extend(SMOOTH);
    }
    if treated == Treated::AboutOrbit {
        names.extend(ABOUT_FORCED_CHIP);
        names.extend(NOT_SMOOTH);
    }
    names.extend(EXTENSIONS_OF_SENSORS);
    match case
        .extensions
        .keys()
        .find(|name| !names.contains(&name.as_str()))
    {
        None => Ok(()),
        Some(name) => Ok(case.refuse_extensions_but(&names, reason(name))?),
    }
}

fn reason(name: &str) -> &'static str {
    match name {
        name if SMOOTH.contains(&name) || ABOUT_FORCED_CHIP.contains(&name) => {
            "the limit then depends on the forced motion, which this method does not follow; --method collocation does, and \
             --linear leaves smooth terms of the structure out"
        }
        name if OF_LINEAR_STRUCTURE.contains(&name) => {
            "it changes the structure, and this method takes receptances as they were measured; remove the table"
        }
        "drift" => {
            "stiffness that moves with time has limits for one moment only; give the stiffness of that moment in \
             [extension.stiffness] instead, or say after how long (--after-s 0 and --after-s T: between, limits lie between)"
        }
        "wear" => {
            "forces that grow with time have limits for one moment only; give the coefficients of that moment in \
             [extension.force-coefficients] instead, or say after how long (--after-s 0 and --after-s T: between, limits lie \
             between)"
        }
        "speed-fluctuation" => {
            "the tooth period then changes from tooth to tooth, and there is no one-period map; `simulate` runs it, and without \
             the table the limits are those of the mean speed"
        }
        _ => {
            "it is not smooth: what it does depends on the amplitude of the forced motion, which this method does not follow; \
             --method collocation takes its equivalent stiffness and damping there, and `simulate` runs it as it is"
        }
    }
}
