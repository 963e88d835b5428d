//! Counts the instructions of the signal chain for each block of samples, on the emulated Cortex-M4F: 1 to 8 teeth, 60 to 30 000 rev/min,
//! a silent cut and full chatter.
//!
//! Each line is `TEETH RPM SIGNAL MEAN EIGHT MOST`: instructions of a block in the mean, the mean of the most expensive eight blocks in a
//! row, and of the most expensive block. Run with `-icount shift=6`, as `count_instructions`. Instructions are not cycles.
#![no_std]
#![no_main]
#![deny(clippy::undocumented_unsafe_blocks)]

use core::hint::black_box;

use cortex_m::singleton;
use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use counter::{Counter, fail};
use quietcut_core::acceleration::{Block, MAX_BLOCK_SAMPLES, Sensor};
use quietcut_core::math::{floor, sin_turns};
use quietcut_core::monitor::{Monitor, Settings, State};
use quietcut_core::tachometer::{Edge, Wheel};
use quietcut_core::units::Nanoseconds;
use quietcut_core::working_point::Tool;

#[path = "support/counter.rs"]
mod counter;

/// Blocks of each point of the grid: half a second, with four spectra of the structure band once its first is complete.
const BLOCKS: usize = 1000;
/// Blocks that are not counted: the first spectrum of the structure band takes 1.3 s of samples.
const UNCOUNTED: usize = 600;
/// Blocks in a row whose mean is looked at.
const ROW: usize = 8;

#[entry]
fn main() -> ! {
    let (Some(peripherals), Some(state)) = (
        cortex_m::Peripherals::take(),
        singleton!(STATE: State = State::new()),
    ) else {
        fail()
    };
    let mut counter = Counter::start(peripherals.SYST);
    for teeth in [1_u8, 2, 4, 8] {
        for rpm in [60.0, 600.0, 2000.0, 6000.0, 15_000.0, 30_000.0] {
            for (signal, chatter) in [("silent", 0.0), ("chatter", 4000.0)] {
                let Some([mean, eight, most]) = cost(&mut counter, state, teeth, rpm, chatter) else {
                    fail()
                };
                hprintln!("{} {} {} {} {} {}", teeth, rpm as u32, signal, mean, eight, most);
            }
        }
    }
    loop {
        debug::exit(debug::EXIT_SUCCESS);
    }
}

/// Instructions per block: mean, largest mean of [`ROW`] blocks, largest.
fn cost(counter: &mut Counter, state: &mut State, teeth: u8, rpm: f32, chatter: f32) -> Option<[u64; 3]> {
    let sensor = Sensor::IIS3DWB_16G;
    let settings = Settings {
        sensor,
        tool: Tool { teeth },
        wheel: Some(Wheel {
            positions: 1,
            missing: 0,
        }),
        assumed_speed: None,
        limits: None,
    };
    let monitor = Monitor::new(settings).ok()?;
    state.reset();
    let per_sample = rpm / 60.0 / sensor.nominal_rate.0;
    let (mut angle, mut phase, mut noise) = (0.0_f32, 0.0_f32, 1_u32);
    let (mut all, mut most, mut eight) = (0, 0, 0);
    let mut row = [0; ROW];
    for number in 0..BLOCKS {
        let mut block = Block {
            sequence: number as u32,
            time: time_of(number * MAX_BLOCK_SAMPLES, sensor.nominal_rate.0),
            ..Block::default()
        };
        let mut edges = heapless::Vec::<Edge, 4>::new();
        for n in 0..MAX_BLOCK_SAMPLES {
            angle += per_sample;
            if angle >= 1.0 {
                angle -= 1.0;
                let time = time_of(number * MAX_BLOCK_SAMPLES + n, sensor.nominal_rate.0);
                edges.push(Edge { time }).ok()?;
            }
            // Chatter at 0.344 of a tooth period beside the first harmonic above 280 Hz.
            let passing = per_sample * f32::from(teeth);
            let harmonic = floor(280.0 / (passing * sensor.nominal_rate.0)) + 1.344;
            phase += passing * harmonic;
            phase -= floor(phase);
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let forced = 1000.0 * sin_turns(angle * f32::from(teeth) - floor(angle * f32::from(teeth)));
            let value = forced + chatter * sin_turns(phase) + (noise >> 28) as f32;
            block
                .counts
                .push([value as i16, (0.6 * value) as i16, 2000])
                .ok()?;
        }
        let instructions = counter.count(|| {
            black_box(monitor.step(state, black_box(&block), black_box(&edges), None, None));
        });
        if number >= UNCOUNTED {
            *row.get_mut(number % ROW)? = instructions;
            all += instructions;
            most = most.max(instructions);
            eight = eight.max(row.iter().sum::<u64>() / ROW as u64);
        }
    }
    Some([all / (BLOCKS - UNCOUNTED) as u64, eight, most])
}

/// Time of a sample.
fn time_of(sample: usize, rate_hz: f32) -> Nanoseconds {
    Nanoseconds(1_000_000_000 + sample as u64 * 1_000_000_000 / rate_hz as u64)
}
