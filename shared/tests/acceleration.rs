//! The sample clock, tested on streams of blocks whose sample rate is known.

#![allow(clippy::unwrap_used)]

use quietcut_core::acceleration::{Block, Continuity, SampleClockState, Sensor};
use quietcut_core::units::Nanoseconds;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Blocks of a sensor whose clock deviates from the nominal rate, with time stamps that have jitter.
struct Stream {
    rate: f64,
    jitter: f64,
    sequence: u32,
    sample: u64,
    random: ChaCha8Rng,
}

impl Stream {
    fn new(rate: f64, jitter: f64, seed: u64) -> Self {
        println!("seed {seed}, rate {rate}, jitter {jitter}");
        Self {
            rate,
            jitter,
            sequence: 7,
            sample: 0,
            random: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    fn time(&self, sample: u64) -> f64 {
        5.0 + sample as f64 / self.rate
    }

    fn block(&mut self, samples: usize) -> Block {
        let late = if self.jitter > 0.0 {
            self.random.random_range(0.0..self.jitter)
        } else {
            0.0
        };
        let time = Nanoseconds(((self.time(self.sample) + late) * 1e9).round() as u64);
        let mut block = Block {
            sequence: self.sequence,
            time,
            ..Block::default()
        };
        for _ in 0..samples {
            block.counts.push([1, 2, 3]).unwrap();
        }
        self.sequence += 1;
        self.sample += samples as u64;
        block
    }
}

fn error_of(state: &SampleClockState, n: u32, truth: f64) -> f64 {
    state.time_of(n).unwrap().0 as f64 * 1e-9 - truth
}

#[test]
fn a_clock_off_by_three_percent_is_fitted() {
    let sensor = Sensor::IIS3DWB_16G;
    let clock = sensor.clock();
    for (off, samples) in [(0.97, 64), (1.03, 64), (1.0, 64), (1.02, 16), (0.98, 1)] {
        for jitter in [0.0, 30e-6] {
            let mut stream = Stream::new(26_667.0 * off, jitter, 1);
            let mut state = SampleClockState::default();
            let mut worst = 0.0_f64;
            for n in 0..60_000 / samples {
                let first = stream.sample;
                clock.observe(&mut state, &stream.block(samples));
                if n * samples > 30_000 {
                    // Stamps are late by half the jitter in the mean. No estimator can remove this offset.
                    let truth = stream.time(first + 5) + 0.5 * jitter;
                    worst = worst.max(error_of(&state, 5, truth).abs());
                }
            }
            let rate = f64::from(state.rate().unwrap().0);
            let off_by = (rate / stream.rate - 1.0).abs();
            // Uniform jitter of 30 µs has 8.7 µs rms. Averaged over 256 blocks, the end of the line has 2/√256 of that and its
            // slope √12/256^1.5 per block; the bounds are four standard deviations. The period in f32 has a step of 2⁻⁸ ns: 64
            // steps per block against a gain of 2/256 give 100 ns. Times are whole ns: 5e-6 of a block of 16 samples.
            let memory = 256.0_f64;
            let sigma = jitter / 12f64.sqrt();
            assert!(worst < 4.0 * 2.0 / memory.sqrt() * sigma + 100e-9, "{worst}");
            let per_block = samples as f64 / stream.rate;
            let bound = 4.0 * 12f64.sqrt() / memory.powf(1.5) * sigma / per_block + 5e-6;
            assert!(off_by < bound, "{off_by} over {bound}");
        }
    }
}

#[test]
fn gaps_are_counted_and_the_time_stays_right() {
    let clock = Sensor::IIS3DWB_16G.clock();
    let mut stream = Stream::new(26_100.0, 20e-6, 2);
    let mut state = SampleClockState::default();
    for _ in 0..400 {
        clock.observe(&mut state, &stream.block(64));
    }
    // The block states the number of lost samples.
    stream.sample += 37;
    let mut block = stream.block(64);
    block.lost = 37;
    assert_eq!(clock.observe(&mut state, &block), Continuity::Gap(37));
    assert_eq!(
        clock.observe(&mut state, &stream.block(64)),
        Continuity::Contiguous
    );
    // Whole blocks of unknown length are lost: the number of samples comes from the clock.
    for lengths in [vec![64], vec![64, 3, 20], vec![1], vec![64; 40]] {
        for _ in 0..400 {
            assert_eq!(
                clock.observe(&mut state, &stream.block(64)),
                Continuity::Contiguous
            );
        }
        for &length in &lengths {
            stream.block(length);
        }
        let lost = lengths.iter().sum::<usize>() as u32;
        let first = stream.sample;
        assert_eq!(
            clock.observe(&mut state, &stream.block(64)),
            Continuity::Gap(lost)
        );
        assert!(error_of(&state, 0, stream.time(first) + 10e-6).abs() < 5e-6);
    }
    assert_eq!(state.lost(), 37 + 64 + 87 + 1 + 64 * 40);
    assert_eq!(state.gaps(), 5);
    // The samples lost in a pause of one minute cannot be counted.
    stream.sample += 60 * 26_100;
    stream.sequence += 1;
    assert_eq!(
        clock.observe(&mut state, &stream.block(64)),
        Continuity::Restarted
    );
    assert_eq!(state.gaps(), 6);
}

#[test]
fn an_undeclared_loss_is_found() {
    let clock = Sensor::IIS3DWB_16G.clock();
    let mut stream = Stream::new(27_000.0, 10e-6, 3);
    let mut state = SampleClockState::default();
    for _ in 0..400 {
        clock.observe(&mut state, &stream.block(64));
    }
    stream.sample += 50;
    let restarted =
        (0..6).position(|_| clock.observe(&mut state, &stream.block(64)) == Continuity::Restarted);
    assert!(restarted.is_some());
    let first = stream.sample;
    clock.observe(&mut state, &stream.block(64));
    assert!(error_of(&state, 0, stream.time(first)).abs() < 20e-6);
}
