//! Tables to upload, blocks to feed, and a line between a host and a device.
#![allow(dead_code)] // Each test file uses its part of it.

#[path = "../../../tests/support/small_table.rs"]
mod small_table;

use std::collections::VecDeque;
use std::convert::Infallible;

use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};
use quietcut_core::acceleration::{Block, Sensor};
use quietcut_core::lobes::LobeTable;
use quietcut_core::monitor::Settings;
use quietcut_core::protocol::{self, Decoder, FrameError, MAX_FRAME, Request, Response};
use quietcut_core::tachometer::{Edge, Wheel};
use quietcut_core::units::Nanoseconds;
use quietcut_core::working_point::Tool;

pub(crate) use small_table::table;

/// The bytes of a table after its header.
pub(crate) fn content_of(table: &LobeTable) -> Vec<u8> {
    table.bytes()[32..].to_vec()
}

/// Settings of a tool with two teeth and one mark per revolution.
pub(crate) const SETTINGS: Settings = Settings {
    sensor: Sensor::IIS3DWB_16G,
    tool: Tool { teeth: 2 },
    wheel: Some(Wheel {
        positions: 1,
        missing: 0,
    }),
    assumed_speed: None,
    limits: None,
};

/// Blocks of a signal with some tones, and the tachometer edges within each block, at 1 200 rev/min.
pub(crate) fn blocks(count: u32) -> Vec<(Block, Vec<Edge>)> {
    const SAMPLE_NS: u64 = 37_500;
    const TURN_NS: u64 = 50_000_000;
    (0..count)
        .map(|sequence| {
            let first = u64::from(sequence) * 64;
            let time_of = |sample: u64| sample * SAMPLE_NS;
            let counts = (first..first + 64)
                .map(|sample| {
                    let t_s = time_of(sample) as f64 * 1e-9;
                    let tone = |hz: f64, size: f64| size * (std::f64::consts::TAU * hz * t_s).sin();
                    [tone(40.0, 900.0) + tone(693.0, 300.0), tone(17.4, 500.0), 2000.0]
                        .map(|value| value as i16)
                })
                .collect();
            let (from, to) = (time_of(first), time_of(first + 64));
            let edges = (from.div_ceil(TURN_NS)..to.div_ceil(TURN_NS)).map(|turn| Edge {
                time: Nanoseconds(turn * TURN_NS),
            });
            (
                Block {
                    sequence,
                    time: Nanoseconds(from),
                    lost: 0,
                    clipped: 0,
                    counts,
                },
                edges.collect(),
            )
        })
        .collect()
}

/// The line at the device's end. It accepts a given number of bytes, then none until the number is raised.
#[derive(Default)]
pub(crate) struct Wire {
    pub(crate) to_device: VecDeque<u8>,
    pub(crate) from_device: Vec<u8>,
    /// Number of bytes that the line still accepts; `None` for any number.
    pub(crate) takes: Option<usize>,
}

impl ErrorType for Wire {
    type Error = Infallible;
}

impl Read for Wire {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        assert!(!self.to_device.is_empty(), "a read that would wait");
        let count = buffer.len().min(self.to_device.len());
        for (slot, byte) in buffer.iter_mut().zip(self.to_device.drain(..count)) {
            *slot = byte;
        }
        Ok(count)
    }
}

impl ReadReady for Wire {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(!self.to_device.is_empty())
    }
}

impl Write for Wire {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let count = bytes.len().min(self.takes.unwrap_or(usize::MAX));
        assert!(count > 0, "a write that would wait");
        self.takes = self.takes.map(|takes| takes - count);
        self.from_device.extend_from_slice(&bytes[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl WriteReady for Wire {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.takes != Some(0))
    }
}

/// The host's end of the line: encodes requests, decodes responses.
#[derive(Default)]
pub(crate) struct Host {
    pub(crate) next: u16,
    decoder: Decoder,
    /// Sequence numbers of the frames from the device.
    pub(crate) sequences: Vec<u16>,
}

impl Host {
    /// The frame of the next request, and its sequence number.
    pub(crate) fn frame(&mut self, request: &Request) -> (u16, Vec<u8>) {
        let sequence = self.next;
        self.next = sequence.wrapping_add(1);
        (sequence, frame(request, sequence))
    }

    /// Decodes the bytes that the device has sent.
    pub(crate) fn receive(&mut self, wire: &mut Wire) -> Vec<Response> {
        let mut responses = Vec::new();
        for byte in wire.from_device.drain(..) {
            if let Some(result) = self.decoder.push(byte) {
                let frame = result.unwrap();
                self.sequences.push(frame.sequence);
                responses.push(frame.message().unwrap());
            }
        }
        responses
    }
}

/// The frame of a request with this sequence number.
pub(crate) fn frame(request: &Request, sequence: u16) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME];
    protocol::encode(request, sequence, &mut buffer).unwrap().to_vec()
}

/// The first frame error that the device has reported.
pub(crate) fn refused_frame(responses: &[Response]) -> Option<FrameError> {
    responses.iter().find_map(|response| match response {
        Response::FrameRefused(error) => Some(*error),
        _ => None,
    })
}
