//! ST IIS3DWB: three axes, 16 bit, 26.667 kHz, ±2 to ±16 g, DC to 6 kHz, a queue of 512 samples.
//!
//! Registers, codes and waiting times are those of ST's data sheet and application note AN5444.
//! The bus is SPI, mode 3 or 0, at most 10 MHz; the first byte of a transfer is the address, its top
//! bit set for a read.

use embedded_hal::delay::DelayNs;
use embedded_hal::spi::{Operation, SpiDevice};
use heapless::Vec;
use quietcut_core::acceleration::{Counts, MAX_BLOCK_SAMPLES, Sensor};
use quietcut_core::units::Hertz;

use super::{Accelerometer, Gap, Queue};

/// What the identity register of an IIS3DWB holds.
pub const IDENTITY: u8 = 0x7b;

/// The most words in the sensor's queue.
pub const QUEUE_WORDS: u16 = 512;

/// Bytes of one word of the queue: a tag and three axes of 16 bits.
const WORD_BYTES: usize = 7;

/// The sensor answers this long after power came.
const BOOT_MILLISECONDS: u32 = 10;

/// Samples are settled this long after the sensor was turned on.
const SETTLING_MILLISECONDS: u32 = 10;

/// A reset takes some 50 µs.
const RESET_POLLS: u32 = 20;
const RESET_POLL_MICROSECONDS: u32 = 100;

/// Addresses of the registers.
pub(crate) mod register {
    pub(crate) const FIFO_CTRL1: u8 = 0x07;
    pub(crate) const FIFO_CTRL2: u8 = 0x08;
    pub(crate) const FIFO_CTRL3: u8 = 0x09;
    pub(crate) const FIFO_CTRL4: u8 = 0x0a;
    pub(crate) const INT1_CTRL: u8 = 0x0d;
    pub(crate) const WHO_AM_I: u8 = 0x0f;
    pub(crate) const CTRL1_XL: u8 = 0x10;
    pub(crate) const CTRL3_C: u8 = 0x12;
    pub(crate) const CTRL4_C: u8 = 0x13;
    pub(crate) const CTRL6_C: u8 = 0x15;
    pub(crate) const CTRL8_XL: u8 = 0x17;
    pub(crate) const OUT_TEMP_L: u8 = 0x20;
    pub(crate) const FIFO_STATUS1: u8 = 0x3a;
    pub(crate) const FIFO_DATA_OUT_TAG: u8 = 0x78;
}

/// Bits of the registers.
mod bits {
    /// An address to read from.
    pub(super) const READ: u8 = 0x80;
    /// CTRL1_XL: the accelerometer runs at 26.667 kHz; no other rate exists.
    pub(super) const XL_ON: u8 = 0b101 << 5;
    /// CTRL1_XL: the second low-pass filter is in the path.
    pub(super) const LPF2_ON: u8 = 1 << 1;
    /// CTRL3_C: reset; clears itself.
    pub(super) const SW_RESET: u8 = 1;
    /// CTRL3_C: the address counts up within a transfer.
    pub(super) const IF_INC: u8 = 1 << 2;
    /// CTRL3_C: the two bytes of a sample are never of different samples.
    pub(super) const BDU: u8 = 1 << 6;
    /// CTRL4_C: the pins are SPI only.
    pub(super) const I2C_OFF: u8 = 1 << 2;
    /// FIFO_CTRL3: acceleration goes to the queue at 26.667 kHz.
    pub(super) const BATCH_XL: u8 = 0b1010;
    /// FIFO_CTRL4: the queue is off and empty.
    pub(super) const BYPASS: u8 = 0b000;
    /// FIFO_CTRL4: new samples overwrite the oldest.
    pub(super) const CONTINUOUS: u8 = 0b110;
    /// INT1_CTRL: pin INT1 is high while the queue holds as many words as the watermark or more.
    pub(super) const INT1_WATERMARK: u8 = 1 << 3;
    /// FIFO_STATUS2: an overrun since this register was last read.
    pub(super) const OVERRUN_LATCHED: u8 = 1 << 3;
    /// FIFO_STATUS2: the two high bits of the level.
    pub(super) const LEVEL_HIGH: u8 = 0b11;
    /// Tag of a word of acceleration, in the top five bits.
    pub(super) const TAG_XL: u8 = 0x02;
}

/// The acceleration at which an axis clips.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Range {
    /// ±2 g, 0.061 mg per count.
    G2,
    /// ±4 g, 0.122 mg per count.
    G4,
    /// ±8 g, 0.244 mg per count.
    G8,
    /// ±16 g, 0.488 mg per count.
    #[default]
    G16,
}

impl Range {
    fn code(self) -> u8 {
        match self {
            Self::G2 => 0b00,
            Self::G16 => 0b01,
            Self::G4 => 0b10,
            Self::G8 => 0b11,
        }
    }

    fn milli_g_per_count(self) -> f32 {
        match self {
            Self::G2 => 0.061,
            Self::G4 => 0.122,
            Self::G8 => 0.244,
            Self::G16 => 0.488,
        }
    }
}

/// What is in the path of the samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Filter {
    /// The first filter only: flat from DC to 6 kHz.
    #[default]
    Wide,
    /// A second low-pass filter whose corner is the sampling rate over a divisor.
    LowPass(Divisor),
}

/// Divisor of the sampling rate that gives the corner of the second low-pass filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Divisor {
    /// 6.7 kHz.
    By4 = 0,
    /// 2.7 kHz.
    By10 = 1,
    /// 1.3 kHz.
    By20 = 2,
    /// 593 Hz.
    By45 = 3,
    /// 267 Hz.
    By100 = 4,
    /// 133 Hz.
    By200 = 5,
    /// 67 Hz.
    By400 = 6,
    /// 33 Hz.
    By800 = 7,
}

/// How the sensor is to be set up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Configuration {
    /// Where the axes clip.
    pub range: Range,
    /// What is in the path of the samples.
    pub filter: Filter,
    /// Samples in the queue that raise pin INT1, 1 to 511.
    pub watermark: u16,
}

impl Default for Configuration {
    /// The full range and band; the watermark leaves 17 ms until the queue is full.
    fn default() -> Self {
        Self {
            range: Range::default(),
            filter: Filter::default(),
            watermark: MAX_BLOCK_SAMPLES as u16,
        }
    }
}

/// What can go wrong between driver and sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Error<B> {
    /// The bus failed.
    Bus(B),
    /// The sensor at this address says it is another; 0x00 and 0xFF mean that nothing answers.
    WrongIdentity {
        /// What the identity register held in place of 0x7B.
        found: u8,
    },
    /// The reset did not end.
    ResetTimeout,
    /// A watermark that the sensor cannot have.
    WatermarkOutOfRange {
        /// What was asked for; 1 to 511 would be right.
        asked: u16,
    },
    /// A register does not hold what was written to it.
    NotWritten {
        /// Address of the register.
        register: u8,
        /// What was written.
        written: u8,
        /// What was read back.
        found: u8,
    },
    /// A level above what the queue can hold.
    LevelOutOfRange {
        /// What the sensor said; at most 512 would be right.
        found: u16,
    },
    /// A word of the queue whose tag is of no acceleration, or whose parity is wrong.
    BadTag {
        /// The tag byte.
        found: u8,
    },
}

impl<B> From<B> for Error<B> {
    fn from(error: B) -> Self {
        Self::Bus(error)
    }
}

/// Driver of one sensor.
pub struct Iis3dwb<S, D> {
    spi: S,
    delay: D,
    configuration: Configuration,
    /// The sensor's count of the last sample read, modulo 4.
    last_slot: Option<u8>,
}

impl<S: SpiDevice, D: DelayNs> Iis3dwb<S, D> {
    /// A sensor on this bus; nothing is sent before [`start`](Accelerometer::start).
    pub fn new(spi: S, delay: D, configuration: Configuration) -> Self {
        Self {
            spi,
            delay,
            configuration,
            last_slot: None,
        }
    }

    /// Temperature of the sensor in degrees Celsius, 1/256 °C per count around 25 °C.
    pub fn temperature_celsius(&mut self) -> Result<f32, Error<S::Error>> {
        let mut bytes = [0; 2];
        self.read_registers(register::OUT_TEMP_L, &mut bytes)?;
        Ok(25.0 + f32::from(i16::from_le_bytes(bytes)) / 256.0)
    }

    fn identify(&mut self) -> Result<(), Error<S::Error>> {
        let mut found = [0];
        self.read_registers(register::WHO_AM_I, &mut found)?;
        match found {
            [IDENTITY] => Ok(()),
            [found] => Err(Error::WrongIdentity { found }),
        }
    }

    /// Puts every register to its default, whatever ran before.
    fn reset(&mut self) -> Result<(), Error<S::Error>> {
        self.write_register(register::CTRL3_C, bits::IF_INC | bits::SW_RESET)?;
        for _ in 0..RESET_POLLS {
            self.delay.delay_us(RESET_POLL_MICROSECONDS);
            let mut control = [0];
            self.read_registers(register::CTRL3_C, &mut control)?;
            if control[0] & bits::SW_RESET == 0 {
                return Ok(());
            }
        }
        Err(Error::ResetTimeout)
    }

    fn configure(&mut self) -> Result<(), Error<S::Error>> {
        let Configuration {
            range,
            filter,
            watermark,
        } = self.configuration;
        if !(1..QUEUE_WORDS).contains(&watermark) {
            return Err(Error::WatermarkOutOfRange { asked: watermark });
        }
        let [watermark_low, watermark_high] = watermark.to_le_bytes();
        let (second_filter, corner) = match filter {
            Filter::Wide => (0, 0),
            Filter::LowPass(divisor) => (bits::LPF2_ON, divisor as u8),
        };
        let settings = [
            (register::CTRL3_C, bits::BDU | bits::IF_INC),
            (register::CTRL4_C, bits::I2C_OFF),
            // All three axes.
            (register::CTRL6_C, 0),
            (register::CTRL8_XL, corner << 5),
            (register::FIFO_CTRL1, watermark_low),
            (register::FIFO_CTRL2, watermark_high),
            (register::FIFO_CTRL3, bits::BATCH_XL),
            (register::FIFO_CTRL4, bits::BYPASS),
            (register::INT1_CTRL, bits::INT1_WATERMARK),
            (
                register::CTRL1_XL,
                bits::XL_ON | range.code() << 2 | second_filter,
            ),
        ];
        for (register, value) in settings {
            self.write_register(register, value)?;
        }
        for (register, written) in settings {
            let mut found = [0];
            self.read_registers(register, &mut found)?;
            if found != [written] {
                let [found] = found;
                return Err(Error::NotWritten {
                    register,
                    written,
                    found,
                });
            }
        }
        Ok(())
    }

    /// Level of the queue, and whether it overran since the last look.
    fn queue(&mut self) -> Result<(u16, bool), Error<S::Error>> {
        let mut status = [0; 2];
        self.read_registers(register::FIFO_STATUS1, &mut status)?;
        let [low, high] = status;
        let level = u16::from_le_bytes([low, high & bits::LEVEL_HIGH]);
        if level > QUEUE_WORDS {
            return Err(Error::LevelOutOfRange { found: level });
        }
        Ok((level, high & bits::OVERRUN_LATCHED != 0))
    }

    fn write_register(&mut self, register: u8, value: u8) -> Result<(), Error<S::Error>> {
        Ok(self.spi.write(&[register, value])?)
    }

    fn read_registers(&mut self, first: u8, values: &mut [u8]) -> Result<(), Error<S::Error>> {
        Ok(self
            .spi
            .transaction(&mut [Operation::Write(&[bits::READ | first]), Operation::Read(values)])?)
    }
}

impl<S: SpiDevice, D: DelayNs> Accelerometer for Iis3dwb<S, D> {
    type Error = Error<S::Error>;

    fn sensor(&self) -> Sensor {
        Sensor {
            nominal_rate: Hertz(26_667.0),
            meters_per_second2_per_count: self.configuration.range.milli_g_per_count() * 1e-3 * 9.806_65,
            ..Sensor::IIS3DWB_16G
        }
    }

    fn watermark(&self) -> u16 {
        self.configuration.watermark
    }

    fn start(&mut self) -> Result<(), Self::Error> {
        self.last_slot = None;
        self.delay.delay_ms(BOOT_MILLISECONDS);
        self.identify()?;
        self.reset()?;
        self.configure()?;
        self.delay.delay_ms(SETTLING_MILLISECONDS);
        self.write_register(register::FIFO_CTRL4, bits::CONTINUOUS)
    }

    fn read(&mut self, samples: &mut Vec<Counts, MAX_BLOCK_SAMPLES>) -> Result<Queue, Self::Error> {
        samples.clear();
        let (level, overrun) = self.queue()?;
        let mut words = [0; WORD_BYTES * MAX_BLOCK_SAMPLES];
        let count = usize::from(level).min(MAX_BLOCK_SAMPLES);
        let Some(words) = words.get_mut(..count * WORD_BYTES) else {
            return Err(Error::LevelOutOfRange { found: level });
        };
        if count > 0 {
            // The address runs from 0x78 to 0x7E and round again, one word after the other.
            self.read_registers(register::FIFO_DATA_OUT_TAG, words)?;
        }
        let mut gap = None;
        for word in words.chunks_exact(WORD_BYTES) {
            let &[tag, x0, x1, y0, y1, z0, z1] = word else {
                continue;
            };
            if tag >> 3 != bits::TAG_XL || tag.count_ones() % 2 != 0 {
                return Err(Error::BadTag { found: tag });
            }
            let slot = tag >> 1 & 0b11;
            if samples.is_empty() {
                gap = self.last_slot.map(|last| Gap {
                    remainder: slot.wrapping_sub(last).wrapping_sub(1) & 0b11,
                    modulus: 4,
                });
            }
            self.last_slot = Some(slot);
            let counts = [[x0, x1], [y0, y1], [z0, z1]].map(i16::from_le_bytes);
            // Cannot fail: no more words were read than samples fit.
            let _ = samples.push(counts);
        }
        Ok(Queue { level, overrun, gap })
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::rc::Rc;

    use super::super::iis3dwb_model::{Bus, Delay, Fault, Model, UNSETTLED};
    use super::*;

    const NOMINAL_PERIOD_NS: f64 = 1e9 / 26_667.0;

    type Samples = Vec<Counts, MAX_BLOCK_SAMPLES>;

    fn driver(model: &Rc<RefCell<Model>>, configuration: Configuration) -> Iis3dwb<Bus, Delay> {
        Iis3dwb::new(Bus(model.clone()), Delay(model.clone()), configuration)
    }

    fn wait(model: &Rc<RefCell<Model>>, ns: u64) {
        let until = model.borrow().now_ns + ns;
        model.borrow_mut().run_until(until);
    }

    #[test]
    fn start_leaves_the_registers_that_the_data_sheet_asks_for() {
        for (range, code, micro_g) in [
            (Range::G2, 0b00, 61.0),
            (Range::G4, 0b10, 122.0),
            (Range::G8, 0b11, 244.0),
            (Range::G16, 0b01, 488.0),
        ] {
            let model = Model::new(NOMINAL_PERIOD_NS);
            let configuration = Configuration {
                range,
                filter: Filter::LowPass(Divisor::By45),
                watermark: 300,
            };
            let mut sensor = driver(&model, configuration);
            sensor.start().unwrap();
            let model = model.borrow();
            assert_eq!(model.register(0x10), 0b1010_0010 | code << 2, "{range:?}");
            assert_eq!(model.register(0x12), 0b0100_0100);
            assert_eq!(model.register(0x17), 0b0110_0000);
            assert_eq!([model.register(0x07), model.register(0x08)], [44, 1]);
            assert_eq!(model.register(0x09), 0b1010);
            assert_eq!(model.register(0x0a), 0b110);
            assert_eq!(model.register(0x0d), 0b1000);
            let scale = sensor.sensor().meters_per_second2_per_count / 9.806_65 * 1e6;
            // Single precision.
            assert!((scale - micro_g).abs() < 1e-3, "{range:?}: {scale}");
        }
    }

    #[test]
    fn start_resets_what_ran_before() {
        let model = Model::new(NOMINAL_PERIOD_NS);
        let other = Configuration {
            range: Range::G2,
            filter: Filter::LowPass(Divisor::By800),
            watermark: 511,
        };
        driver(&model, other).start().unwrap();
        wait(&model, 100_000_000);
        let mut sensor = driver(&model, Configuration::default());
        sensor.start().unwrap();
        assert_eq!(model.borrow().register(0x10), 0b1010_0100);
        assert_eq!(model.borrow().register(0x17), 0);
        let mut samples = Samples::new();
        let queue = sensor.read(&mut samples).unwrap();
        assert_eq!(
            queue,
            Queue {
                level: 0,
                overrun: false,
                gap: None
            }
        );
    }

    #[test]
    fn every_sample_comes_once_in_order_and_settled() {
        let model = Model::new(NOMINAL_PERIOD_NS * 1.03);
        let mut sensor = driver(&model, Configuration::default());
        sensor.start().unwrap();
        let mut samples = Samples::new();
        let mut next = 0;
        // Reads of no samples, of some, of as many as fit, and of more than fit.
        for turn in 0..2000_u64 {
            wait(&model, turn * 2_654_435_761 % 3_200_000);
            let level = model.borrow().level();
            let queue = sensor.read(&mut samples).unwrap();
            // Status is read within two samples.
            assert!((level..level + 2).contains(&usize::from(queue.level)));
            assert!(!queue.overrun);
            assert!(queue.gap.is_none_or(|gap| gap.remainder == 0), "turn {turn}");
            for &counts in &samples {
                assert_ne!(counts, UNSETTLED);
                assert_eq!(counts, Model::counts(next), "turn {turn}");
                next += 1;
            }
        }
        assert!(next > 80_000, "only {next} samples");
    }

    #[test]
    fn an_overrun_is_told_once_with_its_gap() {
        let model = Model::new(NOMINAL_PERIOD_NS);
        let mut sensor = driver(&model, Configuration::default());
        sensor.start().unwrap();
        wait(&model, 10_000_000);
        let mut samples = Samples::new();
        sensor.read(&mut samples).unwrap();
        let last = *samples.last().unwrap();
        wait(&model, 30_000_000);
        let queue = sensor.read(&mut samples).unwrap();
        assert!(queue.overrun);
        assert_eq!(queue.level, QUEUE_WORDS);
        let lost = samples[0][0] - last[0] - 1;
        assert!(lost > 0);
        assert_eq!(i16::from(queue.gap.unwrap().remainder), lost % 4);
        let queue = sensor.read(&mut samples).unwrap();
        assert!(!queue.overrun);
        assert_eq!(queue.gap.unwrap().remainder, 0);
    }

    #[test]
    fn the_watermark_line_rises_at_the_watermark() {
        let model = Model::new(NOMINAL_PERIOD_NS);
        let mut sensor = driver(&model, Configuration::default());
        sensor.start().unwrap();
        while !model.borrow().line() {
            wait(&model, 1000);
        }
        assert_eq!(model.borrow().level(), 64);
        sensor.read(&mut Samples::new()).unwrap();
        assert!(!model.borrow().line());
    }

    #[test]
    fn each_fault_has_its_error() {
        let configuration = Configuration::default();
        for (fault, error) in [
            (Fault::Identity(0x6c), Error::WrongIdentity { found: 0x6c }),
            (Fault::Identity(0xff), Error::WrongIdentity { found: 0xff }),
            (Fault::ResetHangs, Error::ResetTimeout),
            (
                Fault::Deaf(0x10),
                Error::NotWritten {
                    register: 0x10,
                    written: 0b1010_0100,
                    found: 0,
                },
            ),
        ] {
            let model = Model::new(NOMINAL_PERIOD_NS);
            model.borrow_mut().break_with(fault);
            assert_eq!(driver(&model, configuration).start(), Err(error));
        }
        for asked in [0, 512, u16::MAX] {
            let model = Model::new(NOMINAL_PERIOD_NS);
            let configuration = Configuration {
                watermark: asked,
                ..configuration
            };
            let error = Error::WatermarkOutOfRange { asked };
            assert_eq!(driver(&model, configuration).start(), Err(error));
        }
    }

    #[test]
    fn any_turned_bit_of_a_tag_is_found() {
        for bit in 0..8 {
            let model = Model::new(NOMINAL_PERIOD_NS);
            let mut sensor = driver(&model, Configuration::default());
            sensor.start().unwrap();
            wait(&model, 1_000_000);
            model.borrow_mut().break_tags(bit);
            let result = sensor.read(&mut Samples::new());
            assert!(
                matches!(result, Err(Error::BadTag { .. })),
                "bit {bit}: {result:?}"
            );
        }
    }

    #[test]
    fn the_bus_error_comes_through() {
        #[derive(Debug, PartialEq)]
        struct Broken;
        impl embedded_hal::spi::Error for Broken {
            fn kind(&self) -> embedded_hal::spi::ErrorKind {
                embedded_hal::spi::ErrorKind::Other
            }
        }
        impl embedded_hal::spi::ErrorType for Broken {
            type Error = Self;
        }
        impl SpiDevice for Broken {
            fn transaction(&mut self, _: &mut [Operation<'_, u8>]) -> Result<(), Self> {
                Err(Broken)
            }
        }
        let model = Model::new(NOMINAL_PERIOD_NS);
        let mut sensor = Iis3dwb::new(Broken, Delay(model), Configuration::default());
        assert_eq!(sensor.start(), Err(Error::Bus(Broken)));
        assert_eq!(sensor.read(&mut Samples::new()), Err(Error::Bus(Broken)));
    }

    #[test]
    fn temperature_counts_from_25_degrees() {
        let model = Model::new(NOMINAL_PERIOD_NS);
        wait(&model, 20_000_000);
        for (counts, celsius) in [(0, 25.0), (256, 26.0), (-2560, 15.0)] {
            model.borrow_mut().set_temperature(counts);
            let mut sensor = driver(&model, Configuration::default());
            assert_eq!(sensor.temperature_celsius(), Ok(celsius));
        }
    }
}
