//! The protocol version, and the changes that require a new one.
//!
//! Every frame begins with the version of its body. The layout of the frame itself (version, sequence number, CRC-32,
//! COBS) is the same in all versions. A reader therefore recognizes a frame of another version and reports both
//! versions in [`FrameError::Version`](super::FrameError::Version).
//!
//! A change of the bytes of a body (a new field, a variant inserted in the middle, another number type) requires a
//! new version: raise [`VERSION`] and add its frozen bytes to `shared/tests/protocol.rs`. A new variant at the end of
//! an enum leaves all other bytes unchanged and requires none; an older receiver answers
//! [`FrameError::UnknownMessage`](super::FrameError::UnknownMessage) or
//! [`FrameError::Body`](super::FrameError::Body).

/// The protocol version of this code.
pub const VERSION: u8 = 1;
