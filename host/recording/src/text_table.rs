//! Tables as other programs write them, as text or in a MAT-file: columns of numbers with name and unit.

use std::path::Path;

use super::raw::FoundUnit;
use super::{Format, RecordingError, csv, mat};

/// Columns of a text table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TextTable {
    /// Columns of the text table in the order of the file.
    pub columns: Vec<TextColumn>,
    /// Facts about the reading of the text table: separator, decimal mark, encoding, omitted columns.
    pub notes: Vec<String>,
}

/// One column of a text table.
#[derive(Clone, Debug, PartialEq)]
pub struct TextColumn {
    /// Name of the column; its number if the file gives it none.
    pub name: String,
    /// Unit of the column as the file states it; `None` if it states none.
    pub unit: Option<String>,
    /// Number of the column in the file, from 1.
    pub number: usize,
    /// Values, without conversion.
    pub values: Vec<f64>,
}

impl TextTable {
    /// Reads a text table with comma, semicolon, tab or blanks between the columns, and decimal point or comma.
    ///
    /// # Errors
    /// The file cannot be read or has no values; a line has text among its numbers, or another number of
    /// values than the head; commas are both separator and decimal mark; a value is NaN, infinite or missing.
    pub fn read(path: &Path) -> Result<Self, RecordingError> {
        let raw = match Format::of(path)? {
            Format::Mat => match mat::read(path)?.as_mut_slice() {
                [record] => std::mem::take(record),
                records => {
                    return Err(RecordingError::Content {
                        path: path.into(),
                        what: format!("{} records in it; a table is one", records.len()),
                    });
                }
            },
            _ => csv::read(path, false)?,
        };
        let numbers: Vec<usize> = (0..raw.columns.len()).map(|index| raw.number(index)).collect();
        let columns = raw
            .columns
            .into_iter()
            .zip(numbers)
            .map(|(column, number)| TextColumn {
                number,
                name: column.name,
                unit: match column.unit {
                    FoundUnit::Text(unit) => Some(unit),
                    _ => None,
                },
                values: column.samples,
            });
        Ok(Self {
            columns: columns.collect(),
            notes: raw.notes,
        })
    }

    /// Names of the columns of a text file, with their units in brackets, from its head alone; empty if there are none
    /// or the head cannot be understood.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn titles(path: &Path) -> Result<Vec<String>, RecordingError> {
        match Format::of(path)? {
            Format::Mat => Ok(mat::read(path)?
                .into_iter()
                .flat_map(|record| record.columns)
                .map(|column| column.name)
                .collect()),
            _ => csv::titles(path),
        }
    }
}
