//! Host that sends arbitrary bytes, valid or invalid.

use std::time::{Duration, Instant};

use quietcut::device::port::Port;
use quietcut_core::protocol::{Decoder, MAX_FRAME, Reply, Request, Response, encode};

/// Longest wait for a response: a choice that allows for the emulator on a busy machine.
const PATIENCE: Duration = Duration::from_secs(30);
const SECOND: Duration = Duration::from_secs(1);

/// Host at a port that sends bytes and receives responses one by one.
pub struct RawHost {
    port: Box<dyn Port>,
    decoder: Decoder,
}

impl RawHost {
    /// Creates a host at this port.
    pub fn new(port: Box<dyn Port>) -> Self {
        Self {
            port,
            decoder: Decoder::new(),
        }
    }

    /// Sends bytes.
    pub fn send(&mut self, bytes: &[u8]) {
        self.port.send(bytes, SECOND).expect("the line takes bytes");
    }

    /// Receives the next response.
    pub fn receive(&mut self) -> Response {
        let began = Instant::now();
        while began.elapsed() < PATIENCE {
            // Reads one byte at a time, so that bytes after the frame remain for the next call.
            let mut byte = [0];
            if self.port.receive(&mut byte, SECOND).expect("the line holds") == 1
                && let Some(frame) = self.decoder.push(byte[0])
            {
                return frame.expect("a whole frame").message().expect("a response");
            }
        }
        panic!("the device says nothing within {PATIENCE:?}");
    }

    /// Sends a request with this sequence number and returns its reply.
    pub fn ask(&mut self, number: u16, request: &Request) -> Reply {
        self.send(&frame(number, request));
        match self.receive() {
            Response::Reply { request, reply } if request == number => reply,
            other => panic!("{other:?}"),
        }
    }
}

/// Encodes a request with this sequence number as a frame.
pub fn frame(number: u16, request: &Request) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME];
    encode(request, number, &mut buffer)
        .expect("a request fits a frame")
        .to_vec()
}

/// Valid frame except for its protocol version.
pub fn frame_of_version(version: u8, number: u16) -> Vec<u8> {
    let [low, high] = number.to_le_bytes();
    let mut raw = vec![version, low, high, 0];
    raw.extend(quietcut_core::checksum::crc32([&raw[..]]).to_le_bytes());
    // COBS encoding: each zero byte is replaced by the distance to the next one.
    let mut cobs = Vec::new();
    for part in raw.split(|&byte| byte == 0) {
        cobs.push(part.len() as u8 + 1);
        cobs.extend(part);
    }
    cobs.push(0);
    cobs
}
