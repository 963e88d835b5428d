//! Acquisition: from the sensor's queue to blocks with sequence number, time stamp, and numbers of clipped and lost
//! samples.
//!
//! The device's timer captures the rise of the sensor's watermark line. The line rises when the queue reaches W
//! samples, so the time belongs to the W-th sample after the last one read. The sensor's true sample period is fitted
//! to these stamps.

use quietcut_core::acceleration::{Block, is_clipped};
use quietcut_core::event_clock::{EventClock, EventClockState};
use quietcut_core::units::Nanoseconds;

use crate::accelerometer::{Accelerometer, Queue};
use crate::criteria::{CLOCK_MEMORY_STAMPS, RATE_TOLERANCE, STAMP_JITTER_NS};

/// The acquisition of one accelerometer.
pub struct Acquisition<A> {
    accelerometer: A,
    clock: EventClock,
    nominal_period_ns: f32,
    /// The sample clock: sample time as a linear function of the sample number, fitted to the time stamps of the
    /// watermark line. Its newest event is sample number [`Self::stamped_sample`]. `None` before the first time
    /// stamp.
    line: Option<EventClockState>,
    stamped_sample: u64,
    /// Number that the next sample read from the sensor has, if no sample is lost.
    next_sample: u64,
    /// True from a restart of the sensor until the next block, if the sample clock has a time stamp. The sensor does
    /// not count the samples lost during the restart.
    uncounted: bool,
    /// Number of samples that the last read left in the sensor's queue.
    left: u16,
    block: Block,
    next_sequence: u32,
}

impl<A: Accelerometer> Acquisition<A> {
    /// Prepares the acquisition of samples; nothing is sent to the sensor before [`start`](Self::start).
    pub fn new(accelerometer: A) -> Self {
        let nominal_period_ns = 1e9 / accelerometer.sensor().nominal_rate.0;
        Self {
            accelerometer,
            clock: EventClock {
                memory: CLOCK_MEMORY_STAMPS,
                period_uncertainty: 0.5 * RATE_TOLERANCE * nominal_period_ns / STAMP_JITTER_NS,
            },
            nominal_period_ns,
            line: None,
            stamped_sample: 0,
            next_sample: 0,
            uncounted: false,
            left: 0,
            block: Block::default(),
            next_sequence: 0,
        }
    }

    /// The driver of the sensor.
    pub fn accelerometer(&mut self) -> &mut A {
        &mut self.accelerometer
    }

    /// Starts the sensor, or restarts it after an error. The first block after a restart states the number of lost
    /// samples, estimated from the fitted clock; 0 if there was no time stamp before.
    ///
    /// # Errors
    /// The sensor's driver fails.
    pub fn start(&mut self) -> Result<(), A::Error> {
        self.accelerometer.start()?;
        self.uncounted = self.line.is_some();
        self.left = 0;
        Ok(())
    }

    /// True if the last read left at least as many samples as the watermark in the sensor's queue. The watermark line
    /// then stays high, and the next read must not wait for its rise.
    pub fn is_behind(&self) -> bool {
        self.left >= self.accelerometer.watermark()
    }

    /// Reads the next block of samples from the sensor's queue; `None` if the queue is empty.
    ///
    /// `now` is the time just before the call. `rise` is the time of the last rise of the watermark line, if it rose
    /// after the end of the preceding read. A rise *during* a read belongs to no known sample; the caller must discard
    /// it.
    ///
    /// # Errors
    /// The sensor's driver fails; the sensor must then be restarted.
    pub fn read(&mut self, rise: Option<Nanoseconds>, now: Nanoseconds) -> Result<Option<&Block>, A::Error> {
        let queue = self.accelerometer.read(&mut self.block.counts)?;
        let count = self.block.counts.len();
        self.left = queue.level.saturating_sub(count as u16);
        if count == 0 {
            return Ok(None);
        }
        let lost = self.lost(queue, now);
        let rise = rise.filter(|_| !self.uncounted);
        if let Some(rise) = rise {
            self.observe(rise);
        }
        let first = self.next_sample + u64::from(lost);
        self.next_sample = first + count as u64;
        self.uncounted = false;
        self.block.time = self.time_of(first, rise, queue, now);
        self.block.sequence = self.next_sequence;
        self.block.lost = lost;
        self.block.clipped = self
            .block
            .counts
            .iter()
            .filter(|&&counts| is_clipped(counts))
            .count() as u16;
        self.next_sequence = self.next_sequence.wrapping_add(1);
        Ok(Some(&self.block))
    }

    /// Updates the fitted clock with the time stamp of the sample that raised the watermark line.
    fn observe(&mut self, rise: Nanoseconds) {
        let sample = self.next_sample + u64::from(self.accelerometer.watermark()) - 1;
        match &mut self.line {
            None => self.line = Some(self.clock.start(rise, self.nominal_period_ns, STAMP_JITTER_NS)),
            Some(line) => {
                let steps = sample.saturating_sub(self.stamped_sample);
                self.clock
                    .observe(line, steps.try_into().unwrap_or(u32::MAX), rise);
                let bound_ns = RATE_TOLERANCE * self.nominal_period_ns;
                line.limit_period(
                    self.nominal_period_ns - bound_ns,
                    self.nominal_period_ns + bound_ns,
                );
            }
        }
        self.stamped_sample = sample;
    }

    /// Number of samples lost between the last sample read and the first of this block.
    ///
    /// The sensor's count is exact modulo a small number. The fitted clock gives the multiple of that number.
    fn lost(&self, queue: Queue, now: Nanoseconds) -> u32 {
        let gap = queue.gap.filter(|_| !self.uncounted);
        let remainder = gap.map_or(0, |gap| i64::from(gap.remainder));
        if !(queue.overrun || self.uncounted || remainder != 0) {
            return 0;
        }
        // The overrun may have come after the preceding call had read the status. That call has then counted the lost
        // samples already, and their number is 0 here.
        let Some(line) = &self.line else {
            return remainder as u32;
        };
        // Number of the newest sample in the sensor's queue: that of the stamped sample plus the whole sample periods
        // since.
        let newest = self.stamped_sample as i64 + line.events_to(now) as i64;
        let lost = newest + 1 - i64::from(queue.level) - self.next_sample as i64;
        let lost = match gap {
            None => lost,
            Some(gap) => {
                let modulus = i64::from(gap.modulus).max(1);
                // Of the numbers of lost samples that agree with the remainder in the sensor's count, the one nearest
                // to the clock's estimate.
                lost - (lost - remainder + modulus / 2).rem_euclid(modulus) + modulus / 2
            }
        };
        lost.max(remainder).try_into().unwrap_or(u32::MAX)
    }

    /// Time at which the sample with number `first` was taken, on the device's clock.
    fn time_of(&self, first: u64, rise: Option<Nanoseconds>, queue: Queue, now: Nanoseconds) -> Nanoseconds {
        let before = |time: Nanoseconds, samples: f32, period_ns: f32| {
            Nanoseconds(time.0.saturating_sub((samples * period_ns) as u64))
        };
        match (&self.line, rise) {
            (None, _) => before(now, f32::from(queue.level), self.nominal_period_ns),
            // The time is counted back from the time stamp itself with the fitted period, not read from the line fitted
            // to the stamps, because the signal chain fits the block times again.
            (Some(line), Some(rise)) if first <= self.stamped_sample => {
                before(rise, (self.stamped_sample - first) as f32, line.period_ns())
            }
            (Some(line), _) => line.time_at(first as f32 - self.stamped_sample as f32),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::rc::Rc;

    use rand::{Rng, RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::accelerometer::iis3dwb::{Configuration, Iis3dwb};
    use crate::accelerometer::iis3dwb_model::{Bus, Delay, Model};

    const NOMINAL_PERIOD_NS: f64 = 1e9 / 26_667.0;
    /// One tick of the timer that stamps the line: 12.5 ns at 80 MHz, rounded down.
    const TICK_NS: u64 = 12;

    /// A sensor model with its acquisition, in place of a board.
    struct Bench {
        model: Rc<RefCell<Model>>,
        acquisition: Acquisition<Iis3dwb<Bus, Delay>>,
        read_ended_ns: u64,
    }

    impl Bench {
        fn new(rate_error: f64) -> Self {
            let model = Model::new(NOMINAL_PERIOD_NS / (1.0 + rate_error));
            let sensor = Iis3dwb::new(Bus(model.clone()), Delay(model.clone()), Configuration::default());
            let mut acquisition = Acquisition::new(sensor);
            acquisition.start().unwrap();
            Self {
                model,
                acquisition,
                read_ended_ns: 0,
            }
        }

        /// Waits for the watermark line, then for `late_ns`, and reads a block.
        fn block(&mut self, late_ns: u64) -> Block {
            while !self.model.borrow().line() {
                let now = self.model.borrow().now_ns;
                self.model.borrow_mut().run_until(now + 1000);
            }
            let now = self.model.borrow().now_ns + late_ns;
            self.model.borrow_mut().run_until(now);
            let rises = self.model.borrow().rises_ns.clone();
            let rise = rises.last().filter(|&&rise| rise > self.read_ended_ns);
            let rise = rise.map(|rise| Nanoseconds(rise / TICK_NS * TICK_NS));
            let block = self.acquisition.read(rise, Nanoseconds(now)).unwrap().cloned();
            self.read_ended_ns = self.model.borrow().now_ns;
            block.unwrap()
        }

        /// The true number of the block's first sample, and the error of its time stamp in ns.
        fn truth(&self, block: &Block) -> (u64, i64) {
            let [low, _, high] = block.counts[0];
            let first = low as u64 + high as u64 * 30_000;
            for (i, &counts) in block.counts.iter().enumerate() {
                assert_eq!(
                    counts,
                    Model::counts(first + i as u64),
                    "samples of one block follow each other"
                );
            }
            let taken_ns = self.model.borrow().queued_ns[first as usize];
            (first, block.time.0 as i64 - taken_ns as i64)
        }
    }

    #[test]
    fn time_stamps_belong_to_the_first_sample() {
        for rate_error in [-0.03, 0.0, 0.03] {
            let mut bench = Bench::new(rate_error);
            let mut next = 0;
            for number in 0..600 {
                // The reads are late by up to a third of a block.
                let late_ns = number * 12_345 % 800_000;
                let block = bench.block(late_ns);
                let (first, error_ns) = bench.truth(&block);
                assert_eq!(first, next);
                assert_eq!(u64::from(block.sequence), number);
                assert_eq!(block.lost, 0);
                next += block.counts.len() as u64;
                // Before the period is fitted it errs by 3 % over 63 samples. Later the error is a tick of the timer,
                // and at most as much from the fitted period.
                let bound_ns = if number < 8 { 75_000 } else { 2 * TICK_NS as i64 };
                assert!(
                    error_ns.abs() <= bound_ns,
                    "rate {rate_error}, block {number}: {error_ns} ns"
                );
            }
        }
    }

    #[test]
    fn late_reads_lose_nothing_and_keep_time() {
        let mut bench = Bench::new(0.02);
        for _ in 0..100 {
            bench.block(0);
        }
        let mut next = None;
        let mut behind = 0;
        for turn in 0..400 {
            // Every 20th read is so late that several blocks wait. The line does not rise for them again.
            let block = bench.block(if turn % 20 == 0 { 12_000_000 } else { 0 });
            behind += u32::from(bench.acquisition.is_behind());
            let (first, error_ns) = bench.truth(&block);
            assert_eq!(first, next.unwrap_or(first), "turn {turn}");
            next = Some(first + block.counts.len() as u64);
            assert_eq!(block.lost, 0, "turn {turn}");
            // A block without a stamp of its own is extrapolated over less than a full queue: 20 ms times the
            // relative error of the period, some 1e-5 after 100 stamps.
            assert!(error_ns.abs() <= 300, "turn {turn}: {error_ns} ns");
        }
        assert!(behind > 20, "{behind}");
    }

    #[test]
    fn losses_are_counted_exactly() {
        let seed: u64 = rand::rng().next_u64();
        println!("seed {seed}");
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        for rate_error in [-0.03, 0.03] {
            let mut bench = Bench::new(rate_error);
            for _ in 0..200 {
                bench.block(0);
            }
            let (mut next, mut losses) = (None, 0);
            for turn in 0..300 {
                let stall_ns = if turn % 10 == 0 {
                    random.random_range(0..300_000_000)
                } else {
                    0
                };
                let block = bench.block(stall_ns);
                let (first, error_ns) = bench.truth(&block);
                if let Some(next) = next {
                    assert_eq!(
                        u64::from(block.lost),
                        first - next,
                        "turn {turn}, stall of {stall_ns} ns"
                    );
                    losses += u32::from(block.lost > 0);
                }
                next = Some(first + block.counts.len() as u64);
                // In the worst case the period is known from two stamps 2.4 ms apart, each to a tick: an error of 1.5
                // µs in 300 ms.
                assert!(error_ns.abs() <= 3_000, "turn {turn}: {error_ns} ns");
            }
            assert!(losses > 10, "{losses}");
        }
    }

    #[test]
    fn a_restart_is_counted_by_the_clock() {
        let mut bench = Bench::new(0.01);
        for _ in 0..200 {
            bench.block(0);
        }
        let last = bench.block(0);
        let end_ns = last.time.0 + (last.counts.len() as f64 * bench.model.borrow().period_ns) as u64;
        bench.acquisition.start().unwrap();
        let block = bench.block(0);
        let (_, error_ns) = bench.truth(&block);
        // One sample period: after a restart the sample times have any phase relative to those before.
        let period_ns = bench.model.borrow().period_ns;
        assert!((error_ns as f64).abs() <= period_ns, "{error_ns} ns");
        let missing = (block.time.0 - end_ns) as f64 / period_ns;
        assert!(
            (f64::from(block.lost) - missing).abs() <= 1.0,
            "{} lost, {missing} missing",
            block.lost
        );
        let after = bench.block(0);
        assert_eq!(after.lost, 0);
    }

    #[test]
    fn clipped_samples_are_counted() {
        struct Clipping;
        impl Accelerometer for Clipping {
            type Error = ();
            fn sensor(&self) -> quietcut_core::acceleration::Sensor {
                quietcut_core::acceleration::Sensor::IIS3DWB_16G
            }
            fn watermark(&self) -> u16 {
                3
            }
            fn start(&mut self) -> Result<(), ()> {
                Ok(())
            }
            fn read(
                &mut self,
                samples: &mut heapless::Vec<quietcut_core::acceleration::Counts, 64>,
            ) -> Result<Queue, ()> {
                samples.clear();
                samples.extend([[0, i16::MAX, 0], [1, 2, 3], [i16::MIN, 0, i16::MAX]]);
                Ok(Queue {
                    level: 3,
                    ..Queue::default()
                })
            }
        }
        let mut acquisition = Acquisition::new(Clipping);
        let block = acquisition.read(None, Nanoseconds(1_000_000)).unwrap().unwrap();
        assert_eq!(block.clipped, 2);
    }
}
