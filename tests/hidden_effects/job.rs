//! Tool, material and engagement of a cut, and the scales of parameters that follow from them.

/// Tool, material and engagement of the baseline.
#[derive(Clone, Debug)]
pub(crate) struct Job {
    pub(crate) teeth: usize,
    pub(crate) edge_angle_deg: f64,
    pub(crate) diameter_mm: f64,
    /// Tangential, radial and axial cutting coefficient, MPa.
    pub(crate) cutting_mpa: [f64; 3],
    /// Tangential, radial and axial edge coefficient, N/mm.
    pub(crate) edge_n_per_mm: [f64; 3],
    pub(crate) start_deg: f64,
    pub(crate) exit_deg: f64,
    pub(crate) feed_mm: f64,
    /// Runout: offset, µm, and angle, degrees.
    pub(crate) runout: [f64; 2],
}

/// Scales of the parameters of causes in the cutting process.
#[derive(Clone, Debug)]
pub(crate) struct CutScale {
    pub(crate) job: Job,
    pub(crate) depth_mm: f64,
    pub(crate) rpm: f64,
}

impl CutScale {
    /// Cutting speed, m/s.
    pub(crate) fn cutting_speed(&self) -> f64 {
        std::f64::consts::PI * 1e-3 * self.job.diameter_mm * self.rpm / 60.0
    }
}
