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

/// A numeric variable, split into channels; a row vector and a column vector are one channel, of complex numbers two:
/// real part and imaginary part.
#[derive(Debug)]
pub(super) struct Variable {
    pub(super) name: String,
    /// Samples of the variable, all channels equally long. Index: channel, then sample.
    pub(super) values: Vec<Vec<f64>>,
    /// True if every second channel is the imaginary part of that before it.
    pub(super) is_complex: bool,
}

impl Variable {
    /// Number of samples per channel of a matrix, whose longer dimension is time.
    pub(super) fn samples(&self) -> usize {
        self.values.first().map_or(0, Vec::len)
    }

    /// The variable whose channels alternate with those of its imaginary parts.
    pub(super) fn with_imaginary(self, imaginary: Self) -> Self {
        Self {
            values: self
                .values
                .into_iter()
                .zip(imaginary.values)
                .flat_map(|(real, imaginary)| [real, imaginary])
                .collect(),
            is_complex: true,
            ..self
        }
    }

    /// Channels of a variable with their names: the name of the variable, with a number from 1 if it has several
    /// channels.
    pub(super) fn into_columns(self) -> Vec<RawColumn> {
        let parts = 1 + usize::from(self.is_complex);
        let is_one = self.values.len() == parts;
        let name = |index: usize| {
            let name = match is_one {
                true => self.name.clone(),
                false => format!("{}{}", self.name, index / parts + 1),
            };
            match (self.is_complex, index % parts) {
                (false, _) => name,
                (true, 0) => format!("{name} real"),
                (true, _) => format!("{name} imag"),
            }
        };
        self.values
            .into_iter()
            .enumerate()
            .map(|(index, samples)| RawColumn::without_unit(name(index), samples))
            .collect()
    }
}

/// Samples of a matrix in column-major order on their way into channels: the longer dimension is time.
pub(super) struct Channels {
    values: Vec<Vec<f64>>,
    /// True if rows are channels.
    in_rows: bool,
    /// Number of rows of the matrix.
    rows: usize,
    /// Number of samples for which a channel reserves memory at first.
    reserved: usize,
    /// Number of values so far.
    count: usize,
}

impl Channels {
    /// Channels of a matrix without values so far; at most `trusted` samples per channel are believed before they are
    /// read.
    pub(super) fn new(rows: usize, columns: usize, trusted: usize) -> Self {
        Self {
            values: Vec::new(),
            in_rows: rows < columns,
            rows,
            reserved: rows.max(columns).min(trusted),
            count: 0,
        }
    }

    /// Channels of a matrix of zeros.
    pub(super) fn zeros(rows: usize, columns: usize) -> Self {
        let (samples, channels) = (rows.max(columns), rows.min(columns));
        Self {
            values: vec![vec![0.0; samples]; channels],
            count: rows * columns,
            ..Self::new(rows, columns, samples)
        }
    }

    /// Channel and sample of the value with number `index` in column-major order.
    fn place(&self, index: usize) -> (usize, usize) {
        match self.in_rows {
            true => (index % self.rows, index / self.rows),
            false => (index / self.rows, index % self.rows),
        }
    }

    /// Adds the next value.
    pub(super) fn push(&mut self, value: f64) {
        let (channel, _) = self.place(self.count);
        self.count += 1;
        match self.values.get_mut(channel) {
            Some(samples) => samples.push(value),
            None => {
                let mut samples = Vec::with_capacity(self.reserved);
                samples.push(value);
                self.values.push(samples);
            }
        }
    }

    /// Replaces the value with number `index`; there is none beyond the matrix.
    pub(super) fn set(&mut self, index: usize, value: f64) {
        let (channel, sample) = self.place(index);
        if let Some(place) = self
            .values
            .get_mut(channel)
            .and_then(|samples| samples.get_mut(sample))
        {
            *place = value;
        }
    }

    /// The variable with these channels.
    pub(super) fn named(self, name: String) -> Variable {
        Variable {
            name,
            values: self.values,
            is_complex: false,
        }
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

/// The text of letters by their codes: bytes of UTF-8, or one code for each letter. Letters that UTF-16 stores as two
/// codes are dropped.
pub(super) fn text_of_codes(codes: &[u32], are_bytes: bool) -> String {
    if are_bytes {
        let bytes: Vec<u8> = codes.iter().map(|&code| code as u8).collect();
        return String::from_utf8_lossy(&bytes).into_owned();
    }
    codes.iter().filter_map(|&code| char::from_u32(code)).collect()
}
