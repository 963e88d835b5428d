//! The sampled force of a cut.

/// The force of a cut, N, in the machine's axes.
#[derive(Clone, Debug)]
pub(crate) struct CutForce {
    /// Its mean over each finer sample.
    pub mean_n: [Vec<f64>; 3],
    /// At the samples of the record, where forces are measured; 0 at those beside an entry or an exit.
    pub sampled_n: [Vec<f64>; 3],
}

impl CutForce {
    /// This less `other`, over `divisor`.
    pub(crate) fn difference(&self, other: &Self, divisor: f64) -> Self {
        let of = |a: &[Vec<f64>; 3], b: &[Vec<f64>; 3]| {
            std::array::from_fn(|axis| {
                a[axis]
                    .iter()
                    .zip(&b[axis])
                    .map(|(a, b)| (a - b) / divisor)
                    .collect()
            })
        };
        Self {
            mean_n: of(&self.mean_n, &other.mean_n),
            sampled_n: of(&self.sampled_n, &other.sampled_n),
        }
    }
}
