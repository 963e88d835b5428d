//! Tests of reading and writing FRF tables in UFF.

use quietcut_model::structure::Direction;
use quietcut_recording::uff::UffForm;

use super::*;

fn table(step: f64, uneven: f64) -> FrfTable {
    let frequency_hz: Vec<f64> = (1..50)
        .map(|k| step * f64::from(k) + uneven * f64::from(k * k))
        .collect();
    let entry = |response, force, scale: f64| Frf {
        response,
        force,
        receptance: frequency_hz
            .iter()
            .map(|f| Complex64::new(scale * 1e-6 / (1.0 + f), -1e-7 * f))
            .collect(),
        coherence: (scale > 1.0).then(|| frequency_hz.iter().map(|f| 1.0 / (1.0 + f)).collect()),
        folding: (scale > 1.0).then(|| frequency_hz.iter().map(|f| 1e-3 * f).collect()),
    };
    let entries = vec![
        entry(Direction::X, Direction::X, 2.0),
        entry(Direction::Y, Direction::X, 1.0),
    ];
    FrfTable::new(Path::new("a.uff"), frequency_hz.clone(), entries).unwrap()
}

#[test]
fn what_is_written_is_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.uff");
    for (step, uneven) in [(0.25, 0.0), (0.1, 0.003), (1.0 / 3.0, 0.0)] {
        for form in [UffForm::Text, UffForm::Binary] {
            let written = table(step, uneven);
            written.write_uff(&path, form).unwrap();
            let read = FrfTable::read(&path).unwrap();
            for (a, b) in read.frequency_hz().iter().zip(written.frequency_hz()) {
                // Tolerance: 0.001 steps, the rounding of the frequencies.
                assert!((a - b).abs() <= 1e-3 * step, "{a} {b}");
            }
            for (a, b) in read.entries().iter().zip(written.entries()) {
                assert_eq!(a.name(), b.name());
                assert_eq!(a.coherence.is_some(), b.coherence.is_some());
                assert_eq!(a.folding.is_some(), b.folding.is_some());
                for (a, b) in a.folding.iter().flatten().zip(b.folding.iter().flatten()) {
                    assert!((a - b).abs() <= 1e-12 * b.abs());
                }
                for (a, b) in a.receptance.iter().zip(&b.receptance) {
                    assert!((a - b).norm() <= 1e-12 * b.norm());
                }
            }
        }
    }
}

fn function(ordinate: &str, denominator: &str) -> String {
    format!(
        "    -1\n    58\nNONE\nNONE\nNONE\nNONE\nNONE\n    4         0    0         0 NONE               1   2 NONE               1  -2\n\
         \x20        6         3         1  0.00000E+00  1.00000E+00  0.00000E+00\n\
         \x20       18    0    0    0 NONE                 Hz\n{ordinate}\n{denominator}\n         0\n\
         \x20 1.0 2.0 1.0 2.0\n 1.0 2.0\n    -1\n"
    )
}

#[test]
fn the_line_at_0_hz_is_left_out_whichever_function_has_none_there() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.uff");
    let force = "        13    0    1    0 NONE                 N";
    let receptance = function("         8    1    0    0 NONE                 m", force);
    let accelerance = function("        12    1    0    0 NONE                 m/s^2", force)
        .replace("1   2 NONE ", "1   1 NONE ");
    let alone = receptance.clone();
    for (text, lines) in [
        (alone, 3),
        (format!("{receptance}{accelerance}"), 2),
        (format!("{accelerance}{receptance}"), 2),
    ] {
        std::fs::write(&path, text).unwrap();
        let table = FrfTable::read(&path).unwrap();
        assert_eq!(table.frequency_hz().len(), lines);
        let yy = table.entries().iter().find(|entry| entry.name() == "yy").unwrap();
        assert_eq!(*yy.receptance.last().unwrap(), -Complex64::new(1.0, 2.0));
    }
}

#[test]
fn receptance_mobility_and_accelerance_are_distinguished() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.uff");
    let force = "        13    0    1    0 NONE                 N";
    let read = |ordinate: &str, denominator: &str| {
        std::fs::write(&path, function(ordinate, denominator)).unwrap();
        FrfTable::read(&path)
    };
    let value = Complex64::new(1.0, 2.0);
    let omega = Complex64::new(0.0, TAU);
    // The reference direction is negative, so the sign is reversed.
    for (ordinate, denominator, expected, lines) in [
        (
            "         8    1    0    0 NONE                 m",
            force,
            -value,
            3,
        ),
        (
            "         8    1    0    0 NONE                 mm",
            force,
            -value * 1e-3,
            3,
        ),
        (
            "        11    1    0    0 NONE                 m/s",
            force,
            -value / omega,
            2,
        ),
        (
            "        12    1    0    0 NONE                 g",
            force,
            -value * 9.806_65 / (omega * omega),
            2,
        ),
        (
            "        12    1    0    0 NONE                 NONE",
            "        13",
            -value / (omega * omega),
            2,
        ),
        (
            "         1    0    0    0 NONE                 (m/s^2)/N",
            "         0",
            -value / (omega * omega),
            2,
        ),
    ] {
        let table = read(ordinate, denominator).unwrap();
        let at = table.frequency_hz().iter().position(|&f| f == 1.0).unwrap();
        assert_eq!(table.frequency_hz().len(), lines, "{ordinate}");
        assert_eq!(table.entries()[0].name(), "yy");
        assert!(
            (table.entries()[0].receptance[at] - expected).norm() < 1e-15,
            "{ordinate}"
        );
    }
    for (ordinate, denominator, words) in [
        (
            "         1    0    0    0 NONE                 NONE",
            force,
            "response of FRF 1 is not said",
        ),
        (
            "        12    1    0    0 NONE                 m/s^2",
            "         0",
            "reference of FRF 1 is not said",
        ),
        (
            "        13    1    0    0 NONE                 N",
            force,
            "an FRF of force",
        ),
        (
            "        12    1    0    0 NONE                 m/s^2",
            "         8    1    0    0 NONE                 m",
            "per displacement",
        ),
        (
            "        12    1    0    0 NONE                 m/s",
            force,
            "velocity",
        ),
    ] {
        let said = read(ordinate, denominator).unwrap_err().to_string();
        assert!(
            said.contains(words) && said.contains("line 2"),
            "{ordinate}: {said}"
        );
    }
}
