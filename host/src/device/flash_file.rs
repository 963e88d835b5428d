//! Flash memory of the simulated device, in memory or in a file that keeps its lobe tables.

use std::fs::File;
use std::io::{ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use quietcut_firmware::flash_model::FlashModel;
use quietcut_firmware::storage::TableMemory;

/// Size of the flash memory for lobe tables, bytes: the second bank of the NUCLEO-G474RE.
const FLASH_BYTES: usize = 256 * 1024;
/// Smallest writable unit of flash, bytes, as on the NUCLEO-G474RE.
const WORD: usize = 8;
/// Smallest erasable unit of flash, bytes, as on the NUCLEO-G474RE.
const PAGE: usize = 2048;
/// Value of an erased byte.
const ERASED: u8 = 0xff;

/// Failure of the state file of the simulated device.
#[derive(Debug, thiserror::Error)]
pub enum FlashFileError {
    /// The state file of the simulated device cannot be opened, read or created.
    #[error("{}: cannot use it as the memory of the simulated device: {cause}", path.display())]
    Access {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        cause: std::io::Error,
    },
    /// The state file of the simulated device has another length than its flash memory.
    #[error("{}: {found} bytes; a memory of the simulated device has {FLASH_BYTES}; name a new file to begin with an empty one", path.display())]
    Length {
        /// Path of the file.
        path: PathBuf,
        /// Length of the file, bytes.
        found: u64,
    },
}

/// Flash memory with the write and erase rules of the board. Every change is written at once to the state file, if
/// there is one, so that an aborted command loses no earlier change.
pub(super) struct FlashFile {
    flash: FlashModel<Vec<u8>, WORD, PAGE>,
    file: Option<File>,
}

impl FlashFile {
    /// Creates empty flash memory without a file.
    pub(super) fn in_memory() -> Self {
        Self {
            flash: FlashModel::new(vec![ERASED; FLASH_BYTES]),
            file: None,
        }
    }

    /// Opens the flash memory in the file at `path`; a missing file is created with erased flash.
    ///
    /// # Errors
    /// The file cannot be used, or has another length than the flash memory.
    pub(super) fn open(path: &Path) -> Result<Self, FlashFileError> {
        let access = |cause| FlashFileError::Access {
            path: path.into(),
            cause,
        };
        let opened = File::options().read(true).write(true).open(path);
        let mut file = match opened {
            Err(error) if error.kind() == ErrorKind::NotFound => {
                crate::file::write(path, &[ERASED; FLASH_BYTES])
                    .map_err(|error| access(std::io::Error::other(error.to_string())))?;
                File::options()
                    .read(true)
                    .write(true)
                    .open(path)
                    .map_err(access)?
            }
            other => other.map_err(access)?,
        };
        let found = file.metadata().map_err(access)?.len();
        if found != FLASH_BYTES as u64 {
            return Err(FlashFileError::Length {
                path: path.into(),
                found,
            });
        }
        let mut bytes = vec![0; FLASH_BYTES];
        file.read_exact(&mut bytes).map_err(access)?;
        Ok(Self {
            flash: FlashModel::new(bytes),
            file: Some(file),
        })
    }

    /// Writes the bytes of the flash memory from offset `from` to before `to` to the state file of the simulated
    /// device, if it has one.
    fn store(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        let Some(file) = &mut self.file else { return Ok(()) };
        let changed = self.flash.mapped().get(from as usize..to as usize);
        let changed = changed.ok_or(NorFlashErrorKind::OutOfBounds)?;
        file.seek(SeekFrom::Start(from.into()))
            .and_then(|_| file.write_all(changed))
            .map_err(|_| NorFlashErrorKind::Other)
    }
}

impl ErrorType for FlashFile {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for FlashFile {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        self.flash.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl NorFlash for FlashFile {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        self.flash.erase(from, to)?;
        self.store(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        self.flash.write(offset, bytes)?;
        self.store(offset, offset + bytes.len() as u32)
    }
}

impl TableMemory for FlashFile {
    fn mapped(&self) -> &[u8] {
        self.flash.mapped()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flash_writes_reach_the_file_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flash.bin");
        let mut flash = FlashFile::open(&path).unwrap();
        flash.write(4096, &[1, 2, 3, 4, 5, 6, 7, 8]).unwrap();
        flash.write(8192, &[0; 8]).unwrap();
        flash.erase(8192, 8192 + PAGE as u32).unwrap();
        // A word can be written only once after an erasure.
        assert!(flash.write(4096, &[0; 8]).is_err());
        let mut again = FlashFile::open(&path).unwrap();
        let mut bytes = [0; 10];
        again.read(4096, &mut bytes).unwrap();
        assert_eq!(bytes, [1, 2, 3, 4, 5, 6, 7, 8, ERASED, ERASED]);
        assert_eq!(again.mapped(), flash.mapped());
        assert_eq!(again.mapped()[8192], ERASED);
    }

    #[test]
    fn a_file_of_another_kind_is_not_changed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("case.toml");
        std::fs::write(&path, "name = 1").unwrap();
        assert!(matches!(
            FlashFile::open(&path),
            Err(FlashFileError::Length { found: 8, .. })
        ));
        assert_eq!(std::fs::read(&path).unwrap(), b"name = 1");
        let missing = FlashFile::open(&folder.path().join("no/such.bin"));
        assert!(matches!(missing, Err(FlashFileError::Access { .. })));
    }
}
