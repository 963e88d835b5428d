//! Cases that are written and read again.

use super::*;
use quietcut_model::case::Case;
use quietcut_model::structure::Form;
use quietcut_simulate::Effects;

#[test]
fn identified_coefficients_replace_those_of_a_case_and_all_else_stays() {
    let path = quietcut_testkit::tests_folder().join("cases/kuka-kr90-acetal.toml");
    let mut other: Table = std::fs::read_to_string(path).unwrap().parse().unwrap();
    let tool = other["tool"].as_table_mut().unwrap();
    tool.insert("runout_um".into(), 7.0.into());
    tool.insert("runout_um_std".into(), 2.0.into());
    other["material"]
        .as_table_mut()
        .unwrap()
        .insert("krc_mpa_std".into(), 1.0.into());
    let estimate = |key, value| Estimate {
        key,
        directions: Vec::new(),
        value,
        deviation: 0.5,
    };
    let estimates =
        [("ktc_mpa", 101.0), ("krc_mpa", 102.0), ("kac_mpa", 103.0)].map(|(key, value)| estimate(key, value));
    let runout = Runout {
        offset_um: 12.0,
        angle_deg: 30.0,
    };
    let identified = cutting("found", &estimates, 2, 90.0, Some(runout)).unwrap();
    let written = with_coefficients(&identified, &other);
    assert_eq!(written["structure"], other["structure"]);
    assert_eq!(written["cut"], other["cut"]);
    assert_eq!(written["tool"]["diameter_mm"], other["tool"]["diameter_mm"]);
    assert_eq!(written["tool"]["runout_um"], 12.0.into());
    assert!(written["tool"].get("runout_um_std").is_none(), "{written}");
    let mut material = identified["material"].as_table().unwrap().clone();
    if let Some(name) = other["material"].get("name") {
        material.insert("name".into(), name.clone());
    }
    assert_eq!(written["material"], Value::Table(material));
    let text = toml::to_string(&written).unwrap();
    let case = Case::parse(std::path::Path::new("found.toml"), &text).unwrap();
    assert_eq!(case.material.unwrap().ktc_mpa, 101.0);
}

#[test]
fn a_robot_that_is_written_is_read_again() {
    let mut before = quietcut_testkit::robot();
    before.joints[2].cubic_stiffness_nm_per_rad3 = -1e12;
    let of: [fn(usize) -> JointParameter; 3] = [
        JointParameter::Stiffness,
        JointParameter::Damping,
        JointParameter::CubicStiffness,
    ];
    let deviations: Vec<(JointParameter, f64)> = of
        .iter()
        .flat_map(|of| (0..6).map(move |joint| (of(joint), 1.0 + joint as f64)))
        .collect();
    let text = toml::to_string(&robot("found", &before, &deviations)).unwrap();
    let case = Case::parse(std::path::Path::new("found.toml"), &text).unwrap();
    let Form::Joints(after) = &case.structure.as_ref().unwrap().form else {
        panic!("joints")
    };
    assert_eq!(after.joints, before.joints);
    assert_eq!(after.tool_m, before.tool_m);
    assert_eq!(case.deviations.len(), 18);
    // The angles in degrees are rounded once.
    for (a, b) in after.angles_rad.iter().zip(&before.angles_rad) {
        assert!((a - b).abs() < 1e-14);
    }
}

#[test]
fn what_is_written_is_read_again() {
    let estimate = |key, directions: &[Direction], value| Estimate {
        key,
        directions: directions.to_vec(),
        value,
        deviation: 0.01 * f64::abs(value),
    };
    let (y, z) = (Direction::Y, Direction::Z);
    let mut estimates = Vec::new();
    for direction in [y, z] {
        estimates.push(estimate("mass_kg", &[direction], 200.0));
        estimates.push(estimate("damping_ns_per_m", &[direction], 400.0));
        estimates.push(estimate("stiffness_n_per_m", &[direction], 2e6));
        estimates.push(estimate("k3_n_per_m3", &[direction], -3e12));
    }
    estimates.push(estimate("mass_kg", &[y, z], 5.0));
    estimates.push(estimate("kxyy_n_per_m3", &[y, z], 1e12));
    let text = text("found", &[y, z], &estimates).unwrap();
    let case = Case::parse(std::path::Path::new("found.toml"), &text).unwrap();
    let Form::Matrices(m) = &case.structure.as_ref().unwrap().form else {
        panic!("matrices")
    };
    assert_eq!((m.mass[(0, 1)], m.mass[(1, 1)]), (5.0, 200.0));
    assert_eq!(m.cubic_stiffness.as_ref().unwrap()[(1, 1)], -3e12);
    assert_eq!(case.deviations.len(), 2 * 4 + 2);
    let effects = Effects::of_case(&case).unwrap();
    assert_eq!(effects.0.len(), 1);
    let (_, terms) = effects.dynamics(case.structure().unwrap()).unwrap();
    assert_eq!(terms.len(), 1);
}
#[test]
fn a_drive_without_a_spring_is_written_and_read_again() {
    let estimate = |key, value: f64| Estimate {
        key,
        directions: vec![Direction::X],
        value,
        deviation: 0.01 * value.abs(),
    };
    let estimates = [
        estimate("mass_kg", 95.1),
        estimate("damping_ns_per_m", 203.5),
        estimate("fc_n", 20.4),
    ];
    let written = text("drive", &[Direction::X], &estimates).unwrap();
    let case = Case::parse(std::path::Path::new("drive.toml"), &written).unwrap();
    let structure = case.structure().unwrap();
    structure.check().unwrap();
    let Form::Matrices(m) = &structure.form else {
        panic!("matrices")
    };
    assert_eq!(
        (m.mass[(0, 0)], m.damping[(0, 0)], m.stiffness[(0, 0)]),
        (95.1, 203.5, 0.0)
    );
    assert_eq!(m.cubic_stiffness, None);
    // The friction is an extension, which keeps its own deviation. In the structure mass and damping have deviations, and the absent
    // spring has none.
    assert_eq!(Effects::of_case(&case).unwrap().0.len(), 1);
    assert!(written.contains("fc_n_std"), "{written}");
    assert_eq!(case.deviations.len(), 2);
    let only_damping = text("drive", &[Direction::X], &estimates[1..]).unwrap_err();
    assert_eq!(only_damping, CaseFileError::Missing("mass"));
}
