//! Feeding of recorded or simulated samples to the signal chain of a device in place of its sensor.

use heapless::Vec;
use quietcut_core::acceleration::Block;
use quietcut_core::protocol::message::{MAX_EDGES, MAX_FEED_EDGES};
use quietcut_core::protocol::{Feed, Request};
use quietcut_core::tachometer::Edge;

use super::DeviceError;
use super::client::Client;

impl Client {
    /// Feeds one block and the tachometer edges up to the end of the block; returns after the signal chain has
    /// processed the block. Its subscribed events are then available from [`next_event`](Self::next_event).
    ///
    /// # Errors
    /// The port fails, or the device does not answer or refuses the block or the edges.
    pub fn feed(&mut self, block: &Block, edges: &[Edge]) -> Result<(), DeviceError> {
        let (before, with) = edges.split_at(edges.len().saturating_sub(MAX_FEED_EDGES));
        for some in before.chunks(MAX_EDGES) {
            let some = Vec::try_from(some).map_err(|_| DeviceError::TooLarge { request: "edges" })?;
            self.command(&Request::FeedEdges(some), "edges")?;
        }
        let with = Vec::try_from(with).map_err(|_| DeviceError::TooLarge { request: "edges" })?;
        self.command(&Request::Feed(Feed::new(block, with)), "block")
    }
}
