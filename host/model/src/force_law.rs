//! How hard a chip pushes an edge, and how the flank behind the edge is damped.

use super::immersion::Immersion;
use crate::milling::Material;

/// The force on an edge of axial depth b with the chip thickness h (thesis eqs 3.2 to 3.4): tangential, radial and axial
/// F = b·(K_c·h + K_e/sin γ), and what may be added to that:
///
/// - a chip law: K_c·h₀·(h/h₀)^p instead of K_c·h;
/// - process damping: −(C/V)·b·v_n along the chip thickness, and friction times that against the turning;
/// - wear: all of it times 1 + r·t.
#[derive(Clone, Copy, Debug)]
pub struct ForceLaw {
    /// K_c and K_e.
    material: Material,
    sin_edge: f64,
    cos_edge: f64,
    cutting: Coefficients,
    edge: Coefficients,
    /// `None` for a force in proportion to the chip.
    pub chip: Option<ChipLaw>,
    /// `None` where the flank does not touch.
    pub process_damping: Option<ProcessDamping>,
    /// r, 1/s.
    pub wear_per_s: f64,
}

/// K·b·h₀·(h/h₀)^p instead of K·b·h.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChipLaw {
    /// p, positive.
    pub exponent: f64,
    /// h₀, m, positive.
    pub reference_m: f64,
}

impl ChipLaw {
    /// h₀·(h/h₀)^p, m; odd in h: in the linear model a chip of negative thickness pulls.
    pub fn effective_m(self, thickness_m: f64) -> f64 {
        self.reference_m
            * (thickness_m.abs() / self.reference_m)
                .powf(self.exponent)
                .copysign(thickness_m)
    }

    /// The slope p·(h/h₀)^(p − 1) of it; infinite at 0 for p < 1.
    pub fn slope(self, thickness_m: f64) -> f64 {
        self.exponent * (thickness_m.abs() / self.reference_m).powf(self.exponent - 1.0)
    }
}

/// The force −(C/V)·b·v_n of the flank on the surface just cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProcessDamping {
    /// C, N/m.
    pub n_per_m: f64,
    /// Share of it that acts tangentially, against the turning.
    pub friction: f64,
}

/// Coefficients of the tangential force and, by the edge angle, of what the radial and axial forces add up to in
/// the plane of the tool (towards the axis) and along it.
#[derive(Clone, Copy, Debug)]
struct Coefficients {
    tangential: f64,
    inward: f64,
    axial: f64,
}

impl Coefficients {
    fn new(tangential: f64, radial: f64, axial: f64, sin_edge: f64, cos_edge: f64) -> Self {
        Self {
            tangential,
            inward: radial * sin_edge + axial * cos_edge,
            axial: radial * cos_edge - axial * sin_edge,
        }
    }

    fn are_zero(self) -> bool {
        self.tangential == 0.0 && self.inward == 0.0 && self.axial == 0.0
    }

    /// The force in the machine's x, y, z. The tangential one points against the motion of the tooth, (−cos φ, sin φ) in
    /// feed and normal.
    fn force(self, at: Immersion) -> [f64; 3] {
        let [x, y] = at.outward;
        [
            -self.tangential * y - self.inward * x,
            self.tangential * x - self.inward * y,
            self.axial,
        ]
    }
}

impl ForceLaw {
    /// The linear-edge law of a material at an edge angle given by its sine and cosine.
    pub fn new(material: Material, [sin_edge, cos_edge]: [f64; 2]) -> Self {
        let of = |[tangential, radial, axial]: [f64; 3]| {
            Coefficients::new(tangential, radial, axial, sin_edge, cos_edge)
        };
        Self {
            material,
            sin_edge,
            cos_edge,
            cutting: of([material.ktc_mpa, material.krc_mpa, material.kac_mpa].map(|mpa| 1e6 * mpa)),
            edge: of([
                material.kte_n_per_mm,
                material.kre_n_per_mm,
                material.kae_n_per_mm,
            ]
            .map(|n_per_mm| 1e3 * n_per_mm / sin_edge)),
            chip: None,
            process_damping: None,
            wear_per_s: 0.0,
        }
    }

    /// The coefficients.
    pub fn material(&self) -> Material {
        self.material
    }

    /// The same law with other coefficients.
    #[must_use]
    pub fn with_material(self, material: Material) -> Self {
        Self {
            chip: self.chip,
            process_damping: self.process_damping,
            wear_per_s: self.wear_per_s,
            ..Self::new(material, [self.sin_edge, self.cos_edge])
        }
    }

    /// Force of the chip on the tool, N, with the chip thickness and depth in m; without process damping and wear.
    pub fn force_n(&self, at: Immersion, thickness_m: f64, depth_m: f64) -> [f64; 3] {
        self.force_of_n(at, thickness_m, [depth_m; 3])
    }

    /// As [`Self::force_n`], with a depth for the tangential force, one for that towards the axis and one for that along
    /// it: in solid material they are the same.
    pub fn force_of_n(&self, at: Immersion, thickness_m: f64, depths_m: [f64; 3]) -> [f64; 3] {
        let thickness_m = self
            .chip
            .map_or(thickness_m, |chip| chip.effective_m(thickness_m));
        let of = |cutting: f64, edge: f64, depth_m: f64| depth_m * (cutting * thickness_m + edge);
        Coefficients {
            tangential: of(self.cutting.tangential, self.edge.tangential, depths_m[0]),
            inward: of(self.cutting.inward, self.edge.inward, depths_m[1]),
            axial: of(self.cutting.axial, self.edge.axial, depths_m[2]),
        }
        .force(at)
    }

    /// The matrix D of process damping, N s/m, at the cutting speed V in m/s: F = −D v; without wear.
    pub fn damping_ns_per_m(&self, at: Immersion, depth_m: f64, cutting_speed_m_per_s: f64) -> [[f64; 3]; 3] {
        let Some(damping) = self.process_damping else {
            return [[0.0; 3]; 3];
        };
        let normal = [
            at.outward[0] * self.sin_edge,
            at.outward[1] * self.sin_edge,
            -self.cos_edge,
        ];
        // A force of 1 N towards the axis along the chip thickness, and its friction.
        let force = Coefficients::new(damping.friction, 1.0, 0.0, self.sin_edge, self.cos_edge).force(at);
        let size = damping.n_per_m / cutting_speed_m_per_s * depth_m;
        force.map(|force| normal.map(|normal| -size * force * normal))
    }

    /// 1 + r·t.
    pub fn wear(&self, t: f64) -> f64 {
        1.0 + self.wear_per_s * t
    }

    /// True where a tooth feels a force the moment it touches: then the force, or its rate, jumps at loss of contact.
    pub fn jumps_at_contact(&self) -> bool {
        !self.edge.are_zero()
            || self.process_damping.is_some()
            || self.chip.is_some_and(|chip| chip.exponent < 1.0)
    }
}
