//! The lobe table over speed and depth for one cut, and the margin of the cut in it.

use std::sync::Arc;

use quietcut_core::lobes::{Column, IntervalKind, LobeTable, TableError, TabulatedStability};
use quietcut_core::units::{Millimeters, Rpm};
use quietcut_core::working_point::WorkingPoint;

use crate::report::words;

/// Number of speeds of the lobe chart: a choice, one for each second pixel of a page 800 pixels wide, and more than the
/// columns of a terminal.
pub(crate) const COLUMNS: usize = 400;

/// A lobe table with the feed, immersion and posture for which it is drawn.
#[derive(Clone, Debug)]
pub(crate) struct LobeMap {
    bytes: Vec<u8>,
    point: WorkingPoint,
    /// True if no working point is set: the first layer of the table is drawn, and the depth is not known.
    pub(crate) is_assumed: bool,
    /// Slowest and fastest speed of the table, rev/min.
    pub(crate) rpm: [f64; 2],
    /// Largest depth of the table, mm.
    pub(crate) depth_mm: f64,
    columns: Arc<[Option<Column>]>,
}

impl LobeMap {
    /// Lobes of the table in `bytes` at the working point; without one, those of the first layer.
    ///
    /// # Errors
    /// The bytes are no valid lobe table.
    pub(crate) fn new(bytes: Vec<u8>, point: Option<WorkingPoint>) -> Result<Self, TableError> {
        let table = LobeTable::parse(&bytes)?;
        let speeds = [table.speeds().next(), table.speeds().next_back()];
        let first = table.layers().next().map(|layer| WorkingPoint {
            axial_depth: Millimeters(0.0),
            start: layer.start,
            exit: layer.exit,
            feed_per_tooth: layer.feed_from,
            posture: layer.posture,
        });
        let rpm = speeds.map(|speed| f64::from(speed.unwrap_or_default().0));
        let depth_mm = f64::from(table.depths().1.0);
        let is_assumed = point.is_none();
        let point = point.or(first).unwrap_or(WorkingPoint {
            axial_depth: Millimeters(0.0),
            start: Default::default(),
            exit: Default::default(),
            feed_per_tooth: Millimeters(0.0),
            posture: 0,
        });
        let mut map = Self {
            bytes,
            point,
            is_assumed,
            rpm,
            depth_mm,
            columns: Arc::default(),
        };
        map.columns = (0..COLUMNS).map(|index| map.column(map.speed(index))).collect();
        Ok(map)
    }

    /// The same table at another working point.
    pub(crate) fn at(self, point: Option<WorkingPoint>) -> Result<Self, TableError> {
        let is_same = match point {
            Some(point) => !self.is_assumed && point == self.point,
            None => self.is_assumed,
        };
        if is_same {
            return Ok(self);
        }
        Self::new(self.bytes, point)
    }

    /// Speed in the middle of a column of the chart, rev/min.
    fn speed(&self, index: usize) -> f64 {
        let [from, to] = self.rpm;
        from + (index as f64 + 0.5) / COLUMNS as f64 * (to - from)
    }

    /// Columns of the chart, at [`COLUMNS`] speeds that share the range of the table: unstable depths, `None` where the
    /// table has none for this cut.
    pub(crate) fn columns(&self) -> &[Option<Column>] {
        &self.columns
    }

    /// Axial depth of the working point, mm; `None` if none is set.
    pub(crate) fn working_depth_mm(&self) -> Option<f64> {
        (!self.is_assumed).then(|| f64::from(self.point.axial_depth.0))
    }

    /// Unstable depths at a speed; `None` where the table has none for this cut.
    fn column(&self, rpm: f64) -> Option<Column> {
        let table = LobeTable::reopen(&self.bytes).ok()?;
        table.column(Rpm(rpm as f32), &self.point).ok()
    }

    /// Text of the reason why the table holds nothing at a speed for this cut; `None` if it does.
    pub(crate) fn obstacle(&self, rpm: f64) -> Option<String> {
        let table = LobeTable::reopen(&self.bytes).ok()?;
        let why = table.column(Rpm(rpm as f32), &self.point).err()?;
        Some(words::not_known(&why))
    }

    /// Depth at which the table has the next limit above the working depth, minus the working depth.
    pub(crate) fn margin(&self, rpm: f64) -> Margin {
        let Some(depth) = self.working_depth_mm() else {
            return Margin::NoDepth;
        };
        let Some(column) = self.column(rpm) else {
            return Margin::NotKnown(self.obstacle(rpm).unwrap_or_default());
        };
        match column.at(Millimeters(depth as f32)) {
            TabulatedStability::Stable { .. } => {}
            TabulatedStability::NotKnown(why) => return Margin::NotKnown(words::not_known(&why)),
            _ => {
                let limit = column.first_limit().map_or(0.0, |limit| f64::from(limit.from.0));
                return Margin::Unstable { limit_mm: limit };
            }
        }
        let above = column
            .intervals()
            .iter()
            .map(|interval| f64::from(interval.from.0));
        match above.filter(|from| *from >= depth).reduce(f64::min) {
            Some(limit_mm) => Margin::Below {
                limit_mm,
                margin_mm: limit_mm - depth,
            },
            None => Margin::Unlimited { to_mm: self.depth_mm },
        }
    }
}

/// Distance of the working depth from the limit of the table.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Margin {
    /// The cut is stable in the table, and becomes unstable at a larger depth.
    Below { limit_mm: f64, margin_mm: f64 },
    /// The cut is stable in the table down to its largest depth.
    Unlimited { to_mm: f64 },
    /// The cut is not stable in the table; its first limit lies at this depth.
    Unstable { limit_mm: f64 },
    /// No working point is set.
    NoDepth,
    /// The table does not cover the cut, for the given reason.
    NotKnown(String),
}

impl std::fmt::Display for Margin {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Below { limit_mm, margin_mm } => {
                write!(
                    f,
                    "{margin_mm:.2} mm below the limit of {limit_mm:.2} mm in the table"
                )
            }
            Self::Unlimited { to_mm } => write!(f, "stable in the table down to its end at {to_mm:.2} mm"),
            Self::Unstable { limit_mm } => {
                write!(
                    f,
                    "none: not stable at this depth in the table, whose first limit is {limit_mm:.2} mm"
                )
            }
            Self::NoDepth => f.write_str("not known: set the depth with `quietcut working-point`"),
            Self::NotKnown(why) => write!(f, "not known: {why}"),
        }
    }
}

/// Letter of a kind of unstable interval in the lobe chart.
pub(crate) fn letter(kind: IntervalKind) -> char {
    match kind {
        IntervalKind::Hopf => 'H',
        IntervalKind::Flip => 'D',
        IntervalKind::Fold => 'F',
        IntervalKind::Bistable => 'b',
        IntervalKind::Undecided => '?',
    }
}
