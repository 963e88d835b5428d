//! The workpiece material, by its force coefficients.

/// Force coefficients of the linear-edge model (thesis eqs 3.2, 3.6).
///
/// On a tooth with axial depth a, chip thickness h and edge angle γ: F_t = K_te·a/sin γ + K_tc·h·a, and likewise F_r
/// with K_re and K_rc, F_a with K_ae and K_ac.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Tangential cutting coefficient K_tc, MPa (N/mm²), positive.
    pub ktc_mpa: f64,
    /// Radial cutting coefficient K_rc, MPa.
    pub krc_mpa: f64,
    /// Axial cutting coefficient K_ac, MPa.
    pub kac_mpa: f64,
    /// Tangential edge coefficient K_te, N/mm.
    pub kte_n_per_mm: f64,
    /// Radial edge coefficient K_re, N/mm.
    pub kre_n_per_mm: f64,
    /// Axial edge coefficient K_ae, N/mm.
    pub kae_n_per_mm: f64,
}
