//! The lobe table: where this machine is stable.
//!
//! A table holds, for layers of feed per tooth, immersion and posture and for a grid of spindle speeds, the
//! depths of cut that are *not* stable. It is a `.qct` file on the host and the same bytes in the device's flash;
//! [`LobeTable`] reads it where it lies, without a copy.
//!
//! ```text
//! depth │      ▓▓▓▓▓ Hopf ▓▓▓▓▓▓        one column: [ flip 1.58 .. 2.33 ) [ Hopf 2.71 .. end of the table ]
//!       │▓▓▓▓           ░░░░░▓▓▓        first limit of the column: 1.58, a flip
//!       │▓▓▓    ▒▒ ← flip   ░▓▓▓        an island is an interval that ends below the end of the table
//!       │▓▓     ▒▒         ▓▓▓▓
//!       └───────┬┬──────────────── speed
//! ```
//!
//! What the table answers for a point between its entries:
//! - *Speed*: the two neighbouring columns are joined. Where they have the same sequence of overlapping intervals of the
//!   same kinds, ends and chatter frequencies are interpolated linearly; where they differ (an island begins, a
//!   kind changes), a depth is unstable where it is unstable in either column.
//! - *Feed per tooth*: the same between the two neighbouring layers. A layer may hold for a range of feeds.
//! - *Feed direction*: where layers are for some directions, the same between the two around it, if they are at most
//!   [`FEED_DIRECTION_SPAN`] apart and their feeds need no interpolation. A direction that was not told is that of the layers where
//!   they have only one.
//! - *Immersion and posture*: never interpolated. Immersion may differ by [`IMMERSION_TOLERANCE`], posture must be the same.
//! - Outside, the answer is [`Answer::NotKnown`] with the reason, never a guess.
//!
//! A table may say how large the [`InterpolationError`] is, and how its limits move with what the device learns:
//! [`LobeTable::slopes`], [`corrected_limit`].
//!
//! Linear interpolation lies above a limit that is convex between two grid speeds by up to h²·b″/8 (h the
//! step of the grid, b″ the curvature of the limit): who computes a table chooses the grid so that this is small
//! against the margin of [`advice`](crate::advice).
//!
//! [`format`] documents the bytes.

mod additions;
mod answer;
mod check;
mod column;
mod cut;
mod encode;
mod error;
pub mod format;
mod half;
mod slopes;

use serde::{Deserialize, Serialize};

pub use additions::{Additions, InterpolationError};
pub use answer::{Answer, NotKnown};
pub use column::Column;
pub use cut::CutLobes;
pub(crate) use cut::FEW;
pub use encode::{Content, Layer, encode, encode_with, encoded_length, encoded_length_with};
pub use error::TableError;
pub use format::Header;
pub use slopes::{IntervalSlopes, LayerMode, Learned, MODES_MAX, Slopes, corrected_limit};

use crate::units::{Degrees, Hertz, Millimeters, Rpm};
use crate::working_point::{Limits, WorkingPoint};
use format::Shape;

/// How far the immersion of the cut may be from that of a layer, in degrees, at entry and at exit.
///
/// A table is made for one immersion. Half a degree moves the mean directional coefficients of a cut of
/// 90° by about 1 %, well below the depth margin of advice.
pub const IMMERSION_TOLERANCE: Degrees = Degrees(0.5);

/// How far the feed per tooth of the cut may be outside of a layer, relative to it: rounding, nothing more.
pub const FEED_TOLERANCE: f32 = 1e-4;

/// How far apart the feed directions of two layers may be for interpolation between them, in degrees.
pub const FEED_DIRECTION_SPAN: Degrees = Degrees(45.0);

/// How far the feed direction of the cut may be from that of a layer to be the same, in degrees.
pub const FEED_DIRECTION_TOLERANCE: Degrees = Degrees(0.5);

/// What a depth interval is, if it is not stable.
///
/// Multipliers are those over a tooth period; of a tool with teeth at unequal pitch over a revolution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Kind {
    /// Chatter at a frequency of its own: a complex pair of multipliers outside the unit circle.
    Hopf,
    /// Chatter with twice the tooth period: a multiplier below −1.
    Flip,
    /// The forced orbit itself is lost: a multiplier above +1.
    Fold,
    /// The computation could not decide (its error bar crosses the unit circle, or it failed).
    Undecided,
}

/// A range of depths [from, to) that is not stable.
///
/// An interval that ends at the last depth of the table includes it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Interval {
    /// The first depth that is not stable.
    pub from: Millimeters,
    /// The first depth that is stable again, or the last depth of the table.
    pub to: Millimeters,
    /// What it is.
    pub kind: Kind,
    /// The chatter frequency; 0 where it is not known.
    pub chatter: Hertz,
}

/// What a layer is valid for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Validity {
    /// Smallest feed per tooth.
    pub feed_from: Millimeters,
    /// Largest feed per tooth; equal to the smallest where limits depend on the feed.
    pub feed_to: Millimeters,
    /// Immersion angle where a tooth enters.
    pub start: Degrees,
    /// Immersion angle where a tooth leaves.
    pub exit: Degrees,
    /// Posture of the robot; 0 on a machine tool.
    pub posture: u8,
}

impl Validity {
    /// True where both have the same immersion and posture: feeds may then be interpolated between them.
    fn is_family_of(&self, other: &Self) -> bool {
        self.posture == other.posture && self.start == other.start && self.exit == other.exit
    }
}

/// A validated table, read where it lies.
#[derive(Clone, Copy, Debug)]
pub struct LobeTable<'a> {
    bytes: &'a [u8],
    shape: Shape,
    /// Where the feed goes, if that is known.
    feed_direction: Option<Degrees>,
}

impl<'a> LobeTable<'a> {
    /// The table in `bytes`, which must be exactly one table, after checking all of it: header, CRC-32 and every entry.
    ///
    /// Cost: one pass over the bytes for the CRC and one over the entries.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, TableError> {
        let header = Header::read(bytes)?;
        header.check(bytes)?;
        let shape = Shape::read(bytes)?;
        let table = Self {
            bytes,
            shape,
            feed_direction: None,
        };
        table.check_entries()?;
        Ok(table)
    }

    /// Refuses entries that no table may have, as [`parse`](Self::parse) does: for a table whose CRC is known to be right.
    pub fn check_entries(&self) -> Result<(), TableError> {
        check::check_entries(self)
    }

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

    /// The columns of one cut; its axial depth is not used.
    pub fn cut(&self, working_point: &WorkingPoint) -> Result<CutLobes<'a>, NotKnown> {
        CutLobes::new(*self, working_point)
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

    /// The column at any speed and working point; its axial depth is not used.
    pub fn column(&self, speed: Rpm, working_point: &WorkingPoint) -> Result<Column, NotKnown> {
        self.cut(working_point)?.column(speed)
    }

    /// What the table says of the cut at `speed`.
    pub fn lookup(&self, speed: Rpm, working_point: &WorkingPoint) -> Answer {
        match self.column(speed, working_point) {
            Ok(column) => column.at(working_point.axial_depth),
            Err(why) => Answer::NotKnown(why),
        }
    }

    fn speed_rpm(&self, index: usize) -> f32 {
        // Where the bytes changed after the check, NaN fails every comparison and ends in `NotKnown`.
        self.shape.speed_rpm(self.bytes, index).unwrap_or(f32::NAN)
    }

    /// The intervals of one layer at one speed of the grid, as they are stored.
    fn intervals(
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
    fn read_column(&self, layer: usize, speed_index: usize, column: &mut Column) -> Result<(), NotKnown> {
        for interval in self.intervals(layer, speed_index)? {
            column.push(interval?);
        }
        Ok(())
    }

    fn empty_column(&self) -> Column {
        Column::new(self.shape.depth_from_mm, self.shape.depth_to_mm)
    }
}

/// Stands for a layer that could not be read: no working point lies in it.
const NOWHERE: Validity = Validity {
    feed_from: Millimeters(f32::NAN),
    feed_to: Millimeters(f32::NAN),
    start: Degrees(f32::NAN),
    exit: Degrees(f32::NAN),
    posture: 0,
};
