use proptest::prelude::*;

use super::*;

fn text(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
}

/// An object of 64-bit numbers with an interval of 1 ms and a unit.
fn channel(path: &str, count: u64, unit: &str) -> Vec<u8> {
    [
        text(path),
        20u32.to_le_bytes().to_vec(),
        10u32.to_le_bytes().to_vec(),
        1u32.to_le_bytes().to_vec(),
        count.to_le_bytes().to_vec(),
        2u32.to_le_bytes().to_vec(),
        text("wf_increment"),
        10u32.to_le_bytes().to_vec(),
        1e-3f64.to_le_bytes().to_vec(),
        text("unit_string"),
        0x20u32.to_le_bytes().to_vec(),
        text(unit),
    ]
    .concat()
}

fn file(contents: u32, objects: &[Vec<u8>], samples: &[f64]) -> Vec<u8> {
    let metadata = [(objects.len() as u32).to_le_bytes().to_vec(), objects.concat()].concat();
    let raw: Vec<u8> = samples.iter().flat_map(|sample| sample.to_le_bytes()).collect();
    [
        b"TDSm".to_vec(),
        contents.to_le_bytes().to_vec(),
        4713u32.to_le_bytes().to_vec(),
        ((metadata.len() + raw.len()) as u64).to_le_bytes().to_vec(),
        (metadata.len() as u64).to_le_bytes().to_vec(),
        metadata,
        raw,
    ]
    .concat()
}

fn read_bytes(bytes: &[u8]) -> Result<Vec<Raw>, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.tdms");
    std::fs::write(&path, bytes).unwrap();
    read(&path).map_err(|error| error.to_string())
}

fn two() -> [Vec<u8>; 2] {
    [
        channel("/'taps'/'Force'", 2, "N"),
        channel("/'taps'/'Acc''s'", 2, "g"),
    ]
}

#[test]
fn chunks_plain_and_interleaved_are_read() {
    let plain = read_bytes(&file(0b1110, &two(), &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0])).unwrap();
    let [record] = plain.as_slice() else {
        panic!("{plain:?}");
    };
    assert_eq!(record.sample_rate_hz, Some(1000.0));
    assert_eq!(record.columns[0].samples, [1.0, 2.0, 5.0, 6.0]);
    assert_eq!(
        (record.columns[1].name.as_str(), &record.columns[1].unit),
        ("Acc's", &FoundUnit::Text("g".into()))
    );
    let interleaved = read_bytes(&file(0b10_1110, &two(), &[1.0, 2.0, 3.0, 4.0])).unwrap();
    assert_eq!(interleaved[0].columns[0].samples, [1.0, 3.0]);
}

#[test]
fn damaged_files_are_refused_with_the_reason() {
    let whole = file(0b1110, &two(), &[1.0, 2.0, 3.0, 4.0]);
    assert!(read_bytes(b"hello").unwrap_err().contains("5 bytes"));
    assert!(read_bytes(&[0; 40]).unwrap_err().contains("TDSm"));
    let huge = file(0b1110, &[channel("/'a'/'b'", 1 << 60, "N")], &[1.0]);
    assert!(
        read_bytes(&huge)
            .unwrap_err()
            .contains("more than the file can hold")
    );
    assert!(read_bytes(&whole[..60]).unwrap_err().contains("cut off"));
    let daqmx = file(0b1000_1110, &two(), &[1.0, 2.0, 3.0, 4.0]);
    assert!(read_bytes(&daqmx).unwrap_err().contains("DAQmx"));
}

proptest! {
    /// Arbitrary damage gives a value or an error, never a panic.
    #[test]
    fn damaged_files_never_panic(flips in prop::collection::vec((0usize..300, any::<u8>()), 1..8), cut in 0usize..60) {
        let mut bytes = file(0b1110, &two(), &[1.0, 2.0, 3.0, 4.0]);
        for (at, value) in flips {
            let length = bytes.len();
            bytes[at % length] = value;
        }
        bytes.truncate(bytes.len().saturating_sub(cut));
        let _ = super::segments::objects(&bytes);
    }
}
