//! Cutting force on an edge: linear-edge law, chip-thickness exponent, process damping and wear.

use crate::milling::{EdgeAngle, EdgeForce, Immersion, Material};

/// Cutting force on an edge of axial depth b at the chip thickness h (thesis eqs 3.2 to 3.4): the tangential, radial
/// and axial components are F = b·(K_c·h + K_e/sin γ) each. Optional extensions:
///
/// - power law of the chip thickness: K_c·h₀·(h/h₀)^p instead of K_c·h;
/// - process damping at the cutting speed V: −(C/V)·b·v_n along the chip thickness, with the velocity v_n in that
///   direction, and μ·(C/V)·b·v_n tangentially, against the spindle rotation;
/// - wear: the whole force times 1 + r·t.
#[derive(Clone, Copy, Debug)]
pub struct ForceLaw {
    /// Cutting coefficients K_c and edge coefficients K_e of the workpiece material.
    material: Material,
    edge_angle: EdgeAngle,
    cutting: EdgeForce,
    edge: EdgeForce,
    /// Power law of the chip thickness; `None` for a force linear in the chip thickness.
    pub chip: Option<ChipLaw>,
    /// Process damping of the flank; `None` without process damping.
    pub process_damping: Option<ProcessDamping>,
    /// Relative rate r of the force growth by wear, 1/s: all forces are multiplied by 1 + r·t.
    pub wear_per_s: f64,
}

/// Power law of the chip thickness: the cutting force is K·b·h₀·(h/h₀)^p instead of K·b·h.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChipLaw {
    /// Exponent p, positive.
    pub exponent: f64,
    /// Reference chip thickness h₀, m, positive: there the power law equals the linear law.
    pub reference_m: f64,
}

impl ChipLaw {
    /// Effective chip thickness h₀·(|h|/h₀)^p·sgn h, m: as in the linear law, a negative chip thickness gives a
    /// negative cutting force.
    pub fn effective_m(self, thickness_m: f64) -> f64 {
        self.reference_m
            * (thickness_m.abs() / self.reference_m)
                .powf(self.exponent)
                .copysign(thickness_m)
    }

    /// Derivative p·(|h|/h₀)^(p − 1) of the effective chip thickness with respect to h; infinite at h = 0 for p < 1.
    pub fn slope(self, thickness_m: f64) -> f64 {
        self.exponent * (thickness_m.abs() / self.reference_m).powf(self.exponent - 1.0)
    }
}

/// Coefficients of process damping: C of the flank force −(C/V)·b·v_n along the chip thickness, and its friction; see
/// [`ForceLaw`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProcessDamping {
    /// Process damping coefficient C, N/m.
    pub n_per_m: f64,
    /// Friction coefficient μ: ratio of the tangential flank force, against the spindle rotation, to the normal one.
    pub friction: f64,
}

impl ForceLaw {
    /// The linear-edge law of a material at an edge angle γ.
    pub fn new(material: Material, edge_angle: EdgeAngle) -> Self {
        Self {
            material,
            edge_angle,
            cutting: edge_angle
                .force([material.ktc_mpa, material.krc_mpa, material.kac_mpa].map(|mpa| 1e6 * mpa)),
            edge: edge_angle.force(
                [
                    material.kte_n_per_mm,
                    material.kre_n_per_mm,
                    material.kae_n_per_mm,
                ]
                .map(|n_per_mm| 1e3 * n_per_mm / edge_angle.sin()),
            ),
            chip: None,
            process_damping: None,
            wear_per_s: 0.0,
        }
    }

    /// The cutting and edge coefficients.
    pub fn material(&self) -> Material {
        self.material
    }

    /// This force law with the coefficients of another material.
    #[must_use]
    pub fn with_material(self, material: Material) -> Self {
        Self {
            chip: self.chip,
            process_damping: self.process_damping,
            wear_per_s: self.wear_per_s,
            ..Self::new(material, self.edge_angle)
        }
    }

    /// Cutting force on the tool, N, at the chip thickness and axial depth, m, in the axes in which `at` is given;
    /// without process damping and wear.
    pub fn force_n(&self, at: Immersion, thickness_m: f64, depth_m: f64) -> [f64; 3] {
        self.force_of_n(at, thickness_m, [depth_m; 3])
    }

    /// Cutting force on the tool, N, with a separate effective depth, m, for each component: tangential, towards the
    /// tool axis, along the tool axis; without process damping and wear. In solid material the three depths are equal,
    /// see [`Self::force_n`].
    pub fn force_of_n(&self, at: Immersion, thickness_m: f64, depths_m: [f64; 3]) -> [f64; 3] {
        let thickness_m = self
            .chip
            .map_or(thickness_m, |chip| chip.effective_m(thickness_m));
        let of = |cutting: f64, edge: f64, depth_m: f64| depth_m * (cutting * thickness_m + edge);
        EdgeForce {
            tangential: of(self.cutting.tangential, self.edge.tangential, depths_m[0]),
            inward: of(self.cutting.inward, self.edge.inward, depths_m[1]),
            axial: of(self.cutting.axial, self.edge.axial, depths_m[2]),
        }
        .at(at)
    }

    /// Derivative of [`Self::force_n`] with respect to the chip thickness, N/m.
    pub fn slope_n_per_m(&self, at: Immersion, thickness_m: f64, depth_m: f64) -> [f64; 3] {
        let slope = depth_m * self.chip.map_or(1.0, |chip| chip.slope(thickness_m));
        EdgeForce {
            tangential: slope * self.cutting.tangential,
            inward: slope * self.cutting.inward,
            axial: slope * self.cutting.axial,
        }
        .at(at)
    }

    /// Matrix D of process damping, N s/m, in the force F = −D v at the axial depth, m, and cutting speed, m/s; without
    /// wear. Zero without process damping.
    pub fn damping_ns_per_m(&self, at: Immersion, depth_m: f64, cutting_speed_m_per_s: f64) -> [[f64; 3]; 3] {
        let Some(damping) = self.process_damping else {
            return [[0.0; 3]; 3];
        };
        let size = damping.n_per_m / cutting_speed_m_per_s * depth_m;
        self.edge_angle
            .flank(damping.friction, at)
            .map(|row| row.map(|entry| size * entry))
    }

    /// Wear factor 1 + r·t of the cutting force at the time `t`, s.
    pub fn wear(&self, t: f64) -> f64 {
        1.0 + self.wear_per_s * t
    }

    /// True if the cutting force jumps at loss of contact, or its slope there is infinite: with edge force, process
    /// damping or an exponent below 1.
    pub fn jumps_at_contact(&self) -> bool {
        !self.edge.is_zero()
            || self.process_damping.is_some()
            || self.chip.is_some_and(|chip| chip.exponent < 1.0)
    }
}
