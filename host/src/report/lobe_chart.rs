//! Stability lobe diagram: stable axial depths over spindle speed, first limits with their kind, trial cuts. A limit is
//! a depth at which the dominant Floquet multiplier (characteristic multiplier) has the modulus 1.

use plotters::chart::SeriesLabelPosition;
use plotters::prelude::{Circle, LineSeries, PathElement, Polygon, Rectangle, WHITE};
use plotters::style::{Color, RGBColor};
use quietcut_core::lobes::{self, LobeTable};
use quietcut_core::units::{Millimeters, Rpm};

pub use crate::stability::StabilityLoss as LimitKind;

use super::marks::{Mark, draw_marks};
use super::picture::{Axes, BLUE, INK, Labels, ORANGE, PictureError, VIOLET, axes, draw, text};
use super::spindle_area::{SpindleArea, draw_spindle};
use crate::stability::SpeedLine;

/// Smallest axial depth at which stability is lost at one spindle speed, with the kind of loss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstLimit {
    /// Axial depth, mm.
    pub depth_mm: f64,
    /// Kind of the loss of stability: Hopf, flip or fold.
    pub kind: LimitKind,
}

/// Stability at one spindle speed: stable and undecided depths, first limit, percentiles.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Spindle speed, rev/min.
    pub rpm: f64,
    /// Stable axial depths at this speed, mm, as ascending intervals.
    pub stable_mm: Vec<(f64, f64)>,
    /// Undecided depths, mm, as ascending intervals in which the modulus of the dominant Floquet multiplier is 1 within
    /// the error of the method.
    pub undecided_mm: Vec<(f64, f64)>,
    /// Intervals of axial depth in which a second vibration is stable too, mm: stable unless something knocks the tool.
    pub bistable_mm: Vec<(f64, f64)>,
    /// First stability limit at this speed; `None` if none was found up to the largest computed depth, or if the lowest
    /// interval of a lobe table that is not stable is undecided.
    pub first_limit: Option<FirstLimit>,
    /// 5, 50 and 95 % percentiles of the first stability limit at this speed, mm; for an extended case the lower end of
    /// the 90 % interval of the limit, the limit, and the upper end. An entry is `None` if it is deeper than the
    /// largest computed depth. The field is `None` if no spread or interval of the limit is known.
    pub percentiles_mm: Option<[Option<f64>; 3]>,
}

impl Column {
    /// Stability at each spindle speed from one layer of a lobe table, with the depths that the table stores.
    pub fn of_table(table: &LobeTable<'_>, layer: usize) -> Vec<Self> {
        let speeds = table.speeds().enumerate();
        speeds
            .filter_map(|(index, speed)| Some(Self::of_entry(speed, &table.entry(layer, index)?)))
            .collect()
    }

    fn of_entry(speed: Rpm, entry: &lobes::Column) -> Self {
        let pair = |from: Millimeters, to: Millimeters| (f64::from(from.0), f64::from(to.0));
        let of_kind = |kind: lobes::IntervalKind| -> Vec<(f64, f64)> {
            let intervals = entry.intervals().iter().filter(|interval| interval.kind == kind);
            intervals
                .map(|interval| pair(interval.from, interval.to))
                .collect()
        };
        // Below a bistable interval nothing is lost yet: the limit is where the unstable depths above it begin.
        let mut unstable = entry
            .intervals()
            .iter()
            .filter(|interval| interval.kind != lobes::IntervalKind::Bistable);
        let first_limit = unstable.next().and_then(|interval| {
            let kind = match interval.kind {
                lobes::IntervalKind::Hopf => LimitKind::Hopf,
                lobes::IntervalKind::Flip => LimitKind::Flip,
                lobes::IntervalKind::Fold => LimitKind::Fold,
                lobes::IntervalKind::Undecided | lobes::IntervalKind::Bistable => return None,
            };
            Some(FirstLimit {
                depth_mm: f64::from(interval.from.0),
                kind,
            })
        });
        Self {
            rpm: f64::from(speed.0),
            stable_mm: entry.stable().map(|(from, to)| pair(from, to)).collect(),
            undecided_mm: of_kind(lobes::IntervalKind::Undecided),
            bistable_mm: of_kind(lobes::IntervalKind::Bistable),
            first_limit,
            percentiles_mm: None,
        }
    }
}

impl From<&SpeedLine> for Column {
    fn from(line: &SpeedLine) -> Self {
        Self {
            rpm: line.rpm,
            stable_mm: line.stable_mm.iter().map(|&[from, to]| (from, to)).collect(),
            undecided_mm: line.undecided_mm.iter().map(|&[from, to]| (from, to)).collect(),
            bistable_mm: line.bistable_mm.iter().map(|&[from, to]| (from, to)).collect(),
            first_limit: line.first_limit.map(|limit| FirstLimit {
                depth_mm: limit.depth_mm,
                kind: limit.kind,
            }),
            percentiles_mm: line.spread.as_ref().map(|spread| {
                let percentiles = spread.limit_percentiles_mm;
                [percentiles.low, percentiles.median, percentiles.high]
            }),
        }
    }
}

// Fill colour of stable areas. It is opaque, so that overlapping areas do not mix their colours.
const STABLE: RGBColor = RGBColor(0xd2, 0xea, 0xdc);
const BISTABLE: RGBColor = RGBColor(0xf7, 0xe3, 0xb5);
const UNDECIDED: RGBColor = RGBColor(0xd6, 0xd8, 0xdc);
const UNSTABLE: RGBColor = RGBColor(0xfa, 0xec, 0xec);

/// Width and height in pixels of the lobe diagram.
const SIZE: (u32, u32) = (960, 480);

/// Draws the stability lobe diagram as SVG. `columns` must be sorted by speed, with at least two different speeds;
/// depths range from 0 to `depth_max_mm`.
///
/// # Errors
/// There are fewer than two speeds or no depth, or the drawing library fails.
pub fn lobe_chart(
    title: &str,
    columns: &[Column],
    depth_max_mm: f64,
    marks: &[Mark],
) -> Result<String, PictureError> {
    lobe_chart_of_spindle(title, columns, depth_max_mm, marks, None)
}

/// Draws the stability lobe diagram as [`lobe_chart`], with what the spindle can reach if that is known.
///
/// # Errors
/// As [`lobe_chart`].
pub fn lobe_chart_of_spindle(
    title: &str,
    columns: &[Column],
    depth_max_mm: f64,
    marks: &[Mark],
    spindle: Option<&SpindleArea>,
) -> Result<String, PictureError> {
    let (Some(first), Some(last)) = (columns.first(), columns.last()) else {
        return Err(PictureError::nothing("a chart needs at least two speeds"));
    };
    if !(last.rpm > first.rpm && depth_max_mm > 0.0) {
        return Err(PictureError::nothing(
            "a chart needs at least two speeds and a depth",
        ));
    }
    let labels = Labels {
        title,
        x: "spindle speed [rev/min]",
        y: "axial depth of cut [mm]",
    };
    draw(SIZE, |canvas| {
        let mut chart = axes(canvas, &labels, first.rpm..last.rpm, 0.0..depth_max_mm)?;
        chart.draw_series([Rectangle::new(
            [(first.rpm, 0.0), (last.rpm, depth_max_mm)],
            UNSTABLE.filled(),
        )])?;
        let stable = areas(columns, |column| &column.stable_mm);
        chart.draw_series(stable.into_iter().map(|area| Polygon::new(area, STABLE)))?;
        draw_bistable(&mut chart, columns)?;
        draw_undecided(&mut chart, columns, depth_max_mm)?;
        draw_percentiles(&mut chart, columns, depth_max_mm)?;
        for kind in [LimitKind::Hopf, LimitKind::Flip, LimitKind::Fold] {
            draw_limits(&mut chart, columns, depth_max_mm, kind)?;
        }
        if let Some(area) = spindle {
            draw_spindle(&mut chart, area, [first.rpm, last.rpm], depth_max_mm)?;
        }
        draw_marks(canvas, &mut chart, marks)?;
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.85))
            .border_style(INK.mix(0.3))
            .label_font(text(13, INK))
            .draw()?;
        Ok(())
    })
}

/// Draws the bistable depths of a lobe diagram over the stable ones.
fn draw_bistable(chart: &mut Axes<'_, '_>, columns: &[Column]) -> Result<(), PictureError> {
    let areas = areas(columns, |column| &column.bistable_mm);
    if areas.is_empty() {
        return Ok(());
    }
    chart
        .draw_series(areas.into_iter().map(|area| Polygon::new(area, BISTABLE)))?
        .label("bistable: stable unless knocked")
        .legend(|(x, y)| Rectangle::new([(x, y - 4), (x + 18, y + 4)], BISTABLE.filled()));
    Ok(())
}

/// Draws the undecided depths of a lobe diagram, if any interval of them is at least about one pixel high.
fn draw_undecided(
    chart: &mut Axes<'_, '_>,
    columns: &[Column],
    depth_max_mm: f64,
) -> Result<(), PictureError> {
    let pixel_mm = depth_max_mm / f64::from(SIZE.1);
    let intervals = columns.iter().flat_map(|column| &column.undecided_mm);
    if intervals.clone().all(|(from, to)| to - from < pixel_mm) {
        return Ok(());
    }
    let areas = areas(columns, |column| &column.undecided_mm);
    chart
        .draw_series(areas.into_iter().map(|area| Polygon::new(area, UNDECIDED)))?
        .label("undecided: within the error")
        .legend(|(x, y)| Rectangle::new([(x, y - 4), (x + 18, y + 4)], UNDECIDED.filled()));
    Ok(())
}

/// Draws the band between the 5 and 95 % percentiles of the first stability limit, and lines along the 5, 50 and 95 %
/// percentiles; nothing if fewer than two speeds have percentiles.
fn draw_percentiles(
    chart: &mut Axes<'_, '_>,
    columns: &[Column],
    depth_max_mm: f64,
) -> Result<(), PictureError> {
    let known: Vec<(f64, [f64; 3])> = columns
        .iter()
        .filter_map(|column| {
            let percentiles = column.percentiles_mm?;
            Some((
                column.rpm,
                percentiles.map(|depth| depth.unwrap_or(depth_max_mm).min(depth_max_mm)),
            ))
        })
        .collect();
    if known.len() < 2 {
        return Ok(());
    }
    let along = |index: usize| known.iter().map(move |&(rpm, depths)| (rpm, depths[index]));
    let band: Vec<(f64, f64)> = along(0).chain(along(2).rev()).collect();
    chart
        .draw_series([Polygon::new(band, INK.mix(0.12))])?
        .label("5 to 95 % percentiles of the limit")
        .legend(|(x, y)| Rectangle::new([(x, y - 4), (x + 18, y + 4)], INK.mix(0.12).filled()));
    for (index, width) in [(0, 1), (1, 2), (2, 1)] {
        chart.draw_series(LineSeries::new(along(index), INK.mix(0.5).stroke_width(width)))?;
    }
    Ok(())
}

fn limit_look(kind: LimitKind) -> (RGBColor, &'static str) {
    match kind {
        LimitKind::Hopf => (BLUE, "limit: Hopf"),
        LimitKind::Flip => (ORANGE, "limit: period doubling (flip)"),
        LimitKind::Fold => (VIOLET, "limit: fold"),
    }
}

/// Polygons of depth intervals over the spindle speed: trapezoids between two neighbouring speeds with equally many
/// intervals, else rectangles to the midpoint between the speeds.
fn areas(columns: &[Column], intervals: impl Fn(&Column) -> &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
    let mut areas = Vec::new();
    for (left, right) in columns.iter().zip(columns.iter().skip(1)) {
        if intervals(left).len() == intervals(right).len() {
            for (&(a, b), &(c, d)) in intervals(left).iter().zip(intervals(right)) {
                areas.push(vec![(left.rpm, a), (right.rpm, c), (right.rpm, d), (left.rpm, b)]);
            }
        } else {
            let middle = 0.5 * (left.rpm + right.rpm);
            for (column, from, to) in [(left, left.rpm, middle), (right, middle, right.rpm)] {
                for &(a, b) in intervals(column) {
                    areas.push(vec![(from, a), (to, a), (to, b), (from, b)]);
                }
            }
        }
    }
    areas
}

/// Draws the first stability limits of one kind (Hopf, flip or fold) as lines.
fn draw_limits(
    chart: &mut Axes<'_, '_>,
    columns: &[Column],
    depth_max_mm: f64,
    kind: LimitKind,
) -> Result<(), PictureError> {
    let (color, name) = limit_look(kind);
    for (index, run) in limit_runs(columns, depth_max_mm, kind).into_iter().enumerate() {
        // A run of a single speed has no line to draw; the circle at each point of a run marks it.
        chart.draw_series(run.iter().map(|&at| Circle::new(at, 1, color.filled())))?;
        let line = chart.draw_series(LineSeries::new(run, color.stroke_width(3)))?;
        if index == 0 {
            line.label(name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(3)));
        }
    }
    Ok(())
}

/// Runs of neighbouring spindle speeds whose first stability limit has kind `kind`; a run extends to the midpoint
/// towards a neighbour of another kind.
fn limit_runs(columns: &[Column], depth_max_mm: f64, kind: LimitKind) -> Vec<Vec<(f64, f64)>> {
    let visible = |column: &Column| column.first_limit.filter(|limit| limit.depth_mm <= depth_max_mm);
    let mut runs: Vec<Vec<(f64, f64)>> = Vec::new();
    let mut open = false;
    for (index, column) in columns.iter().enumerate() {
        let Some(limit) = visible(column) else {
            open = false;
            continue;
        };
        let neighbour = index.checked_sub(1).and_then(|before| columns.get(before));
        let half_way = neighbour.and_then(|before| {
            let there = visible(before)?;
            let depth_mm = 0.5 * (limit.depth_mm + there.depth_mm);
            (there.kind != limit.kind).then_some((0.5 * (column.rpm + before.rpm), depth_mm))
        });
        match (limit.kind == kind, runs.last_mut()) {
            (true, Some(run)) if open => run.push((column.rpm, limit.depth_mm)),
            (true, _) => runs.push(
                half_way
                    .into_iter()
                    .chain([(column.rpm, limit.depth_mm)])
                    .collect(),
            ),
            (false, Some(run)) if open => run.extend(half_way),
            (false, _) => {}
        }
        open = limit.kind == kind;
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::marks::MarkKind;

    fn column(rpm: f64, stable_mm: &[(f64, f64)], kind: LimitKind) -> Column {
        let first_limit = stable_mm
            .first()
            .map(|&(_, depth_mm)| FirstLimit { depth_mm, kind });
        Column {
            rpm,
            stable_mm: stable_mm.to_vec(),
            undecided_mm: Vec::new(),
            bistable_mm: Vec::new(),
            first_limit,
            percentiles_mm: None,
        }
    }

    #[test]
    fn areas_follow_the_intervals() {
        let columns = [
            column(1000.0, &[(0.0, 2.0)], LimitKind::Hopf),
            column(1010.0, &[(0.0, 1.6)], LimitKind::Flip),
            column(1020.0, &[(0.0, 1.5), (2.3, 2.7)], LimitKind::Flip),
        ];
        let areas = areas(&columns, |column| &column.stable_mm);
        assert_eq!(
            areas[0],
            [(1000.0, 0.0), (1010.0, 0.0), (1010.0, 1.6), (1000.0, 2.0)]
        );
        // The stable island begins midway between 1010 and 1020 rev/min: one area on the left, two on the right.
        assert_eq!(areas.len(), 4);
        assert_eq!(
            areas[3],
            [(1015.0, 2.3), (1020.0, 2.3), (1020.0, 2.7), (1015.0, 2.7)]
        );
    }

    #[test]
    fn limits_of_two_kinds_meet_half_way() {
        let columns = [
            column(1000.0, &[(0.0, 2.0)], LimitKind::Hopf),
            column(1010.0, &[(0.0, 1.8)], LimitKind::Hopf),
            column(1020.0, &[(0.0, 1.4)], LimitKind::Flip),
            column(1030.0, &[(0.0, 9.0)], LimitKind::Hopf),
        ];
        let hopf = limit_runs(&columns, 4.0, LimitKind::Hopf);
        assert_eq!(hopf, [vec![(1000.0, 2.0), (1010.0, 1.8), (1015.0, 1.6)]]);
        assert_eq!(
            limit_runs(&columns, 4.0, LimitKind::Flip),
            [vec![(1015.0, 1.6), (1020.0, 1.4)]]
        );
    }

    #[test]
    fn the_chart_names_its_kinds_and_points() {
        let columns = [
            column(600.0, &[(0.0, 3.0)], LimitKind::Hopf),
            column(1045.0, &[(0.0, 1.3)], LimitKind::Flip),
            column(1200.0, &[(0.0, 2.0)], LimitKind::Hopf),
        ];
        let mark = Mark {
            rpm: 1045.0,
            depth_mm: 2.0,
            kind: MarkKind::Chatter,
            label: "first cut".into(),
            advice: Some((1150.0, 2.0)),
            wrong: false,
        };
        let svg = lobe_chart("robot", &columns, 4.0, &[mark]).unwrap();
        for said in [
            "robot",
            "limit: Hopf",
            "limit: period doubling (flip)",
            "first cut",
            "rev/min",
        ] {
            assert!(svg.contains(said), "{said}");
        }
        assert!(!svg.contains("limit: fold"));
    }

    #[test]
    fn an_empty_chart_is_refused() {
        let one = [column(600.0, &[(0.0, 3.0)], LimitKind::Hopf)];
        assert!(lobe_chart("", &one, 4.0, &[]).is_err());
        assert!(lobe_chart("", &[], 4.0, &[]).is_err());
    }

    #[test]
    fn a_table_is_drawn_as_the_device_has_it() {
        use quietcut_core::lobes::{Content, Interval, IntervalKind, Layer, Validity, encode};
        use quietcut_core::units::{Degrees, Hertz};

        let interval = |from: f32, to: f32, kind| Interval {
            from: Millimeters(from),
            to: Millimeters(to),
            kind,
            chatter: Hertz(17.0),
        };
        let columns = [
            &[
                interval(1.25, 1.5, IntervalKind::Bistable),
                interval(1.5, 2.25, IntervalKind::Flip),
                interval(2.75, 4.0, IntervalKind::Hopf),
            ][..],
            &[interval(0.0, 4.0, IntervalKind::Undecided)][..],
        ];
        let validity = Validity {
            feed_from: Millimeters(0.15),
            feed_to: Millimeters(0.15),
            start: Degrees(90.0),
            exit: Degrees(180.0),
            posture: 0,
        };
        let content = Content {
            name: "robot",
            teeth: 2,
            limits: None,
            depth_from: Millimeters(0.0),
            depth_to: Millimeters(4.0),
            speeds: &[Rpm(1036.0), Rpm(1040.0)],
            layers: &[Layer {
                validity,
                columns: &columns,
            }],
        };
        let mut buffer = [0; 1024];
        let bytes = encode(&content, &mut buffer).unwrap();
        let columns = Column::of_table(&LobeTable::parse(bytes).unwrap(), 0);
        // Table entries are rounded to the safe side by at most one step of the 16-bit grid, 4 mm / 65535.
        let step = 4.0 / 65_535.0;
        let near = |a: f64, b: f64| (a - b).abs() <= step;
        assert_eq!((columns.len(), columns[0].stable_mm.len()), (2, 2));
        let (from, to) = columns[0].stable_mm[1];
        assert!(near(from, 2.25) && near(to, 2.75), "{columns:?}");
        let limit = columns[0].first_limit.unwrap();
        assert!(near(limit.depth_mm, 1.5) && limit.kind == LimitKind::Flip);
        assert!(columns[1].stable_mm.is_empty() && columns[1].first_limit.is_none());
        assert_eq!(columns[1].undecided_mm.len(), 1);
        let [(from, to)] = columns[0].bistable_mm[..] else {
            panic!("{columns:?}");
        };
        assert!(near(from, 1.25) && near(to, 1.5), "{columns:?}");
        let chart = lobe_chart("robot", &columns, 4.0, &[]).unwrap();
        assert!(chart.contains("bistable: stable unless knocked"));
    }
}
