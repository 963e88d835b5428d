//! The cutting force along a record, upsampled and at its samples.

/// The cutting force along the machine's axes, N.
#[derive(Clone, Debug)]
pub(crate) struct CutForce {
    /// Mean cutting force over each interval of the upsampled grid, N.
    pub mean_n: [Vec<f64>; 3],
    /// Cutting force at the samples of the record, N; 0 at samples near the entry or exit of a tooth, and at all
    /// samples if no force is measured.
    pub sampled_n: [Vec<f64>; 3],
}

impl CutForce {
    /// Difference of two cutting forces over a divisor: (`self` − `other`)/`divisor`.
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
