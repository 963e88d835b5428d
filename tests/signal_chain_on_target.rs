//! The signal chain on the emulated Cortex-M4F: the same bits as on the host, and its cost in instructions.
#![allow(clippy::expect_used, clippy::indexing_slicing)]

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::fs;
use std::sync::OnceLock;

use object::{Object, ObjectSection};
use quietcut_core::fft;
use quietcut_tests::{chain_bits, emulator, firmware_image};

/// One run of the counting image for all tests.
fn counts() -> &'static BTreeMap<String, u64> {
    static COUNTS: OnceLock<BTreeMap<String, u64>> = OnceLock::new();
    COUNTS.get_or_init(emulator::count_instructions)
}

/// Compares elementary functions, decimation, both transforms, the spectra, and the search for a tone in them.
#[test]
fn target_and_host_compute_the_same_bits() {
    let mut memory = Box::new(chain_bits::Memory::new());
    for (part, here) in [
        ("math", chain_bits::of_math()),
        ("decimation", chain_bits::of_decimation()),
        ("spectra", chain_bits::of_spectra(&mut memory)),
    ] {
        assert_eq!(counts()[&format!("bits-of-{part}")], u64::from(here), "{part}");
    }
}

/// The compiler that built the instruction counter, as the image contains it.
fn compiler() -> String {
    let bytes = fs::read(firmware_image::count_instructions()).expect("the counting image");
    let elf = object::File::parse(&*bytes).expect("an ELF file");
    let comment = elf.section_by_name(".comment").expect("a section .comment");
    let text = String::from_utf8_lossy(comment.data().expect("its text")).into_owned();
    let version = text.split('\0').find(|line| line.starts_with("rustc"));
    version.expect("the name of the compiler").to_owned()
}

/// Signal-to-noise ratio in decibel of the 1024-point transform, compared with an exact transform, for a 16-bit tone between two
/// bins.
fn snr_db(dbfs: f64) -> f64 {
    const POINTS: usize = 1024;
    let amplitude = 32767.0 * 10f64.powf(dbfs / 20.0);
    let mut samples: [i32; POINTS] = std::array::from_fn(|n| {
        (amplitude * (TAU * 100.4 * n as f64 / POINTS as f64 + 0.3).cos()).round() as i32
    });
    let exact: Vec<[f64; 2]> = (0..=POINTS / 2)
        .map(|k| {
            samples.iter().enumerate().fold([0.0, 0.0], |[re, im], (n, &x)| {
                let (sin, cos) = (TAU * (k * n % POINTS) as f64 / POINTS as f64).sin_cos();
                [re + f64::from(x) * cos, im - f64::from(x) * sin]
            })
        })
        .collect();
    let transform = fft::rfft_1024(&mut samples);
    let [dc, nyquist] = transform.bins[0];
    let ours = [[dc, 0]]
        .into_iter()
        .chain(transform.bins[1..].iter().copied())
        .chain([[nyquist, 0]]);
    let scale = f64::from(transform.exponent).exp2();
    let (mut signal, mut noise) = (0.0, 0.0);
    for (found, exact) in ours.zip(exact) {
        for part in 0..2 {
            signal += exact[part] * exact[part];
            noise += (f64::from(found[part]) * scale - exact[part]).powi(2);
        }
    }
    10.0 * (signal / noise).log10()
}

#[test]
fn cost_and_accuracy_of_the_transform() {
    let counts = counts();
    println!(
        "Instructions of a real transform, {}, target-cpu=cortex-m4:",
        compiler()
    );
    println!("{:>8} {:>12} {:>16}", "points", "fixed point", "microfft (f32)");
    for points in [256, 512, 1024, 2048, 4096] {
        let (ours, theirs) = (
            counts[&format!("rfft-{points}")],
            counts[&format!("microfft-{points}")],
        );
        println!("{points:>8} {ours:>12} {theirs:>16}");
    }
    let (loud, quiet) = (snr_db(-1.0), snr_db(-40.0));
    println!("1024 points, by gcc 12.2 -O3: arm_rfft_fast_f32 44676, arm_rfft_q15 44234, arm_rfft_q31 87025");
    println!("1024 points, 16-bit tone between two bins: {loud:.1} dB at −1 dBFS, {quiet:.1} dB at −40 dBFS");
    for piece in [
        "tool-spectrum",
        "tool-search",
        "structure-spectrum",
        "structure-search",
        "decimation-4000",
        "tachometer-1-mark-1000-edges",
        "tachometer-1-mark-most",
        "tachometer-60-2-1000-edges",
        "tachometer-60-2-most",
    ] {
        println!("{piece}: {}", counts[piece]);
    }
    // The tests of the transform give 145 and 143 dB for a tone between two bins.
    assert!(loud >= 140.0 && quiet >= 138.0, "{loud} dB, {quiet} dB");
    // Counts measured with rustc 1.95.0; a tenth more is allowed for other versions.
    for (piece, measured) in [
        ("rfft-1024", 45_225),
        ("microfft-1024", 50_059),
        ("tool-spectrum", 238_434),
        ("structure-spectrum", 536_553),
        ("decimation-4000", 1_630_342),
        ("sqrt-1000", 39_003),
    ] {
        assert!(
            counts[piece] <= measured * 11 / 10,
            "{piece}: {} instructions, {measured} expected",
            counts[piece]
        );
    }
    assert!(
        counts["sqrt-1000"] < counts["libm-sqrt-1000"],
        "micromath no longer earns its place in math::sqrt"
    );
}
