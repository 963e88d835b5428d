//! What is constant in a class, and a line: taken off all that is fitted.

use super::column::{Column, dot};
use crate::stroboscope::{CAPACITY, Window};

/// What is constant in a class, and a line: taken off every column.
pub(super) struct Nuisance {
    pub(super) length: usize,
    classes: usize,
    first_class: usize,
    /// The line without its class means.
    pub(super) line: Column,
    pub(super) line_square: f32,
}

impl Nuisance {
    pub(super) fn new(window: &Window<'_>) -> Self {
        let mut nuisance = Self {
            length: window.length(),
            classes: window.classes(),
            first_class: window.class(0),
            line: [0.0; CAPACITY],
            line_square: 0.0,
        };
        let mut line = [0.0; CAPACITY];
        for (row, slot) in line.iter_mut().enumerate().take(nuisance.length) {
            *slot = row as f32;
        }
        nuisance.take_class_means_off(&mut line);
        nuisance.line_square = line.iter().map(|x| x * x).sum();
        nuisance.line = line;
        nuisance
    }

    /// Class of a row.
    pub(super) fn class(&self, row: usize) -> usize {
        (self.first_class + row) % self.classes
    }

    fn take_class_means_off(&self, column: &mut Column) {
        for start in 0..self.classes.min(self.length) {
            let rows = || (start..self.length).step_by(self.classes);
            let sum: f32 = rows().filter_map(|row| column.get(row)).sum();
            let mean = sum / rows().count() as f32;
            for row in rows() {
                if let Some(value) = column.get_mut(row) {
                    *value -= mean;
                }
            }
        }
    }

    /// Takes class means and line off a column.
    pub(super) fn take_off(&self, column: &mut Column) {
        self.take_class_means_off(column);
        let part = dot(column, &self.line) / self.line_square;
        for (value, line) in column.iter_mut().zip(&self.line) {
            *value -= part * line;
        }
    }
}
