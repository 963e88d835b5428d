//! Describing functions: the contribution of nonlinear terms to the dynamic stiffness F/X of a harmonic motion.
//!
//! With x = X·sin ωt a force f_r(x, v) acts at the fundamental as N(X, ω)·x, N = (2/(2πX))·∫f_r·(sin + i·cos) d(ωt) over a period:
//! the real part is a stiffness, the imaginary part a damping force per displacement.

use quietcut_model::effects::EffectName;

pub use quietcut_model::effects::describing_functions::*;

/// Type of a nonlinear restoring or damping force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Nonlinearity {
    /// Cubic spring k3·x³.
    CubicStiffness,
    /// Quadratic spring k2·x²; its force appears at twice the excitation frequency and as an offset.
    QuadraticStiffness,
    /// Cubic damping c3·v³.
    CubicDamping,
    /// Springs k3·x³ + k5·x⁵ with coefficients of opposite sign: softening turns into hardening, or the reverse.
    SofteningHardening,
    /// Coulomb friction fc·sign(v).
    CoulombFriction,
    /// Backlash: a spring that exerts no force within a gap.
    Backlash,
    /// Hysteresis of Bouc and Wen.
    Hysteresis,
}

impl Nonlinearity {
    /// Name of the nonlinear effect, as in a case file.
    pub fn name(self) -> &'static str {
        match self {
            Self::CubicStiffness => EffectName::CubicStiffness.name(),
            Self::QuadraticStiffness => EffectName::QuadraticStiffness.name(),
            Self::CubicDamping => EffectName::CubicDamping.name(),
            Self::SofteningHardening => EffectName::SofteningHardening.name(),
            Self::CoulombFriction => EffectName::CoulombFriction.name(),
            Self::Backlash => EffectName::Backlash.name(),
            Self::Hysteresis => EffectName::Hysteresis.name(),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use num_complex::Complex64;

    use super::*;

    /// The describing function by numerical summation over a period, with x = X·cos p.
    fn brute(amplitude: f64, force: impl Fn(f64, f64) -> f64) -> Complex64 {
        let count = 200_000;
        let mut sum = Complex64::ZERO;
        for k in 0..count {
            let p = 2.0 * PI * (f64::from(k) + 0.5) / f64::from(count);
            let f = force(amplitude * p.cos(), -amplitude * p.sin());
            sum += Complex64::new(f * p.cos(), -f * p.sin());
        }
        sum * (2.0 / (f64::from(count) * amplitude))
    }

    #[test]
    fn describing_functions_equal_numerical_sums() {
        let (x, w) = (1.3, 2.0);
        let gap = 0.4;
        let pairs = [
            (cubic_stiffness(x), brute(x, |x, _| x.powi(3))),
            (quintic_stiffness(x), brute(x, |x, _| x.powi(5))),
            (cubic_damping(x, w), brute(x, |_, v| (w * v).powi(3))),
            (coulomb_friction(x), brute(x, |_, v| v.signum())),
            (backlash(x, gap), brute(x, |x, _| -x.clamp(-gap, gap))),
            (backlash(0.3, gap), brute(0.3, |x, _| -x.clamp(-gap, gap))),
        ];
        for (closed, summed) in pairs {
            // The error of the midpoint rule at a kink of the force is of second order in the step.
            assert!((closed - summed).norm() < 1e-6, "{closed} {summed}");
        }
    }

    #[test]
    fn hysteresis_vanishes_at_small_and_is_friction_at_large_amplitude() {
        // At amplitudes X far below the yield displacement z_y, z = x up to a relative error of X/z_y.
        assert!(hysteresis(1e-3, 1.0).norm() < 2e-3);
        // At amplitudes X far above z_y the stiffness −1 cancels the spring and friction of the force z_y remains; rounded corners
        // reduce it by (z_y/X)^(3/2).
        let large = hysteresis(100.0, 1.0);
        assert!((large - (coulomb_friction(100.0) - 1.0)).norm() < 3e-3, "{large}");
    }
}
