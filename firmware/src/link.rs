//! The device's end of the serial line: frames to and from the host, without blocking.

use embedded_io::{Read, ReadReady, Write, WriteReady};
use heapless::Deque;
use quietcut_core::protocol::{
    Decoder, FrameError, FrameErrors, MAX_FRAME, Request, Response, Sequence, encode,
};

/// Capacity in bytes of the output queue to the host: four frames of the largest length.
const OUTGOING: usize = 4 * MAX_FRAME;

/// A received request with its sequence number, or the reason why its frame is refused.
pub type Received = Result<(u16, Request), FrameError>;

/// The device's end of the serial line to the host.
pub struct Link {
    decoder: Decoder,
    sent: Sequence,
    outgoing: Deque<u8, OUTGOING>,
    frames: u32,
    errors: FrameErrors,
}

impl Default for Link {
    fn default() -> Self {
        Self::new()
    }
}

impl Link {
    /// A link before the first byte is received or sent.
    pub const fn new() -> Self {
        Self {
            decoder: Decoder::new(),
            sent: Sequence::from(0),
            outgoing: Deque::new(),
            frames: 0,
            errors: FrameErrors {
                too_long: 0,
                cobs: 0,
                too_short: 0,
                crc: 0,
                version: 0,
                unknown_message: 0,
                body: 0,
                trailing_bytes: 0,
                out_of_order: 0,
            },
        }
    }

    /// Processes received bytes up to the end of the first frame. Returns the number of bytes processed, and the
    /// request, or the refusal of its frame, if a frame is complete.
    pub fn receive(&mut self, bytes: &[u8]) -> (usize, Option<Received>) {
        for (index, &byte) in bytes.iter().enumerate() {
            let Some(result) = self.decoder.push(byte) else {
                continue;
            };
            let result = result.and_then(|frame| Ok((frame.sequence, frame.message()?)));
            match &result {
                Ok(_) => self.frames = self.frames.saturating_add(1),
                Err(error) => self.errors.count(error),
            }
            return (index + 1, Some(result));
        }
        (bytes.len(), None)
    }

    /// Counts a refused frame that was readable, but whose sequence number is not the expected one.
    pub fn count(&mut self, error: &FrameError) {
        self.errors.count(error);
    }

    /// Number of readable frames received.
    pub fn frames(&self) -> u32 {
        self.frames
    }

    /// Numbers of refused frames, counted for each reason of the refusal.
    pub fn errors(&self) -> &FrameErrors {
        &self.errors
    }

    /// Number of frames of the largest length for which the output queue has room.
    pub fn room(&self) -> usize {
        (OUTGOING - self.outgoing.len()) / MAX_FRAME
    }

    /// Appends the frame of a response to the output queue. Returns false if the queue has no room for a frame of the
    /// largest length, or the response is too large for a frame.
    pub fn send(&mut self, response: &Response) -> bool {
        let mut buffer = [0; MAX_FRAME];
        if self.room() == 0 {
            return false;
        }
        let Ok(frame) = encode(response, self.sent.take(), &mut buffer) else {
            return false;
        };
        frame.iter().all(|&byte| self.outgoing.push_back(byte).is_ok())
    }

    /// The bytes in the output queue of the link, or the first part of them.
    pub fn outgoing(&self) -> &[u8] {
        match self.outgoing.as_slices() {
            ([], second) => second,
            (first, _) => first,
        }
    }

    /// Removes the first `count` bytes of [`outgoing`](Self::outgoing), after the caller has sent them.
    pub fn sent(&mut self, count: usize) {
        for _ in 0..count {
            self.outgoing.pop_front();
        }
    }

    /// Sends as many bytes of the output queue as the line accepts without blocking. Returns true if it accepted any.
    ///
    /// # Errors
    /// Writing to the line fails.
    pub fn flush<IO: Write + WriteReady>(&mut self, io: &mut IO) -> Result<bool, IO::Error> {
        let mut is_busy = false;
        while !self.outgoing().is_empty() && io.write_ready()? {
            let count = io.write(self.outgoing())?;
            if count == 0 {
                break;
            }
            self.sent(count);
            is_busy = true;
        }
        Ok(is_busy)
    }
}

/// A serial line to the host as a non-blocking byte stream in both directions.
pub trait Line: Read + ReadReady + Write + WriteReady {}

impl<T: Read + ReadReady + Write + WriteReady> Line for T {}
