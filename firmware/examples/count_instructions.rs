//! Counts the instructions of the stages of the signal chain on the emulated Cortex-M4F.
//!
//! Run with `-icount shift=6`. The emulator then advances its clock by 64 ns per instruction, and SysTick, at 25 MHz, by 1.6
//! ticks. Every count is printed as one line `NAME COUNT`, without the count of an empty function. Instructions are not cycles:
//! compare only counts of one compiler version.
//!
//! Lines `bits-of-NAME NUMBER` give digests of the computed results, for comparison with the host.
#![no_std]
#![no_main]
#![deny(clippy::undocumented_unsafe_blocks)]

use core::hint::black_box;

use cortex_m::singleton;
use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use counter::{Counter, fail};
use quietcut_core::decimation::{Decimation, State};
use quietcut_core::lobes::LobeTable;
use quietcut_core::tachometer::{Edge, Tachometer, TachometerState, Wheel};
use quietcut_core::units::{Hertz, Nanoseconds, Rpm};
use quietcut_core::{fft, math};

#[path = "support/counter.rs"]
mod counter;
// The tests that compare the digests include these files too, with `pub` items.
#[allow(unreachable_pub)]
#[path = "../../tests/support/chain_bits.rs"]
mod chain_bits;
#[allow(unreachable_pub)]
#[path = "../../tests/support/table_bits.rs"]
mod table_bits;

#[entry]
fn main() -> ! {
    let Some(peripherals) = cortex_m::Peripherals::take() else {
        fail()
    };
    let mut counter = Counter::start(peripherals.SYST);

    let mut sum = 0_u32;
    print(&mut counter, "loop-of-1000-additions", || {
        for i in 0..1000_u32 {
            sum = black_box(sum.wrapping_add(i));
        }
    });
    black_box(sum);

    transforms(&mut counter);
    spectra(&mut counter);
    decimation(&mut counter);
    tachometer(&mut counter);
    lobe_table(&mut counter);
    print(&mut counter, "sqrt-1000", || {
        (1..=1000_u16).for_each(|x| keep(math::sqrt(black_box(f32::from(x)))))
    });
    print(&mut counter, "libm-sqrt-1000", || {
        (1..=1000_u16).for_each(|x| keep(libm::sqrtf(black_box(f32::from(x)))))
    });
    hprintln!("bits-of-math {}", chain_bits::of_math());
    hprintln!("bits-of-decimation {}", chain_bits::of_decimation());

    loop {
        debug::exit(debug::EXIT_SUCCESS);
    }
}

/// Counts the fixed-point transforms and the single-precision transforms of microfft, on the same samples.
fn transforms(counter: &mut Counter) {
    let (Some(fixed), Some(float)) = (
        singleton!(FIXED: [i32; 4096] = [0; 4096]),
        singleton!(FLOAT: [f32; 4096] = [0.0; 4096]),
    ) else {
        fail()
    };
    macro_rules! both {
        ($points:literal, $fixed:path, $float:path) => {
            let (Some(fixed), Some(float)) = (fixed.first_chunk_mut(), float.first_chunk_mut()) else {
                fail()
            };
            let mut noise = 1_u32;
            for (fixed, float) in fixed.iter_mut().zip(float.iter_mut()) {
                noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                *fixed = noise as i32 >> 16;
                *float = *fixed as f32;
            }
            let (fixed, float) = (black_box(fixed), black_box(float));
            print(counter, concat!("rfft-", $points), || keep($fixed(fixed)));
            print(counter, concat!("microfft-", $points), || {
                keep($float(float))
            });
        };
    }
    both!(256, fft::rfft_256, microfft::real::rfft_256);
    both!(512, fft::rfft_512, microfft::real::rfft_512);
    both!(1024, fft::rfft_1024, microfft::real::rfft_1024);
    both!(2048, fft::rfft_2048, microfft::real::rfft_2048);
    both!(4096, fft::rfft_4096, microfft::real::rfft_4096);
}

/// Counts the spectra of both bands, summed over three axes, and the search for a tone in them.
fn spectra(counter: &mut Counter) {
    let Some(memory) = singleton!(MEMORY: chain_bits::Memory = chain_bits::Memory::new()) else {
        fail()
    };
    hprintln!("bits-of-spectra {}", chain_bits::of_spectra(memory));
    print(counter, "tool-spectrum", || keep(memory.tool_spectrum()));
    let spectrum = memory.tool_spectrum();
    print(counter, "tool-search", || keep(chain_bits::search(spectrum)));
    print(counter, "structure-spectrum", || {
        keep(memory.structure_spectrum())
    });
    let spectrum = memory.structure_spectrum();
    print(counter, "structure-search", || keep(chain_bits::search(spectrum)));
}

/// Counts the decimation of 4000 sensor samples to both bands.
fn decimation(counter: &mut Counter) {
    let Ok(decimation) = Decimation::new(Hertz(26_667.0)) else {
        fail()
    };
    let mut state = State::new();
    let counts = black_box([1234, -567, 2048]);
    print(counter, "decimation-4000", || {
        for _ in 0..4000 {
            keep(decimation.step(&mut state, black_box(counts)));
        }
    });
}

/// Counts 1000 edges of a wheel at constant speed, and the most that one edge takes.
fn tachometer(counter: &mut Counter) {
    for (name, most, positions, missing) in [
        ("tachometer-1-mark-1000-edges", "tachometer-1-mark-most", 1, 0),
        ("tachometer-60-2-1000-edges", "tachometer-60-2-most", 60, 2),
    ] {
        let Some(tachometer) = Tachometer::new(Wheel { positions, missing }) else {
            fail()
        };
        let mut state = TachometerState::new();
        let mut time = 0;
        let teeth = u64::from(positions - missing);
        let mut edge = |edge: u64| {
            let gap = u64::from(edge % teeth == 0) * u64::from(missing);
            time += (1 + gap) * 100_000 + 37 * (edge % 5);
            keep(tachometer.observe(
                &mut state,
                Edge {
                    time: Nanoseconds(time),
                },
            ));
        };
        print(counter, name, || (0..1000).for_each(&mut edge));
        let most_of_all = (1000..1200).map(|n| counter.count(|| edge(n))).max();
        hprintln!("{} {}", most, most_of_all.unwrap_or(0));
    }
}

/// Counts lookups and advice in a lobe table of 96 KB.
fn lobe_table(counter: &mut Counter) {
    let Some(memory) = singleton!(TABLE: table_bits::Memory = table_bits::Memory::new()) else {
        fail()
    };
    let Some(table) = memory.table() else { fail() };
    hprintln!("bits-of-table {}", table_bits::of_table(&table));
    print(counter, "table-parse", || {
        keep(LobeTable::parse(black_box(table.bytes())))
    });
    let cut = table_bits::cut(1.1);
    print(counter, "table-lookup", || {
        keep(table.lookup(black_box(Rpm(1000.5)), &cut))
    });
    print(counter, "advice-speed", || {
        keep(table_bits::advice(&table, black_box(1000.0), 1.1))
    });
    print(counter, "advice-depth", || {
        keep(table_bits::advice(&table, black_box(1000.0), 3.0))
    });
}

/// Prints the number of instructions of `piece`.
fn print(counter: &mut Counter, name: &str, piece: impl FnOnce()) {
    hprintln!("{} {}", name, counter.count(piece));
}

/// Keeps the compiler from removing the computation of an unused value.
fn keep<T>(value: T) {
    black_box(value);
}
