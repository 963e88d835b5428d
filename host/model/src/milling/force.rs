//! The force on a tooth, and the average of the force of all teeth over a tooth-passing period (thesis eqs 3.1–3.8,
//! 7.1–7.2).

use nalgebra::{Matrix3, Vector3};

use super::{EdgeAngle, Engagement, Immersion, Material};

/// A vector that rotates with a tooth: v(φ) = constant + cosine·cos φ + sine·sin φ, in feed, normal and axial
/// direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotatingVector {
    /// Constant part, independent of φ.
    pub constant: Vector3<f64>,
    /// Coefficient of cos φ.
    pub cosine: Vector3<f64>,
    /// Coefficient of sin φ.
    pub sine: Vector3<f64>,
}

impl RotatingVector {
    /// The coefficients of a vector function that is linear in (sin φ, cos φ) with a constant. Its values at the pairs
    /// (0, 0), (0, 1) and (1, 0) determine them.
    fn of(of: impl Fn(Immersion) -> [f64; 3]) -> Self {
        let at = |sin: f64, cos: f64| {
            Vector3::from(of(Immersion {
                sin,
                outward: [sin, cos],
            }))
        };
        let constant = at(0.0, 0.0);
        Self {
            constant,
            cosine: at(0.0, 1.0) - constant,
            sine: at(1.0, 0.0) - constant,
        }
    }

    /// The vector v(φ) at the immersion angle φ, rad.
    pub fn at(&self, angle: f64) -> Vector3<f64> {
        let (sin, cos) = angle.sin_cos();
        self.constant + self.cosine * cos + self.sine * sin
    }

    /// The vector times a factor.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self {
            constant: self.constant * factor,
            cosine: self.cosine * factor,
            sine: self.sine * factor,
        }
    }

    /// ∫ v(φ) uᵀ(φ) dφ over the immersion angle from `start` to `exit`, rad, with u = `other`; closed form.
    fn product_integral(&self, other: &Self, start: f64, exit: f64) -> Matrix3<f64> {
        let ((s0, c0), (s1, c1)) = (start.sin_cos(), exit.sin_cos());
        let length = exit - start;
        let (cos, sin) = (s1 - s0, c0 - c1);
        let half_sin_2 = 0.5 * (s1 * c1 - s0 * c0);
        let (cos_cos, sin_sin) = (0.5 * length + half_sin_2, 0.5 * length - half_sin_2);
        let sin_cos = 0.5 * (s1 * s1 - s0 * s0);
        let (v, u) = (self, other);
        v.constant * u.constant.transpose() * length
            + (v.constant * u.cosine.transpose() + v.cosine * u.constant.transpose()) * cos
            + (v.constant * u.sine.transpose() + v.sine * u.constant.transpose()) * sin
            + v.cosine * u.cosine.transpose() * cos_cos
            + v.sine * u.sine.transpose() * sin_sin
            + (v.cosine * u.sine.transpose() + v.sine * u.cosine.transpose()) * sin_cos
    }

    /// ∫ v(φ) dφ over the immersion angle from `start` to `exit`, rad.
    fn integral(&self, start: f64, exit: f64) -> Vector3<f64> {
        self.constant * (exit - start)
            + self.cosine * (exit.sin() - start.sin())
            + self.sine * (start.cos() - exit.cos())
    }
}

/// The force on one tooth of axial depth a with chip thickness h at immersion angle φ:
/// F = a·(cutting(φ)·h + edge(φ)), on the tool, in feed, normal and axial direction.
///
/// The chip thickness is h = normal(φ)ᵀ(f_t e_x + u − u_τ), where u is the displacement of the tool and u_τ that one
/// tooth-passing period before, when the preceding tooth was at the same angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToothForce {
    /// Cutting force per axial depth and chip thickness, Pa: K_tc times its direction, thesis eq. 7.2 with +k_rc cos γ
    /// in row 3.
    pub cutting: RotatingVector,
    /// Direction in which a displacement of the tool makes the chip thicker, without unit (thesis eq. 3.1).
    pub normal: RotatingVector,
    /// Edge force per axial depth, N/m (thesis eq. 3.6).
    pub edge: RotatingVector,
}

impl ToothForce {
    /// The force on a tooth with an edge angle in a workpiece `material`.
    pub fn new(edge_angle: EdgeAngle, material: &Material) -> Self {
        const PA_PER_MPA: f64 = 1e6;
        const N_PER_M: f64 = 1e3;
        let cutting = edge_angle.force([material.ktc_mpa, material.krc_mpa, material.kac_mpa]);
        let edge = edge_angle.force([
            material.kte_n_per_mm,
            material.kre_n_per_mm,
            material.kae_n_per_mm,
        ]);
        Self {
            cutting: RotatingVector::of(|at| cutting.at(at)).scaled(PA_PER_MPA),
            normal: RotatingVector::of(|at| edge_angle.normal(at)),
            edge: RotatingVector::of(|at| edge.at(at)).scaled(N_PER_M / edge_angle.sin()),
        }
    }

    /// Directional coefficient matrix K_tc α(φ) = cutting·normalᵀ of one tooth, Pa: force per axial depth and
    /// displacement.
    pub fn directional(&self, angle: f64) -> Matrix3<f64> {
        self.cutting.at(angle) * self.normal.at(angle).transpose()
    }

    /// Force per axial depth of one tooth at the chip thickness of the feed alone, N/m: cutting·normalᵀ f_t e_x + edge.
    pub fn forced(&self, angle: f64, feed_per_tooth_m: f64) -> Vector3<f64> {
        self.cutting.at(angle) * (self.normal.at(angle).x * feed_per_tooth_m) + self.edge.at(angle)
    }

    /// [`Averaged`] directional coefficients and force per axial depth, which zeroth-order approximation and Nyquist
    /// criterion use.
    pub fn averaged(&self, engagement: &Engagement, feed_per_tooth_m: f64) -> Averaged {
        let Engagement { start, exit, pitch } = *engagement;
        let directional = self.cutting.product_integral(&self.normal, start, exit) / pitch;
        let forced = directional.column(0) * feed_per_tooth_m + self.edge.integral(start, exit) / pitch;
        Averaged { directional, forced }
    }
}

/// Directional coefficients, and force per axial depth without vibration, summed over the teeth in cut and averaged
/// over one tooth-passing period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Averaged {
    /// Averaged directional coefficient matrix K_tc α₀, Pa.
    pub directional: Matrix3<f64>,
    /// Mean force per axial depth from feed and edges, N/m: the z column of β_e + β_f.
    pub forced: Vector3<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::milling::{Cut, Tool};

    fn tool(teeth: usize, edge_angle_deg: f64) -> Tool {
        Tool {
            teeth,
            edge_angle_deg,
            diameter_mm: None,
            pitch_deg: vec![360.0 / teeth as f64; teeth],
            runout: None,
        }
    }

    const MATERIAL: Material = Material {
        ktc_mpa: 1835.0,
        krc_mpa: 1132.0,
        kac_mpa: 280.0,
        kte_n_per_mm: 25.0,
        kre_n_per_mm: 45.0,
        kae_n_per_mm: 10.0,
    };

    /// Tangential, radial and axial force multiplied by the rotation matrix R(φ) of thesis eq. 3.4 as printed.
    fn by_rotation(forces: Vector3<f64>, angle: f64, gamma: f64) -> Vector3<f64> {
        let ((sp, cp), (sg, cg)) = (angle.sin_cos(), gamma.sin_cos());
        Matrix3::new(-cp, -sp * sg, -sp * cg, sp, -cp * sg, -cp * cg, 0.0, cg, -sg) * forces
    }

    #[test]
    fn tooth_force_is_that_of_equations_3_2_and_3_4() {
        let force = ToothForce::new(EdgeAngle::new(50.0), &MATERIAL);
        let gamma = 50.0_f64.to_radians();
        let (depth, feed) = (0.67e-3, 0.05e-3);
        for step in 0..=36 {
            let angle = f64::from(step) * 5.0_f64.to_radians();
            let chip = feed * angle.sin() * gamma.sin();
            let width = depth / gamma.sin();
            let direct = by_rotation(
                Vector3::new(
                    25e3 * width + 1835e6 * chip * depth,
                    45e3 * width + 1132e6 * chip * depth,
                    10e3 * width + 280e6 * chip * depth,
                ),
                angle,
                gamma,
            );
            let ours = force.forced(angle, feed) * depth;
            assert!((ours - direct).norm() < 1e-12 * direct.norm(), "{angle}");
        }
    }

    #[test]
    fn directional_coefficients_are_those_of_equation_6_7() {
        let force = ToothForce::new(EdgeAngle::new(90.0), &MATERIAL);
        let kr = 1132.0 / 1835.0;
        for step in 0..=36 {
            let angle = f64::from(step) * 5.0_f64.to_radians();
            let (s, c) = angle.sin_cos();
            let printed = [
                [-s * (c + kr * s), -c * (c + kr * s)],
                [s * (s - kr * c), c * (s - kr * c)],
            ];
            let ours = force.directional(angle) / 1835e6;
            for i in 0..2 {
                for j in 0..2 {
                    assert!((ours[(i, j)] - printed[i][j]).abs() < 1e-14);
                }
            }
            // With an edge angle of 90°, z does not change the chip thickness, but F_z still acts.
            assert!(ours[(0, 2)].abs() < 1e-15 && (ours[(2, 0)] + s * 280.0 / 1835.0).abs() < 1e-14);
        }
    }

    #[test]
    fn averages_in_closed_form_are_those_of_quadrature() {
        let force = ToothForce::new(EdgeAngle::new(50.0), &MATERIAL);
        for (start, exit) in [(0.0, 180.0), (126.87, 180.0), (0.0, 60.0), (70.0, 110.0)] {
            let cut = Cut {
                start_deg: start,
                exit_deg: exit,
                feed_per_tooth_mm: 0.05,
                feed_direction_deg: 0.0,
            };
            let engagement = Engagement::new(&tool(4, 50.0), &cut);
            let averaged = force.averaged(&engagement, 0.05e-3);
            // Midpoint rule: its error is (Δφ)²/24 times a second derivative of a few times the size.
            const STEPS: u32 = 20_000;
            let step = (engagement.exit - engagement.start) / f64::from(STEPS);
            let mut directional = Matrix3::zeros();
            let mut forced = Vector3::zeros();
            for i in 0..STEPS {
                let angle = engagement.start + (f64::from(i) + 0.5) * step;
                directional += force.directional(angle) * (step / engagement.pitch);
                forced += force.forced(angle, 0.05e-3) * (step / engagement.pitch);
            }
            assert!((averaged.directional - directional).norm() < 1e-7 * directional.norm());
            assert!((averaged.forced - forced).norm() < 1e-7 * forced.norm());
        }
    }
}
