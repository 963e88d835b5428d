//! Segments of a TDMS file: lead-in, objects with properties and layout of their samples, and the samples.

use std::collections::BTreeMap;

use super::bytes::{Bytes, size_of_kind};

/// Length of the lead-in, the fixed first part of each segment of a TDMS file, bytes.
const LEAD_IN: usize = 28;

/// Bits of the table of contents in the lead-in of a TDMS segment: what the segment contains, and in which form.
const HAS_METADATA: u32 = 1 << 1;
const HAS_NEW_OBJECTS: u32 = 1 << 2;
const HAS_SAMPLES: u32 = 1 << 3;
const IS_INTERLEAVED: u32 = 1 << 5;
const IS_BIG_ENDIAN: u32 = 1 << 6;
const IS_DAQMX: u32 = 1 << 7;

/// Type of a text.
const TEXT: u32 = 0x20;

/// An object of a TDMS file, that is a channel, a group or the root, with its properties and all its numeric samples.
pub(super) struct Object {
    pub(super) path: String,
    pub(super) properties: BTreeMap<String, Property>,
    pub(super) samples: Vec<f64>,
    layout: Option<Layout>,
}

/// Value of a property.
pub(super) enum Property {
    Number(f64),
    Text(String),
}

/// Layout of the samples of one channel in one chunk of a TDMS segment.
#[derive(Clone, Copy)]
struct Layout {
    kind: u32,
    /// Number of values per chunk.
    count: u64,
    /// Length per chunk, bytes.
    bytes: u64,
}

/// Reads all objects (channels, groups, root) of a TDMS file.
pub(super) fn objects(data: &[u8]) -> Result<Vec<Object>, String> {
    let mut objects: Vec<Object> = Vec::new();
    // Indices in `objects` of the channels that have samples in the present segment.
    let mut active: Vec<usize> = Vec::new();
    let mut at = 0;
    while at + LEAD_IN <= data.len() {
        let mut lead = Bytes {
            data,
            at,
            is_big_endian: false,
        };
        let mark = lead.take(4)?;
        if mark != b"TDSm" {
            return Err(format!(
                "no TDMS file: a segment with the mark TDSm is needed at byte {at}"
            ));
        }
        let contents = lead.u32()?;
        lead.is_big_endian = contents & IS_BIG_ENDIAN != 0;
        let _version = lead.u32()?;
        let (next, samples) = (lead.u64()?, lead.u64()?);
        let start = at + LEAD_IN;
        let rest = (data.len() - start) as u64;
        // A TDMS segment that was not closed has an offset of all ones to the next segment; such a segment reaches to
        // the end of the file.
        let end = start + usize::try_from(next.min(rest)).unwrap_or(0);
        let first = start + usize::try_from(samples.min(rest)).unwrap_or(0);
        if contents & HAS_METADATA != 0 {
            if contents & HAS_NEW_OBJECTS != 0 {
                active.clear();
            }
            metadata(&mut lead, &mut objects, &mut active)?;
        }
        if contents & HAS_SAMPLES != 0 && first < end {
            if contents & IS_DAQMX != 0 {
                return Err("raw data of DAQmx are not read; save the file with scaled samples".into());
            }
            let mut raw = Bytes {
                data: &data[..end],
                at: first,
                is_big_endian: lead.is_big_endian,
            };
            read_samples(&mut raw, &mut objects, &active, contents & IS_INTERLEAVED != 0)?;
        }
        at = end;
    }
    if objects.is_empty() {
        return Err(format!(
            "{} bytes; a TDMS file begins with a segment TDSm of {LEAD_IN} bytes",
            data.len()
        ));
    }
    Ok(objects)
}

/// Reads the metadata of a TDMS segment: for each object its properties and, if it has samples, their layout.
fn metadata(bytes: &mut Bytes<'_>, objects: &mut Vec<Object>, active: &mut Vec<usize>) -> Result<(), String> {
    let count = bytes.u32()?;
    for _ in 0..count {
        let path = bytes.text()?;
        let index = objects
            .iter()
            .position(|object| object.path == path)
            .unwrap_or_else(|| {
                objects.push(Object {
                    path: path.clone(),
                    properties: BTreeMap::new(),
                    samples: Vec::new(),
                    layout: None,
                });
                objects.len() - 1
            });
        match bytes.u32()? {
            u32::MAX => {}
            // As in the segment before.
            0 => {
                if objects[index].layout.is_some() && !active.contains(&index) {
                    active.push(index);
                }
            }
            0x6912_0000 | 0x6913_0000 => {
                return Err(format!(
                    "channel {path} has raw data of DAQmx, which are not read; save the file with scaled samples"
                ));
            }
            _ => {
                let kind = bytes.u32()?;
                let _dimension = bytes.u32()?;
                let count = bytes.u64()?;
                let length = match size_of_kind(kind) {
                    Some(size) => count.checked_mul(size as u64),
                    None if kind == TEXT => Some(bytes.u64()?),
                    None => {
                        return Err(format!(
                            "channel {path} has values of type {kind}, which is not read"
                        ));
                    }
                };
                let length = length
                    .filter(|length| *length <= bytes.data.len() as u64)
                    .ok_or_else(|| {
                        format!(
                            "channel {path} has {count} values, more than the file can hold: it is damaged"
                        )
                    })?;
                objects[index].layout = Some(Layout {
                    kind,
                    count,
                    bytes: length,
                });
                if !active.contains(&index) {
                    active.push(index);
                }
            }
        }
        let properties = bytes.u32()?;
        for _ in 0..properties {
            let name = bytes.text()?;
            let kind = bytes.u32()?;
            let value = if kind == TEXT {
                Some(Property::Text(bytes.text()?))
            } else if let Some(number) = bytes.number(kind)? {
                Some(Property::Number(number))
            } else {
                let size = size_of_kind(kind)
                    .ok_or_else(|| format!("property \"{name}\" has type {kind}, which is not read"))?;
                bytes.take(size)?;
                None
            };
            if let Some(value) = value {
                objects[index].properties.insert(name, value);
            }
        }
    }
    Ok(())
}

/// Reads the numeric samples of a TDMS segment chunk by chunk; an incomplete last chunk is left out. In each chunk the
/// values stand channel after channel, or interleaved.
fn read_samples(
    bytes: &mut Bytes<'_>,
    objects: &mut [Object],
    active: &[usize],
    is_interleaved: bool,
) -> Result<(), String> {
    let layouts: Vec<(usize, Layout)> = active
        .iter()
        .filter_map(|&index| objects[index].layout.map(|layout| (index, layout)))
        .collect();
    let chunk: u64 = layouts.iter().map(|(_, layout)| layout.bytes).sum();
    if chunk == 0 {
        return Ok(());
    }
    let chunks = (bytes.data.len() - bytes.at) as u64 / chunk;
    for _ in 0..chunks {
        if is_interleaved {
            let rows = layouts.first().map_or(0, |(_, layout)| layout.count);
            if layouts
                .iter()
                .any(|(_, layout)| layout.count != rows || layout.kind == TEXT)
            {
                return Err(
                    "interleaved channels with different numbers of samples: the file is damaged".into(),
                );
            }
            for _ in 0..rows {
                for (index, layout) in &layouts {
                    value(bytes, *layout, &mut objects[*index].samples)?;
                }
            }
            continue;
        }
        for (index, layout) in &layouts {
            if layout.kind == TEXT {
                bytes.take(layout.bytes as usize)?;
                continue;
            }
            for _ in 0..layout.count {
                value(bytes, *layout, &mut objects[*index].samples)?;
            }
        }
    }
    Ok(())
}

/// Reads one value of a TDMS channel; time stamps and truth values are no samples and are skipped.
fn value(bytes: &mut Bytes<'_>, layout: Layout, samples: &mut Vec<f64>) -> Result<(), String> {
    match bytes.number(layout.kind)? {
        Some(number) => samples.push(number),
        None => {
            bytes.take(size_of_kind(layout.kind).unwrap_or(0))?;
        }
    }
    Ok(())
}
