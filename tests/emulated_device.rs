//! The ARM image in the emulator: what it says over its serial ports.
#![allow(clippy::expect_used)]

use std::io::{Read, Write};

use quietcut_core::acceleration::Block;
use quietcut_core::tachometer::Edge;
use quietcut_core::units::Nanoseconds;
use quietcut_firmware::stimulus::Stimulus;
use quietcut_tests::emulator::{self, Emulator, Memory};

#[test]
fn boots_and_answers() {
    let memory = Memory::erased();
    let emulator = Emulator::start(&memory);
    let mut link = emulator.link();
    link.write_all(b"quietcut").expect("the device takes bytes");
    let mut answer = [0; 8];
    link.read_exact(&mut answer).expect("the device answers");
    assert_eq!(&answer, b"quietcut");
    assert!(
        emulator.log().contains("INFO quietcut on mps2-an386"),
        "{}",
        emulator.log()
    );
}

#[test]
fn answers_on_a_serial_device() {
    let memory = Memory::erased();
    let emulator = Emulator::start(&memory);
    let device = emulator.serial_device();
    let mut port = serialport::new(device.path(), 921_600)
        .timeout(emulator::PATIENCE)
        .open()
        .expect("a serial device");
    for round in 0..3 {
        let began = std::time::Instant::now();
        port.write_all(b"quietcut").expect("the device takes bytes");
        let mut answer = [0; 8];
        port.read_exact(&mut answer).expect("the device answers");
        assert_eq!(&answer, b"quietcut");
        println!("round trip {round}: {:?}", began.elapsed());
    }
}

fn cut(blocks: u32) -> Vec<Stimulus> {
    let block = |sequence: u32| Block {
        sequence,
        time: Nanoseconds(u64::from(sequence) * 2_400_000),
        counts: (0..64_i16).map(|i| [i * 100, -i * 200, i]).collect(),
        ..Block::default()
    };
    let edge = |sequence: u32| Edge {
        time: Nanoseconds(u64::from(sequence) * 2_400_000),
    };
    (0..blocks)
        .flat_map(|i| [Stimulus::Edge(edge(i)), Stimulus::Block(block(i))])
        .collect()
}

#[test]
fn takes_simulated_samples() {
    let memory = Memory::erased();
    let mut emulator = Emulator::start(&memory);
    let stimuli = cut(100);
    let began = std::time::Instant::now();
    emulator.feed(&stimuli);
    println!(
        "serial port: {:.0} samples/s",
        64_000.0 / began.elapsed().as_secs_f64()
    );
    let began = std::time::Instant::now();
    emulator.feed_stored(&cut(1000));
    println!(
        "memory: {:.0} samples/s",
        64_000.0 / began.elapsed().as_secs_f64()
    );
}

#[test]
fn counts_instructions() {
    let counts = emulator::count_instructions();
    assert_eq!(counts, emulator::count_instructions(), "a count must repeat");
    // Per turn: add, store and load of the black box, count, compare, branch.
    let turns = counts["loop-of-1000-additions"];
    assert!(
        (3000..=8000).contains(&turns),
        "{turns} instructions for 1000 turns"
    );
}
