//! A value for each row of a window.

use crate::stroboscope::CAPACITY;

/// A value for each row.
pub(super) type Column = [f32; CAPACITY];

pub(super) fn dot(a: &Column, b: &Column) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
