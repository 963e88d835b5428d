//! Lookup and advice on the emulated Cortex-M4F: the same bits as on the host, and their cost in instructions.
#![allow(clippy::expect_used, clippy::indexing_slicing)]

use quietcut_core::lobes::LobeTable;
use quietcut_tests::{emulator, table_bits};

#[test]
fn a_table_of_96_kilobytes_answers_the_same_and_in_time() {
    let counts = emulator::count_instructions();
    let mut memory = Box::new(table_bits::Memory::new());
    let table = memory.table().expect("a table");
    let length = table.bytes().len();
    assert_eq!(counts["bits-of-table"], u64::from(table_bits::of_table(&table)));
    assert!(LobeTable::parse(table.bytes()).is_ok());

    println!("Instructions for a table of {length} bytes, 600 speeds in 6 layers:");
    // Counts measured with rustc 1.95.0; a tenth more is allowed for other versions. The sensor's queue holds 19 ms, which are
    // 3.2 million cycles of the board: advice without any stable speed must end before the queue is full.
    for (piece, measured) in [
        ("table-parse", 1_628_821),
        ("table-lookup", 6_888),
        ("advice-speed", 156_235),
        ("advice-depth", 2_190_751),
    ] {
        println!("{piece}: {}", counts[piece]);
        assert!(
            counts[piece] <= measured * 11 / 10,
            "{piece}: {} instructions, {measured} expected",
            counts[piece]
        );
    }
}
