//! Frames: delimiter, version, sequence number and CRC-32 around a message.
//!
//! | bytes | before COBS |
//! |---|---|
//! | 1 | version of the protocol, [`VERSION`] |
//! | 2 | sequence number, little-endian |
//! | 1 … [`MAX_BODY`] | body: the message in postcard |
//! | 4 | CRC-32 of all preceding bytes, little-endian |
//!
//! COBS removes zero bytes, and one zero byte ends the frame. Zeros between frames are ignored. After connecting, a
//! host sends one zero to end a frame that noise may have begun.

use cobs::{DecodeResult, DecoderState};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use super::version::VERSION;
use crate::checksum::crc32;

/// Largest length of the body of a frame, in bytes.
pub const MAX_BODY: usize = 512;

const HEADER: usize = 3;
const CRC: usize = 4;
/// Largest length of a frame before COBS encoding, in bytes.
const MAX_RAW: usize = HEADER + MAX_BODY + CRC;

/// Largest length of a frame on the wire, in bytes, with the closing zero: COBS adds one byte, and another for
/// every 254.
pub const MAX_FRAME: usize = MAX_RAW + MAX_RAW / 254 + 1 + 1;

/// A message: a type that can be sent as the body of a frame.
pub trait Message: Serialize + DeserializeOwned {
    /// Number of variants of the message type. The first byte of the body is the index of the variant.
    const VARIANTS: u8;
}

/// The reason why a received frame is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FrameError {
    /// More bytes arrived than a frame may have, without a closing zero.
    TooLong {
        /// Largest length of a frame before COBS encoding, in bytes.
        limit: u16,
    },
    /// The bytes are not valid COBS (consistent overhead byte stuffing).
    Cobs,
    /// The frame has fewer bytes than the version, the sequence number, a body of one byte and the CRC take.
    TooShort {
        /// Bytes found.
        found: u8,
    },
    /// The CRC-32 of the frame does not match: bytes were changed on the line.
    Crc {
        /// The CRC in the frame.
        frame: u32,
        /// The CRC-32 computed from the bytes of the frame.
        computed: u32,
    },
    /// The frame was sent with another protocol version.
    Version {
        /// The version of this code.
        ours: u8,
        /// The version of the frame.
        theirs: u8,
    },
    /// An unknown message variant.
    UnknownMessage {
        /// The number of the variant.
        variant: u8,
    },
    /// The body of the frame is not a valid message of the variant that its first byte names.
    Body {
        /// The number of the variant.
        variant: u8,
    },
    /// Surplus bytes after the message.
    TrailingBytes {
        /// Number of surplus bytes.
        count: u16,
    },
    /// The sequence number of the frame is not the expected one: frames were lost, repeated or reordered.
    OutOfOrder {
        /// The expected sequence number.
        expected: u16,
        /// The sequence number of the frame that arrived.
        found: u16,
    },
}

impl core::fmt::Display for FrameError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TooLong { limit } => write!(f, "a frame without an end within {limit} bytes"),
            Self::Cobs => f.write_str("a frame that ends too soon (no valid COBS)"),
            Self::TooShort { found } => {
                write!(f, "a frame of {found} bytes: {} are the least", HEADER + 1 + CRC)
            }
            Self::Crc { frame, computed } => write!(
                f,
                "a frame that changed on the way: its CRC-32 is {computed:08x}, it says {frame:08x}"
            ),
            Self::Version { ours, theirs } => {
                write!(
                    f,
                    "a frame of protocol version {theirs}: this side speaks version {ours}"
                )
            }
            Self::UnknownMessage { variant } => write!(f, "an unknown message, number {variant}"),
            Self::Body { variant } => {
                write!(f, "message number {variant} with content that it cannot have")
            }
            Self::TrailingBytes { count } => write!(f, "{count} bytes behind the message"),
            Self::OutOfOrder { expected, found } => {
                write!(f, "frame number {found} where number {expected} was due")
            }
        }
    }
}

impl core::error::Error for FrameError {}

/// Number of refused frames, counted for each kind of [`FrameError`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FrameErrors {
    /// [`FrameError::TooLong`].
    pub too_long: u32,
    /// [`FrameError::Cobs`].
    pub cobs: u32,
    /// [`FrameError::TooShort`].
    pub too_short: u32,
    /// [`FrameError::Crc`].
    pub crc: u32,
    /// [`FrameError::Version`].
    pub version: u32,
    /// [`FrameError::UnknownMessage`].
    pub unknown_message: u32,
    /// [`FrameError::Body`].
    pub body: u32,
    /// [`FrameError::TrailingBytes`].
    pub trailing_bytes: u32,
    /// [`FrameError::OutOfOrder`].
    pub out_of_order: u32,
}

impl FrameErrors {
    /// Counts an error.
    pub fn count(&mut self, error: &FrameError) {
        let counter = match error {
            FrameError::TooLong { .. } => &mut self.too_long,
            FrameError::Cobs => &mut self.cobs,
            FrameError::TooShort { .. } => &mut self.too_short,
            FrameError::Crc { .. } => &mut self.crc,
            FrameError::Version { .. } => &mut self.version,
            FrameError::UnknownMessage { .. } => &mut self.unknown_message,
            FrameError::Body { .. } => &mut self.body,
            FrameError::TrailingBytes { .. } => &mut self.trailing_bytes,
            FrameError::OutOfOrder { .. } => &mut self.out_of_order,
        };
        *counter = counter.saturating_add(1);
    }

    /// Total number of errors.
    pub fn total(&self) -> u32 {
        [
            self.too_long,
            self.cobs,
            self.too_short,
            self.crc,
            self.version,
            self.unknown_message,
            self.body,
            self.trailing_bytes,
            self.out_of_order,
        ]
        .into_iter()
        .fold(0, u32::saturating_add)
    }
}

/// A message that is too large for a frame. All messages of this crate fit; a test checks the largest message of each
/// variant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooLarge;

/// Writes the frame of a message into `buffer` and returns its bytes, with the closing zero.
///
/// # Errors
/// [`TooLarge`] if the body has more than [`MAX_BODY`] bytes.
pub fn encode<'b, M: Message>(
    message: &M,
    sequence: u16,
    buffer: &'b mut [u8; MAX_FRAME],
) -> Result<&'b [u8], TooLarge> {
    let mut raw = [0; MAX_RAW];
    let [low, high] = sequence.to_le_bytes();
    raw[..HEADER].copy_from_slice(&[VERSION, low, high]);
    let body = raw.get_mut(HEADER..HEADER + MAX_BODY).ok_or(TooLarge)?;
    let body_length = postcard::to_slice(message, body).map_err(|_| TooLarge)?.len();
    let (content, rest) = raw.split_at_mut_checked(HEADER + body_length).ok_or(TooLarge)?;
    let crc = crc32([&*content]).to_le_bytes();
    rest.get_mut(..CRC).ok_or(TooLarge)?.copy_from_slice(&crc);

    let raw = raw.get(..HEADER + body_length + CRC).ok_or(TooLarge)?;
    let length = cobs::try_encode(raw, buffer).map_err(|_| TooLarge)?;
    *buffer.get_mut(length).ok_or(TooLarge)? = 0;
    buffer.get(..length + 1).ok_or(TooLarge)
}

/// A received frame with valid CRC and version.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// Sequence number of the frame.
    pub sequence: u16,
    body: &'a [u8],
}

impl Frame<'_> {
    /// Decodes the message in the frame.
    ///
    /// # Errors
    /// [`FrameError::UnknownMessage`], [`FrameError::Body`] or [`FrameError::TrailingBytes`] if the body is not exactly
    /// one message.
    pub fn message<M: Message>(&self) -> Result<M, FrameError> {
        let variant = self.body.first().copied().unwrap_or_default();
        if variant >= M::VARIANTS {
            return Err(FrameError::UnknownMessage { variant });
        }
        match postcard::take_from_bytes(self.body) {
            Ok((message, [])) => Ok(message),
            Ok((_, rest)) => Err(FrameError::TrailingBytes {
                count: rest.len() as u16,
            }),
            Err(_) => Err(FrameError::Body { variant }),
        }
    }
}

/// Decoder of a byte stream into frames.
///
/// After invalid bytes, decoding resumes after the next zero byte. Each run of invalid bytes gives one error.
#[derive(Debug)]
pub struct Decoder {
    state: DecoderState,
    raw: [u8; MAX_RAW],
    length: usize,
    /// True while the rest of a frame that is too long is skipped.
    is_skipping: bool,
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

impl Decoder {
    /// A frame decoder before its first byte.
    pub const fn new() -> Self {
        Self {
            state: DecoderState::Idle,
            raw: [0; MAX_RAW],
            length: 0,
            is_skipping: false,
        }
    }

    /// Takes a byte from the line. Returns the frame that it completes, or the reason why a frame is refused; `None` if
    /// neither.
    pub fn push(&mut self, byte: u8) -> Option<Result<Frame<'_>, FrameError>> {
        if self.is_skipping {
            self.is_skipping = byte != 0;
            return None;
        }
        match self.state.feed(byte) {
            Ok(DecodeResult::NoData) => None,
            Ok(DecodeResult::DataStart) => {
                self.length = 0;
                None
            }
            Ok(DecodeResult::DataContinue(byte)) => match self.raw.get_mut(self.length) {
                Some(slot) => {
                    *slot = byte;
                    self.length += 1;
                    None
                }
                None => {
                    self.state = DecoderState::Idle;
                    self.is_skipping = true;
                    Some(Err(FrameError::TooLong {
                        limit: MAX_RAW as u16,
                    }))
                }
            },
            Ok(DecodeResult::DataComplete) => Some(open(self.raw.get(..self.length).unwrap_or_default())),
            Err(_) => {
                // The decoder found a zero byte within a frame. The COBS decoder is idle again, so the next byte begins
                // a new frame.
                Some(Err(FrameError::Cobs))
            }
        }
    }
}

/// Checks length, CRC and version of a frame. The version comes last, because that of a damaged frame has no meaning.
fn open(raw: &[u8]) -> Result<Frame<'_>, FrameError> {
    let too_short = FrameError::TooShort {
        found: raw.len() as u8,
    };
    let (content, crc) = raw.split_last_chunk::<CRC>().ok_or(too_short)?;
    let (&[theirs, low, high], body) = content.split_first_chunk::<HEADER>().ok_or(too_short)?;
    if body.is_empty() {
        return Err(too_short);
    }
    let (frame, computed) = (u32::from_le_bytes(*crc), crc32([content]));
    if frame != computed {
        return Err(FrameError::Crc { frame, computed });
    }
    if theirs != VERSION {
        return Err(FrameError::Version {
            ours: VERSION,
            theirs,
        });
    }
    Ok(Frame {
        sequence: u16::from_le_bytes([low, high]),
        body,
    })
}

/// The sequence numbers of the frames in one direction of the line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sequence {
    due: Option<u16>,
}

impl Sequence {
    /// The sequence numbers of frames whose next frame has the number `next`.
    pub const fn from(next: u16) -> Self {
        Self { due: Some(next) }
    }

    /// Returns the sequence number of the next frame to send. It is 0 for the first, unless another number
    /// was set.
    pub fn take(&mut self) -> u16 {
        let number = self.due.unwrap_or_default();
        self.due = Some(number.wrapping_add(1));
        number
    }

    /// Checks the sequence number of a received frame. If no number is expected yet, any is accepted.
    ///
    /// # Errors
    /// [`FrameError::OutOfOrder`] if `found` is not the expected number, which then stays the same.
    pub fn check(&mut self, found: u16) -> Result<(), FrameError> {
        match self.due {
            Some(expected) if expected != found => Err(FrameError::OutOfOrder { expected, found }),
            _ => {
                self.restart_after(found);
                Ok(())
            }
        }
    }

    /// Accepts a received frame with the sequence number `found`: the number after it is expected next.
    pub fn restart_after(&mut self, found: u16) {
        self.due = Some(found.wrapping_add(1));
    }
}
