//! The unstable depth intervals of a lobe table, corrected for changed modal parameters and cutting force.

use super::slopes::{IntervalSlopes, LayerMode, Learned, Slopes, corrected_limit};
use super::{Column, Interval, LobeTable};
use crate::units::{Hertz, Millimeters};

impl LobeTable<'_> {
    /// The modes of a layer of the lobe table, in the order of the derivatives; empty if the table has no derivatives.
    pub fn modes(&self, layer: usize) -> impl ExactSizeIterator<Item = LayerMode> + '_ {
        (0..self.shape.modes).map(move |mode| {
            self.shape
                .layer_mode(self.bytes, layer, mode)
                .unwrap_or(LayerMode {
                    frequency: Hertz(f32::NAN),
                    damping_ratio: f32::NAN,
                })
        })
    }

    /// Derivatives of both ends of the unstable depth interval with this index, for a layer at one speed of the table.
    /// `None` if the table has no derivatives or no such interval.
    pub fn slopes(&self, layer: usize, speed_index: usize, interval: usize) -> Option<IntervalSlopes> {
        let range = self.shape.column_range(self.bytes, layer, speed_index)?;
        let index = range
            .start
            .checked_add(interval)
            .filter(|index| *index < range.end)?;
        self.shape.interval_slopes(self.bytes, index)
    }

    /// The unstable depth intervals of one layer at one speed of the table, corrected for changed modal parameters and
    /// cutting force. In a table without derivatives they equal those of [`entry`](Self::entry). `None` if the entry
    /// does not exist or cannot be read.
    ///
    /// Interval ends at the smallest or largest depth of the table are not shifted. An interval is removed if its ends
    /// meet or cross. An interval that would overlap the preceding one begins where the preceding one ends.
    pub fn corrected_entry(&self, layer: usize, speed_index: usize, learned: &Learned) -> Option<Column> {
        let mut column = self.empty_column();
        let depths = self.depths();
        let mut end = depths.0;
        for (index, interval) in self.intervals(layer, speed_index).ok()?.enumerate() {
            let interval = interval.ok()?;
            let slopes = self.slopes(layer, speed_index, index).unwrap_or_default();
            let stays = |depth: Millimeters| depth.0 <= depths.0.0 || depth.0 >= depths.1.0;
            let moved = |depth: Millimeters, slopes: &Slopes| {
                if stays(depth) {
                    depth
                } else {
                    corrected_limit(depth, slopes, learned, depths)
                }
            };
            let from = Millimeters(f32::max(moved(interval.from, &slopes.from).0, end.0));
            let to = moved(interval.to, &slopes.to);
            if from < to {
                column.push(Interval { from, to, ..interval });
                end = to;
            }
        }
        Some(column)
    }
}
