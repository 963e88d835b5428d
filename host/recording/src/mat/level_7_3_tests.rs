//! Files of level 7.3 that `hdf5storage` and `h5py` wrote, whole and damaged. `tests/lab_files.rs` compares their samples
//! with those that were written.

use std::io::Cursor;

use proptest::prelude::*;

use super::items;
use super::records::records;
use super::value::{Item, Value};
use crate::raw::Raw;

/// Vectors, chunks that are compressed and shuffled, a compressed file with checksums, a structure, a structure array.
const FILES: [&[u8]; 5] = [
    include_bytes!("../../../../tests/data/lab_files/hdf5_flat.mat"),
    include_bytes!("../../../../tests/data/lab_files/hdf5_chunks.mat"),
    include_bytes!("../../../../tests/data/lab_files/hdf5_flat_fs.mat"),
    include_bytes!("../../../../tests/data/lab_files/hdf5_struct_units.mat"),
    include_bytes!("../../../../tests/data/lab_files/hdf5_struct_array.mat"),
];

fn read(bytes: &[u8]) -> Result<Vec<Item>, String> {
    items(&mut Cursor::new(bytes), bytes.len() as u64)
}

fn found(bytes: &[u8]) -> Result<Vec<Raw>, String> {
    read(bytes).and_then(records)
}

/// Place of `pattern` in `bytes`; a test needs it once.
fn place(bytes: &[u8], pattern: &[u8]) -> usize {
    let mut places = (0..bytes.len()).filter(|&at| bytes[at..].starts_with(pattern));
    let first = places.next().unwrap();
    assert_eq!(places.next(), None, "more than one place");
    first
}

#[test]
fn fields_come_in_the_order_of_their_declaration() {
    let names = |bytes| -> Vec<String> {
        let Value::Elements(elements) = read(bytes).unwrap().remove(0).value else {
            panic!("no structure");
        };
        elements[0].iter().map(|item| item.name.clone()).collect()
    };
    assert_eq!(names(FILES[3]), ["force_x", "acc_x", "Fs", "units"]);
    assert_eq!(names(FILES[4]), ["time", "force_x_N", "acc_x_g"]);
}

#[test]
fn each_element_of_a_structure_array_is_a_record() {
    let labels: Vec<Option<String>> = found(FILES[4])
        .unwrap()
        .into_iter()
        .map(|raw| raw.label)
        .collect();
    let expected = ["impacts(1)", "impacts(2)", "impacts(3)"];
    assert_eq!(labels, expected.map(|label| Some(label.to_owned())));
}

#[test]
fn a_file_cut_off_anywhere_is_refused_or_read_in_part() {
    for bytes in FILES {
        // The end of a file is an object or a dataset: a byte less is a byte that is needed, or free space.
        for length in (0..bytes.len()).step_by(7) {
            if let Ok(records) = found(&bytes[..length]) {
                assert!(
                    length > bytes.len() / 2,
                    "{length} of {} bytes: {records:?}",
                    bytes.len()
                );
            }
        }
    }
}

/// A file that claims gigabytes is refused before memory is taken: a dataset of 2³² values, in one block or in chunks.
#[test]
fn sizes_beyond_the_file_are_refused() {
    // Dimensions of the first vector of 1 × 128 numbers, as they stand in its header.
    let dimensions = [1_u64.to_le_bytes(), 128_u64.to_le_bytes()].concat();
    let mut large = FILES[0].to_vec();
    let at = (0..large.len())
        .find(|&at| large[at..].starts_with(&dimensions))
        .unwrap();
    large[at + 8..at + 16].copy_from_slice(&(1_u64 << 32).to_le_bytes());
    let said = read(&large).map(|_| ()).unwrap_err();
    assert!(said.contains("4294967296 values, more than a file of"), "{said}");
    large[at + 8..at + 16].copy_from_slice(&(1_u64 << 22).to_le_bytes());
    let said = read(&large).map(|_| ()).unwrap_err();
    assert!(
        said.contains("33554432 bytes") && said.contains("beyond its end"),
        "{said}"
    );
    // 3 × 128 numbers in chunks of 2 × 50.
    let mut large = FILES[1].to_vec();
    let at = place(
        &large,
        &[3_u64.to_le_bytes(), 128_u64.to_le_bytes(), 3_u64.to_le_bytes()].concat(),
    );
    large[at + 8..at + 16].copy_from_slice(&(1_u64 << 20).to_le_bytes());
    let said = read(&large).map(|_| ()).unwrap_err();
    assert!(said.contains("only 6 of its 41944 chunks were written"), "{said}");
}

#[test]
fn a_chunk_that_decompresses_to_more_than_its_size_is_refused() {
    // Chunks of 2 × 25 instead of 2 × 50 numbers: each chunk is too long for its place.
    let mut bytes = FILES[1].to_vec();
    let lengths = [2_u32.to_le_bytes(), 50_u32.to_le_bytes(), 8_u32.to_le_bytes()].concat();
    let at = place(&bytes, &lengths);
    bytes[at..at + 4].copy_from_slice(&1_u32.to_le_bytes());
    let said = read(&bytes).map(|_| ()).unwrap_err();
    assert!(said.contains("chunk"), "{said}");
}

#[test]
fn a_wrong_checksum_of_a_chunk_is_refused() {
    // The last stored byte of a chunk is in its checksum of the compressed bytes.
    let good = FILES[2];
    let mut refused = 0;
    for at in (0..good.len()).step_by(8) {
        let mut bytes = good.to_vec();
        bytes[at] ^= 0x10;
        if found(&bytes).is_err_and(|said| said.contains("checksum is wrong")) {
            refused += 1;
        }
    }
    // Both channels are several hundred compressed bytes, and each of them is in the sum.
    assert!(refused > 50, "{refused} of {} damaged bytes", good.len() / 8);
}

#[test]
fn heads_without_an_hdf5_file_are_refused() {
    let head = &FILES[0][..512];
    let said = read(head).map(|_| ()).unwrap_err();
    assert!(said.contains("level 7.3") && said.contains("cut off"), "{said}");
    let mut version = FILES[0].to_vec();
    version[512 + 8] = 9;
    let said = read(&version).map(|_| ()).unwrap_err();
    assert!(
        said.contains("version 9 of HDF5") && said.contains("-v7"),
        "{said}"
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    /// Damage and cuts give values or an error, never a panic, and end.
    #[test]
    fn damaged_files_of_level_7_3_never_panic(
        file in 0..FILES.len(),
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 1usize..9), 1..8),
        cut in prop::option::weighted(0.3, any::<prop::sample::Index>()),
    ) {
        let mut bytes = FILES[file].to_vec();
        for (at, value, length) in flips {
            let at = at.index(bytes.len());
            let end = (at + length).min(bytes.len());
            bytes[at..end].fill(value);
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        let _ = found(&bytes);
    }
}
