//! Virtual spindle of the simulated device: joins consecutive cuts on one clock.

use std::collections::VecDeque;
use std::sync::mpsc::Receiver;

use quietcut_core::acceleration::Block;
use quietcut_core::tachometer::Edge;
use quietcut_core::units::Nanoseconds;

use crate::simulate::SensedCut;

/// Block of acceleration samples with the tachometer edges that precede the next block.
pub(super) type Step = (Block, Vec<Edge>);

/// Joins cuts, each of which starts at its own time 0 and block 0, to one sequence of blocks.
pub(super) struct VirtualSpindle {
    cuts: Receiver<SensedCut>,
    steps: VecDeque<Step>,
    next_sequence: u32,
    next_time: u64,
}

impl VirtualSpindle {
    pub(super) fn new(cuts: Receiver<SensedCut>) -> Self {
        Self {
            cuts,
            steps: VecDeque::new(),
            next_sequence: 0,
            next_time: 0,
        }
    }

    /// Next block without removing it; `None` while the spindle stands still. A cut after a pause starts at `now`.
    pub(super) fn peek(&mut self, now: Nanoseconds) -> Option<&Step> {
        if self.steps.is_empty() {
            let sensed = self.cuts.try_recv().ok()?;
            // The sensor was off while the spindle stood still, so that a pause does not count as lost samples.
            self.next_time = self.next_time.max(now.0);
            self.append(sensed);
        }
        self.steps.front()
    }

    /// Removes and returns the block that [`peek`](Self::peek) shows; `None` if it has found none.
    pub(super) fn take(&mut self) -> Option<Step> {
        self.steps.pop_front()
    }

    fn append(&mut self, sensed: SensedCut) {
        let (offset, first) = (self.next_time, self.next_sequence);
        let period = block_period(&sensed.blocks);
        let mut edges = sensed
            .edges
            .iter()
            .map(|edge| Edge {
                time: Nanoseconds(edge.time.0 + offset),
            })
            .peekable();
        let starts = sensed.blocks.iter().skip(1).map(|block| block.time.0 + offset);
        let ends = starts.chain(std::iter::once(u64::MAX));
        for (block, end) in sensed.blocks.iter().zip(ends) {
            let mut own = Vec::new();
            while let Some(edge) = edges.next_if(|edge| edge.time.0 < end) {
                own.push(edge);
            }
            let block = Block {
                sequence: block.sequence.wrapping_add(first),
                time: Nanoseconds(block.time.0 + offset),
                ..block.clone()
            };
            self.next_sequence = block.sequence.wrapping_add(1);
            self.next_time = block.time.0 + period;
            self.steps.push_back((block, own));
        }
    }
}

/// Time between the starts of two successive sample blocks, ns: the mean over all blocks, since time stamps jitter; 0
/// for fewer than two blocks.
fn block_period(blocks: &[Block]) -> u64 {
    match (blocks.first(), blocks.last()) {
        (Some(first), Some(last)) if blocks.len() > 1 => {
            last.time.0.saturating_sub(first.time.0) / (blocks.len() as u64 - 1)
        }
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;
    use crate::simulate::Statistics;

    fn sensed(blocks: u32, edges_ms: &[u64]) -> SensedCut {
        let block = |sequence: u32| Block {
            sequence,
            time: Nanoseconds(u64::from(sequence) * 1_000_000),
            ..Block::default()
        };
        SensedCut {
            blocks: (0..blocks).map(block).collect(),
            edges: edges_ms
                .iter()
                .map(|ms| Edge {
                    time: Nanoseconds(ms * 1_000_000),
                })
                .collect(),
            statistics: Statistics::default(),
        }
    }

    #[test]
    fn cuts_follow_one_another_without_a_gap() {
        let (send, receive) = channel();
        send.send(sensed(3, &[0, 2])).unwrap();
        send.send(sensed(2, &[1])).unwrap();
        let mut spindle = VirtualSpindle::new(receive);
        let now = Nanoseconds(0);
        let mut steps = Vec::new();
        while spindle.peek(now).is_some() {
            let (block, edges) = spindle.take().unwrap();
            let edges: Vec<u64> = edges.iter().map(|edge| edge.time.0 / 1_000_000).collect();
            steps.push((block.sequence, block.time.0 / 1_000_000, edges));
        }
        let expected = [
            (0, 0, vec![0]),
            (1, 1, vec![]),
            (2, 2, vec![2]),
            (3, 3, vec![]),
            (4, 4, vec![4]),
        ];
        assert_eq!(steps, expected);
        // After a pause the next cut starts at the current time.
        send.send(sensed(1, &[])).unwrap();
        let (block, _) = spindle.peek(Nanoseconds(9_000_000)).unwrap();
        assert_eq!((block.sequence, block.time), (5, Nanoseconds(9_000_000)));
    }
}
