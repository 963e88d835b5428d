//! ST IIS3DWB: three axes, 16 bit, 26.667 kHz, ±2 to ±16 g, DC to 6 kHz, a queue of 512 samples.
//!
//! Registers, codes and waiting times are those of ST's data sheet and application note AN5444.
//! The bus is SPI, mode 3 or 0, at most 10 MHz; the first byte of a transfer is the address, its top
//! bit set for a read.

mod bits;
mod configuration;
pub(crate) mod register;
#[cfg(test)]
mod tests;

use embedded_hal::delay::DelayNs;
use embedded_hal::spi::{Operation, SpiDevice};
use heapless::Vec;
use quietcut_core::acceleration::{Counts, MAX_BLOCK_SAMPLES, Sensor};
use quietcut_core::units::Hertz;

pub use configuration::{Configuration, Divisor, Filter, Range};

use super::{Accelerometer, Gap, Queue};

/// Content of the identity register of an IIS3DWB accelerometer.
pub const IDENTITY: u8 = 0x7b;

/// Capacity of the sample queue in the accelerometer, in words (one word per sample).
pub const QUEUE_WORDS: u16 = 512;

/// Length in bytes of one word in the sensor's sample queue: a tag and three axes of 16 bits.
const WORD_BYTES: usize = 7;

/// Boot time after power-on.
const BOOT_MILLISECONDS: u32 = 10;

/// Time after the sensor is switched on until its samples have settled.
const SETTLING_MILLISECONDS: u32 = 10;

/// Largest number of polls of the sensor's reset bit before the reset has failed. A reset takes about 50 µs.
const RESET_POLLS: u32 = 20;
/// Interval between two polls of the sensor's reset bit.
const RESET_POLL_MICROSECONDS: u32 = 100;

/// Error of the sensor driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Error<B> {
    /// The bus failed.
    Bus(B),
    /// The identity register of the sensor has another value than expected; 0x00 and 0xFF mean that no sensor answers.
    WrongIdentity {
        /// Value read from the identity register; 0x7B is expected.
        found: u8,
    },
    /// The sensor did not end its reset in time.
    ResetTimeout,
    /// The requested watermark (queue level that raises the interrupt line) is out of range.
    WatermarkOutOfRange {
        /// The requested watermark, in samples; 1 to 511 are possible.
        asked: u16,
    },
    /// A register of the sensor does not hold the value that was written to it.
    NotWritten {
        /// Address of the register.
        register: u8,
        /// The written value.
        written: u8,
        /// The value read back.
        found: u8,
    },
    /// The queue level that the sensor states exceeds the capacity of its queue.
    LevelOutOfRange {
        /// The queue level that the sensor states, in samples; at most 512 is possible.
        found: u16,
    },
    /// A word from the sensor's queue has a tag other than acceleration, or a wrong parity bit in the tag.
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

/// Driver of one IIS3DWB accelerometer on an SPI bus.
pub struct Iis3dwb<S, D> {
    spi: S,
    delay: D,
    configuration: Configuration,
    /// The 2-bit sample count in the tag of the last word read from the sensor's queue; `None` before the first word
    /// after a start of the sensor.
    last_slot: Option<u8>,
}

impl<S: SpiDevice, D: DelayNs> Iis3dwb<S, D> {
    /// A driver for the sensor on this bus; nothing is sent before [`start`](Accelerometer::start).
    pub fn new(spi: S, delay: D, configuration: Configuration) -> Self {
        Self {
            spi,
            delay,
            configuration,
            last_slot: None,
        }
    }

    /// Temperature of the sensor in degrees Celsius, in steps of 1/256 °C.
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

    /// Resets the registers of the sensor to their default values.
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
            // Writing 0 to this register enables all three axes.
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

    /// Level of the sensor's queue in words, and whether the queue has overflowed since the preceding call.
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
            // The register address that the sensor reads out counts from 0x78 to 0x7E and wraps, so that one transfer
            // reads word after word of its queue.
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
            // The push cannot fail: only as many words were read from the queue as fit into `samples`.
            let _ = samples.push(counts);
        }
        Ok(Queue { level, overrun, gap })
    }
}
