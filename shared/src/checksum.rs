//! The checksum of tables and frames.

use crc::{CRC_32_ISO_HDLC, Crc, Digest, Table};

const CRC_32: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// CRC-32 (ISO-HDLC, the one of zip and Ethernet) of several pieces, as if they stood one behind the other.
///
/// It finds every single flipped bit and every burst of up to 32 bits.
pub fn crc32<'a>(pieces: impl IntoIterator<Item = &'a [u8]>) -> u32 {
    let mut digest = digest();
    for piece in pieces {
        digest.update(piece);
    }
    digest.finalize()
}

/// A CRC-32 under way.
fn digest() -> Digest<'static, u32, Table<1>> {
    static ENGINE: Crc<u32, Table<1>> = CRC_32;
    ENGINE.digest()
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
