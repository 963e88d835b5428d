//! Values of a MAT-file: numbers split into channels, text, structures and cells.

use crate::raw::RawColumn;

/// A named value of a MAT-file: a variable, or a field of a structure.
#[derive(Debug)]
pub(super) struct Item {
    pub(super) name: String,
    pub(super) value: Value,
}

/// A value of the file.
#[derive(Debug)]
pub(super) enum Value {
    Numbers(Variable),
    Text(String),
    /// Elements of a structure array, each with its fields. Each element of a cell array is stored as an element with
    /// one field without name.
    Elements(Vec<Vec<Item>>),
}

/// A real numeric variable, split into channels; a row vector and a column vector are one channel.
#[derive(Debug)]
pub(super) struct Variable {
    pub(super) name: String,
    /// Samples of the variable, all channels equally long. Index: channel, then sample.
    pub(super) values: Vec<Vec<f64>>,
}

impl Variable {
    /// Number of samples per channel of a matrix, whose longer dimension is time.
    pub(super) fn samples(&self) -> usize {
        self.values.first().map_or(0, Vec::len)
    }

    /// Channels of a variable with their names: the name of the variable, with a number from 1 if it has several
    /// channels.
    pub(super) fn into_columns(self) -> Vec<RawColumn> {
        let is_one = self.values.len() == 1;
        let name = |index: usize| match is_one {
            true => self.name.clone(),
            false => format!("{}{}", self.name, index + 1),
        };
        self.values
            .into_iter()
            .enumerate()
            .map(|(index, samples)| RawColumn::without_unit(name(index), samples))
            .collect()
    }
}

impl Item {
    /// This value with the name of the structure field that holds it: a MAT-file stores elements of structures without
    /// names of their own.
    pub(super) fn named(mut self, name: &str) -> Self {
        self.name = name.into();
        if let Value::Numbers(variable) = &mut self.value {
            variable.name = name.into();
        }
        self
    }
}
