//! Damaged and hostile files: every reader answers with a value or a message, without a panic, and takes memory in
//! proportion to the file.
//!
//! One test for all readers: the peak of memory is that of the whole process.
#![allow(clippy::expect_used)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::panic;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use num_complex::Complex;
use quietcut_frf::{Frf, FrfTable};

use quietcut_model::structure::Direction;
use quietcut_recording::{Channel, Quantity, Recording, Sidecar, UffForm};
use quietcut_testkit::slice;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The allocator of the system, which counts the bytes that are taken.
struct Counting;

static TAKEN: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

/// SAFETY: every call goes to the allocator of the system unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let taken = TAKEN.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        PEAK.fetch_max(taken, Ordering::Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        TAKEN.fetch_sub(layout.size(), Ordering::Relaxed);
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// The bytes that `work` takes at most beside those that are taken before.
fn peak_of(work: impl FnOnce()) -> usize {
    let before = TAKEN.load(Ordering::Relaxed);
    PEAK.store(before, Ordering::Relaxed);
    work();
    PEAK.load(Ordering::Relaxed).saturating_sub(before)
}

/// Bytes of memory that a reader may take for any file: its buffers, and room for the first values of a function.
const MEMORY: usize = 8 << 20;

/// Bytes of memory that a reader may take for each byte of the file: a value of one byte becomes one of 8 while the
/// vector that holds it doubles, and the text of a CSV table of receptances is in memory beside the values.
const MEMORY_PER_BYTE: usize = 64;

/// Damaged files of each format, in every run of the tests and in the campaigns.
const DAMAGED: [u64; 2] = [150, 600];

/// A file as it should be, and how it is called.
struct Sample {
    name: &'static str,
    bytes: Vec<u8>,
}

#[test]
fn damaged_files_are_answered_without_a_panic_and_without_much_memory() {
    let seed = std::env::var("QUIETCUT_SEED").map_or(20_240_611, |seed| seed.parse().expect("a number"));
    println!("seed {seed}");
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let folder = tempfile::tempdir().expect("a folder");
    // The text of a panic that is caught would only bury the message of this test.
    let hook = panic::take_hook();
    panic::set_hook(Box::new(|_| {}));
    let mut faults = Vec::new();
    for sample in samples(folder.path()) {
        let path = folder.path().join(sample.name);
        for round in 0..slice(DAMAGED[0], DAMAGED[1]) {
            let bytes = if round == 0 {
                sample.bytes.clone()
            } else {
                damaged(&sample.bytes, &mut random)
            };
            faults.extend(fault(&path, &bytes).map(|what| format!("{} round {round}: {what}", sample.name)));
        }
    }
    for (name, bytes) in crafted() {
        let path = folder.path().join(name);
        faults.extend(fault(&path, &bytes).map(|what| format!("{name} ({} bytes): {what}", bytes.len())));
    }
    panic::set_hook(hook);
    assert!(
        faults.is_empty(),
        "seed {seed}: {} faults\n{}",
        faults.len(),
        faults.iter().take(20).cloned().collect::<Vec<_>>().join("\n")
    );
}

/// Why a reader fails this test with a file; `None` where all of them answer.
fn fault(path: &Path, bytes: &[u8]) -> Option<String> {
    std::fs::write(path, bytes).expect("a file can be written");
    let mut died = false;
    let peak = peak_of(|| {
        died |= panic::catch_unwind(|| drop(Recording::read(path))).is_err();
        if path
            .extension()
            .is_some_and(|ending| ending != "wav" && ending != "mat")
        {
            died |= panic::catch_unwind(|| drop(FrfTable::read(path))).is_err();
        }
    });
    let allowed = MEMORY + MEMORY_PER_BYTE * bytes.len();
    if died {
        Some("panic".into())
    } else {
        (peak > allowed).then(|| format!("{peak} bytes of memory; {allowed} are allowed"))
    }
}

/// Flips bytes, writes sizes that cannot be, and cuts the end off.
fn damaged(whole: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    // Headers decide: most of the damage is there.
    let reach = if random.random_bool(0.7) {
        bytes.len().min(1200)
    } else {
        bytes.len()
    };
    for _ in 0..random.random_range(1..6) {
        let at = random.random_range(0..reach);
        match random.random_range(0..4) {
            0 => bytes[at] = random.random(),
            1 => bytes[at] ^= 1 << random.random_range(0..8),
            2 => {
                let huge = [u32::MAX, i32::MAX as u32, 1 << 30, 1 << 24, 0][random.random_range(0..5)];
                for (byte, new) in bytes[at..].iter_mut().zip(huge.to_le_bytes()) {
                    *byte = new;
                }
            }
            _ => {
                for byte in bytes[at..].iter_mut().take(9) {
                    if byte.is_ascii_digit() || *byte == b' ' {
                        *byte = b'9';
                    }
                }
            }
        }
    }
    if random.random_bool(0.3) {
        bytes.truncate(random.random_range(0..bytes.len()));
    }
    bytes
}

/// One file of each format, as it should be.
fn samples(folder: &Path) -> Vec<Sample> {
    let channel = |name: &str, quantity, scale: f64| Channel {
        name: name.into(),
        quantity,
        samples: (0..200).map(|k| scale * f64::from(k).sin()).collect(),
    };
    let recording = Recording {
        path: folder.join("a.csv"),
        sample_rate_hz: 1000.0,
        start_s: 0.0,
        since_s: 0.0,
        channels: vec![
            channel("fx", Quantity::Force, 100.0),
            channel("ax", Quantity::Acceleration, 1.0),
        ],
        sidecar: Sidecar::default(),
    };
    let receptance = (1..100)
        .map(|k| Complex::new(1e-6 / f64::from(k), -1e-7))
        .collect();
    let frequency_hz: Vec<f64> = (1..100).map(f64::from).collect();
    let table = FrfTable::new(
        Path::new("a.csv"),
        frequency_hz.clone(),
        vec![Frf {
            response: Direction::X,
            force: Direction::X,
            receptance,
            coherence: Some(frequency_hz.iter().map(|_| 0.9).collect()),
            folding: None,
        }],
    )
    .expect("a table");
    let written = |name: &'static str, write: &dyn Fn(&Path)| {
        let path = folder.join(name);
        write(&path);
        Sample {
            name,
            bytes: std::fs::read(&path).expect("it was written"),
        }
    };
    let samples = vec![
        written("record.csv", &|path| recording.write(path).expect("written")),
        written("record.uff", &|path| {
            recording.write_uff(path, UffForm::Text).expect("written")
        }),
        written("record.bunv", &|path| {
            recording.write_uff(path, UffForm::Binary).expect("written");
        }),
        written("frf.csv", &|path| table.write(path).expect("written")),
        written("frf.uff", &|path| {
            table.write_uff(path, UffForm::Text).expect("written")
        }),
        written("frf.bunv", &|path| {
            table.write_uff(path, UffForm::Binary).expect("written")
        }),
        written("cuts.csv", &|path| {
            std::fs::write(
                path,
                "rpm,depth_mm,chatter_hz,verdict\n900,1.5,,stable\n900,1.7,17.4,hopf\n",
            )
            .expect("written");
        }),
        Sample {
            name: "record.mat",
            bytes: mat(&[matrix([3, 200], 9, 600 * 8, &numbers(600))]),
        },
        Sample {
            name: "level-7.3.mat",
            bytes: include_bytes!("../../../tests/data/lab_files/hdf5_flat.mat").to_vec(),
        },
        Sample {
            name: "chunks.mat",
            bytes: include_bytes!("../../../tests/data/lab_files/hdf5_chunks.mat").to_vec(),
        },
        Sample {
            name: "record.lvm",
            bytes: lvm(),
        },
        Sample {
            name: "record.tdms",
            bytes: tdms(100, &numbers(200)),
        },
        Sample {
            name: "german.csv",
            bytes: b"Messung 3\nFs = 1000 Hz\n\nKraft X [N];Acc X [m/s\xb2]\n0,5;1,5\n-0,5;2,5\n1;2\n"
                .repeat(3),
        },
        Sample {
            name: "frf-found.csv",
            bytes: b"Freq [Hz];Mag Hxx [um/N];Phase Hxx [deg]\n1;2,5;-10\n2;3,5;-100\n3;1;-170\n".to_vec(),
        },
        Sample {
            name: "record.wav",
            bytes: wav(2, 400 * 4, &numbers(200)),
        },
    ];
    for name in ["record", "frf", "cuts"] {
        let _ = std::fs::remove_file(folder.join(name).with_extension("toml"));
    }
    samples
}

/// Files whose headers promise what the file does not hold.
fn crafted() -> Vec<(&'static str, Vec<u8>)> {
    let some = numbers(64);
    let zeros = vec![0; 1 << 26];
    let uff = |count: &str| {
        format!(
            "    -1\n    58\nNONE\nNONE\nNONE\nNONE\nNONE\n    1         0    0         0 x                  1   1 NONE               0   0\n\
             \x20        4{count:>10}         1  0.00000E+00  1.00000E-03  0.00000E+00\n\
             \x20       17    0    0    0 NONE                 s\n         8    0    0    0 NONE                 m\n         0\n         0\n\
             \x20 1.0 2.0 1.0 2.0\n    -1\n"
        )
        .into_bytes()
    };
    vec![
        // A matrix in a compressed element, with more zeros than a record has.
        (
            "zeros.mat",
            mat(&[compressed(&matrix([1, 1 << 26], 2, 1 << 26, &zeros))]),
        ),
        ("rows.mat", mat(&[matrix([3, i32::MAX], 9, u32::MAX - 3, &some)])),
        (
            "promise.mat",
            mat(&[compressed(&matrix([1, 1 << 28], 9, 1 << 31, &some))]),
        ),
        ("promise.tdms", tdms(u64::MAX / 16, &some)),
        ("channels.wav", wav(65_535, u32::MAX - 1023, &some)),
        ("length.wav", wav(1, u32::MAX - 1023, &some)),
        ("stereo.wav", wav(2, 4 * 63, &some)),
        ("count.uff", uff("9999999999")),
        ("negative.uff", uff("-1")),
    ]
}

fn numbers(count: u32) -> Vec<u8> {
    (0..count)
        .flat_map(|k| f64::from(k).sin().to_le_bytes())
        .collect()
}

/// A LabVIEW measurement file with one block.
fn lvm() -> Vec<u8> {
    let mut text = String::from(
        "LabVIEW Measurement\nSeparator\tTab\nDecimal_Separator\t.\n***End_of_Header***\n\nChannels\t2\nY_Unit_Label\tN\tg\n\
         X_Dimension\tTime\tTime\nDelta_X\t0.001\t0.001\n***End_of_Header***\nX_Value\tForce X\tAcc X\tComment\n",
    );
    for k in 0..100 {
        text += &format!(
            "{}\t{}\t{}\t\n",
            0.001 * f64::from(k),
            f64::from(k).sin(),
            f64::from(k).cos()
        );
    }
    text.into_bytes()
}

/// A TDMS file with one segment of two channels, each of `count` numbers as it says.
fn tdms(count: u64, data: &[u8]) -> Vec<u8> {
    let text = |text: &str| [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat();
    let channel = |name: &str| {
        [
            text(&format!("/'taps'/'{name}'")),
            20u32.to_le_bytes().to_vec(),
            10u32.to_le_bytes().to_vec(),
            1u32.to_le_bytes().to_vec(),
            count.to_le_bytes().to_vec(),
            1u32.to_le_bytes().to_vec(),
            text("wf_increment"),
            10u32.to_le_bytes().to_vec(),
            1e-3f64.to_le_bytes().to_vec(),
        ]
        .concat()
    };
    let metadata = [2u32.to_le_bytes().to_vec(), channel("Force X"), channel("Acc X")].concat();
    [
        b"TDSm".to_vec(),
        14u32.to_le_bytes().to_vec(),
        4713u32.to_le_bytes().to_vec(),
        ((metadata.len() + data.len()) as u64).to_le_bytes().to_vec(),
        (metadata.len() as u64).to_le_bytes().to_vec(),
        metadata,
        data.to_vec(),
    ]
    .concat()
}

/// A MAT-file of these elements.
fn mat(elements: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = vec![b' '; 124];
    bytes.extend([0, 1, b'I', b'M']);
    bytes.extend(elements.concat());
    bytes
}

/// A matrix of doubles, stored as numbers of type `kind` in `length` bytes, as it says.
fn matrix(dimensions: [i32; 2], kind: u32, length: u32, data: &[u8]) -> Vec<u8> {
    let mut inner = Vec::new();
    let mut element = |kind: u32, length: u32, data: &[u8]| {
        inner.extend(kind.to_le_bytes());
        inner.extend(length.to_le_bytes());
        inner.extend(data);
        inner.resize(inner.len().next_multiple_of(8), 0);
    };
    element(6, 8, &[6, 0, 0, 0, 0, 0, 0, 0]);
    element(5, 8, &dimensions.map(i32::to_le_bytes).concat());
    element(1, 2, b"ch");
    element(kind, length, data);
    let whole = (u64::from(length) + 64).min(u64::from(u32::MAX)) as u32;
    [&14u32.to_le_bytes()[..], &whole.to_le_bytes(), &inner].concat()
}

/// An element in a zlib stream.
fn compressed(data: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(data).expect("compressed");
    let data = encoder.finish().expect("compressed");
    [
        &15u32.to_le_bytes()[..],
        &(data.len() as u32).to_le_bytes(),
        &data,
    ]
    .concat()
}

/// A WAV file of 32-bit floats, whose data are as long as it says.
fn wav(channels: u16, length: u32, data: &[u8]) -> Vec<u8> {
    let align = channels.wrapping_mul(4);
    [
        &b"RIFF"[..],
        &(36u32.wrapping_add(length)).to_le_bytes(),
        b"WAVEfmt ",
        &16u32.to_le_bytes(),
        &3u16.to_le_bytes(),
        &channels.to_le_bytes(),
        &8000u32.to_le_bytes(),
        &(8000 * u32::from(align)).to_le_bytes(),
        &align.to_le_bytes(),
        &32u16.to_le_bytes(),
        b"data",
        &length.to_le_bytes(),
        data,
    ]
    .concat()
}
