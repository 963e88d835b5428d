//! Flash in ordinary memory, as strict as the real one, whose power can be cut.
//!
//! For tests and for the simulated device of the host. A page is erased to ones, a word may be written once
//! after that; what is not aligned, out of bounds or written twice is an error.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

use crate::storage::TableMemory;

/// Flash of words of `WRITE` and pages of `ERASE` bytes in the memory `B`.
#[derive(Clone, Debug)]
pub struct FlashModel<B, const WRITE: usize, const ERASE: usize> {
    bytes: B,
    power: Power,
}

/// How long power lasts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Power {
    On,
    /// Power fails within the operation behind this many more; what it leaves depends on the noise.
    FailsAfter {
        operations: u32,
        noise: u64,
    },
    Off,
}

/// What becomes of an operation.
enum Fate {
    Done,
    Cut(Noise),
}

/// What a loss of power leaves in a word or a page: pseudo-random bits (xorshift64).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// A value of any size, below `bound`.
    fn below(&mut self, bound: usize) -> usize {
        if bound == 0 {
            0
        } else {
            (self.next() % bound as u64) as usize
        }
    }

    /// A byte on its way from one value to another: as before, as wanted, or any bits between.
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
    /// Flash with this content; new flash is all ones.
    pub const fn new(bytes: B) -> Self {
        Self {
            bytes,
            power: Power::On,
        }
    }

    /// Lets the power fail within the operation (a write or an erase) behind the next `operations`.
    ///
    /// What that one leaves behind follows from `noise`: words before the cut are done, the one it falls into may hold any bits
    /// between before and after, those behind are untouched; of a page that is being erased every byte may be anything.
    /// Later operations fail.
    pub fn fail_after(&mut self, operations: u32, noise: u64) {
        // Xorshift stands still at 0.
        self.power = Power::FailsAfter {
            operations,
            noise: noise.max(1),
        };
    }

    /// True once the power has failed.
    pub fn is_off(&self) -> bool {
        self.power == Power::Off
    }

    /// The content, which outlives a loss of power.
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
                // Any content, or one that still looks as before.
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
