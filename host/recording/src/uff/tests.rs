//! Tests of the reader with unusual, damaged and truncated files.

use std::path::PathBuf;

use num_complex::Complex;
use proptest::prelude::*;

use super::*;
use crate::{Channel, Sidecar, TestKind};

/// A valid data set 58 of three samples: lines 1 to 15, data in line 14.
const TEXT: &str = "    -1
    58
az
NONE
NONE
NONE
NONE
    1         0    0         0 NONE               1   3 NONE               0   0
         4         3         1  1.00000E+00  1.00000E-03  0.00000E+00
        17    0    0    0 NONE                 s                   
        12    1    0    0 NONE                 m/s^2               
         0    0    0    0 NONE                 NONE                
         0    0    0    0 NONE                 NONE                
  1.000000000000E+00 -2.500000000000E+00  3.000000000000E+00
    -1
";

const SAMPLES: [f64; 3] = [1.0, -2.5, 3.0];

/// The data set [`TEXT`] in binary form, with the given header fields and data.
fn binary(order: u8, format: u8, lines: u8, bytes: usize, data: &[u8]) -> Vec<u8> {
    let first = format!("    58b{order:6}{format:6}{lines:12}{bytes:12}     0     0           0           0");
    let head = TEXT.replacen("    58", &first, 1);
    let at = head.find("  1.000000000000E+00 ").unwrap();
    let mut file = head.as_bytes()[..at].to_vec();
    file.extend(data);
    file
}

fn little() -> Vec<u8> {
    SAMPLES.iter().flat_map(|sample| sample.to_le_bytes()).collect()
}

fn big() -> Vec<u8> {
    SAMPLES.iter().flat_map(|sample| sample.to_be_bytes()).collect()
}

fn joined(parts: &[&[u8]]) -> Vec<u8> {
    parts.concat()
}

/// Expected result of reading a file.
enum Outcome {
    /// Success with these samples in each of the named channels.
    Read(Vec<f64>, &'static [&'static str]),
    /// Error in this line (0: without line) whose message contains these words.
    Refused(u64, &'static str),
}

use Outcome::{Read, Refused};

fn fine() -> Outcome {
    Read(SAMPLES.to_vec(), &["az"])
}

/// [`TEXT`] with one replacement.
fn changed(from: &str, to: &str) -> Vec<u8> {
    changed_all(&[(from, to)])
}

/// [`TEXT`] with several replacements.
fn changed_all(changes: &[(&str, &str)]) -> Vec<u8> {
    let mut text = String::from(TEXT);
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    text.into_bytes()
}

/// Data line of [`TEXT`].
const DATA: &str = "  1.000000000000E+00 -2.500000000000E+00  3.000000000000E+00";
/// Start of record 7 of [`TEXT`]: number type, count, spacing, first abscissa and step.
const FORM: &str = "         4         3         1  1.00000E+00  1.00000E-03";

/// Unusual files that must be read.
fn odd_but_clear() -> Vec<(&'static str, Vec<u8>, Outcome)> {
    let four = |data: &str| changed_all(&[("         4         3", "         2         4"), (DATA, data)]);
    vec![
        ("as it should be", TEXT.into(), fine()),
        ("carriage returns", TEXT.replace('\n', "\r\n").into_bytes(), fine()),
        ("empty lines before the last mark", changed("E+00\n    -1\n", "E+00\n\n\r\n  \n    -1\n"), fine()),
        ("empty lines after the first mark", changed("    -1\n    58", "\n\n    -1\n\n    58"), fine()),
        ("no last mark", changed("E+00\n    -1\n", "E+00\n"), fine()),
        ("no last line end", changed("E+00\n    -1\n", "E+00\n    -1"), fine()),
        ("a mark too many", changed("    -1\n    58", "    -1\n    -1\n    58"), fine()),
        ("marks at the left edge", TEXT.replace("    -1", "-1").into_bytes(), fine()),
        ("words before the first mark", joined(&[b"made by a program\n", TEXT.as_bytes()]), fine()),
        ("D exponents", TEXT.replace("E+00", "D+00").into_bytes(), fine()),
        ("small exponents", TEXT.replace("E+00", "e0").into_bytes(), fine()),
        ("one value per line", changed(
            DATA, "1\n\n-2.5\n3\n"), fine()),
        ("commas", changed("E+00 -2.5", "E+00, -2.5"), fine()),
        ("fields that touch", changed("E+00 -2.5", "E+00-2.5"), fine()),
        ("header without trailing blanks", changed("NONE                \n  1.0", "NONE\n  1.0"), fine()),
        ("short axes", changed("         0    0    0    0 NONE                 NONE                \n         0    0    0    0 NONE                 NONE                \n", "         0\n\n"), fine()),
        ("no z value", changed("  1.00000E-03  0.00000E+00", "  1.00000E-03"), fine()),
        ("record 7 in words", changed("         4         3         1  1.00000E+00  1.00000E-03  0.00000E+00", "4 3 1 1.0 0.001 0"), fine()),
        ("record 6 in words", changed("    1         0    0         0 NONE               1   3 NONE               0   0", "1 0 0 0 NONE 1 3 NONE 0 0"), fine()),
        ("letters that are no UTF-8", joined(&[TEXT.split("az").next().unwrap().as_bytes(), b"Ger\xe4t", TEXT.split("az").nth(1).unwrap().as_bytes()]), fine()),
        ("units in capitals", changed("m/s^2", "M/SEC2"), Read(SAMPLES.to_vec(), &["az"])),
        ("a unit of its own", changed("m/s^2", "g    "), Read(SAMPLES.map(|sample| sample * 9.806_65).to_vec(), &["az"])),
        ("units of the file", joined(&[
            b"    -1\n   164\n         5mm-milli-newton      2\n  1.0D+03  1.0D+03  1.0D+00\n  2.7D+02\n    -1\n",
            &changed("m/s^2", "NONE ")]), Read(SAMPLES.map(|sample| sample * 1e-3).to_vec(), &["az"])),
        ("units at the end", joined(&[
            &changed("m/s^2", "NONE "),
            b"    -1\n   164\n         5mm-milli-newton      2\n  1.0D+03  1.0D+03  1.0D+00\n  2.7D+02\n    -1\n",
            ]), Read(SAMPLES.map(|sample| sample * 1e-3).to_vec(), &["az"])),
        ("other data sets around", joined(&[
            b"    -1\n   151\nmodel\nNONE\n    -1\n", TEXT.as_bytes(), b"    -1\n  2411\n 1 1 1 1\n 0.0 0.0 0.0\n    -1\n"]), fine()),
        ("against the axis", changed("   3 NONE", "  -3 NONE"), Read(SAMPLES.map(|sample| -sample).to_vec(), &["az"])),
        ("two of a name", joined(&[TEXT.as_bytes(), TEXT.replace("   1   3", "   2   3").as_bytes()]),
            Read(SAMPLES.to_vec(), &["az_1", "az_2"])),
        ("two of a node", joined(&[TEXT.as_bytes(), TEXT.as_bytes()]), Read(SAMPLES.to_vec(), &["az_1_1", "az_1_2"])),
        ("-1 among the data", four("1\n-1\n-1\n5"), Read(vec![1.0, -1.0, -1.0, 5.0], &["az"])),
        ("-1 at the end of the data", four("1\n2\n3\n-1"), Read(vec![1.0, 2.0, 3.0, -1.0], &["az"])),
        ("-1 at the start of the data", four("-1\n2\n3\n4"), Read(vec![-1.0, 2.0, 3.0, 4.0], &["az"])),
        (
            "uneven times",
            changed_all(&[(FORM, "         4         3         0  0.00000E+00  0.00000E+00"), (DATA, "0.0 1.0 0.001 -2.5\n0.002 3.0")]),
            fine(),
        ),
        ("binary", binary(1, 2, 11, 24, &joined(&[&little(), b"\n    -1\n"])), fine()),
        ("binary, the other byte order", binary(2, 2, 11, 24, &joined(&[&big(), b"\n    -1\n"])), fine()),
        ("binary, the mark right behind", binary(1, 2, 11, 24, &joined(&[&little(), b"    -1\r\n"])), fine()),
        ("binary, empty lines behind", binary(1, 2, 11, 24, &joined(&[&little(), b"\r\n\r\n\n    -1\n"])), fine()),
        ("binary, number of bytes unknown", binary(1, 2, 0, 0, &joined(&[&little(), b"    -1\n"])), fine()),
        ("binary, padded", binary(1, 2, 11, 32, &joined(&[&little(), &[0; 8], b"\n    -1\n"])), fine()),
        ("binary, no last mark", binary(1, 2, 11, 24, &little()), fine()),
        ("binary, more lines", {
            let file = binary(1, 2, 12, 24, &[]);
            joined(&[&file, b"a line of its own\n", &little(), b"\n    -1\n"])
        }, fine()),
    ]
}

/// Damaged files with the line and the message of the expected error.
fn damaged() -> Vec<(&'static str, Vec<u8>, Outcome)> {
    let cut = |line: usize| {
        let lines: Vec<&str> = TEXT.lines().take(line).collect();
        (lines.join("\n") + "\n").into_bytes()
    };
    vec![
        ("empty", Vec::new(), Refused(1, "58")),
        ("no mark", b"hello\nworld\n".to_vec(), Refused(2, "-1")),
        ("bytes", vec![0xff; 300], Refused(1, "-1")),
        (
            "only other data sets",
            b"    -1\n   151\nx\n    -1\n".to_vec(),
            Refused(4, "[151]"),
        ),
        (
            "no number of a data set",
            changed("    58", "    az"),
            Refused(2, "\"az\""),
        ),
        ("ends in the words", cut(5), Refused(5, "ends within")),
        ("ends in the axes", cut(11), Refused(11, "ends within")),
        (
            "a mark in the axes",
            changed("        12    1", "    -1\n        12    1"),
            Refused(11, "-1 in line 9"),
        ),
        ("no data", changed(DATA, ""), Refused(15, "0 of 3")),
        (
            "too few data",
            changed("  3.000000000000E+00\n    -1\n", "\n\n"),
            Refused(15, "2 of 3"),
        ),
        (
            "too few data, then another data set",
            joined(&[
                &changed(" -2.500000000000E+00  3.000000000000E+00", ""),
                TEXT.as_bytes(),
            ]),
            Refused(15, "1 of 3"),
        ),
        (
            "too many data",
            changed("  3.000000000000E+00\n", "  3.0 4.0\n"),
            Refused(14, "more numbers than the 3"),
        ),
        (
            "a line too many",
            changed("3.000000000000E+00\n", "3.0\n4.0\n"),
            Refused(15, "after all 3"),
        ),
        (
            "letters among the data",
            changed("-2.500000000000E+00", "two and a half"),
            Refused(14, "\"two\""),
        ),
        (
            "half a number",
            changed("-2.500000000000E+00", "-2.500000000000E+"),
            Refused(14, "number is needed"),
        ),
        (
            "not a number",
            changed("-2.500000000000E+00", "NaN"),
            Refused(2, "sample 2 is NaN"),
        ),
        (
            "infinite",
            changed("-2.500000000000E+00", "1.0E+999"),
            Refused(2, "sample 2 is inf"),
        ),
        (
            "function type",
            changed("    1         0    0", "    a         0    0"),
            Refused(8, "function type"),
        ),
        (
            "an FRF",
            changed("    1         0    0", "    4         0    0"),
            Refused(0, "[4]"),
        ),
        (
            "direction",
            changed("   3 NONE", "  33 NONE"),
            Refused(8, "direction 33"),
        ),
        (
            "ordinate type",
            changed("         4         3", "         3         3"),
            Refused(9, "ordinate data type \"3\""),
        ),
        (
            "number of values",
            changed("         4         3", "         4       3.5"),
            Refused(9, "\"3.5\""),
        ),
        (
            "negative number of values",
            changed("         4         3", "         4        -3"),
            Refused(9, "\"-3\""),
        ),
        (
            "absurd number of values",
            changed("         4         3", "         49999999999"),
            Refused(15, "3 of 9999999999"),
        ),
        (
            "spacing",
            changed("         3         1", "         3         2"),
            Refused(9, "spacing \"2\""),
        ),
        (
            "no step",
            changed("1.00000E-03", "0.00000E+00"),
            Refused(9, "greater than 0"),
        ),
        (
            "step of letters",
            changed("1.00000E-03", "        abc"),
            Refused(9, "\"abc\""),
        ),
        (
            "specific data type",
            changed("        12    1", "        xx    1"),
            Refused(11, "\"xx\""),
        ),
        ("unit", changed("m/s^2", "knots"), Refused(2, "knots")),
        (
            "unit of another quantity",
            changed("m/s^2", "N    "),
            Refused(2, "acceleration"),
        ),
        (
            "complex samples",
            changed_all(&[
                ("         4         3", "         6         3"),
                (DATA, "1 2 3 4 5 6"),
            ]),
            Refused(2, "complex"),
        ),
        (
            "channels of other lengths",
            joined(&[
                TEXT.as_bytes(),
                &changed_all(&[("         4         3", "         4         2"), (DATA, "1 2")]),
            ]),
            Refused(17, "sampled together"),
        ),
        (
            "units of zero",
            joined(&[
                b"    -1\n   164\n         1SI\n  0.0D+00  1.0D+00  1.0D+00\n    -1\n",
                TEXT.as_bytes(),
            ]),
            Refused(4, "greater than 0"),
        ),
        (
            "units without a code",
            joined(&[b"    -1\n   164\n    -1\n", TEXT.as_bytes()]),
            Refused(3, "units code"),
        ),
        (
            "binary of DEC",
            binary(1, 1, 11, 24, &little()),
            Refused(2, "IEEE 754"),
        ),
        (
            "binary order",
            binary(3, 2, 11, 24, &little()),
            Refused(2, "byte order \"3\""),
        ),
        (
            "binary, too few lines",
            binary(1, 2, 9, 24, &little()),
            Refused(2, "9 lines"),
        ),
        (
            "binary, nothing said",
            TEXT.replacen("    58", "    58b", 1).into_bytes(),
            Refused(2, "byte order"),
        ),
        (
            "binary, cut off",
            binary(1, 2, 11, 24, &little()[..19]),
            Refused(13, "2 of 3"),
        ),
        (
            "binary, bytes too few",
            binary(
                1,
                2,
                11,
                12,
                &joined(&[&little()[..12], b"\n    -1\nabcdefghijklmnop\n"]),
            ),
            Refused(13, "need 24"),
        ),
        (
            "binary, no mark behind",
            binary(1, 2, 11, 24, &joined(&[&little(), b"xyz\n"])),
            Refused(14, "\"xyz\""),
        ),
    ]
}

fn check(name: &str, bytes: &[u8], outcome: &Outcome) {
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join("a.uff");
    std::fs::write(&path, bytes).unwrap();
    match (Recording::read(&path), outcome) {
        (Ok(recording), Read(samples, names)) => {
            let found: Vec<&str> = recording
                .channels
                .iter()
                .map(|channel| channel.name.as_str())
                .collect();
            assert_eq!(found, *names, "{name}");
            for channel in &recording.channels {
                for (sample, expected) in channel.samples.iter().zip(samples) {
                    // Unit conversion causes one rounding.
                    assert!(
                        (sample - expected).abs() <= 1e-15 * expected.abs(),
                        "{name}: {sample}"
                    );
                }
                assert_eq!(channel.samples.len(), samples.len(), "{name}");
            }
            assert!((recording.sample_rate_hz - 1000.0).abs() < 1e-6, "{name}");
        }
        (Err(error), Refused(line, words)) => {
            let said = error.to_string();
            let place = if *line == 0 {
                "a.uff: ".into()
            } else {
                format!("a.uff, line {line}: ")
            };
            assert!(said.contains(&place) && said.contains(words), "{name}: {said}");
        }
        (Ok(recording), Refused(line, _)) => panic!("{name}: {recording:?}, line {line} is wrong"),
        (Err(error), Read(..)) => panic!("{name}: {error}"),
    }
}

#[test]
fn unusual_files_are_read() {
    for (name, bytes, outcome) in &odd_but_clear() {
        check(name, bytes, outcome);
    }
}

#[test]
fn damaged_files_are_refused_with_file_and_line() {
    let corpus = damaged();
    assert!(corpus.len() >= 30);
    for (name, bytes, outcome) in &corpus {
        check(name, bytes, outcome);
    }
}

#[test]
fn nodes_of_channels_are_those_of_the_headers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.uff");
    let second = TEXT.replacen("NONE               1   3", "NONE              12  -1", 1);
    std::fs::write(&path, [TEXT, &second].concat()).unwrap();
    assert_eq!(
        nodes(&path).unwrap(),
        [("az".to_owned(), 1), ("ax".to_owned(), 12)]
    );
}

#[test]
fn single_precision_and_complex_uneven_values_are_sorted() {
    let head = "    1         0    0         0 NONE               1   3 NONE               0   0";
    let text = TEXT.replace(
        head,
        "    4         0    0         0 NONE               1   3 NONE               1   3",
    );
    let at = text.find("  1.000000000000E+00 ").unwrap();
    let set = |record7: &str, data: &[u8], first: &str| {
        let head = text[..at].replacen("    58", first, 1);
        let line = text.lines().nth(8).unwrap();
        let file = joined(&[head.replace(line, record7).as_bytes(), data]);
        parse(file.as_slice()).unwrap().remove(0)
    };
    let complex = Ordinate::Complex(vec![Complex::new(0.5, -1.5), Complex::new(2.0, 4.0)]);
    let text_set = set(
        "         5         2         0  0.0          0.0          0.0",
        b"  1.00000E+00  5.00000E-01 -1.50000E+00  3.00000E+00  2.00000E+00  4.00000E+00\n    -1\n",
        "    58",
    );
    assert_eq!(
        (text_set.uneven, &text_set.ordinate),
        (Some(vec![1.0, 3.0]), &complex)
    );
    let singles: Vec<u8> = [1.0_f32, 0.5, -1.5, 3.0, 2.0, 4.0]
        .iter()
        .flat_map(|v| v.to_be_bytes())
        .collect();
    let single = set("5 2 0 0 0 0", &singles, "    58b 2 2 11 24 0 0 0 0");
    assert_eq!(
        (single.uneven, &single.ordinate),
        (Some(vec![1.0, 3.0]), &complex)
    );
    // The abscissa of double-precision ordinates: single precision (standard) or double precision (some writers).
    let values = [0.5_f64, -1.5, 2.0, 4.0];
    let mixed: Vec<u8> = [(1.0_f32, 0), (3.0, 2)]
        .iter()
        .flat_map(|&(x, k)| {
            [
                x.to_le_bytes().to_vec(),
                values[k].to_le_bytes().to_vec(),
                values[k + 1].to_le_bytes().to_vec(),
            ]
        })
        .flatten()
        .collect();
    let standard = set("6 2 0 0 0 0", &mixed, "    58b 1 2 11 40 0 0 0 0");
    assert_eq!(
        (standard.uneven, &standard.ordinate),
        (Some(vec![1.0, 3.0]), &complex)
    );
    let doubles: Vec<u8> = [1.0, 0.5, -1.5, 3.0, 2.0, 4.0_f64]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let double = set("6 2 0 0 0 0", &doubles, "    58b 1 2 11 48 0 0 0 0");
    assert_eq!(
        (double.uneven, &double.ordinate),
        (Some(vec![1.0, 3.0]), &complex)
    );
}

/// Two files of one measurement, as text with six digits and as binary, must agree.
#[test]
#[ignore = "measured records: QUIETCUT_DATA names their folder"]
fn both_measured_samples_read_to_the_same_signal() {
    let folder = PathBuf::from(std::env::var_os("QUIETCUT_DATA").unwrap());
    let read = |name: &str| Recording::read(folder.join("uff").join(name)).unwrap();
    let (text, binary) = (read("Sample_UFF58_ascii.uff"), read("Sample_UFF58b_bin.uff"));
    assert_eq!((text.len(), text.sample_rate_hz), (79_292, 65_536.0));
    assert_eq!(text.sample_rate_hz, binary.sample_rate_hz);
    let (text, binary) = (&text.channels[0], &binary.channels[0]);
    assert_eq!(
        (text.name.as_str(), text.quantity),
        ("mic 01", Quantity::Pressure)
    );
    assert_eq!((&text.name, text.quantity), (&binary.name, binary.quantity));
    for (a, b) in text.samples.iter().zip(&binary.samples) {
        // Half a unit of the sixth digit, plus the rounding to single precision.
        assert!((a - b).abs() <= 5.1e-6 * b.abs(), "{a} {b}");
    }
    let other = Recording::read(folder.join("uff/heat_engine_housing.uff")).unwrap_err();
    assert!(other.to_string().contains("[151, 2411, 2412, 2414]"), "{other}");
}

fn recording(samples: Vec<f64>) -> Recording {
    let channel = |name: &str, quantity| Channel {
        name: name.into(),
        quantity,
        samples: samples.clone(),
    };
    Recording {
        path: "a.uff".into(),
        sample_rate_hz: 10_240.0,
        start_s: 0.5,
        since_s: 0.0,
        channels: vec![
            channel("fx", Quantity::Force),
            channel("az", Quantity::Acceleration),
            channel("tacho", Quantity::Level),
            channel("a_name_of_many_letters", Quantity::Unknown),
        ],
        sidecar: Sidecar {
            kind: Some(TestKind::Sweep),
            ..Sidecar::default()
        },
    }
}

proptest! {
    #[test]
    fn a_written_recording_reads_back_unchanged(samples in prop::collection::vec(-1e6..1e6f64, 2..50)) {
        let folder = tempfile::tempdir().unwrap();
        for form in [UffForm::Text, UffForm::Binary] {
            let path = folder.path().join("a.uff");
            let written = recording(samples.clone());
            written.write_uff(&path, form).unwrap();
            let read = Recording::read(&path).unwrap();
            prop_assert_eq!(read.sample_rate_hz, 10_240.0);
            prop_assert_eq!(read.start_s, 0.5);
            for (a, b) in read.channels.iter().zip(&written.channels) {
                prop_assert_eq!(&a.name, &b.name);
                prop_assert!(a.quantity == b.quantity || b.quantity == Quantity::Level);
                for (a, b) in a.samples.iter().zip(&b.samples) {
                    // Text keeps thirteen digits, binary all.
                    let tolerance = if form == UffForm::Text { 1e-12 * b.abs() } else { 0.0 };
                    prop_assert!((a - b).abs() <= tolerance);
                }
            }
        }
    }

    /// Arbitrary damage gives a value or an error, never a panic.
    #[test]
    fn damaged_files_never_panic(
        flips in prop::collection::vec((0usize..2000, any::<u8>()), 1..8),
        cut in 0usize..2000,
        which in any::<prop::sample::Index>(),
    ) {
        let corpus = odd_but_clear();
        let mut bytes = corpus[which.index(corpus.len())].1.clone();
        for (at, value) in flips {
            let length = bytes.len();
            bytes[at % length] = value;
        }
        bytes.truncate(bytes.len().max(cut) - cut / 4);
        if let Ok(sets) = parse(bytes.as_slice()) {
            for set in sets {
                let _ = (set.name(), unit(&set.header.ordinate, set.units));
            }
        }
    }
}
