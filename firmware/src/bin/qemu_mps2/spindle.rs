//! Receiver of the simulated signals of the emulated board, in place of sensor and tachometer.

use heapless::Vec;
use quietcut_core::protocol::message::MAX_BLOCK_EDGES;
use quietcut_core::tachometer::Edge;
use quietcut_firmware::device::Device;
use quietcut_firmware::stimulus::{MAX_FRAME_BYTES, MEMORY_BYTES, REFUSED, STORE_OFFSET, Stimulus, TAKEN};

use crate::clock::BoardClock;
use crate::cost::Cost;
use crate::flash::{Flash, PSRAM_BASE};
use crate::uart::Uart;

/// Receiver of stimuli (simulated sample blocks and tachometer edges), which passes them to the device.
pub(crate) struct Spindle {
    frame: Vec<u8, MAX_FRAME_BYTES>,
    /// True while the rest of a stimulus frame that is too long is skipped.
    is_skipping: bool,
    /// Tachometer edges that arrived for the next block of samples, in order of arrival.
    edges: Vec<Edge, MAX_BLOCK_EDGES>,
    /// Measured costs of the device.
    pub(crate) cost: Cost,
}

type BoardDevice = Device<'static, Flash, BoardClock>;

impl Spindle {
    pub(crate) fn new(cost: Cost) -> Self {
        Self {
            frame: Vec::new(),
            is_skipping: false,
            edges: Vec::new(),
            cost,
        }
    }

    /// Processes a byte from the stimulus port. Returns the byte that answers a frame at the end of the frame, or as
    /// soon as the frame is too long.
    pub(crate) fn take(&mut self, byte: u8, device: &mut BoardDevice, line: &mut Uart) -> Option<u8> {
        if self.is_skipping {
            self.is_skipping = byte != 0;
            return None;
        }
        if self.frame.push(byte).is_err() {
            self.frame.clear();
            self.is_skipping = byte != 0;
            return Some(REFUSED);
        }
        if byte != 0 {
            return None;
        }
        let stimulus = postcard::from_bytes_cobs(&mut self.frame);
        self.frame.clear();
        let is_done = match stimulus {
            Ok(Stimulus::Stored { bytes }) => self.play(bytes as usize, device, line),
            Ok(stimulus) => self.give(stimulus, device, line),
            Err(_) => None,
        };
        Some(if is_done.is_some() { TAKEN } else { REFUSED })
    }

    /// Passes the stimuli that the first `bytes` bytes of the store in the board's memory contain to the device;
    /// `None` if the store is shorter, and as soon as one stimulus is unreadable or refused.
    fn play(&mut self, bytes: usize, device: &mut BoardDevice, line: &mut Uart) -> Option<()> {
        if bytes > MEMORY_BYTES - STORE_OFFSET {
            return None;
        }
        // SAFETY: the range of stored stimuli lies within the PSRAM, where the linker places nothing. The host does not
        // write to it between its message and the answer.
        let mut rest =
            unsafe { core::slice::from_raw_parts((PSRAM_BASE + STORE_OFFSET) as *const u8, bytes) };
        while !rest.is_empty() {
            let (stimulus, after) = postcard::take_from_bytes(rest).ok()?;
            self.give(stimulus, device, line)?;
            rest = after;
        }
        Some(())
    }

    /// Processes a stimulus: keeps a tachometer edge for the next block, passes a block of samples to the device, or
    /// logs the costs. `None` if it is refused: too many edges, or [`Stimulus::Stored`].
    fn give(&mut self, stimulus: Stimulus, device: &mut BoardDevice, line: &mut Uart) -> Option<()> {
        match stimulus {
            Stimulus::Edge(edge) => self.edges.push(edge).ok()?,
            Stimulus::Block(block) => {
                self.cost.of_block(|| device.take(&block, &self.edges));
                self.edges.clear();
                // Waits until all messages of the device are sent, so that no report is dropped. A simulated spindle
                // can wait.
                loop {
                    let Ok(is_busy) = device.poll(line);
                    if !is_busy && device.outgoing().is_empty() {
                        break;
                    }
                }
            }
            Stimulus::AskCost => self.cost.log(),
            Stimulus::Stored { .. } => return None,
        }
        Some(())
    }
}
