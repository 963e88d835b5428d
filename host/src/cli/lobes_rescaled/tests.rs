use super::*;

const CASE: &str = "# My mill.\n[structure]\nkind = \"modes\"\ndirections = [\"x\"]\nrpm = 0 # taps\n[[structure.mode]]\nfrequency_hz = 900.0 # bending\n\
                    damping_ratio = 0.02\nleft = [[0.0, -0.05]]\nright = [[0.05, 0.0]]\n[[structure.mode]]\nfrequency_hz = 1500\ndamping_ratio = 0.02\n\
                    left = [[0.0, -0.04]]\nright = [[0.04, 0.0]]\n";

fn found(mode: usize, frequency_hz: f64) -> Rescaling {
    Rescaling {
        modes: vec![RescaledMode {
            mode,
            frequency_hz,
            factor: 0.8,
            factor_std: 0.01,
            speeds_rpm: vec![9000.0],
        }],
        cuts: Vec::new(),
    }
}

#[test]
fn the_written_case_is_the_rescaled_one_with_its_comments() {
    let before = Case::parse(Path::new("case.toml"), CASE).unwrap();
    let text = text_of(CASE, &found(1, 900.0)).unwrap();
    for words in ["# My mill.", "# taps", "# bending"] {
        assert!(text.contains(words), "{words}: {text}");
    }
    let after = Case::parse(Path::new("case.toml"), &text).unwrap();
    assert_eq!(after.structure_rpm, Some(9000.0));
    let modes = |case: &Case| match &case.structure.as_ref().unwrap().form {
        crate::structure::Form::Modes(modes) => modes.clone(),
        _ => Vec::new(),
    };
    let (then, now) = (modes(&before), modes(&after));
    assert_eq!(now, [then[0].with_frequency_scaled(0.8), then[1].clone()]);
    let assumed = after.assumptions();
    assert!(
        assumed[0].contains("mode 1, 900.000 Hz before, is multiplied by 0.8000"),
        "{assumed:?}"
    );
    assert!(
        !assumed.iter().any(|sentence| sentence.contains("standstill")),
        "{assumed:?}"
    );
    // σ of the frequency is that of the factor, 0.01, times 900 Hz.
    assert!(text.contains("frequency_hz_std = 9.0"), "{text}");
    // A number without a point is a number too.
    let text = text_of(CASE, &found(2, 1500.0)).unwrap();
    assert!(text.contains("frequency_hz = 1200.0"), "{text}");
}

#[test]
fn a_covariance_holds_the_error_of_the_factor_alone() {
    let case = format!(
        "{CASE}[uncertainty]\nparameters = [\"structure.mode.1.frequency_hz\", \"structure.mode.1.left.1.imaginary\", \"structure.mode.2.frequency_hz\"]\n\
         covariance = [[4.0, 0.001, 0.5], [0.001, 1e-6, 0.0002], [0.5, 0.0002, 9.0]]\n"
    );
    let text = text_of(&case, &found(1, 900.0)).unwrap();
    assert!(!text.contains("frequency_hz_std"), "{text}");
    let table: toml::Table = text.parse().unwrap();
    let rows = table["uncertainty"]["covariance"].as_array().unwrap();
    let rows: Vec<Vec<f64>> = rows
        .iter()
        .map(|row| {
            row.as_array()
                .unwrap()
                .iter()
                .filter_map(toml::Value::as_float)
                .collect()
        })
        .collect();
    let expected = [
        [81.0, 0.0, 0.0],
        [0.0, 1e-6 / 0.64, 0.0002 / 0.8],
        [0.0, 0.0002 / 0.8, 9.0],
    ];
    for (row, expected) in rows.iter().zip(expected) {
        for (entry, expected) in row.iter().zip(expected) {
            assert!((entry - expected).abs() <= 1e-12 * expected, "{rows:?}");
        }
    }
    Case::parse(Path::new("case.toml"), &text).unwrap();
}
