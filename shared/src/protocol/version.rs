//! The version of the protocol, and what it stands for.
//!
//! Every frame begins with the version that its body is written in. The layout of the frame itself (version,
//! sequence number, CRC-32, COBS) is the same in all versions, so that whoever reads a frame of another version knows that it is one:
//! [`FrameError::Version`](super::FrameError::Version) carries both.
//!
//! What changes the bytes of a body, be it a field, a variant in the middle or the type of a number, needs a new
//! version: raise [`VERSION`] and add its frozen bytes to `shared/tests/protocol.rs`. A new variant at the end of an enum does not
//! change the bytes of the others and needs none; who does not know it answers
//! [`FrameError::UnknownMessage`](super::FrameError::UnknownMessage) or [`FrameError::Body`](super::FrameError::Body).

/// The version that this code speaks.
pub const VERSION: u8 = 1;
