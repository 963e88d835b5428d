//! Writes identified parameters as the text of a case file.

use nalgebra::{DMatrix, Vector3};
use num_complex::Complex64;
use toml::{Table, Value};

use crate::case_uncertainty;
use crate::modes::{IdentifiedMode, ModalModel};
use crate::robot::joints::JointParameter;
use quietcut_model::effects::EffectName;
use quietcut_model::milling::Runout;
use quietcut_model::structure::{Direction, Joint, Mode, Robot};

/// One identified parameter of a case, of the equations of motion or of the cutting force, with its standard deviation.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Key of the parameter in a case: `mass_kg`, `k3_n_per_m3` …
    pub key: &'static str,
    /// Direction of the parameter; two directions for an off-diagonal entry of a matrix and for a coupling, none for a
    /// coefficient of the cutting force.
    pub directions: Vec<Direction>,
    /// Value, in the unit that ends the key.
    pub value: f64,
    /// Standard deviation of the value, in its unit.
    pub deviation: f64,
}

/// Reason why an identified model does not fit into a case file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CaseFileError {
    /// A required parameter was not identified: the mass, or a cutting coefficient.
    #[error("a case needs {0}, which this method does not give")]
    Missing(&'static str),
    /// Parameters of one extension have different directions, but a case holds an extension once.
    #[error(
        "[extension.{0}] is needed in two directions; a case holds one: identify the directions one by one"
    )]
    Twice(&'static str),
    /// No direction is both excited and measured.
    #[error(
        "no direction is both driven and measured, so the modes are not those of a tool; drive where the motion is measured"
    )]
    NoDirection,
    /// The case is not valid TOML, or cannot be written as TOML.
    #[error("the case cannot be written as TOML: {0}")]
    Toml(String),
}

/// Text of the case file in TOML.
///
/// # Errors
/// A value has no form in TOML.
fn written(case: &Table) -> Result<String, CaseFileError> {
    let mut case = case.clone();
    // The crate `toml` writes the covariance in one line, which no person can read.
    let uncertainty = case.remove(case_uncertainty::SECTION);
    let text = toml::to_string(&case).map_err(|error| CaseFileError::Toml(error.to_string()))?;
    Ok(text + &uncertainty.map_or_else(String::new, |section| case_uncertainty::text(&section)))
}

/// Sections of a case file about the tool and the cut, which [`with_sections`] takes from another case.
const OTHERS: [&str; 4] = ["tool", "material", "cut", "limits"];

/// Case file `text` whose sections tool, material, cut and limits are replaced by those that the case `other` has, and
/// to whose `[uncertainty]` the covariance is added that `other` has of parameters of these four sections.
///
/// # Errors
/// The text is not valid TOML, or the result cannot be written as TOML.
pub fn with_sections(text: &str, other: &Table) -> Result<String, CaseFileError> {
    let mut case: Table = text
        .parse()
        .map_err(|error: toml::de::Error| CaseFileError::Toml(error.to_string()))?;
    for section in OTHERS {
        if let Some(value) = other.get(section) {
            case.insert(section.into(), value.clone());
        }
    }
    case_uncertainty::take_over(&mut case, other, &OTHERS);
    written(&case)
}

/// Case file `text` that states the spindle speed of its structure, rev/min, 0 at standstill. A case without structure stays as it
/// is.
///
/// # Errors
/// The text is not valid TOML, or the result cannot be written as TOML.
pub fn with_speed(text: &str, rpm: f64) -> Result<String, CaseFileError> {
    let mut case: Table = text
        .parse()
        .map_err(|error: toml::de::Error| CaseFileError::Toml(error.to_string()))?;
    if let Some(structure) = case.get_mut("structure").and_then(Value::as_table_mut) {
        structure.insert("rpm".into(), rpm.into());
    }
    written(&case)
}

/// The case `other` with the name, the tool and the material of `identified`, a case of [`cutting`].
///
/// The name of the material and the keys of the tool that `identified` lacks are those of `other`; but if `identified`
/// has a runout, no key of the runout of `other` stays. Force coefficients that were not identified do not stay.
pub fn with_coefficients(identified: &Table, other: &Table) -> Table {
    let mut case = other.clone();
    for (section, value) in identified {
        case.insert(section.clone(), value.clone());
    }
    let mut keep = |section: &str, is_kept: &dyn Fn(&str) -> bool| {
        let before = other.get(section).and_then(Value::as_table);
        let now = case.get_mut(section).and_then(Value::as_table_mut);
        if let (Some(before), Some(now)) = (before, now) {
            for (key, value) in before.iter().filter(|(key, _)| is_kept(key)) {
                now.entry(key.clone()).or_insert_with(|| value.clone());
            }
        }
    };
    let has_runout = identified
        .get("tool")
        .is_some_and(|tool| tool.get("runout_um").is_some());
    keep("tool", &|key| {
        !(has_runout && key.starts_with(EffectName::Runout.name()))
    });
    keep("material", &|key| key == "name");
    case
}

/// Text of a case file with the complex modes of `model`, in the directions that are both excited and measured, the
/// joint covariance of their parameters, and the assumptions of the identification.
///
/// # Errors
/// No direction is both excited and measured, or a value has no form in TOML.
pub fn text_of_modes(name: &str, model: &ModalModel) -> Result<String, CaseFileError> {
    let directions = model.directions();
    if directions.is_empty() {
        return Err(CaseFileError::NoDirection);
    }
    let picked = |all: &[Direction], index: usize| all.iter().position(|known| *known == directions[index]);
    let modes: Vec<IdentifiedMode> = model
        .modes
        .iter()
        .map(|found| {
            let places = |all| (0..directions.len()).filter_map(move |index| picked(all, index));
            let (left, right) = (places(&model.forces), places(&model.responses));
            IdentifiedMode {
                mode: Mode {
                    left: left.clone().map(|place| found.mode.left[place]).collect(),
                    right: right.clone().map(|place| found.mode.right[place]).collect(),
                    ..found.mode
                },
                left_std: left.map(|place| found.left_std[place]).collect(),
                right_std: right.map(|place| found.right_std[place]).collect(),
                ..*found
            }
        })
        .collect();
    let mut case = modal(name, &directions, &modes);
    // The joint covariance replaces the standard deviations.
    let found = case
        .get_mut("structure")
        .and_then(|structure| structure.get_mut("mode"));
    for mode in found.and_then(Value::as_array_mut).into_iter().flatten() {
        if let Value::Table(mode) = mode {
            mode.retain(|key, _| !key.ends_with("_std"));
        }
    }
    let uncertainty = case_uncertainty::of_modes(model, &directions);
    case.insert(case_uncertainty::SECTION.into(), Value::Table(uncertainty));
    let mut assumed = left_out(model, &directions);
    if model.gain_error.is_none() {
        assumed.push(EXACT_GAINS.into());
    }
    let not_measured = model.not_measured().into_iter();
    let zero: Vec<String> = not_measured
        .filter(|(p, q)| directions.contains(p) && directions.contains(q))
        .map(|(p, q)| format!("h{p}{q}"))
        .collect();
    let mut provenance = Table::new();
    for (key, texts) in [("assumed", assumed), ("zero_receptances", zero)] {
        if !texts.is_empty() {
            let texts = texts.into_iter().map(Value::from).collect();
            provenance.insert(key.to_owned(), Value::Array(texts));
        }
    }
    if !provenance.is_empty() {
        case.insert("provenance".into(), Value::Table(provenance));
    }
    written(&case)
}

/// Assumption written into a case if the covariance of the modes contains no errors of the sensors' gains.
const EXACT_GAINS: &str = "the gains of force and response sensors are taken as exact: limits are off by as many percent as these; \
    --calibration-percent of identify puts their error into the intervals";

/// A sentence for each of x, y and z that is not among `directions`, those that are both excited and measured.
fn left_out(model: &ModalModel, directions: &[Direction]) -> Vec<String> {
    let axes = [Direction::X, Direction::Y, Direction::Z].into_iter();
    axes.filter(|axis| !directions.contains(axis))
        .map(|axis| {
            let reason = match (model.forces.contains(&axis), model.responses.contains(&axis)) {
                (true, _) => "driven, but not measured",
                (false, true) => "measured, but not driven",
                (false, false) => "neither driven nor measured",
            };
            format!("{axis} is left out: it was {reason}")
        })
        .collect()
}

/// Table of a case file with complex modes, whose left and right shapes have an entry for each of `directions`.
pub fn modal(name: &str, directions: &[Direction], modes: &[IdentifiedMode]) -> Table {
    let pairs = |shape: &[[f64; 2]]| -> Value {
        let entry = |parts: &[f64; 2]| Value::Array(parts.map(Value::Float).into());
        Value::Array(shape.iter().map(entry).collect())
    };
    let parts = |shape: &[Complex64]| -> Vec<[f64; 2]> { shape.iter().map(|z| [z.re, z.im]).collect() };
    let modes = modes.iter().map(|found| {
        let mut mode = Table::new();
        mode.insert("frequency_hz".into(), found.mode.frequency_hz.into());
        mode.insert("frequency_hz_std".into(), found.frequency_std_hz.into());
        mode.insert("damping_ratio".into(), found.mode.damping_ratio.into());
        mode.insert("damping_ratio_std".into(), found.damping_ratio_std.into());
        mode.insert("left".into(), pairs(&parts(&found.mode.left)));
        mode.insert("left_std".into(), pairs(&found.left_std));
        mode.insert("right".into(), pairs(&parts(&found.mode.right)));
        mode.insert("right_std".into(), pairs(&found.right_std));
        Value::Table(mode)
    });
    let mut structure = Table::new();
    structure.insert("kind".into(), "modes".into());
    let names = directions.iter().map(|direction| Value::from(direction.name()));
    structure.insert("directions".into(), Value::Array(names.collect()));
    structure.insert("mode".into(), Value::Array(modes.collect()));
    let mut case = Table::new();
    case.insert("name".into(), name.into());
    case.insert("structure".into(), Value::Table(structure));
    case
}

/// Table of a case file with a robot at its posture; `deviations` are the standard deviations of the identified joint
/// parameters.
pub fn robot(name: &str, robot: &Robot, deviations: &[(JointParameter, f64)]) -> Table {
    let place = |place: &Vector3<f64>| numbers(place.iter().copied());
    let joint = |joint: &Joint| {
        let mut table = Table::new();
        let i = &joint.inertia_kg_m2;
        table.insert("axis".into(), place(&joint.axis));
        table.insert("point_m".into(), place(&joint.point_m));
        table.insert("center_m".into(), place(&joint.center_m));
        table.insert(
            "inertia_kg_m2".into(),
            numbers([i[(0, 0)], i[(1, 1)], i[(2, 2)], i[(0, 1)], i[(0, 2)], i[(1, 2)]].into_iter()),
        );
        for (key, value) in [
            ("stiffness_nm_per_rad", joint.stiffness_nm_per_rad),
            ("damping_nms_per_rad", joint.damping_nms_per_rad),
            ("mass_kg", joint.mass_kg),
            ("rotor_kg_m2", joint.rotor_kg_m2),
            ("cubic_stiffness_nm_per_rad3", joint.cubic_stiffness_nm_per_rad3),
            ("cubic_damping_nms3_per_rad3", joint.cubic_damping_nms3_per_rad3),
        ] {
            table.insert(key.into(), value.into());
        }
        table
    };
    let mut joints: Vec<Table> = robot.joints.iter().map(joint).collect();
    for (parameter, deviation) in deviations {
        if let Some(table) = joints.get_mut(parameter.joint(robot.joints.len())) {
            table.insert(format!("{}_std", parameter.key()), (*deviation).into());
        }
    }
    let mut structure = Table::new();
    structure.insert("kind".into(), "joints".into());
    structure.insert(
        "directions".into(),
        Value::Array(["x", "y", "z"].map(Value::from).into()),
    );
    structure.insert("tool_m".into(), place(&robot.tool_m));
    let joints = joints.into_iter().map(Value::Table).collect();
    structure.insert("joint".into(), Value::Array(joints));
    let mut posture = Table::new();
    let angles = robot.angles_rad.iter().map(|angle| angle.to_degrees());
    posture.insert("joints_deg".into(), numbers(angles));
    let mut case = Table::new();
    case.insert("name".into(), name.into());
    case.insert("structure".into(), Value::Table(structure));
    case.insert("posture".into(), Value::Table(posture));
    case
}

fn numbers(values: impl Iterator<Item = f64>) -> Value {
    Value::Array(values.map(Value::Float).collect())
}

/// Table of a case file with force coefficients, number of teeth, edge angle, and the runout if it was identified.
///
/// # Errors
/// A cutting coefficient is missing.
pub fn cutting(
    name: &str,
    material: &[Estimate],
    teeth: usize,
    edge_angle_deg: f64,
    runout: Option<Runout>,
) -> Result<Table, CaseFileError> {
    let mut table = Table::new();
    for key in ["ktc_mpa", "krc_mpa", "kac_mpa"] {
        if !material.iter().any(|estimate| estimate.key == key) {
            return Err(CaseFileError::Missing(key));
        }
    }
    for estimate in material {
        table.insert(estimate.key.into(), estimate.value.into());
        table.insert(format!("{}_std", estimate.key), estimate.deviation.into());
    }
    let mut tool = Table::new();
    tool.insert("teeth".into(), Value::Integer(teeth as i64));
    tool.insert("edge_angle_deg".into(), edge_angle_deg.into());
    if let Some(runout) = runout {
        tool.insert("runout_um".into(), runout.offset_um.into());
        tool.insert("runout_angle_deg".into(), runout.angle_deg.into());
    }
    let mut case = Table::new();
    case.insert("name".into(), name.into());
    case.insert("tool".into(), Value::Table(tool));
    case.insert("material".into(), Value::Table(table));
    Ok(case)
}

/// Name of the extension of a case that contains the parameter `key`; `None` for every other key, such as those of the
/// structure's matrices, cubic ones included.
fn extension_of(key: &str) -> Option<&'static str> {
    let effect = match key {
        "k2_n_per_m2" => EffectName::QuadraticStiffness,
        "k5_n_per_m5" => EffectName::SofteningHardening,
        "fc_n" => EffectName::CoulombFriction,
        "kxyy_n_per_m3" | "kxxy_n_per_m2" => EffectName::ModeCoupling,
        _ => return None,
    };
    Some(effect.name())
}

/// Text of a case file with mass, damping, stiffness and cubic terms as matrices, and the other terms as extensions.
/// With a quintic stiffness, the cubic stiffness is in the same extension. A constant force is left out.
///
/// A law without a damping or a stiffness term, such as that of a drive that moves freely, has a zero matrix there. The
/// standard deviations of the matrix are zero too: the law states that the term is absent.
///
/// # Errors
/// The mass was not identified, one extension is needed with different directions, or a value has no form in TOML.
pub fn text(name: &str, directions: &[Direction], estimates: &[Estimate]) -> Result<String, CaseFileError> {
    let mut structure = Table::new();
    structure.insert("kind".into(), "matrices".into());
    let names = directions.iter().map(|direction| Value::from(direction.name()));
    structure.insert("directions".into(), Value::Array(names.collect()));
    // If k5 was identified, the extension softening-hardening holds both k3 and k5.
    let turned = estimates.iter().any(|estimate| estimate.key == "k5_n_per_m5");
    let matrices = [
        ("mass", "mass_kg", true),
        ("damping", "damping_ns_per_m", true),
        ("stiffness", "stiffness_n_per_m", true),
        ("cubic_damping", "c3_ns3_per_m3", false),
        ("cubic_stiffness", "k3_n_per_m3", false),
    ];
    for (matrix, key, required) in matrices {
        let of_matrix: Vec<&Estimate> = estimates.iter().filter(|estimate| estimate.key == key).collect();
        if of_matrix.is_empty() && matrix == "mass" {
            return Err(CaseFileError::Missing(matrix));
        }
        if (of_matrix.is_empty() && !required) || (turned && matrix == "cubic_stiffness") {
            continue;
        }
        structure.insert(
            matrix.into(),
            rows(directions, &of_matrix, |estimate| estimate.value),
        );
        structure.insert(
            format!("{matrix}_std"),
            rows(directions, &of_matrix, |estimate| estimate.deviation),
        );
    }
    let mut case = Table::new();
    case.insert("name".into(), name.into());
    case.insert("structure".into(), Value::Table(structure));
    let extensions = extensions(directions, estimates, turned)?;
    if !extensions.is_empty() {
        case.insert("extension".into(), Value::Table(extensions));
    }
    written(&case)
}

fn extensions(
    directions: &[Direction],
    estimates: &[Estimate],
    turned: bool,
) -> Result<Table, CaseFileError> {
    let mut extensions = Table::new();
    for estimate in estimates {
        let extension = match estimate.key {
            "k3_n_per_m3" if turned => Some(EffectName::SofteningHardening.name()),
            key => extension_of(key),
        };
        let Some(extension) = extension else { continue };
        let place: Value = match estimate.directions[..] {
            [one] => one.name().into(),
            _ => Value::Array(
                estimate
                    .directions
                    .iter()
                    .map(|direction| direction.name().into())
                    .collect(),
            ),
        };
        let table = extensions
            .entry(extension)
            .or_insert_with(|| Value::Table(Table::new()));
        let Value::Table(table) = table else { continue };
        let key = if estimate.directions.len() > 1 {
            "directions"
        } else {
            "direction"
        };
        if directions.len() > 1 || key == "directions" {
            match table.get(key) {
                Some(known) if *known != place => return Err(CaseFileError::Twice(extension)),
                _ => table.insert(key.into(), place),
            };
        }
        table.insert(estimate.key.into(), estimate.value.into());
        table.insert(format!("{}_std", estimate.key), estimate.deviation.into());
    }
    Ok(extensions)
}

fn rows(directions: &[Direction], estimates: &[&Estimate], of: impl Fn(&Estimate) -> f64) -> Value {
    let mut matrix = DMatrix::zeros(directions.len(), directions.len());
    for estimate in estimates {
        let place =
            |direction: Option<&Direction>| directions.iter().position(|known| Some(known) == direction);
        if let (Some(i), Some(j)) = (
            place(estimate.directions.first()),
            place(estimate.directions.last()),
        ) {
            matrix[(i, j)] = of(estimate);
            matrix[(j, i)] = of(estimate);
        }
    }
    let rows = matrix.row_iter().map(|row| {
        let entries: Vec<Value> = row.iter().map(|entry| Value::Float(*entry)).collect();
        Value::Array(entries)
    });
    Value::Array(rows.collect())
}

#[cfg(test)]
mod tests;
