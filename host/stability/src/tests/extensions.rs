//! Stability of cases with extensions, and extensions that linear stability refuses.

use crate::orbit::EquivalentProblem;
use crate::*;
use quietcut_model::case::Case;

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
fn effects_without_multipliers_are_refused_with_their_reason() {
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
    // Effects of sensors do not change stability and are accepted.
    assert!(Problem::new(&case("[extension.sensor-gain]\ngain = 1.2\n"), CubicTerms::Refuse).is_ok());
}

#[test]
fn friction_with_teeth_that_are_not_alike_is_refused_on_a_linear_structure_too() {
    let friction = "[extension.coulomb-friction]\nfc_n = 1.0\ndirection = \"x\"\n";
    assert!(EquivalentProblem::new(&case(friction)).is_ok());
    let runout = "[extension.runout]\nrunout_um = 20.0\n";
    let error = EquivalentProblem::new(&case(&format!("{friction}{runout}"))).unwrap_err();
    assert!(error.to_string().contains("leave out runout"), "{error}");
}
