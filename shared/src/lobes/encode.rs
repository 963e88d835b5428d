//! Encoding of a lobe table into a buffer that the caller provides.

use super::additions::{Additions, direction_code};
use super::bytes::saturate;
use super::check::{check_layers, check_speeds, interval_order};
use super::format::{
    ERROR_GIVEN, HEADER_LENGTH, Header, MAX_INTERVALS, MODES_SHIFT, NAME_CAPACITY, SCHEMA, SCHEMA_ADDITIONS,
    SCHEMA_PLAIN, STEPS,
};
use super::shape::{Shape, kind_code};
use super::{Interval, IntervalKind, LobeTable, TableError, Validity, half};
use crate::units::{Millimeters, Rpm};
use crate::working_point::Limits;

/// The content of a table.
#[derive(Clone, Copy, Debug)]
pub struct Content<'a> {
    /// Name of the case from which the table is computed; at most [`NAME_CAPACITY`] bytes.
    pub name: &'a str,
    /// Number of teeth of the tool.
    pub teeth: u8,
    /// Speed limits of the machine's spindle, if known.
    pub limits: Option<Limits>,
    /// The smallest axial depth of the table.
    pub depth_from: Millimeters,
    /// The largest axial depth of the table.
    pub depth_to: Millimeters,
    /// Spindle speeds of the lobe table, strictly ascending, with steps of any size.
    pub speeds: &'a [Rpm],
    /// The layers, in any order.
    pub layers: &'a [Layer<'a>],
}

/// One layer of a table.
#[derive(Clone, Copy, Debug)]
pub struct Layer<'a> {
    /// The cuts (feed, immersion, posture) for which the layer is valid.
    pub validity: Validity,
    /// For each spindle speed of the table the unstable depth intervals, ascending and without overlaps. A speed whose
    /// computation failed has one interval of kind [`Undecided`](super::IntervalKind::Undecided) over all depths.
    pub columns: &'a [&'a [Interval]],
}

/// Length in bytes of the table that [`encode`] writes.
pub fn encoded_length(content: &Content<'_>) -> u64 {
    encoded_length_with(content, &Additions::default())
}

/// Length in bytes of the table that [`encode_with`] writes.
pub fn encoded_length_with(content: &Content<'_>, additions: &Additions<'_>) -> u64 {
    shape_of(content, additions).length()
}

/// Writes a lobe table of schema 1 into `buffer` and returns its bytes. The generation number in the header is 0.
pub fn encode<'b>(content: &Content<'_>, buffer: &'b mut [u8]) -> Result<&'b [u8], TableError> {
    encode_with(content, &Additions::default(), buffer)
}

/// Writes a lobe table with the optional parts of schema 2. If all of them are empty, and no interval is bistable, the
/// bytes are those of schema 1.
pub fn encode_with<'b>(
    content: &Content<'_>,
    additions: &Additions<'_>,
    buffer: &'b mut [u8],
) -> Result<&'b [u8], TableError> {
    let shape = shape_of(content, additions);
    shape.check()?;
    check_speeds(content.speeds.iter().copied())?;
    additions.check(shape.layers, shape.intervals)?;
    check_layers(content.layers.iter().enumerate().map(|(index, layer)| {
        let direction = additions.feed_directions.get(index).copied().flatten();
        (layer.validity, direction)
    }))?;
    if content.name.len() > NAME_CAPACITY {
        return Err(TableError::Name {
            length: saturate(content.name.len()),
        });
    }
    let (needed, found) = (shape.length(), buffer.len() as u64);
    let bytes = usize::try_from(needed)
        .ok()
        .filter(|_| needed <= u64::from(u32::MAX))
        .and_then(|length| buffer.get_mut(..length))
        .ok_or(TableError::Buffer { needed, found })?;

    let (head, payload) = bytes
        .split_at_mut_checked(HEADER_LENGTH)
        .ok_or(TableError::Buffer { needed, found })?;
    write_payload(content, additions, &shape, payload)?;
    let header = Header {
        schema: match (shape.has_bistable, shape.is_extended) {
            (true, _) => SCHEMA,
            (false, true) => SCHEMA_ADDITIONS,
            (false, false) => SCHEMA_PLAIN,
        },
        length: needed as u32,
        generation: 0,
        crc: 0,
    };
    head.copy_from_slice(&header.with_generation(0, payload).to_bytes());
    // The table that was just written must pass the checks of the reader.
    LobeTable::parse(bytes).map(|table| table.bytes())
}

fn shape_of(content: &Content<'_>, additions: &Additions<'_>) -> Shape {
    let intervals = || {
        content
            .layers
            .iter()
            .flat_map(|layer| layer.columns)
            .flat_map(|column| column.iter())
    };
    let has_bistable = intervals().any(|interval| interval.kind == IntervalKind::Bistable);
    Shape {
        teeth: content.teeth,
        limits: content.limits,
        depth_from_mm: content.depth_from.0,
        depth_to_mm: content.depth_to.0,
        // `f32::max` ignores a chatter frequency that is NaN. `write_column` refuses it later.
        chatter_max_hz: intervals().map(|i| i.chatter.0).fold(0.0, f32::max),
        layers: content.layers.len(),
        speeds: content.speeds.len(),
        intervals: intervals().count(),
        name_length: content.name.len(),
        is_extended: has_bistable || !additions.is_empty(),
        has_bistable,
        error_given: additions.interpolation_error.is_some(),
        modes: additions.mode_count(),
    }
}

fn write_payload(
    content: &Content<'_>,
    additions: &Additions<'_>,
    shape: &Shape,
    payload: &mut [u8],
) -> Result<(), TableError> {
    let mut writer = Writer { rest: payload };
    let limits = content.limits.unwrap_or(Limits {
        rpm_min: Rpm(0.0),
        rpm_max: Rpm(0.0),
    });
    writer.put(&[content.teeth, content.name.len() as u8]);
    writer.put(&(content.layers.len() as u16).to_le_bytes());
    writer.put(&(content.speeds.len() as u16).to_le_bytes());
    let mut flags = u16::from(content.limits.is_some());
    if shape.error_given {
        flags |= ERROR_GIVEN;
    }
    // `Additions::check` has limited the number of modes to `MODES_MAX`.
    flags |= (shape.modes as u16) << MODES_SHIFT;
    writer.put(&flags.to_le_bytes());
    for value in [
        limits.rpm_min.0,
        limits.rpm_max.0,
        shape.depth_from_mm,
        shape.depth_to_mm,
        shape.chatter_max_hz,
    ] {
        writer.put(&value.to_le_bytes());
    }
    writer.put(&saturate(shape.intervals).to_le_bytes());
    let mut name = [0; NAME_CAPACITY];
    for (slot, byte) in name.iter_mut().zip(content.name.bytes()) {
        *slot = byte;
    }
    writer.put(&name);
    write_layers(content, additions, &mut writer)?;
    for speed in content.speeds {
        writer.put(&speed.0.to_le_bytes());
    }
    for (index, layer) in content.layers.iter().enumerate() {
        write_column_starts(index, layer, &mut writer)?;
    }
    for (index, layer) in content.layers.iter().enumerate() {
        for (speed, column) in layer.columns.iter().enumerate() {
            write_column(shape, (index, speed), column, &mut writer)?;
        }
    }
    write_additions(additions, shape, &mut writer);
    Ok(())
}

fn write_additions(additions: &Additions<'_>, shape: &Shape, writer: &mut Writer<'_>) {
    if let Some(error) = additions.interpolation_error {
        writer.put(&error.depth.0.to_le_bytes());
        writer.put(&error.speed.to_le_bytes());
    }
    for mode in additions.modes.iter().copied().flatten() {
        writer.put(&mode.frequency.0.to_le_bytes());
        writer.put(&mode.damping_ratio.to_le_bytes());
    }
    for slopes in additions.slopes {
        for number in [&slopes.from, &slopes.to]
            .into_iter()
            .flat_map(|end| end.numbers(shape.modes))
        {
            writer.put(&half::encode(number).to_le_bytes());
        }
    }
}

fn write_layers(
    content: &Content<'_>,
    additions: &Additions<'_>,
    writer: &mut Writer<'_>,
) -> Result<(), TableError> {
    let mut first_interval = 0;
    for (index, layer) in content.layers.iter().enumerate() {
        if layer.columns.len() != content.speeds.len() {
            return Err(TableError::Columns {
                layer: saturate(index),
                found: saturate(layer.columns.len()),
                speeds: saturate(content.speeds.len()),
            });
        }
        let validity = layer.validity;
        for value in [
            validity.feed_from.0,
            validity.feed_to.0,
            validity.start.0,
            validity.exit.0,
        ] {
            writer.put(&value.to_le_bytes());
        }
        let direction = additions.feed_directions.get(index).copied().flatten();
        let code = direction.and_then(direction_code);
        writer.put(&[validity.posture, u8::from(code.is_some())]);
        writer.put(&code.unwrap_or(0).to_le_bytes());
        writer.put(&saturate(first_interval).to_le_bytes());
        first_interval += layer.columns.iter().map(|column| column.len()).sum::<usize>();
    }
    Ok(())
}

fn write_column_starts(index: usize, layer: &Layer<'_>, writer: &mut Writer<'_>) -> Result<(), TableError> {
    let mut start = 0_usize;
    writer.put(&0_u16.to_le_bytes());
    for (speed, column) in layer.columns.iter().enumerate() {
        start += column.len();
        let too_many = |found| TableError::TooManyIntervals {
            layer: saturate(index),
            speed: saturate(speed),
            found: saturate(found),
        };
        if column.len() > MAX_INTERVALS {
            return Err(too_many(column.len()));
        }
        let code = u16::try_from(start).map_err(|_| too_many(start))?;
        writer.put(&code.to_le_bytes());
    }
    Ok(())
}

fn write_column(
    shape: &Shape,
    (layer, speed): (usize, usize),
    column: &[Interval],
    writer: &mut Writer<'_>,
) -> Result<(), TableError> {
    let (mut end_mm, mut end_code) = (shape.depth_from_mm, 0);
    for (index, interval) in column.iter().enumerate() {
        let (from_mm, to_mm) = (interval.from.0, interval.to.0);
        // The negated comparison also refuses a depth that is NaN.
        if !(from_mm >= end_mm && from_mm < to_mm && to_mm <= shape.depth_to_mm) {
            return Err(interval_order(layer, speed, index));
        }
        if !(interval.chatter.0 >= 0.0 && interval.chatter.0.is_finite()) {
            return Err(TableError::Chatter {
                found: interval.chatter,
            });
        }
        // The bounds leave at least one depth step for this unstable interval and for each following one, so that
        // rounding removes no interval.
        let following = (column.len() - 1 - index) as u16;
        let top = u16::MAX.saturating_sub(following);
        let from = depth_code_down(shape, from_mm)
            .max(end_code)
            .min(top.saturating_sub(1));
        let to = depth_code_up(shape, to_mm).min(top).max(from.saturating_add(1));
        for code in [from, to, chatter_code(shape, interval.chatter.0)] {
            writer.put(&code.to_le_bytes());
        }
        writer.put(&[kind_code(interval.kind), 0]);
        (end_mm, end_code) = (to_mm, to);
    }
    Ok(())
}

/// A depth within this distance of a step of the 16-bit depth scale, in steps, is taken as exactly that step, so that a
/// decoded table encodes to the same bytes.
///
/// Decoding in f32 errs by up to 65 535·2⁻²⁴ = 0.004 steps from the step size, and by as much from each of two
/// roundings: 0.012.
const SNAP_STEPS: f64 = 0.02;

// Depth in steps of the 16-bit scale of the table. Double precision keeps the error far below `SNAP_STEPS`; only the
// host encodes tables.
fn depth_steps(shape: &Shape, depth_mm: f32) -> f64 {
    let range_mm = f64::from(shape.depth_to_mm) - f64::from(shape.depth_from_mm);
    (f64::from(depth_mm) - f64::from(shape.depth_from_mm)) / range_mm * f64::from(STEPS)
}

fn depth_code_down(shape: &Shape, depth_mm: f32) -> u16 {
    (depth_steps(shape, depth_mm) + SNAP_STEPS) as u16
}

fn depth_code_up(shape: &Shape, depth_mm: f32) -> u16 {
    let steps = depth_steps(shape, depth_mm) - SNAP_STEPS;
    let below = steps as u16;
    if f64::from(below) < steps {
        below.saturating_add(1)
    } else {
        below
    }
}

fn chatter_code(shape: &Shape, chatter_hz: f32) -> u16 {
    if chatter_hz == 0.0 {
        return 0;
    }
    let steps = f64::from(chatter_hz) / f64::from(shape.chatter_max_hz) * f64::from(STEPS);
    ((steps + 0.5) as u16).max(1)
}

/// Writes bytes of a lobe table to consecutive positions. The buffer length was computed from the same content, so
/// nothing is cut off.
struct Writer<'b> {
    rest: &'b mut [u8],
}

impl Writer<'_> {
    fn put(&mut self, piece: &[u8]) {
        let rest = core::mem::take(&mut self.rest);
        let (slot, rest) = rest.split_at_mut(piece.len().min(rest.len()));
        for (to, from) in slot.iter_mut().zip(piece) {
            *to = *from;
        }
        self.rest = rest;
    }
}
