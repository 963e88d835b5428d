//! The stability lobes of one cut: the two layers of a lobe table between which the cut is interpolated.

use super::{
    Column, FEED_DIRECTION_SPAN, FEED_DIRECTION_TOLERANCE, FEED_TOLERANCE, IMMERSION_TOLERANCE, Interval,
    LobeTable, NotKnown, TabulatedStability,
};
use crate::units::{Degrees, Millimeters, Rpm};
use crate::working_point::WorkingPoint;

/// Largest number of unstable depth intervals in a stored column of the lobe table for which no combination of up to
/// four columns exceeds the capacity of a [`Column`].
///
/// Two columns of n and m intervals combine to at most 2n + m intervals. Four columns of 3 combine to at most 27, and a
/// [`Column`] holds 32.
pub(crate) const FEW: usize = 3;

/// Position of a spindle speed between two neighbouring speeds of the lobe table.
#[derive(Clone, Copy)]
struct Between {
    /// Index of the largest speed of the lobe table that does not exceed the spindle speed.
    below: usize,
    /// Interpolation weight of the next higher speed of the lobe table, 0 to 1.
    weight: f32,
}

/// The columns (unstable depths over spindle speed) of a lobe table for one feed, feed direction, immersion and
/// posture.
#[derive(Clone, Copy, Debug)]
pub struct CutLobes<'a> {
    table: LobeTable<'a>,
    near: usize,
    far: usize,
    /// Interpolation weight of the table layer with index `far`, 0 to 1; layer `near` has the rest.
    weight: f32,
}

impl<'a> CutLobes<'a> {
    pub(super) fn new(table: LobeTable<'a>, working_point: &WorkingPoint) -> Result<Self, NotKnown> {
        let (near, far, weight) = bracket(&table, working_point)?;
        Ok(Self {
            table,
            near,
            far,
            weight,
        })
    }

    /// The unstable depth intervals at a spindle speed, interpolated between speeds and layers of the lobe table.
    pub fn column(&self, speed: Rpm) -> Result<Column, NotKnown> {
        let between = self.between(speed)?;
        let mut column = self.table.empty_column();
        self.read(self.near, between, &mut column)?;
        if self.near == self.far {
            return Ok(column);
        }
        let mut far = self.table.empty_column();
        self.read(self.far, between, &mut far)?;
        let mut blended = self.table.empty_column();
        blended.blend(&column, &far, self.weight);
        Ok(blended)
    }

    /// Indices of the one or two table layers from which the cut is interpolated.
    pub(crate) fn layers(&self) -> impl Iterator<Item = usize> + use<> {
        [Some(self.near), (self.far != self.near).then_some(self.far)]
            .into_iter()
            .flatten()
    }

    /// The unstable depth intervals that the lobe table stores for a layer at one of its speeds.
    ///
    /// A depth that is stable at two neighbouring speeds of the table, in all [`layers`](Self::layers), is stable
    /// between them. A depth that is stable at neither, in no layer, is unstable between them. Most lookups therefore
    /// need no interpolation.
    ///
    /// Returns `None` if the list cannot be read, or has more than [`FEW`] intervals, for which these two rules are not
    /// guaranteed. An item is `None` if that interval cannot be read.
    pub(crate) fn stored(
        &self,
        layer: usize,
        speed_index: usize,
    ) -> Option<impl Iterator<Item = Option<Interval>> + use<'a>> {
        let LobeTable { bytes, shape, .. } = self.table;
        shape
            .column(bytes, layer, speed_index)
            .filter(|column| column.len() <= FEW)
    }

    /// Reads the unstable depth intervals of one table layer, interpolated in spindle speed, into an empty column.
    fn read(&self, layer: usize, between: Between, column: &mut Column) -> Result<(), NotKnown> {
        if between.weight == 0.0 {
            return self.table.read_column(layer, between.below, column);
        }
        let (mut below, mut above) = (self.table.empty_column(), self.table.empty_column());
        self.table.read_column(layer, between.below, &mut below)?;
        self.table.read_column(layer, between.below + 1, &mut above)?;
        column.blend(&below, &above, between.weight);
        Ok(())
    }

    /// The position of a spindle speed between two neighbouring speeds of the lobe table.
    fn between(&self, speed: Rpm) -> Result<Between, NotKnown> {
        let count = self.table.shape.speeds;
        let outside = || NotKnown::Speed {
            asked: speed,
            from: Rpm(self.table.speed_rpm(0)),
            to: Rpm(self.table.speed_rpm(count.saturating_sub(1))),
        };
        let above = self.table.speeds_up_to(speed);
        let below = above.checked_sub(1).ok_or_else(outside)?;
        let below_rpm = self.table.speed_rpm(below);
        if below_rpm == speed.0 {
            return Ok(Between { below, weight: 0.0 });
        }
        if above >= count {
            return Err(outside());
        }
        let weight = (speed.0 - below_rpm) / (self.table.speed_rpm(above) - below_rpm);
        if (0.0..=1.0).contains(&weight) {
            Ok(Between { below, weight })
        } else {
            Err(NotKnown::Damaged)
        }
    }
}

impl<'a> LobeTable<'a> {
    /// The stability lobes of the table for one cut; the axial depth of the working point is not used.
    pub fn cut(&self, working_point: &WorkingPoint) -> Result<CutLobes<'a>, NotKnown> {
        CutLobes::new(*self, working_point)
    }

    /// The unstable depth intervals at a spindle speed for one cut; the axial depth of the working point is not used.
    pub fn column(&self, speed: Rpm, working_point: &WorkingPoint) -> Result<Column, NotKnown> {
        self.cut(working_point)?.column(speed)
    }

    /// Stability of the cut at spindle speed `speed` and the working point, from the lobe table.
    pub fn lookup(&self, speed: Rpm, working_point: &WorkingPoint) -> TabulatedStability {
        match self.column(speed, working_point) {
            Ok(column) => column.at(working_point.axial_depth),
            Err(why) => TabulatedStability::NotKnown(why),
        }
    }
}

/// The two table layers that enclose the working point in feed or in feed direction, and the interpolation weight of
/// the second; one layer twice if nothing is to be interpolated.
// `inline(never)` on this function and those below: one copy of the code saves flash, and the time of a call is
// negligible.
#[inline(never)]
fn bracket(table: &LobeTable<'_>, working_point: &WorkingPoint) -> Result<(usize, usize, f32), NotKnown> {
    // A lobe table of schema 1 has no feed directions.
    if !table.shape.is_extended {
        return bracket_feed(table, working_point, &|_| true);
    }
    let mut directions = family(table, working_point).filter_map(|layer| table.feed_direction(layer));
    let Some(first) = directions.next() else {
        return bracket_feed(table, working_point, &|_| true);
    };
    let Some(asked) = table.cut_direction() else {
        if directions.any(|other| other != first) {
            return Err(NotKnown::FeedDirectionNotTold);
        }
        return bracket_feed(table, working_point, &|_| true);
    };
    let unknown = NotKnown::FeedDirection { asked };
    let (below, above) = neighbours(table, working_point, asked).ok_or(unknown)?;
    let at = |direction: Degrees| {
        bracket_feed(table, working_point, &|layer| {
            table.feed_direction(layer).is_none_or(|other| other == direction)
        })
    };
    let (to_below, to_above) = (turn(below, asked), turn(asked, above));
    if below == above || to_below <= FEED_DIRECTION_TOLERANCE.0 {
        return at(below);
    }
    if to_above <= FEED_DIRECTION_TOLERANCE.0 {
        return at(above);
    }
    match (at(below)?, at(above)?) {
        // A lookup interpolates between table layers in feed or in feed direction, not in both: that would need four
        // layers.
        ((low, same_low, _), (high, same_high, _)) if low == same_low && high == same_high => {
            Ok((low, high, to_below / (to_below + to_above)))
        }
        _ => Err(unknown),
    }
}

/// Indices of the table layers for the posture and immersion of the working point.
fn family<'t>(table: &'t LobeTable<'_>, working_point: &'t WorkingPoint) -> impl Iterator<Item = usize> + 't {
    table
        .layers()
        .enumerate()
        .filter(|(_, layer)| {
            layer.posture == working_point.posture
                && is_close(layer.start, working_point.start)
                && is_close(layer.exit, working_point.exit)
        })
        .map(|(index, _)| index)
}

/// The nearest feed directions of table layers below and above the requested one, if one of them is within
/// [`FEED_DIRECTION_TOLERANCE`] of it or the two are at most [`FEED_DIRECTION_SPAN`] apart. A layer for any direction
/// counts as having exactly the requested one.
#[inline(never)]
fn neighbours(
    table: &LobeTable<'_>,
    working_point: &WorkingPoint,
    asked: Degrees,
) -> Option<(Degrees, Degrees)> {
    let (mut below, mut above): (Option<Degrees>, Option<Degrees>) = (None, None);
    for layer in family(table, working_point) {
        let direction = table.feed_direction(layer).unwrap_or(asked);
        if below.is_none_or(|best| turn(direction, asked) < turn(best, asked)) {
            below = Some(direction);
        }
        if above.is_none_or(|best| turn(asked, direction) < turn(asked, best)) {
            above = Some(direction);
        }
    }
    let (below, above) = (below?, above?);
    // If the table has one feed direction only, it is the neighbour below and above the requested one. It is then valid
    // only within the tolerance.
    let (to_below, to_above) = (turn(below, asked), turn(asked, above));
    let is_there = f32::min(to_below, to_above) <= FEED_DIRECTION_TOLERANCE.0;
    (is_there || to_below + to_above <= FEED_DIRECTION_SPAN.0).then_some((below, above))
}

/// The angle in degrees from one feed direction to another, counter-clockwise, from 0 to below 360; NaN if their
/// difference is NaN or above 10⁶ degrees.
#[inline(never)]
fn turn(from: Degrees, to: Degrees) -> f32 {
    let mut turn = to.0 - from.0;
    if !(-1.0e6..=1.0e6).contains(&turn) {
        return f32::NAN;
    }
    while turn < 0.0 {
        turn += 360.0;
    }
    while turn >= 360.0 {
        turn -= 360.0;
    }
    turn
}

/// The two table layers whose feeds per tooth enclose that of the working point, and the interpolation weight of the
/// second layer. A layer whose feed range contains the feed is returned twice. `belongs` selects the layers to search.
#[inline(never)]
fn bracket_feed(
    table: &LobeTable<'_>,
    working_point: &WorkingPoint,
    belongs: &dyn Fn(usize) -> bool,
) -> Result<(usize, usize, f32), NotKnown> {
    let feed_mm = working_point.feed_per_tooth.0;
    let mut posture_known = false;
    let mut range: Option<(f32, f32)> = None;
    let mut below: Option<(usize, f32)> = None;
    let mut above: Option<(usize, f32)> = None;
    for (index, layer) in table.layers().enumerate() {
        if layer.posture != working_point.posture || !belongs(index) {
            continue;
        }
        posture_known = true;
        if !is_close(layer.start, working_point.start) || !is_close(layer.exit, working_point.exit) {
            continue;
        }
        let (from_mm, to_mm) = (layer.feed_from.0, layer.feed_to.0);
        if feed_mm >= from_mm * (1.0 - FEED_TOLERANCE) && feed_mm <= to_mm * (1.0 + FEED_TOLERANCE) {
            return Ok((index, index, 0.0));
        }
        let (low, high) = range.unwrap_or((from_mm, to_mm));
        range = Some((f32::min(low, from_mm), f32::max(high, to_mm)));
        if to_mm < feed_mm && below.is_none_or(|(_, best)| to_mm > best) {
            below = Some((index, to_mm));
        }
        if from_mm > feed_mm && above.is_none_or(|(_, best)| from_mm < best) {
            above = Some((index, from_mm));
        }
    }
    match (below, above, range) {
        (Some((low, low_mm)), Some((high, high_mm)), _) => {
            Ok((low, high, (feed_mm - low_mm) / (high_mm - low_mm)))
        }
        (_, _, Some((from, to))) => Err(NotKnown::Feed {
            asked: Millimeters(feed_mm),
            from: Millimeters(from),
            to: Millimeters(to),
        }),
        (_, _, None) if posture_known => Err(NotKnown::Immersion {
            start: working_point.start,
            exit: working_point.exit,
        }),
        (_, _, None) => Err(NotKnown::Posture {
            asked: working_point.posture,
        }),
    }
}

fn is_close(a: Degrees, b: Degrees) -> bool {
    (a.0 - b.0).abs() <= IMMERSION_TOLERANCE.0
}
