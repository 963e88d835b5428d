//! Tests of the section `[uncertainty]`.

use std::path::Path;

use nalgebra::DMatrix;

use super::{Case, Parameter, ParameterCovariance};

const MACHINE: &str = r#"[structure]
kind = "modes"
directions = ["x"]
[[structure.mode]]
frequency_hz = 17.0
damping_ratio = 0.03
left = [[0.002, 0.001]]
right = [[0.002, -0.001]]
[material]
ktc_mpa = 600.0
krc_mpa = 200.0
krc_mpa_std = 20.0
kac_mpa = 0.0
"#;

fn parse(uncertainty: &str) -> Result<Case, String> {
    let text = format!("{MACHINE}[uncertainty]\n{uncertainty}\n");
    Case::parse(Path::new("machine.toml"), &text).map_err(|error| error.to_string())
}

#[test]
fn names_and_covariance_arrive() {
    let case = parse(
        "parameters = [\"structure.mode.1.frequency_hz\", \"structure.mode.1.left.1.imaginary\", \"material.ktc_mpa\"]\n\
         covariance = [[0.04, -0.5e-5, 0.0], [-0.5e-5, 1e-8, 0.0], [0.0, 0.0, 400.0]]",
    )
    .unwrap();
    let known = case.covariance.as_ref().unwrap();
    let expected = [
        Parameter::Frequency(0),
        Parameter::Left(0, 0, true),
        Parameter::Ktc,
    ];
    assert_eq!(known.parameters, expected);
    assert_eq!(known.covariance[(0, 1)], -0.5e-5);
    assert!(case.is_uncertain());
}

/// Sections that are refused: the section, the line of the fault in the whole file, and words of the message.
const WRONG: [(&str, usize, &[&str]); 13] = [
    (
        "parameters = [\"structure.mode.1.frequency\"]\ncovariance = [[1.0]]",
        15,
        &["structure.mode.1.frequency_hz", "closest"],
    ),
    (
        "parameters = [\"structure.mode[1].frequency_hz\"]\ncovariance = [[1.0]]",
        15,
        &["\"structure.mode.1.frequency_hz\" (the closest)"],
    ),
    (
        "parameters = [\"structure.mode.2.frequency_hz\"]\ncovariance = [[1.0]]",
        15,
        &["structure.mode.2", "structure.mode.1.frequency_hz"],
    ),
    (
        "parameters = [\"cut.start_deg\"]\ncovariance = [[1.0]]",
        15,
        &["cut.start_deg"],
    ),
    (
        "parameters = [\"material.krc_mpa\"]\ncovariance = [[1.0]]",
        15,
        &["material.krc_mpa", "_std"],
    ),
    (
        "parameters = [\"material.ktc_mpa\",\n \"material.ktc_mpa\"]\ncovariance = [[1.0, 0.0], [0.0, 1.0]]",
        16,
        &["twice"],
    ),
    ("parameters = []\ncovariance = []", 15, &["at least one"]),
    (
        "parameters = [\"material.ktc_mpa\"]\ncovariance = [[1.0], [1.0]]",
        16,
        &["2 rows", "1 rows of 1"],
    ),
    (
        "parameters = [\"material.ktc_mpa\", \"material.kac_mpa\"]\ncovariance = [\n[1.0, 0.5],\n[0.4, 1.0]]",
        17,
        &["0.5 in row 1, column 2", "0.4", "symmetric"],
    ),
    (
        "parameters = [\"material.ktc_mpa\", \"material.kac_mpa\"]\ncovariance = [\n[1.0, 0.0],\n[0.0, -1.0]]",
        18,
        &["-1 in row 2", "0 or more"],
    ),
    (
        "parameters = [\"material.ktc_mpa\", \"material.kac_mpa\"]\ncovariance = [[4.0, 2.1], [2.1, 1.0]]",
        16,
        &["2.1 in row 1", "at most 2"],
    ),
    (
        // Each pair is possible; all three correlations of −0.9 together are not.
        "parameters = [\"material.ktc_mpa\", \"material.kac_mpa\", \"material.kte_n_per_mm\"]\n\
         covariance = [[1.0, -0.9, -0.9], [-0.9, 1.0, -0.9], [-0.9, -0.9, 1.0]]",
        16,
        &["negative eigenvalue", "positive semidefinite"],
    ),
    (
        "parameters = [\"material.ktc_mpa\"]",
        14,
        &["[uncertainty] lacks covariance"],
    ),
];

#[test]
fn each_fault_is_refused_with_line_and_reason() {
    for (section, line, words) in WRONG {
        let message = parse(section).unwrap_err();
        assert!(message.contains(&format!("line {line},")), "{line}: {message}");
        for word in words {
            assert!(message.contains(word), "{word}: {message}");
        }
    }
}

#[test]
fn independent_variables_have_the_covariance_that_the_case_states() {
    let all = [
        Parameter::Ktc,
        Parameter::Krc,
        Parameter::Kac,
        Parameter::Kte,
        Parameter::Kre,
    ];
    for rank in 1..=5 {
        // A covariance of five parameters of very different scales that depend on `rank` variables only.
        let scales = [1e-9, 1.0, 1e3, 1e-3, 1e6];
        let mixing = DMatrix::from_fn(5, rank, |i, j| {
            scales[i] * ((1.3 * i as f64 + 1.0) * (2.1 * j as f64 + 1.7)).sin()
        });
        let known = ParameterCovariance {
            parameters: all.to_vec(),
            covariance: &mixing * mixing.transpose(),
        };
        let variables = known.independent_parts();
        assert_eq!(variables.len(), rank);
        let mut sum = DMatrix::<f64>::zeros(5, 5);
        for parts in &variables {
            for a in parts {
                for b in parts {
                    let place = |parameter| all.iter().position(|known| *known == parameter).unwrap();
                    sum[(place(a.parameter), place(b.parameter))] += a.std * b.std;
                }
            }
        }
        for i in 0..5 {
            for j in 0..5 {
                let size = scales[i] * scales[j];
                // A dropped variance is at most 1e-8 of a parameter's, a dropped covariance 1e-8 of the product.
                let error = (sum[(i, j)] - known.covariance[(i, j)]).abs();
                assert!(error < 1e-7 * size, "{rank}: {i} {j} {error}");
            }
        }
    }
}

#[test]
fn every_parameter_has_a_name_of_its_own() {
    for case in ["kuka-kr90-acetal", "insperger-2dof-ad0.5", "six-joint-robot"] {
        let case = super::tests::case(case);
        let all = Parameter::of_case(&case);
        let mut names: Vec<String> = all.iter().map(|parameter| parameter.name()).collect();
        assert!(names.len() > 10);
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), all.len());
    }
}
