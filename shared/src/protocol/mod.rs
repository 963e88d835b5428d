//! The wire: postcard + CRC-32 + COBS, with sequence numbers and a version handshake.
