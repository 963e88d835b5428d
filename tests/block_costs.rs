//! Instructions of the signal chain for each block of samples on the emulated Cortex-M4F, over teeth, speeds and signals
#![allow(clippy::panic)]

use std::time::Duration;

use quietcut_tests::{emulator, firmware_image};

/// Clock of the image for the NUCLEO-G474RE, Hz.
const CLOCK_HZ: f64 = 160e6;
/// Samples of a block, and their rate.
const SAMPLES: f64 = 64.0;
const RATE_HZ: f64 = 26_667.0;

/// Prints the grid. Shares of the processor are those at one cycle per instruction; a Cortex-M4F takes up to two.
#[test]
#[ignore = "campaign"]
fn cost_grid() {
    let printed = emulator::printed_counts(&firmware_image::count_blocks(), Duration::from_secs(1200));
    let available = CLOCK_HZ * SAMPLES / RATE_HZ;
    println!("instructions per block of 64 samples; {available:.0} cycles are available");
    println!("| teeth | rev/min | signal | mean | eight blocks | most | mean share |");
    println!("|---|---|---|---|---|---|---|");
    for line in printed.lines() {
        let fields: Vec<&str> = line.split(' ').collect();
        let [teeth, rpm, signal, mean, eight, most] = fields[..] else {
            panic!("not a cost: {line}");
        };
        let share = mean
            .parse::<f64>()
            .map_or(f64::NAN, |mean| 100.0 * mean / available);
        println!("| {teeth} | {rpm} | {signal} | {mean} | {eight} | {most} | {share:.0} % |");
    }
}
