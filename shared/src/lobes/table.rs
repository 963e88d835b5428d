//! A table, read where its bytes lie.

use super::format::{self, Header};
use super::shape::Shape;
use super::validity::NOWHERE;
use super::{Column, InterpolationError, Interval, NotKnown, TableError, Validity};
use crate::units::{Degrees, Hertz, Millimeters, Rpm};
use crate::working_point::Limits;

/// A validated table, read where it lies.
#[derive(Clone, Copy, Debug)]
pub struct LobeTable<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) shape: Shape,
    /// Where the feed goes, if that is known.
    pub(super) feed_direction: Option<Degrees>,
}

impl<'a> LobeTable<'a> {
    /// The table in bytes that [`parse`](Self::parse) accepted before: the CRC and the entries are not checked again.
    ///
    /// Bytes that changed since do no harm beyond wrong entries: every read is checked against their length.
    pub fn reopen(bytes: &'a [u8]) -> Result<Self, TableError> {
        Header::read(bytes)?;
        Ok(Self {
            bytes,
            shape: Shape::read(bytes)?,
            feed_direction: None,
        })
    }

    /// The bytes of the table, header included.
    pub fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// The header.
    pub fn header(&self) -> Result<Header, TableError> {
        Header::read(self.bytes)
    }

    /// Name of the case the table was computed from.
    pub fn name(&self) -> &'a str {
        self.shape.name(self.bytes)
    }

    /// Number of teeth of the tool.
    pub fn teeth(&self) -> u8 {
        self.shape.teeth
    }

    /// Limits of the machine, where the case has them.
    pub fn limits(&self) -> Option<Limits> {
        self.shape.limits
    }

    /// The smallest and the largest depth.
    pub fn depths(&self) -> (Millimeters, Millimeters) {
        (
            Millimeters(self.shape.depth_from_mm),
            Millimeters(self.shape.depth_to_mm),
        )
    }

    /// Largest difference between an entry and the depth it was made from, in mm: one step of the 16-bit grid.
    ///
    /// Entries are rounded to the unstable side: `from` down, `to` up (see [`format`]).
    pub fn depth_step(&self) -> Millimeters {
        Millimeters(self.shape.depth_step_mm())
    }

    /// Largest difference between an entry and the chatter frequency it was made from: half a step of the 16-bit grid.
    pub fn chatter_error(&self) -> Hertz {
        Hertz(0.5 * self.shape.chatter_step_hz())
    }

    /// The spindle speeds of the grid, ascending.
    pub fn speeds(&self) -> impl ExactSizeIterator<Item = Rpm> + DoubleEndedIterator + use<'a> {
        let table = *self;
        (0..self.shape.speeds).map(move |index| Rpm(table.speed_rpm(index)))
    }

    /// The speed of the grid at `index`.
    pub fn speed(&self, index: usize) -> Option<Rpm> {
        (index < self.shape.speeds).then(|| Rpm(self.speed_rpm(index)))
    }

    /// Number of speeds of the grid below or equal to `speed`; they are `0..` this.
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

    /// What the layers are valid for, in the order of the table.
    pub fn layers(&self) -> impl ExactSizeIterator<Item = Validity> + Clone + use<'a> {
        let table = *self;
        (0..self.shape.layers).map(move |layer| table.shape.validity(table.bytes, layer).unwrap_or(NOWHERE))
    }

    /// The entries of one layer at one speed of the grid.
    pub fn entry(&self, layer: usize, speed_index: usize) -> Option<Column> {
        let mut column = self.empty_column();
        self.read_column(layer, speed_index, &mut column).ok()?;
        Some(column)
    }

    /// The same table for cuts whose feed has this direction, from the machine's x towards its y.
    pub fn towards(self, feed_direction: Degrees) -> Self {
        Self {
            feed_direction: Some(feed_direction),
            ..self
        }
    }

    /// The feed direction that cuts are asked for with, as [`towards`](Self::towards) has told it.
    pub fn asked_direction(&self) -> Option<Degrees> {
        self.feed_direction
    }

    pub(super) fn speed_rpm(&self, index: usize) -> f32 {
        // Where the bytes changed after the check, NaN fails every comparison and ends in `NotKnown`.
        self.shape.speed_rpm(self.bytes, index).unwrap_or(f32::NAN)
    }

    /// The intervals of one layer at one speed of the grid, as they are stored.
    pub(super) fn intervals(
        &self,
        layer: usize,
        speed_index: usize,
    ) -> Result<impl Iterator<Item = Result<Interval, NotKnown>> + use<'a>, NotKnown> {
        let column = self.shape.column(self.bytes, layer, speed_index);
        let intervals = column.ok_or(NotKnown::Damaged)?.take(format::MAX_INTERVALS);
        Ok(intervals.map(|interval| interval.ok_or(NotKnown::Damaged)))
    }

    /// Reads the intervals of one layer at one speed of the grid into an empty column.
    ///
    /// Columns are large: they are filled where they lie, not moved.
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
    /// How far lookups between the entries may be off; `None` where the table does not say.
    pub fn interpolation_error(&self) -> Option<InterpolationError> {
        self.shape.interpolation_error(self.bytes)
    }

    /// The feed direction that a layer holds for, from the machine's x towards its y; `None` for any.
    pub fn feed_direction(&self, layer: usize) -> Option<Degrees> {
        self.shape.feed_direction(self.bytes, layer).ok().flatten()
    }
}
