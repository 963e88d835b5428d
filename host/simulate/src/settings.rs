//! How exactly to integrate.

/// How exactly to integrate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Error allowed per step, m.
    pub absolute_m: f64,
    /// Error allowed per step, as a share of the amplitude of the motion.
    pub relative: f64,
    /// A displacement beyond this ends the run as diverged, m.
    pub largest_m: f64,
    /// More steps than this end the run: of equations that are too stiff to be worth it.
    pub steps_max: u64,
}

impl Default for Settings {
    /// A millionth of a micrometer, a hundred-millionth of the amplitude; a tool does not move by 0.1 m.
    fn default() -> Self {
        Self {
            absolute_m: 1e-12,
            relative: 1e-8,
            largest_m: 0.1,
            steps_max: u64::MAX,
        }
    }
}
