use std::io::{Cursor, Write};

use flate2::Compression;
use flate2::write::ZlibEncoder;
use proptest::prelude::*;

use super::level_5::{COMPRESSED, MATRIX};
use super::value::{Value, Variable};
use super::*;
use crate::raw::RawColumn;

/// A data element of type `kind`, padded to a multiple of 8 bytes.
fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = kind.to_le_bytes().to_vec();
    bytes.extend((data.len() as u32).to_le_bytes());
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

fn matrix_element(name: &str, class: u32, rows: i32, columns: i32, kind: u32, data: &[u8]) -> Vec<u8> {
    let mut inner = element(6, &[class.to_le_bytes(), [0; 4]].concat());
    inner.extend(element(5, &[rows.to_le_bytes(), columns.to_le_bytes()].concat()));
    inner.extend(element(1, name.as_bytes()));
    inner.extend(element(kind, data));
    element(MATRIX, &inner)
}

fn compressed(data: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(data).unwrap();
    let data = encoder.finish().unwrap();
    let mut bytes = COMPRESSED.to_le_bytes().to_vec();
    bytes.extend((data.len() as u32).to_le_bytes());
    bytes.extend(data);
    bytes
}

fn file(elements: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = vec![b' '; 124];
    bytes.extend([0, 1, b'I', b'M']);
    bytes.extend(elements.concat());
    bytes
}

fn doubles(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn of(bytes: &[u8]) -> Result<Vec<Variable>, String> {
    let items = items(&mut Cursor::new(bytes), bytes.len() as u64)?;
    Ok(items
        .into_iter()
        .filter_map(|item| match item.value {
            Value::Numbers(variable) => Some(variable),
            _ => None,
        })
        .collect())
}

#[test]
fn vectors_plain_and_compressed_and_stored_small_are_read() {
    let bytes = file(&[
        matrix_element("ax", 6, 3, 1, 9, &doubles(&[1.0, -2.5, 3.0])),
        // A small element: three one-byte values of a double matrix, stored inside the tag.
        compressed(&matrix_element("small", 6, 1, 3, 2, &[7, 8, 9])),
        matrix_element("both", 6, 3, 2, 9, &doubles(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])),
        // Text (class 4) is no channel.
        matrix_element("text", 4, 1, 3, 4, &[b'a', 0, b'b', 0, b'c', 0]),
    ]);
    let read: Vec<(String, Vec<f64>)> = of(&bytes)
        .unwrap()
        .into_iter()
        .flat_map(Variable::into_columns)
        .map(|column| (column.name, column.samples))
        .collect();
    assert_eq!(
        read,
        [
            ("ax".into(), vec![1.0, -2.5, 3.0]),
            ("small".into(), vec![7.0, 8.0, 9.0]),
            ("both1".into(), vec![1.0, 2.0, 3.0]),
            ("both2".into(), vec![4.0, 5.0, 6.0]),
        ]
    );
}

#[test]
fn invalid_mat_files_are_refused_with_the_reason() {
    let whole = file(&[matrix_element("ax", 6, 3, 1, 9, &doubles(&[1.0, 2.0, 3.0]))]);
    let said = |bytes: &[u8]| of(bytes).map(|_| ()).unwrap_err();
    assert!(said(b"hello").contains("5 bytes"));
    assert!(said(&whole[..whole.len() - 9]).contains("cut off"));
    assert!(said(&[b'x'; 200]).contains("IM or MI"));
    let mut newer = whole.clone();
    newer[..10].copy_from_slice(b"MATLAB 7.3");
    assert!(said(&newer).contains("level 7.3, but holds no HDF5"));
    let wrong = file(&[matrix_element("ax", 6, 4, 1, 9, &doubles(&[1.0, 2.0, 3.0]))]);
    assert!(said(&wrong).contains("4 by 1, but has 3 values"));
}

#[test]
fn the_longer_side_of_a_matrix_is_time() {
    let channels = |rows, columns, count: u32| {
        let values: Vec<f64> = (0..count).map(f64::from).collect();
        let bytes = file(&[matrix_element("a", 6, rows, columns, 9, &doubles(&values))]);
        let columns: Vec<RawColumn> = of(&bytes)
            .unwrap()
            .into_iter()
            .flat_map(Variable::into_columns)
            .collect();
        columns
            .into_iter()
            .map(|column| (column.name, column.samples))
            .collect::<Vec<_>>()
    };
    let named = |name: &str, samples: [f64; 4]| (name.to_owned(), samples.to_vec());
    // Values are stored in column-major order.
    assert_eq!(
        channels(3, 4, 12),
        [
            named("a1", [0.0, 3.0, 6.0, 9.0]),
            named("a2", [1.0, 4.0, 7.0, 10.0]),
            named("a3", [2.0, 5.0, 8.0, 11.0]),
        ]
    );
    assert_eq!(
        channels(4, 2, 8),
        [
            named("a1", [0.0, 1.0, 2.0, 3.0]),
            named("a2", [4.0, 5.0, 6.0, 7.0])
        ]
    );
    assert_eq!(channels(1, 4, 4), [named("a", [0.0, 1.0, 2.0, 3.0])]);
    assert_eq!(channels(0, 4, 0), []);
}

#[test]
fn channels_in_rows_match_a_time_vector() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mat");
    let bytes = file(&[
        matrix_element("t", 6, 1, 4, 9, &doubles(&[0.0, 0.1, 0.2, 0.3])),
        matrix_element(
            "a",
            6,
            2,
            4,
            9,
            &doubles(&[1.0, -1.0, 2.0, -2.0, 3.0, -3.0, 4.0, -4.0]),
        ),
    ]);
    std::fs::write(&path, bytes).unwrap();
    let recording = crate::Recording::read(&path).unwrap();
    assert_eq!(recording.len(), 4);
    assert_eq!(recording.channel("a1").unwrap().samples, [1.0, 2.0, 3.0, 4.0]);
    assert_eq!(recording.channel("a2").unwrap().samples, [-1.0, -2.0, -3.0, -4.0]);
}

#[test]
fn nan_and_infinite_samples_are_refused_with_channel_and_time_or_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mat");
    for (value, word) in [
        (f64::NAN, "NaN"),
        (f64::INFINITY, "inf"),
        (f64::NEG_INFINITY, "-inf"),
    ] {
        let bytes = file(&[
            matrix_element("t", 6, 1, 4, 9, &doubles(&[0.0, 0.1, 0.2, 0.3])),
            matrix_element("ch", 6, 1, 4, 9, &doubles(&[1.0, 2.0, value, 4.0])),
        ]);
        std::fs::write(&path, bytes).unwrap();
        let said = crate::Recording::read(&path).unwrap_err().to_string();
        let place = format!("\"ch\": sample 3 at 0.2 s is {word}");
        assert!(said.contains(&place) && said.contains("--until-s"), "{said}");
        let before = crate::Segment {
            from_s: None,
            until_s: Some(0.2),
        };
        let read = crate::Recording::read_segment(&path, before).unwrap();
        assert_eq!(read.channel("ch").unwrap().samples, [1.0, 2.0]);
    }
}

#[test]
fn a_constant_channel_is_read_and_a_decompression_bomb_refused() {
    let zeros = |count: usize| {
        let matrix = matrix_element("a", 6, 1, count as i32, 2, &vec![0; count]);
        of(&file(&[compressed(&matrix)]))
    };
    assert_eq!(zeros(1 << 20).unwrap()[0].samples(), 1 << 20);
    let said = zeros(1 << 24).map(|_| ()).unwrap_err();
    assert!(
        said.contains("16777216 values") && said.contains("200 bytes per byte"),
        "{said}"
    );
}

proptest! {
    /// Arbitrary damage gives a value or an error, never a panic.
    #[test]
    fn damaged_files_never_panic(flips in prop::collection::vec((0usize..400, any::<u8>()), 1..8), cut in 0usize..400) {
        let mut bytes = file(&[
            matrix_element("ax", 6, 3, 1, 9, &doubles(&[1.0, 2.0, 3.0])),
            compressed(&matrix_element("ay", 6, 3, 1, 9, &doubles(&[1.0, 2.0, 3.0]))),
        ]);
        for (at, value) in flips {
            let length = bytes.len();
            bytes[at % length] = value;
        }
        bytes.truncate(bytes.len().saturating_sub(cut % 60));
        let _ = of(&bytes);
    }
}
