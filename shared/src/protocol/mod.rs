//! The wire: postcard + CRC-32 + COBS, with sequence numbers and a version handshake.
//!
//! ```text
//! Request ─ postcard ─► body ─► [version][sequence][body][CRC-32] ─ COBS ─► bytes 00   host to device
//!                                                                                       device to host: Response
//! ```
//!
//! How a host talks to a device:
//! - It sends one [`Request`] at a time and waits for the [`Response::Reply`] with the request's sequence number. Where
//!   none comes it sends the same frame again, *with the same sequence number*: a device that has done the
//!   request already does not do it twice but repeats its reply.
//! - It begins with [`Request::Hello`], under any sequence number; the next request has the following number, and so on, around
//!   the end of 16 bits. A device refuses any other number with [`FrameError::OutOfOrder`] and waits for
//!   the right one, or for another `Hello`.
//! - What the device sends by itself (reports, spectra, strobes) it numbers with the replies in one count of its own. A
//!   jump in it means that frames were lost on the line.
//! - A frame that the device cannot read it answers with [`Response::FrameRefused`] and counts in [`Status`].
//!
//! [`frame`] documents the bytes, [`version`] what may change and how.

pub mod frame;
pub mod message;
pub mod version;

pub use frame::{Decoder, Frame, FrameError, FrameErrors, MAX_FRAME, Sequence, encode};
pub use message::{
    Feed, Info, Refusal, Reply, Reports, Request, Response, Slot, SpectrumChunk, Status, StrobeChunk,
    Subscription, TableSummary, Upload,
};
pub use version::VERSION;
