//! The CRC-32 checksum of lobe tables and protocol frames.

use crc::{CRC_32_ISO_HDLC, Crc, Digest, Table};

const CRC_32: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// CRC-32 (ISO-HDLC, as in zip and Ethernet) of the concatenation of several byte slices.
///
/// It detects every single-bit error and every error burst of up to 32 bits.
pub fn crc32<'a>(pieces: impl IntoIterator<Item = &'a [u8]>) -> u32 {
    let mut crc = Crc32::new();
    for piece in pieces {
        crc.update(piece);
    }
    crc.value()
}

/// An incremental CRC-32.
#[derive(Clone)]
pub struct Crc32(Digest<'static, u32, Table<1>>);

impl Default for Crc32 {
    fn default() -> Self {
        Self::new()
    }
}

impl Crc32 {
    /// The CRC-32 checksum before the first byte of data.
    pub fn new() -> Self {
        static ENGINE: Crc<u32, Table<1>> = CRC_32;
        Self(ENGINE.digest())
    }

    /// Appends bytes to the data of the CRC-32 checksum.
    pub fn update(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// The CRC-32 checksum of all appended bytes.
    pub fn value(&self) -> u32 {
        self.0.clone().finalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_check_value_of_the_catalogue() {
        assert_eq!(crc32([b"123456789".as_slice()]), 0xCBF4_3926);
        assert_eq!(crc32([b"1234".as_slice(), b"", b"56789"]), 0xCBF4_3926);
    }
}
