//! The lobe table, read in place from its bytes.

use super::format::{self, Header};
use super::shape::Shape;
use super::validity::NOWHERE;
use super::{Column, InterpolationError, Interval, NotKnown, TableError, Validity};
use crate::units::{Degrees, Hertz, Millimeters, Rpm};
use crate::working_point::Limits;

/// A lobe table, read in place without a copy. [`parse`](Self::parse) checks its bytes, [`reopen`](Self::reopen) trusts
/// them.
#[derive(Clone, Copy, Debug)]
pub struct LobeTable<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) shape: Shape,
    /// Feed direction of the cut that is looked up, if set.
    pub(super) feed_direction: Option<Degrees>,
}

impl<'a> LobeTable<'a> {
    /// Opens the bytes of a lobe table that [`parse`](Self::parse) has accepted before, without checking CRC and
    /// entries again.
    ///
    /// If the bytes were changed since, entries may be wrong. Every read is bounds-checked.
    pub fn reopen(bytes: &'a [u8]) -> Result<Self, TableError> {
        Header::read(bytes)?;
        Ok(Self {
            bytes,
            shape: Shape::read(bytes)?,
            feed_direction: None,
        })
    }

    /// The bytes of the lobe table, header included.
    pub fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// The header.
    pub fn header(&self) -> Result<Header, TableError> {
        Header::read(self.bytes)
    }

    /// Name of the case from which the table was computed.
    pub fn name(&self) -> &'a str {
        self.shape.name(self.bytes)
    }

    /// Number of teeth of the tool for which the table was computed.
    pub fn teeth(&self) -> u8 {
        self.shape.teeth
    }

    /// Speed limits of the machine that the table states; `None` if it states none.
    pub fn limits(&self) -> Option<Limits> {
        self.shape.limits
    }

    /// The smallest and the largest axial depth of the table.
    pub fn depths(&self) -> (Millimeters, Millimeters) {
        (
            Millimeters(self.shape.depth_from_mm),
            Millimeters(self.shape.depth_to_mm),
        )
    }

    /// Largest rounding error of a depth in the table: one step of its 16-bit scale.
    ///
    /// Depths are rounded to the unstable side: `from` down, `to` up (see [`format`]).
    pub fn depth_step(&self) -> Millimeters {
        Millimeters(self.shape.depth_step_mm())
    }

    /// Largest rounding error of a chatter frequency in the table: half a step of its 16-bit scale. Only a frequency
    /// below half a step errs by more, as it is not rounded to 0.
    pub fn chatter_error(&self) -> Hertz {
        Hertz(0.5 * self.shape.chatter_step_hz())
    }

    /// The grid speeds, ascending.
    pub fn speeds(&self) -> impl ExactSizeIterator<Item = Rpm> + DoubleEndedIterator + use<'a> {
        let table = *self;
        (0..self.shape.speeds).map(move |index| Rpm(table.speed_rpm(index)))
    }

    /// The spindle speed of the table with this index; `None` beyond the last.
    pub fn speed(&self, index: usize) -> Option<Rpm> {
        (index < self.shape.speeds).then(|| Rpm(self.speed_rpm(index)))
    }

    /// Number of spindle speeds of the table that are at most `speed`; their indices are 0 to this number − 1.
    pub fn speeds_up_to(&self, speed: Rpm) -> usize {
        let (mut low, mut high) = (0, self.shape.speeds);
        while low < high {
            let middle = low + (high - low) / 2;
            if self.speed_rpm(middle) <= speed.0 {
                low = middle + 1
            } else {
                high = middle
            }
        }
        low
    }

    /// The cuts for which each layer is valid (feed, immersion, posture), in the order of the table.
    pub fn layers(&self) -> impl ExactSizeIterator<Item = Validity> + Clone + use<'a> {
        let table = *self;
        (0..self.shape.layers).map(move |layer| table.shape.validity(table.bytes, layer).unwrap_or(NOWHERE))
    }

    /// The unstable depth intervals of one layer at one speed of the table; `None` if the table has no such layer or
    /// speed, or is damaged.
    pub fn entry(&self, layer: usize, speed_index: usize) -> Option<Column> {
        let mut column = self.empty_column();
        self.read_column(layer, speed_index, &mut column).ok()?;
        Some(column)
    }

    /// The same table for a cut with this feed direction: the angle from the machine's x axis towards its y axis.
    pub fn towards(self, feed_direction: Degrees) -> Self {
        Self {
            feed_direction: Some(feed_direction),
            ..self
        }
    }

    /// The feed direction of the cut that is looked up, as set by [`towards`](Self::towards); `None` if none is set.
    pub fn cut_direction(&self) -> Option<Degrees> {
        self.feed_direction
    }

    pub(super) fn speed_rpm(&self, index: usize) -> f32 {
        // A speed beyond the bytes of the table is NaN: all comparisons with it fail, and the lookup returns
        // `NotKnown`.
        self.shape.speed_rpm(self.bytes, index).unwrap_or(f32::NAN)
    }

    /// The unstable depth intervals that the table stores for one layer at one of its speeds.
    pub(super) fn intervals(
        &self,
        layer: usize,
        speed_index: usize,
    ) -> Result<impl Iterator<Item = Result<Interval, NotKnown>> + use<'a>, NotKnown> {
        let column = self.shape.column(self.bytes, layer, speed_index);
        let intervals = column.ok_or(NotKnown::Damaged)?.take(format::MAX_INTERVALS);
        Ok(intervals.map(|interval| interval.ok_or(NotKnown::Damaged)))
    }

    /// Reads the unstable depth intervals of one layer at one speed of the table into an empty column.
    ///
    /// A column is large, so it is filled in place rather than returned.
    pub(super) fn read_column(
        &self,
        layer: usize,
        speed_index: usize,
        column: &mut Column,
    ) -> Result<(), NotKnown> {
        for interval in self.intervals(layer, speed_index)? {
            column.push(interval?);
        }
        Ok(())
    }

    pub(super) fn empty_column(&self) -> Column {
        Column::new(self.shape.depth_from_mm, self.shape.depth_to_mm)
    }
}

impl LobeTable<'_> {
    /// Bound of the interpolation error that the lobe table states; `None` if it states none.
    pub fn interpolation_error(&self) -> Option<InterpolationError> {
        self.shape.interpolation_error(self.bytes)
    }

    /// The feed direction for which a layer of the table is valid, from the machine's x axis towards its y axis; `None`
    /// for any direction, and for a layer that cannot be read.
    pub fn feed_direction(&self, layer: usize) -> Option<Degrees> {
        self.shape.feed_direction(self.bytes, layer).ok().flatten()
    }
}
