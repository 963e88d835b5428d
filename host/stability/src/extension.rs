//! What the extensions of a case make of its structure and its cutting process.

use std::sync::Arc;

use super::StabilityError;
use quietcut_model::case::{AXIAL_DEPTH_MODULATION, Case, EXTENSIONS_OF_SENSORS};
use quietcut_model::milling::Material;
use quietcut_model::structure::FirstOrder;
use quietcut_model::{Cutter, Effects, ForceLaw, ModelError, Term};

/// Extensions that change the linear structure: its matrices, its modes.
const OF_LINEAR_STRUCTURE: [&str; 4] = ["mass", "stiffness", "damping", "missing-mode"];

/// Smooth terms of the equation of motion: about a forced orbit they have slopes.
const SMOOTH: [&str; 5] = [
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
const ABOUT_FORCED_CHIP: [&str; 2] = ["process-damping", "force-exponent"];

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
pub(super) fn refuse_others(case: &Case, treated: Treated) -> Result<(), StabilityError> {
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

/// The case as it is after `after_s` of work: drift and wear are then a stiffness and coefficients of that moment.
///
/// # Errors
/// A drift beside a stiffness of its own, forces or stiffness that have vanished by then, or an extension that the case cannot
/// have.
pub fn after(case: &Case, after_s: f64) -> Result<Case, StabilityError> {
    let not_covered = |what| StabilityError::NotCovered {
        path: case.path.clone(),
        what,
    };
    // Keys and values are judged by those who know them.
    Effects::of_case(case).map_err(|cause| wrong(case, cause.into()))?;
    let number = |table: &toml::Table, key: &str| {
        let value = table.get(key)?;
        value
            .as_float()
            .or_else(|| value.as_integer().map(|whole| whole as f64))
    };
    let mut moved = case.clone();
    if let Some(wear) = moved.extensions.remove("wear") {
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
        moved.extensions.remove("force-coefficients");
        moved.extensions.remove("edge-force");
        if let Some(flank) = moved.extensions.get_mut("process-damping")
            && let Some(damping) = number(flank, "process_damping_n_per_m")
        {
            flank.insert("process_damping_n_per_m".into(), (factor * damping).into());
        }
    }
    if let Some(drift) = moved.extensions.remove("drift") {
        if moved.extensions.contains_key("stiffness") {
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
        moved.extensions.insert("stiffness".into(), stiffness);
    }
    Ok(moved)
}

/// The effects of a case with these names.
fn effects(case: &Case, names: &[&str]) -> Result<Effects, StabilityError> {
    let all = Effects::of_case(case).map_err(|cause| wrong(case, cause.into()))?;
    Ok(Effects(
        all.0
            .into_iter()
            .filter(|effect| names.contains(&effect.name()))
            .collect(),
    ))
}

fn wrong(case: &Case, cause: ModelError) -> StabilityError {
    StabilityError::Extension {
        path: case.path.clone(),
        cause: Box::new(cause),
    }
}

/// The linear structure with its extensions, in the machine's axes.
///
/// # Errors
/// The case has none, it is indefinite, or it cannot have an extension.
pub(super) fn structure(case: &Case) -> Result<FirstOrder, StabilityError> {
    let structure = case.structure()?;
    let effects = effects(case, &OF_LINEAR_STRUCTURE)?;
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
pub(super) fn material(case: &Case) -> Result<Material, StabilityError> {
    let names = ["force-coefficients", "edge-force"];
    if !case.extensions.keys().any(|name| names.contains(&name.as_str())) {
        return Ok(*case.material()?);
    }
    Ok(law(case, &names)?.material())
}

/// The force law with these extensions.
fn law(case: &Case, names: &[&str]) -> Result<ForceLaw, StabilityError> {
    Ok(cutter(case, names)?.force)
}

/// The tool with these extensions.
fn cutter(case: &Case, names: &[&str]) -> Result<Cutter, StabilityError> {
    // The depth is no part of what is asked.
    let cutter = Cutter::new(case.tool()?, case.material()?, case.cut()?, 1e-3);
    let effects = effects(case, names)?;
    let cutter = cutter.and_then(|cutter| effects.cutter(cutter));
    cutter.map_err(|cause| wrong(case, cause))
}

/// How far the radius of each tooth exceeds the mean, m, in the order of the teeth: runout.
///
/// # Errors
/// A section is missing, or an extension that the case cannot have.
pub(crate) fn radial_m(case: &Case) -> Result<Vec<f64>, StabilityError> {
    let teeth = cutter(case, &["runout"])?.teeth;
    Ok(teeth.iter().map(|tooth| tooth.radial_m).collect())
}

/// What acts about a forced orbit: smooth terms, the chip law, the damping of the flank.
///
/// # Errors
/// An extension that the case cannot have.
pub(crate) fn about_orbit(case: &Case) -> Result<AboutOrbit, StabilityError> {
    let structure = case.structure()?;
    let mut terms = Vec::new();
    for effect in &effects(case, &SMOOTH)?.0 {
        let found = effect
            .terms(structure)
            .map_err(|cause| wrong(case, cause.into()))?;
        terms.extend(found.into_iter().map(Arc::from));
    }
    Ok(AboutOrbit {
        terms,
        law: law(case, &ABOUT_FORCED_CHIP)?,
    })
}

/// The terms of a case that are not smooth, on the structure as the other extensions leave it.
///
/// # Errors
/// An extension that the case cannot have.
pub(crate) fn not_smooth(case: &Case) -> Result<Vec<Box<dyn Term>>, StabilityError> {
    let structure = case.structure()?;
    let names: Vec<&str> = OF_LINEAR_STRUCTURE.into_iter().chain(NOT_SMOOTH).collect();
    match effects(case, &names)?.dynamics(structure) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CubicTerms, Problem};

    fn case(extension: &str) -> Case {
        let path = format!(
            "{}/../../tests/cases/kuka-kr90-half.toml",
            env!("CARGO_MANIFEST_DIR")
        );
        let text = std::fs::read_to_string(&path).unwrap();
        Case::parse(path.as_ref(), &format!("{text}\n{extension}")).unwrap()
    }

    #[test]
    fn wear_and_drift_are_coefficients_and_stiffness_of_the_moment() {
        let moving = case(
            "[extension.wear]\nrelative_rate_per_s = 0.001\n[extension.drift]\nrelative_change = -0.1\ntime_constant_s = 300.0\n",
        );
        let error = Problem::new(&moving, CubicTerms::Refuse).unwrap_err().to_string();
        assert!(error.contains("--after-s"), "{error}");
        let then = Problem::new(&after(&moving, 300.0).unwrap(), CubicTerms::Refuse).unwrap();
        let mut expected = case("");
        let material = expected.material.as_mut().unwrap();
        (material.ktc_mpa, material.krc_mpa) = (1.3 * material.ktc_mpa, 1.3 * material.krc_mpa);
        if let quietcut_model::structure::Form::Matrices(matrices) =
            &mut expected.structure.as_mut().unwrap().form
        {
            matrices.stiffness *= 1.0 - 0.1 * (1.0 - (-1.0_f64).exp());
        }
        let expected = Problem::new(&expected, CubicTerms::Refuse).unwrap();
        let point = |problem: &Problem| crate::point(problem, 900.0, 1.0).unwrap().multiplier;
        assert!((point(&then) - point(&expected)).norm() < 1e-9);
        let start = Problem::new(&after(&moving, 0.0).unwrap(), CubicTerms::Refuse).unwrap();
        let plain = Problem::new(&case(""), CubicTerms::Refuse).unwrap();
        assert!((point(&start) - point(&plain)).norm() < 1e-9);
        assert!((point(&then) - point(&plain)).norm() > 1e-2);
    }

    #[test]
    fn what_has_no_multipliers_is_refused_with_its_reason() {
        for (extension, reason) in [
            (
                "[extension.coulomb-friction]\nfc_n = 1.0\ndirection = \"x\"\n",
                "not smooth",
            ),
            (
                "[extension.speed-fluctuation]\ndelta = 0.01\nfrequency_hz = 2.0\n",
                "tooth period",
            ),
            (
                "[extension.cubic-stiffness]\nk3_n_per_m3 = 1e12\ndirection = \"x\"\n",
                "--method collocation",
            ),
        ] {
            let error = Problem::new(&case(extension), CubicTerms::Refuse)
                .unwrap_err()
                .to_string();
            assert!(error.contains(reason), "{error}");
        }
        // Sensors change nothing.
        assert!(Problem::new(&case("[extension.sensor-gain]\ngain = 1.2\n"), CubicTerms::Refuse).is_ok());
    }
}
