//! The protocol between host and device: postcard, CRC-32 and COBS, with sequence numbers and a version handshake.
//!
//! ```text
//! Request ─ postcard ─► body ─► [version][sequence][body][CRC-32] ─ COBS ─► bytes 00   host to device
//!                                                                                       device to host: Response
//! ```
//!
//! Rules of the dialogue:
//! - The host sends one [`Request`] at a time and waits for the [`Response::Reply`] with the request's sequence
//!   number. After a timeout it sends the same frame again, *with the same sequence number*. A device that has
//!   already done the request does not do it again, but repeats its reply; only `Hello` is done again.
//! - A session begins with [`Request::Hello`], which may have any sequence number. Each further request has the next
//!   number, modulo 2¹⁶. The device refuses any other number with [`FrameError::OutOfOrder`] and waits for the
//!   expected number or another `Hello`.
//! - The device numbers all its frames (replies, reports, spectra, strobes) in one sequence of its own. A jump means
//!   that frames were lost on the line.
//! - The device answers an unreadable frame with [`Response::FrameRefused`] and counts it in [`Status`].
//!
//! [`frame`] specifies the bytes, [`version`] the rules for changes.

pub mod frame;
pub mod message;
pub mod version;

pub use frame::{Decoder, Frame, FrameError, FrameErrors, MAX_FRAME, Sequence, encode};
pub use message::{
    Feed, Info, Refusal, Reply, Reports, Request, Response, Slot, SpectrumChunk, Status, StrobeChunk,
    Subscription, TableSummary, Upload,
};
pub use version::VERSION;
