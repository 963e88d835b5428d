//! Tolerances and bounds of the time integration.

use super::criteria::LARGEST_DISPLACEMENT_M;

/// Tolerances and bounds of the time integration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Absolute tolerance of the local error of the displacement, m.
    pub absolute_m: f64,
    /// Relative tolerance of the local error, as a fraction of the amplitude of the motion.
    pub relative: f64,
    /// Displacement of the tool, or another state of the structure converted into one, beyond which the motion counts
    /// as diverged, m.
    pub largest_m: f64,
    /// Largest number of steps, accepted and rejected; more end the run as too stiff.
    pub steps_max: u64,
}

impl Default for Settings {
    /// Tolerances of 1e-12 m and of 1e-8 of the amplitude, far below the error of any measurement; a displacement of at
    /// most 0.1 m; any number of steps.
    fn default() -> Self {
        Self {
            absolute_m: 1e-12,
            relative: 1e-8,
            largest_m: LARGEST_DISPLACEMENT_M,
            steps_max: u64::MAX,
        }
    }
}
