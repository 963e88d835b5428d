//! Measured receptances with their statistics.

use quietcut_numerics::statistics::{NINETY_PERCENT, student_ninety_percent};

use super::recording_group::RecordingGroup;
use crate::table::FrfTable;

/// Measured receptances with their statistics.
#[derive(Clone, Debug)]
pub struct Measurement {
    /// Measured receptances with the coherence of each response, or without it for fewer than three single impacts of a
    /// hammer and for one period of periodic excitation. With several forces it is the multiple coherence.
    pub table: FrfTable,
    /// Standard deviation of |H|, by entry of the table, then by frequency, m/N.
    pub deviation: Vec<Vec<f64>>,
    /// One value per entry of the table. False if its standard deviation is meaningless, since it comes from fewer than
    /// three single impacts of a hammer, or from one period of periodic excitation.
    pub has_deviation: Vec<bool>,
    /// One value per entry of the table: degrees of freedom of its standard deviations from periodic excitation; `None`
    /// for other excitation, with normal quantiles.
    pub freedoms: Vec<Option<usize>>,
    /// Groups of recordings that were evaluated together.
    pub groups: Vec<RecordingGroup>,
    /// Warnings for the user, such as of double impacts or of responses that had not settled.
    pub warnings: Vec<String>,
}

impl Measurement {
    /// Half the width of the 90 % interval of an entry of the table, in its standard deviations: 1.645, or the larger
    /// quantile of Student's distribution where the entry has `freedoms`.
    pub fn ninety_percent(&self, entry: usize) -> f64 {
        self.freedoms
            .get(entry)
            .copied()
            .flatten()
            .map_or(NINETY_PERCENT, student_ninety_percent)
    }
}
