//! Fourier series of the directional coefficients and of the forced excitation over the tooth-passing period.

use nalgebra::{Matrix3, Vector3};
use num_complex::Complex64;

use super::{Engagement, RotatingVector, ToothForce};

/// The k-th coefficients of the Fourier series Σ_k α_k e^{ikΩt}, Ω = 2π/τ, of the directional coefficients and of the
/// force without vibration, each summed over all teeth in cut. The tooth-passing period τ starts when a tooth enters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Harmonic {
    /// Coefficient K_tc α_k of the directional matrix, Pa.
    pub directional: Matrix3<Complex64>,
    /// Coefficient of the force per axial depth from feed and edges, N/m: the z column of (β_e + β_f)_k.
    pub forced: Vector3<Complex64>,
}

impl ToothForce {
    /// The k-th [`Harmonic`] of this force over the tooth-passing period, in closed form. Harmonic −k is its complex
    /// conjugate, harmonic 0 the average.
    pub fn harmonic(&self, engagement: &Engagement, feed_per_tooth_m: f64, k: i32) -> Harmonic {
        let (cutting, normal, edge) = (
            exponentials(&self.cutting),
            exponentials(&self.normal),
            exponentials(&self.edge),
        );
        let mut directional = Matrix3::zeros();
        let mut forced = Vector3::zeros();
        for (p, cutting) in (-1..=1).zip(&cutting) {
            for (q, normal) in (-1..=1).zip(&normal) {
                directional += cutting * normal.transpose() * integral(engagement, p + q, k);
            }
        }
        for (p, edge) in (-1..=1).zip(&edge) {
            forced += edge * integral(engagement, p, k);
        }
        forced += directional.column(0) * Complex64::from(feed_per_tooth_m);
        Harmonic { directional, forced }
    }
}

/// The coefficients of e^{−iφ}, 1 and e^{iφ} of a rotating vector.
fn exponentials(vector: &RotatingVector) -> [Vector3<Complex64>; 3] {
    let half = |sign: f64| {
        vector.cosine.zip_map(&vector.sine, |cos, sin| {
            Complex64::new(0.5 * cos, 0.5 * sign * sin)
        })
    };
    [half(1.0), vector.constant.map(Complex64::from), half(-1.0)]
}

/// (1/θ) ∫ e^{imφ} e^{−ikN(φ − start)} dφ over the immersion angle φ from the start to the exit angle, with the pitch
/// angle θ and N = 2π/θ teeth.
fn integral(engagement: &Engagement, m: i32, k: i32) -> Complex64 {
    let Engagement { start, exit, pitch } = *engagement;
    let (m, harmonic_rate) = (f64::from(m), f64::from(k) * std::f64::consts::TAU / pitch);
    let rate = m - harmonic_rate;
    let sum = if rate.abs() < 1e-9 {
        // But for rounding, m − kN is an integer: zero, or at least one in magnitude.
        Complex64::cis(harmonic_rate * start) * (exit - start)
    } else {
        let at_exit = Complex64::cis(m * exit - harmonic_rate * (exit - start));
        (at_exit - Complex64::cis(m * start)) / Complex64::new(0.0, rate)
    };
    sum / pitch
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::milling::{Cut, EdgeAngle, Material, Tool};

    fn tool(teeth: usize) -> Tool {
        Tool {
            teeth,
            edge_angle_deg: 50.0,
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

    #[test]
    fn harmonics_are_those_of_quadrature_and_the_zeroth_is_the_average() {
        for (teeth, start, exit) in [
            (1, 0.0, 180.0),
            (2, 90.0, 180.0),
            (4, 126.87, 180.0),
            (9, 10.0, 130.0),
        ] {
            let tool = tool(teeth);
            let cut = Cut {
                start_deg: start,
                exit_deg: exit,
                feed_per_tooth_mm: 0.05,
                feed_direction_deg: 0.0,
            };
            let force = ToothForce::new(EdgeAngle::new(50.0), &MATERIAL);
            let engagement = Engagement::new(&tool, &cut);
            let averaged = force.averaged(&engagement, 0.05e-3);
            let zeroth = force.harmonic(&engagement, 0.05e-3, 0);
            let close = |a: Matrix3<Complex64>, b: Matrix3<Complex64>, tolerance: f64| {
                (a - b).norm() < tolerance * averaged.directional.norm()
            };
            assert!(close(
                zeroth.directional,
                averaged.directional.map(Complex64::from),
                1e-13
            ));
            assert!(
                (zeroth.forced - averaged.forced.map(Complex64::from)).norm()
                    < 1e-13 * averaged.forced.norm()
            );
            for k in [-3, 1, 2, 4, 5] {
                let harmonic = force.harmonic(&engagement, 0.05e-3, k);
                let conjugate = force.harmonic(&engagement, 0.05e-3, -k);
                assert!(close(
                    harmonic.directional,
                    conjugate.directional.map(|entry| entry.conj()),
                    1e-13
                ));
                // Midpoint rule: its error is (kN Δφ)²/24 of the size, here below 1e-6.
                const STEPS: u32 = 20_000;
                let step = (engagement.exit - engagement.start) / f64::from(STEPS);
                let mut directional = Matrix3::zeros();
                let mut forced = Vector3::zeros();
                for i in 0..STEPS {
                    let turned = (f64::from(i) + 0.5) * step;
                    let angle = engagement.start + turned;
                    let factor =
                        Complex64::cis(-f64::from(k) * teeth as f64 * turned) * (step / engagement.pitch);
                    directional += force.directional(angle).map(Complex64::from) * factor;
                    forced += force.forced(angle, 0.05e-3).map(Complex64::from) * factor;
                }
                assert!(close(harmonic.directional, directional, 1e-5), "{teeth} {k}");
                assert!((harmonic.forced - forced).norm() < 1e-5 * averaged.forced.norm());
            }
        }
    }
}
