use std::path::Path;

use super::*;

/// A mode at an angle to x in degrees.
fn mode(frequency_hz: f64, angle_deg: f64) -> ComparedMode {
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    ComparedMode {
        frequency_hz,
        frequency_std_hz: Some(0.1),
        damping_ratio: 0.02,
        damping_ratio_std: Some(1e-3),
        shape: vec![
            (Direction::X, Complex64::new(0.0, cos)),
            (Direction::Y, Complex64::new(0.0, sin)),
        ],
    }
}

#[test]
fn modes_are_paired_by_shape_where_frequency_alone_would_be_wrong() {
    // The modes in x and y change places: 500 Hz in x becomes 530 Hz, and 520 Hz in y becomes 505 Hz.
    let before = [mode(500.0, 0.0), mode(520.0, 90.0)];
    let after = [mode(505.0, 88.0), mode(530.0, 2.0), mode(900.0, 0.0)];
    let found: Vec<(Option<usize>, Option<usize>)> = pairs(&before, &after)
        .iter()
        .map(|pair| (pair.before, pair.after))
        .collect();
    assert_eq!(found, [(Some(1), Some(0)), (Some(0), Some(1)), (None, Some(2))]);
    // cos² 2° = 0.99878.
    let assurance = pairs(&before, &after)[0].assurance.unwrap();
    assert!((assurance - 0.998_782).abs() < 1e-6, "{assurance}");
}

#[test]
fn one_common_direction_pairs_by_frequency_alone() {
    let mut only_x = mode(505.0, 0.0);
    only_x.shape.truncate(1);
    let found = pairs(&[mode(500.0, 0.0)], &[only_x]);
    assert_eq!(found.len(), 1);
    assert_eq!(
        (found[0].before, found[0].after, found[0].assurance),
        (Some(0), Some(0), None)
    );
}

#[test]
fn modes_without_a_common_direction_are_no_pair() {
    let (mut only_x, mut only_y) = (mode(500.0, 0.0), mode(500.0, 90.0));
    only_x.shape.truncate(1);
    only_y.shape.remove(0);
    assert_eq!(pairs(&[only_x], &[only_y]).len(), 2);
}

#[test]
fn modes_of_a_case_are_those_of_its_matrices_with_the_stated_deviations() {
    // m = 1 kg: ω² = k, 2ζω = c.
    let matrices = r#"
[structure]
kind = "matrices"
directions = ["x", "y"]
mass = [[1.0, 0.0], [0.0, 1.0]]
damping = [[4.0, 0.0], [0.0, 6.0]]
stiffness = [[1e4, 0.0], [0.0, 4e4]]
"#;
    let case = Case::parse(Path::new("a.toml"), matrices).unwrap();
    let found = ComparedMode::of_case(&case).unwrap();
    assert_eq!(found.len(), 2);
    for (mode, (omega, zeta)) in found.iter().zip([(100.0, 0.02), (200.0, 0.015)]) {
        assert!((mode.frequency_hz * TAU / omega - 1.0).abs() < 1e-9);
        assert!((mode.damping_ratio / zeta - 1.0).abs() < 1e-9);
        assert_eq!((mode.frequency_std_hz, mode.damping_ratio_std), (None, None));
    }
    assert!(found[0].shape[1].1.norm() < 1e-9 * found[0].shape[0].1.norm());
    let modes = r#"
[structure]
kind = "modes"
directions = ["x"]
[[structure.mode]]
frequency_hz = 50.0
frequency_hz_std = 0.25
damping_ratio = 0.02
left = [[1e-3, -1e-3]]
right = [[1e-3, -1e-3]]
"#;
    let case = Case::parse(Path::new("b.toml"), modes).unwrap();
    let found = ComparedMode::of_case(&case).unwrap();
    assert_eq!(
        (found[0].frequency_std_hz, found[0].damping_ratio_std),
        (Some(0.25), None)
    );
}
