//! A tooth passing as a row: eight angles of each axis as five harmonics of the tooth period.

use crate::synchronous::{CHANNELS, SLOTS, ToothPassing};

/// Harmonics of the tooth period that eight angles tell apart.
pub(super) const GROUPS: usize = SLOTS / 2 + 1;

/// Place of each group of values in a row: cosines and sines of harmonics 1 to 3 for three axes, one value for 0 and 4.
pub(super) const ENDS: [(usize, usize); GROUPS] = [(0, 3), (3, 9), (9, 15), (15, 21), (21, CHANNELS)];

/// Values of a tooth passing, harmonic by harmonic; the transform keeps the sum of squares.
pub(super) type Row = [f32; CHANNELS];

/// Transforms a tooth passing.
pub(super) fn row(passing: &ToothPassing) -> Row {
    const H: f32 = core::f32::consts::FRAC_1_SQRT_2;
    let mut row = [0.0; CHANNELS];
    for axis in 0..3 {
        let x: [f32; SLOTS] = core::array::from_fn(|slot| passing[3 * slot + axis]);
        let (s04, d04) = (x[0] + x[4], x[0] - x[4]);
        let (s15, d15) = (x[1] + x[5], x[1] - x[5]);
        let (s26, d26) = (x[2] + x[6], x[2] - x[6]);
        let (s37, d37) = (x[3] + x[7], x[3] - x[7]);
        let (even, odd) = (s04 + s26, s15 + s37);
        let (p, q) = (H * (d15 - d37), H * (d15 + d37));
        row[axis] = 0.5 * H * (even + odd);
        row[21 + axis] = 0.5 * H * (even - odd);
        row[3 + axis] = 0.5 * (d04 + p);
        row[6 + axis] = 0.5 * (d26 + q);
        row[9 + axis] = 0.5 * (s04 - s26);
        row[12 + axis] = 0.5 * (s15 - s37);
        row[15 + axis] = 0.5 * (d04 - p);
        row[18 + axis] = 0.5 * (q - d26);
    }
    row
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_transform_keeps_squares_and_parts_harmonics() {
        let passing: ToothPassing = core::array::from_fn(|n| ((n * 7919 % 23) as f32) - 11.0);
        let square = |values: &[f32]| values.iter().map(|x| x * x).sum::<f32>();
        assert!((square(&row(&passing)) / square(&passing) - 1.0).abs() < 1e-5);
        for (harmonic, (from, to)) in ENDS.into_iter().enumerate() {
            let tone: ToothPassing =
                core::array::from_fn(|n| crate::math::cos_turns((harmonic * (n / 3)) as f32 / SLOTS as f32));
            let row = row(&tone);
            assert!((square(&row[from..to]) / square(&tone) - 1.0).abs() < 1e-5);
        }
    }
}
