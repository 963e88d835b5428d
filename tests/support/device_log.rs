//! Decoder of the device's log: defmt frames, and the image whose symbols contain the format strings.

use std::collections::HashMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use defmt_parser::{Fragment, ParserMode, Type};
use object::{Object, ObjectSymbol};

/// Decodes frames to one line per entry. Frames that cannot be decoded are shown as bytes.
pub fn decode(image: &Path, frames: &[u8]) -> String {
    let strings = match Strings::read(image) {
        Ok(strings) => strings,
        Err(why) => return format!("{} bytes of log, but {why}\n", frames.len()),
    };
    let mut text = String::new();
    for frame in frames.split(|&byte| byte == 0).filter(|frame| !frame.is_empty()) {
        let line = rzcobs::decode(frame).ok().and_then(|bytes| strings.line(&bytes));
        match line {
            Some(line) => text.push_str(&line),
            None => write!(text, "not decoded: {frame:02x?}").unwrap_or_default(),
        }
        text.push('\n');
    }
    text
}

/// The format strings of an image by their index, which is the address of their symbol.
struct Strings {
    by_index: HashMap<u16, (String, String)>,
    timestamp: Option<String>,
}

impl Strings {
    fn read(image: &Path) -> Result<Self, String> {
        let bytes = fs::read(image).map_err(|error| format!("{}: {error}", image.display()))?;
        let elf = object::File::parse(&*bytes).map_err(|error| format!("{}: {error}", image.display()))?;
        let mut strings = Self {
            by_index: HashMap::new(),
            timestamp: None,
        };
        for symbol in elf.symbols() {
            // The symbols of the log have JSON objects with tag and text as names.
            let Some(name) = symbol.name().ok().filter(|name| name.starts_with('{')) else {
                continue;
            };
            let Ok(name) = serde_json::from_str::<serde_json::Value>(name) else {
                continue;
            };
            let part = |key: &str| name[key].as_str().unwrap_or_default().to_owned();
            let (tag, text) = (part("tag"), part("data"));
            if tag == "defmt_timestamp" {
                strings.timestamp = Some(text);
            } else if let Ok(index) = u16::try_from(symbol.address()) {
                strings.by_index.insert(index, (tag, text));
            }
        }
        Ok(strings)
    }

    fn line(&self, bytes: &[u8]) -> Option<String> {
        let mut rest = Bytes(bytes);
        let (tag, format) = self.by_index.get(&u16::from_le_bytes(rest.take()?))?;
        let time = match &self.timestamp {
            Some(format) => self.arguments(format, &mut rest)?,
            None => String::new(),
        };
        let level = tag.trim_start_matches("defmt_").to_uppercase();
        Some(format!("{time} {level} {}", self.arguments(format, &mut rest)?))
    }

    /// Inserts the arguments, read in the order of their indices, into a format string.
    fn arguments(&self, format: &str, rest: &mut Bytes<'_>) -> Option<String> {
        let fragments = defmt_parser::parse(format, ParserMode::ForwardsCompatible).ok()?;
        let mut parameters: Vec<_> = fragments
            .iter()
            .filter_map(|fragment| match fragment {
                Fragment::Parameter(parameter) => Some((parameter.index, &parameter.ty)),
                Fragment::Literal(_) => None,
            })
            .collect();
        parameters.sort_by_key(|(index, _)| *index);
        parameters.dedup_by_key(|(index, _)| *index);
        let mut values = HashMap::new();
        for (index, kind) in parameters {
            values.insert(index, self.value(kind, rest)?);
        }
        fragments
            .iter()
            .map(|fragment| match fragment {
                Fragment::Literal(text) => Some(text.to_string()),
                Fragment::Parameter(parameter) => values.get(&parameter.index).cloned(),
            })
            .collect()
    }

    fn value(&self, kind: &Type, rest: &mut Bytes<'_>) -> Option<String> {
        Some(match kind {
            Type::Bool => (rest.take::<1>()? != [0]).to_string(),
            Type::U8 => u8::from_le_bytes(rest.take()?).to_string(),
            Type::U16 => u16::from_le_bytes(rest.take()?).to_string(),
            Type::U32 | Type::Usize => u32::from_le_bytes(rest.take()?).to_string(),
            Type::U64 => u64::from_le_bytes(rest.take()?).to_string(),
            Type::I8 => i8::from_le_bytes(rest.take()?).to_string(),
            Type::I16 => i16::from_le_bytes(rest.take()?).to_string(),
            Type::I32 | Type::Isize => i32::from_le_bytes(rest.take()?).to_string(),
            Type::I64 => i64::from_le_bytes(rest.take()?).to_string(),
            Type::F32 => f32::from_le_bytes(rest.take()?).to_string(),
            Type::F64 => f64::from_le_bytes(rest.take()?).to_string(),
            Type::IStr => self.by_index.get(&u16::from_le_bytes(rest.take()?))?.1.clone(),
            Type::Str => {
                let length = u32::from_le_bytes(rest.take()?) as usize;
                String::from_utf8(rest.slice(length)?.to_vec()).ok()?
            }
            Type::Debug | Type::Display => {
                let length = rest.0.iter().position(|&byte| byte == 0xff)?;
                let text = String::from_utf8(rest.slice(length)?.to_vec()).ok()?;
                rest.slice(1)?;
                text
            }
            Type::Format => {
                let (_, format) = self.by_index.get(&u16::from_le_bytes(rest.take()?))?;
                if format.contains('|') {
                    // An enum: the string contains all its variants, and one byte selects the variant.
                    let variant = usize::from(rest.take::<1>()?[0]);
                    self.arguments(format.split('|').nth(variant)?, rest)?
                } else {
                    self.arguments(format, rest)?
                }
            }
            _ => return None,
        })
    }
}

struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.slice(N)?.try_into().ok()
    }

    fn slice(&mut self, length: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(taken)
    }
}
