//! A host that says what it likes, right or wrong.

use std::time::{Duration, Instant};

use quietcut::device::port::Port;
use quietcut_core::protocol::{Decoder, MAX_FRAME, Reply, Request, Response, encode};

/// The longest wait for a response: the emulator on a busy machine.
const PATIENCE: Duration = Duration::from_secs(30);
const SECOND: Duration = Duration::from_secs(1);

/// A host at a port that sends bytes and hears responses one by one.
pub struct RawHost {
    port: Box<dyn Port>,
    decoder: Decoder,
}

impl RawHost {
    /// A host at this port.
    pub fn new(port: Box<dyn Port>) -> Self {
        Self {
            port,
            decoder: Decoder::new(),
        }
    }

    /// Sends bytes.
    pub fn say(&mut self, bytes: &[u8]) {
        self.port.send(bytes, SECOND).expect("the line takes bytes");
    }

    /// The next response.
    pub fn hear(&mut self) -> Response {
        let began = Instant::now();
        while began.elapsed() < PATIENCE {
            // One byte at a time: what comes behind the frame is left for the next call.
            let mut byte = [0];
            if self.port.receive(&mut byte, SECOND).expect("the line holds") == 1
                && let Some(frame) = self.decoder.push(byte[0])
            {
                return frame.expect("a whole frame").message().expect("a response");
            }
        }
        panic!("the device says nothing within {PATIENCE:?}");
    }

    /// The reply to a request under this sequence number.
    pub fn ask(&mut self, number: u16, request: &Request) -> Reply {
        self.say(&frame(number, request));
        match self.hear() {
            Response::Reply { request, reply } if request == number => reply,
            other => panic!("{other:?}"),
        }
    }
}

/// The frame of a request under this sequence number.
pub fn frame(number: u16, request: &Request) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME];
    encode(request, number, &mut buffer)
        .expect("a request fits a frame")
        .to_vec()
}

/// A frame that is right in all but its version.
pub fn frame_of_version(version: u8, number: u16) -> Vec<u8> {
    let [low, high] = number.to_le_bytes();
    let mut raw = vec![version, low, high, 0];
    raw.extend(quietcut_core::checksum::crc32([&raw[..]]).to_le_bytes());
    // COBS by hand: each zero is replaced by the distance to the next.
    let mut cobs = Vec::new();
    for part in raw.split(|&byte| byte == 0) {
        cobs.push(part.len() as u8 + 1);
        cobs.extend(part);
    }
    cobs.push(0);
    cobs
}
