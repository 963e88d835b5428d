//! A model of flash memory with the restrictions of real flash, whose power can be cut.
//!
//! It serves tests and the simulated device of the host. An erase sets all bits of a page. A word may be written once
//! after each erase. Unaligned writes and erases, access out of bounds, and a second write are errors.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

use crate::storage::TableMemory;

/// Model of a flash memory with words of `WRITE` bytes and pages of `ERASE` bytes. Its content is stored in `B`.
#[derive(Clone, Debug)]
pub struct FlashModel<B, const WRITE: usize, const ERASE: usize> {
    bytes: B,
    power: Power,
}

/// State of the power supply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Power {
    On,
    /// Power fails during a flash operation, after this number of complete ones. The seed `noise` determines the bits
    /// left behind.
    FailsAfter {
        operations: u32,
        noise: u64,
    },
    Off,
}

/// Outcome of a write or erase of the modelled flash: done, or interrupted by a loss of power.
enum Fate {
    Done,
    Cut(Noise),
}

/// Pseudo-random bits (xorshift64) that a loss of power leaves in a word or page.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// A pseudo-random number from 0 to `bound` − 1; 0 if `bound` is 0.
    fn below(&mut self, bound: usize) -> usize {
        if bound == 0 {
            0
        } else {
            (self.next() % bound as u64) as usize
        }
    }

    /// The value of a flash byte after a loss of power during its change: the old value, the new value, or a mixture of
    /// their bits.
    fn between(&mut self, before: u8, wanted: u8) -> u8 {
        match self.below(3) {
            0 => before,
            1 => wanted,
            _ => {
                let changed = (before ^ wanted) & self.next() as u8;
                before ^ changed
            }
        }
    }
}

impl<B: AsRef<[u8]> + AsMut<[u8]>, const WRITE: usize, const ERASE: usize> FlashModel<B, WRITE, ERASE> {
    /// A flash memory with this content. In erased flash all bits are ones.
    pub const fn new(bytes: B) -> Self {
        Self {
            bytes,
            power: Power::On,
        }
    }

    /// Lets the power fail during a write or an erase, after the next `operations` complete ones.
    ///
    /// The seed `noise` determines the content after the interruption. An interrupted write leaves the earlier words
    /// written, at most one word with a mixture of old and new bits, and the rest unchanged. An interrupted erase
    /// leaves any value in every byte of the erased pages. All later writes and erases fail.
    pub fn fail_after(&mut self, operations: u32, noise: u64) {
        // The seed is made non-zero, because a xorshift generator cannot leave the state 0.
        self.power = Power::FailsAfter {
            operations,
            noise: noise.max(1),
        };
    }

    /// True after the power of the modelled flash has failed.
    pub fn is_off(&self) -> bool {
        self.power == Power::Off
    }

    /// The content of the modelled flash, also after a loss of power.
    pub fn into_bytes(self) -> B {
        self.bytes
    }

    fn next_operation(&mut self) -> Result<Fate, NorFlashErrorKind> {
        match self.power {
            Power::On => Ok(Fate::Done),
            Power::Off => Err(NorFlashErrorKind::Other),
            Power::FailsAfter { operations: 0, noise } => {
                self.power = Power::Off;
                Ok(Fate::Cut(Noise(noise)))
            }
            Power::FailsAfter { operations, noise } => {
                self.power = Power::FailsAfter {
                    operations: operations - 1,
                    noise,
                };
                Ok(Fate::Done)
            }
        }
    }

    fn range(&mut self, from: u32, to: usize) -> Result<&mut [u8], NorFlashErrorKind> {
        self.bytes
            .as_mut()
            .get_mut(from as usize..to)
            .ok_or(NorFlashErrorKind::OutOfBounds)
    }
}

impl<B, const WRITE: usize, const ERASE: usize> ErrorType for FlashModel<B, WRITE, ERASE> {
    type Error = NorFlashErrorKind;
}

impl<B: AsRef<[u8]> + AsMut<[u8]>, const WRITE: usize, const ERASE: usize> ReadNorFlash
    for FlashModel<B, WRITE, ERASE>
{
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, bytes.len())?;
        bytes.copy_from_slice(self.range(offset, offset as usize + bytes.len())?);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.as_ref().len()
    }
}

impl<B: AsRef<[u8]> + AsMut<[u8]>, const WRITE: usize, const ERASE: usize> NorFlash
    for FlashModel<B, WRITE, ERASE>
{
    const WRITE_SIZE: usize = WRITE;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        let fate = self.next_operation()?;
        let bytes = self.range(from, to as usize)?;
        match fate {
            Fate::Done => {
                bytes.fill(0xFF);
                Ok(())
            }
            Fate::Cut(mut noise) => {
                // An interrupted erase leaves bytes between the old value and 0xFF, or random ones; in one of four
                // cases all bytes keep the old value.
                let is_as_before = noise.below(4) == 0;
                for byte in bytes.iter_mut().filter(|_| !is_as_before) {
                    *byte = match noise.below(2) {
                        0 => noise.between(*byte, 0xFF),
                        _ => noise.next() as u8,
                    };
                }
                Err(NorFlashErrorKind::Other)
            }
        }
    }

    fn write(&mut self, offset: u32, data: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, data.len())?;
        let fate = self.next_operation()?;
        let bytes = self.range(offset, offset as usize + data.len())?;
        if bytes.iter().any(|&byte| byte != 0xFF) {
            return Err(NorFlashErrorKind::Other);
        }
        match fate {
            Fate::Done => {
                bytes.copy_from_slice(data);
                Ok(())
            }
            Fate::Cut(mut noise) => {
                let cut = noise.below(data.len() / WRITE + 1) * WRITE;
                for (index, (byte, wanted)) in bytes.iter_mut().zip(data).enumerate() {
                    if index < cut {
                        *byte = *wanted;
                    } else if index < cut + WRITE {
                        *byte = noise.between(*byte, *wanted);
                    }
                }
                Err(NorFlashErrorKind::Other)
            }
        }
    }
}

impl<B: AsRef<[u8]> + AsMut<[u8]>, const WRITE: usize, const ERASE: usize> TableMemory
    for FlashModel<B, WRITE, ERASE>
{
    fn mapped(&self) -> &[u8] {
        self.bytes.as_ref()
    }
}
